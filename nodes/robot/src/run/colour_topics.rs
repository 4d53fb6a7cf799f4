//! Which topics of a bag give the map its colours.

use bag_player::{Bag, BagInfo, Selection};
use geometry::CameraModel;
use msgs::RosMessage;
use msgs::convert;
use msgs::sensor_msgs::{CameraInfo, CompressedImage, Image};

use super::inputs::{TopicArgs, ViewTopics};
use crate::console;
use crate::failure::Failure;
use crate::offer::Offer;
use crate::visual::{VisualTopicArgs, VisualTopics};

/// The topics of the colour camera.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct ColourTopics {
    /// Of the images.
    pub(crate) image: String,
    /// Whether they are JPEG or PNG.
    pub(crate) is_compressed: bool,
    /// Of their calibration: that of the depth images where these are registered and have it alone.
    pub(crate) camera_info: String,
}

impl ColourTopics {
    /// The topics beside the depth images: those that the user named, else those with the usual names. `None` where the bag has
    /// none, and, with a note, where those that it has cannot be used.
    ///
    /// # Errors
    /// When those that the user named are not there.
    pub(super) fn choose(
        args: &VisualTopicArgs,
        view: &ViewTopics,
        bag: &Bag,
        info: &BagInfo,
    ) -> Result<Option<Self>, Failure> {
        let ViewTopics::Depth { image: depth, camera_info } = view else { return Ok(None) };
        let offer = Offer::of_bag(info);
        let chosen = match VisualTopics::choose(args, depth, camera_info, &offer) {
            Ok(chosen) => chosen,
            Err(failure) if args.is_empty() => {
                if VisualTopics::is_usual_in(&offer) {
                    console::note(format_args!("the map has no colours: {failure}"));
                }
                return Ok(None);
            }
            Err(failure) => return Err(failure),
        };
        // An infrared or a grey camera is taken where it is named.
        if args.is_empty() && !chosen.has_usual_name() {
            return Ok(None);
        }
        let VisualTopics { image, is_compressed, camera_info, .. } = chosen;
        let topics = Self { image, is_compressed, camera_info };
        if let Err(reason) = topics.check(bag) {
            console::note(format_args!("the map has no colours: {}: {reason}", topics.image));
            return Ok(None);
        }
        Ok(Some(topics))
    }

    /// The topics of raw images that the user wants to be masked, by the same rules.
    ///
    /// # Errors
    /// When there are none.
    pub(crate) fn to_be_masked(
        topics: &TopicArgs,
        view: &ViewTopics,
        bag: &Bag,
        info: &BagInfo,
    ) -> Result<Self, Failure> {
        let ViewTopics::Depth { image: depth, camera_info } = view else {
            return Err(Failure::new(
                "--colour needs depth images: with clouds alone no image is masked".to_owned(),
            ));
        };
        let args = topics.visual();
        let chosen = VisualTopics::choose(args, depth, camera_info, &Offer::of_bag(info))?;
        if args.is_empty() && !chosen.has_usual_name() {
            return Err(Failure::new(format!(
                "the bag has no colour images by the names of its topics; {} is one of other images",
                chosen.image
            ))
            .fix("--image names the topic of the colour camera"));
        }
        let VisualTopics { image, is_compressed, camera_info, .. } = chosen;
        if is_compressed {
            return Err(Failure::new(format!(
                "{image}: compressed images are not masked, raw ones are"
            ))
            .fix("without --colour they are kept as they are"));
        }
        let chosen = Self { image, is_compressed, camera_info };
        let refused = |reason| Failure::new(format!("{}: {reason}", chosen.image));
        let size_px = chosen.size_of_camera(bag).map_err(refused)?;
        let message = first::<Image>(bag, &chosen.image).map_err(refused)?;
        chosen
            .check_size((message.width as usize, message.height as usize), size_px)
            .map_err(refused)?;
        Ok(chosen)
    }

    /// Each topic, with the name that the node knows it by.
    pub(super) fn by_node_name(&self) -> [(&'static str, &str); 2] {
        let image = if self.is_compressed { "rgb/image/compressed" } else { "rgb/image" };
        [(image, &self.image), ("rgb/camera_info", &self.camera_info)]
    }

    /// Reads the first image and its calibration.
    ///
    /// # Errors
    /// With what is wrong with them.
    fn check(&self, bag: &Bag) -> Result<(), String> {
        let image = if self.is_compressed {
            let message = first::<CompressedImage>(bag, &self.image)?;
            convert::image_from_compressed_message(&message).map_err(|error| error.to_string())?
        } else {
            first::<Image>(bag, &self.image)?
        };
        let image =
            convert::colour_image_from_message(&image).map_err(|error| error.to_string())?;
        let size_px = self.size_of_camera(bag)?;
        self.check_size((image.width_px(), image.height_px()), size_px)
    }

    fn size_of_camera(&self, bag: &Bag) -> Result<(usize, usize), String> {
        let message = first::<CameraInfo>(bag, &self.camera_info)?;
        let camera =
            convert::camera_of_image(&message, &self.image).map_err(|error| error.to_string())?;
        camera.validate().map_err(|error| error.to_string())?;
        let CameraModel { width_px, height_px, .. } = camera;
        Ok((width_px, height_px))
    }

    fn check_size(
        &self,
        image_px: (usize, usize),
        (width_px, height_px): (usize, usize),
    ) -> Result<(), String> {
        if image_px == (width_px, height_px) {
            return Ok(());
        }
        Err(format!(
            "its images have {} x {} pixels, and the calibration on {} is for {width_px} x {height_px}",
            image_px.0, image_px.1, self.camera_info
        ))
    }
}

/// The first message of a topic.
fn first<M: RosMessage>(bag: &Bag, topic: &str) -> Result<M, String> {
    let selection = Selection { topics: Some(vec![topic.to_owned()]), ..Selection::default() };
    let mut messages = bag.messages(&selection).map_err(|error| error.to_string())?;
    let first = messages.next().ok_or_else(|| format!("nothing is on {topic}"))?;
    let decoded = first.and_then(|message| message.decode::<M>());
    decoded.map_err(|error| error.to_string())
}
