//! How the bag's topics are played to the nodes: unchanged, or depth images as PNG if the kernel's receive
//! buffer is too small for raw ones.

use std::fmt;
use std::path::Path;

use bag_player::{Bag, Selection};
use geometry::{DepthImage, DepthPixels};
use msgs::convert::{self, COMPRESSED_DEPTH_TOPIC, COMPRESSED_IMAGE_TOPIC};
use msgs::sensor_msgs::Image;
use node_shell::{GrantedBuffer, RAISE_RECEIVE_BUFFER};

use crate::run::PoseSource;
use crate::run::inputs::{Inputs, ViewTopics};
use crate::run::parameters::PipelineParameters;
use crate::run::recorder::Stage;
use crate::visual;

/// The topics that are played to the nodes.
pub(super) struct Feed {
    /// The value of detection's parameter `input`.
    pub(super) input: &'static str,
    /// The value of its parameter `colour`, where it is another than in the parameters of the run.
    pub(super) colour: Option<&'static str>,
    pub(super) topics: Vec<FedTopic>,
    /// Why depth images are compressed, if they are.
    pub(super) compression: Option<Compression>,
    /// Images that are too large and stay raw, since the pose node reads raw images.
    pub(super) too_large: Option<Compression>,
}

/// A topic of the bag that is played to a node.
pub(super) struct FedTopic {
    pub(super) bag_topic: String,
    /// The name that the player's remapping gives it, within the namespace.
    pub(super) played_name: String,
    /// The names that the nodes know it by; none of the topics of tf.
    pub(super) names: Vec<&'static str>,
    pub(super) compressed: Option<Compressed>,
    /// The node whose diagnostics count its received messages.
    pub(super) node: &'static str,
}

/// What the images of a topic are compressed as, without loss.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Compressed {
    /// Depths.
    Depth,
    /// Colours.
    Colour,
}

/// Depth images that are too large as they are.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Compression {
    raw_bytes: usize,
    png_bytes: usize,
    largest_safe: usize,
    /// Whether the compression rounds metres to millimetres.
    rounds: bool,
}

impl Feed {
    /// Compares the bag's first depth image with what the kernel grants.
    pub(super) fn choose(
        bag: &Path,
        inputs: &Inputs,
        parameters: &PipelineParameters,
        granted: Option<GrantedBuffer>,
    ) -> Self {
        let needed = match &inputs.view {
            // The player and detection report what cannot be read.
            ViewTopics::Depth { image, .. } if !inputs.view.is_compressed() => {
                granted.and_then(|granted| Compression::needed(bag, image, granted))
            }
            ViewTopics::Depth { .. } | ViewTopics::Points(_) => None,
        };
        let is_visual = matches!(inputs.pose, PoseSource::Visual(_));
        let (compression, too_large) = if is_visual { (None, needed) } else { (needed, None) };
        let is_asked_for = |(name, _): &(&str, &str)| match *name {
            "imu" => parameters.pose_node().use_imu,
            "wheels" => parameters.pose_node().use_wheels,
            _ => true,
        };
        let node = |name: &str| match name {
            "imu" | "wheels" => visual::NODE,
            "rgb/image" | "rgb/image/compressed" | "rgb/camera_info" if is_visual => visual::NODE,
            _ => Stage::Detection.name(),
        };
        let colour = inputs.colour_of_map().filter(|colour| !colour.is_compressed);
        let colours_are_too_large = colour.is_some_and(|colour| {
            granted.is_some_and(|granted| is_too_large(bag, &colour.image, granted))
        });
        let compressed = |name: &str| match name {
            "depth/image" if compression.is_some() => Some(Compressed::Depth),
            "rgb/image" if colours_are_too_large => Some(Compressed::Colour),
            _ => None,
        };
        let fed = inputs.by_node_name().into_iter().filter(is_asked_for);
        let mut topics = Vec::<FedTopic>::new();
        for (name, topic) in fed {
            // Registered images have one calibration for both, and a topic is played once.
            if let Some(played) = topics.iter_mut().find(|played| played.bag_topic == topic) {
                played.names.push(name);
                continue;
            }
            topics.push(FedTopic {
                bag_topic: topic.to_owned(),
                played_name: played_name(topic),
                names: vec![name],
                compressed: compressed(name),
                node: node(name),
            });
        }
        // The nodes of the run have a tree of frames of their own.
        let transforms = inputs.transforms.iter().map(|topic| FedTopic {
            bag_topic: (*topic).to_owned(),
            played_name: topic.trim_start_matches('/').to_owned(),
            names: Vec::new(),
            compressed: None,
            node: Stage::Detection.name(),
        });
        Self {
            input: if compression.is_some() { "compressed_depth" } else { inputs.view.kind() },
            colour: colours_are_too_large.then_some("compressed"),
            topics: topics.into_iter().chain(transforms).collect(),
            compression,
            too_large,
        }
    }
}

/// The name under which a topic of the bag is played: its own, which says whether images are rectified, apart from the topics that
/// the nodes publish.
fn played_name(bag_topic: &str) -> String {
    format!("bag/{}", bag_topic.trim_start_matches('/'))
}

/// The remappings by which the nodes find the topics of the bag, compressed or not.
pub(super) fn remappings(inputs: &Inputs) -> Vec<String> {
    let mut rules = Vec::new();
    for (name, topic) in inputs.by_node_name() {
        let played = played_name(topic);
        let transport = match name {
            "depth/image" => Some(COMPRESSED_DEPTH_TOPIC),
            "rgb/image" => Some(COMPRESSED_IMAGE_TOPIC),
            _ => None,
        };
        rules.extend(transport.map(|below| format!("{name}/{below}:={played}/{below}")));
        rules.push(format!("{name}:={played}"));
    }
    rules
}

/// Whether the first message of a topic is larger than what the kernel lets a socket receive at once.
fn is_too_large(bag: &Path, topic: &str, granted: GrantedBuffer) -> bool {
    let first = || {
        let selection = Selection { topics: Some(vec![topic.to_owned()]), ..Selection::default() };
        Bag::open(bag).ok()?.messages(&selection).ok()?.next()?.ok()
    };
    first().is_some_and(|message| granted.check(topic, message.data.len()).is_err())
}

impl FedTopic {
    /// The name of what the node subscribes to, within the namespace.
    pub(super) fn received_name(&self) -> String {
        match self.compressed {
            Some(Compressed::Depth) => format!("{}/{COMPRESSED_DEPTH_TOPIC}", self.played_name),
            Some(Compressed::Colour) => format!("{}/{COMPRESSED_IMAGE_TOPIC}", self.played_name),
            None => self.played_name.clone(),
        }
    }
}

impl Compression {
    /// The note about images that are too large and not compressed.
    pub(super) fn uncompressed_note(&self) -> String {
        format!(
            "depth images of {} kB are larger than the {} kB that the kernel lets a socket receive at once, and \
             the pose node needs them, and colour images, uncompressed: some may be lost; \
             `{RAISE_RECEIVE_BUFFER}` fixes it",
            self.raw_bytes / 1000,
            self.largest_safe / 1000
        )
    }

    fn needed(bag: &Path, topic: &str, granted: GrantedBuffer) -> Option<Self> {
        let bag = Bag::open(bag).ok()?;
        let selection = Selection { topics: Some(vec![topic.to_owned()]), ..Selection::default() };
        let first = bag.messages(&selection).ok()?.next()?.ok()?;
        let too_large = granted.check(topic, first.data.len()).err()?;
        let image = convert::depth_from_message(&first.decode::<Image>().ok()?).ok()?;
        Self::of(&image, first.data.len(), too_large.largest_safe)
    }

    fn of(image: &DepthImage, raw_bytes: usize, largest_safe: usize) -> Option<Self> {
        let png_bytes = convert::compressed_message_from_depth(image).ok()?.data.len();
        let rounds = matches!(image.pixels(), DepthPixels::Metres(_));
        // An image of noise may become larger.
        (png_bytes < raw_bytes).then_some(Self { raw_bytes, png_bytes, largest_safe, rounds })
    }
}

impl fmt::Display for Compression {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let kb = |bytes: usize| bytes / 1000;
        write!(
            formatter,
            "depth images of {} kB are larger than the {} kB that the kernel lets a socket receive at \
             once: they are sent as PNG of {} kB",
            kb(self.raw_bytes),
            kb(self.largest_safe),
            kb(self.png_bytes)
        )?;
        if self.rounds {
            write!(formatter, ", rounded to millimetres")?;
        } else {
            write!(formatter, ", without loss")?;
        }
        if self.png_bytes > self.largest_safe {
            write!(formatter, ", and even so some will be lost")?;
        }
        write!(formatter, "; to send raw ones: `{RAISE_RECEIVE_BUFFER}`")
    }
}

#[cfg(test)]
mod tests {
    use geometry::Stamp;

    use super::*;

    fn image(pixels: DepthPixels) -> DepthImage {
        DepthImage::new(Stamp::default(), "camera".to_owned(), (100, 100), pixels).unwrap()
    }

    #[test]
    fn the_note_names_the_sizes_and_the_fix() {
        let even = image(DepthPixels::Millimetres(vec![1500; 10_000]));
        let compression = Compression::of(&even, 20_000, 15_000).unwrap();
        let line = compression.to_string();
        for part in ["20 kB", "15 kB", "without loss", "sysctl -w net.core.rmem_max="] {
            assert!(line.contains(part), "{line}");
        }
        assert!(!line.contains("will be lost") && !line.contains('\n'), "{line}");
        let metres = image(DepthPixels::Metres(vec![1.5; 10_000]));
        let line = Compression::of(&metres, 40_000, 10).unwrap().to_string();
        assert!(line.contains("rounded to millimetres, and even so some will be lost"), "{line}");
        let line = compression.uncompressed_note();
        assert!(line.contains("20 kB") && line.contains("net.core.rmem_max="), "{line}");
    }

    #[test]
    fn an_image_that_would_grow_is_not_compressed() {
        let mut state = 1_u32;
        let noise = (0..10_000).map(|_| {
            state ^= state << 13;
            state ^= state >> 17;
            state ^= state << 5;
            state as u16
        });
        let image = image(DepthPixels::Millimetres(noise.collect()));
        assert_eq!(Compression::of(&image, 20_000, 15_000), None);
    }
}
