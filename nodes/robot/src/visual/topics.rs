//! Which topics of a bag the pose node reads.

use clap::Args;
use msgs::RosMessage;
use msgs::nav_msgs::Odometry;
use msgs::sensor_msgs::{CameraInfo, CompressedImage, Image, Imu};

use crate::failure::Failure;
use crate::offer::Offer;
use crate::run::view_topics::raw_name;

/// Topics that the user names; the rest is found by type and name.
#[derive(Args, Clone, Debug, Default)]
pub struct VisualTopicArgs {
    /// The colour image topic of the visual odometry and of the map's colours (Image, or CompressedImage)
    #[arg(long, value_name = "TOPIC")]
    image: Option<String>,
    /// The CameraInfo topic of the colour image
    #[arg(long, value_name = "TOPIC")]
    image_info: Option<String>,
}

/// The topics of the pose node.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct VisualTopics {
    /// Of the colour images.
    pub image: String,
    /// Whether the colour images are compressed.
    pub is_compressed: bool,
    /// Of the colour camera's calibration.
    pub camera_info: String,
    /// Of the depth images.
    pub depth: String,
    /// Of the inertial unit.
    pub imu: Option<String>,
    /// Of the wheels' odometry.
    pub wheels: Option<String>,
}

impl VisualTopicArgs {
    /// Whether the user names none.
    pub(crate) fn is_empty(&self) -> bool {
        self.image.is_none() && self.image_info.is_none()
    }
}

impl VisualTopics {
    /// Chooses among topics: those that the user named, else those with the usual names. Depth images that are
    /// registered need no calibration of their own, and many bags have one for both.
    pub fn choose(
        args: &VisualTopicArgs,
        depth: &str,
        depth_info: &str,
        offer: &Offer<'_>,
    ) -> Result<Self, Failure> {
        let (image, is_compressed) = color_image(args, depth, offer)?;
        let camera_info = match &args.image_info {
            Some(named) => name_of(named, offer),
            None => {
                let beside = |image: &str| {
                    let parent = image.rsplit_once('/').map_or("", |(parent, _)| parent);
                    format!("{parent}/camera_info")
                };
                let base = image.strip_suffix("/compressed").unwrap_or(&image);
                let own = beside(base);
                if offer.has(&own, CameraInfo::TYPE_NAME) { own } else { depth_info.to_owned() }
            }
        };
        if !offer.has(&camera_info, CameraInfo::TYPE_NAME) {
            return Err(Failure::new(format!(
                "{} has no camera_info on {camera_info}",
                offer.place()
            ))
            .fix("--image-info names the topic of the colour camera's calibration"));
        }
        let first = |type_name: &str| offer.of_type(type_name).next().map(str::to_owned);
        Ok(Self {
            image,
            is_compressed,
            camera_info,
            depth: depth.to_owned(),
            imu: first(Imu::TYPE_NAME),
            wheels: first(Odometry::TYPE_NAME),
        })
    }

    /// Whether there are images of a colour camera by their name.
    pub(crate) fn is_usual_in(offer: &Offer<'_>) -> bool {
        let images = offer.of_type(Image::TYPE_NAME);
        images.chain(offer.of_type(CompressedImage::TYPE_NAME)).any(is_colour)
    }

    /// Whether the images are of a colour camera by their name: others may be of an infrared or a grey one.
    pub(crate) fn has_usual_name(&self) -> bool {
        is_usual(&self.image)
    }

    /// The topics that the node subscribes to, each with the name that the node knows it by; without the depth image.
    pub fn by_node_name(&self) -> Vec<(&'static str, &str)> {
        let image = if self.is_compressed { "rgb/image/compressed" } else { "rgb/image" };
        let mut topics = vec![(image, self.image.as_str())];
        topics.push(("rgb/camera_info", &self.camera_info));
        topics.extend(self.imu.as_deref().map(|topic| ("imu", topic)));
        topics.extend(self.wheels.as_deref().map(|topic| ("wheels", topic)));
        topics
    }
}

/// The topic of the depth images: the named one, or the only one there is. Compressed ones are taken where there are no others.
pub fn depth_topic(named: Option<&str>, offer: &Offer<'_>) -> Result<String, Failure> {
    if let Some(named) = named {
        return Ok(name_of(named, offer));
    }
    let mut found = offer.of_type(Image::TYPE_NAME).filter(|topic| topic.contains("depth"));
    let mut compressed =
        offer.of_type(CompressedImage::TYPE_NAME).filter(|topic| raw_name(topic).is_some());
    let found = match found.next() {
        Some(one) => (Some(one), found.next()),
        None => (compressed.next(), compressed.next()),
    };
    match found {
        (Some(only), None) => Ok(only.to_owned()),
        (None, _) => {
            let failure =
                Failure::new(format!("{} has no depth images{}", offer.place(), offer.unread()));
            Err(failure.fix(if offer.is_of_a_lidar_alone() {
                "of a 3D LiDAR: `stillmap odometry BAG --of lidar -o FILE`, `stillmap run BAG --pose lidar`".to_owned()
            } else {
                format!("--depth names their topic; {}", offer.listed_by())
            }))
        }
        (Some(one), Some(other)) => {
            Err(Failure::new(format!("{} has several topics of depth images", offer.place()))
                .fix(format!("choose with --depth: {one}, {other}, ...")))
        }
    }
}

/// The name of a topic as it is there; the given name where there is no such topic.
fn name_of(named: &str, offer: &Offer<'_>) -> String {
    offer.find(named).map_or(named, |(topic, _)| topic).to_owned()
}

/// The topic of a depth camera's calibration: beside its images.
pub fn depth_info_topic(depth: &str) -> String {
    let raw = raw_name(depth).unwrap_or(depth);
    let parent = raw.rsplit_once('/').map_or("", |(parent, _)| parent);
    format!("{parent}/camera_info")
}

fn is_colour(topic: &str) -> bool {
    is_usual(topic) && !topic.contains("depth")
}

fn is_usual(image: &str) -> bool {
    ["rgb", "color", "colour"].iter().any(|name| image.contains(name))
}

/// The colour image, and whether it is compressed.
fn color_image(
    args: &VisualTopicArgs,
    depth: &str,
    offer: &Offer<'_>,
) -> Result<(String, bool), Failure> {
    if let Some(named) = &args.image {
        return match offer.find(named) {
            Some((topic, Image::TYPE_NAME)) => Ok((topic.to_owned(), false)),
            Some((topic, CompressedImage::TYPE_NAME)) => Ok((topic.to_owned(), true)),
            Some((_, type_name)) => {
                Err(Failure::new(format!("topic {named} carries {type_name}, no image")))
            }
            None => Err(Failure::new(format!("{} has no topic {named}", offer.place()))
                .fix(offer.listed_by())),
        };
    }
    let is_color = |topic: &&str| *topic != depth && !topic.contains("depth");
    let raw = offer.of_type(Image::TYPE_NAME).filter(is_color).map(|topic| (topic, false));
    let packed =
        offer.of_type(CompressedImage::TYPE_NAME).filter(is_color).map(|topic| (topic, true));
    let candidates: Vec<(&str, bool)> = raw.chain(packed).collect();
    let usual: Vec<&(&str, bool)> =
        candidates.iter().filter(|(topic, _)| is_usual(topic)).collect();
    match (candidates.as_slice(), usual.as_slice()) {
        ([], _) => Err(Failure::new(format!(
            "{} has no colour images{}",
            offer.place(),
            offer.unread()
        ))
        .fix("visual odometry takes sensor_msgs/Image or CompressedImage beside the depth images")),
        ([(topic, is_compressed)], _) => Ok(((*topic).to_owned(), *is_compressed)),
        (several, []) => Err(undecided(several.iter(), offer)),
        (_, usual) => {
            let of_camera = of_the_camera(depth, usual);
            let (topic, is_compressed) =
                of_camera.ok_or_else(|| undecided(usual.iter().copied(), offer))?;
            Ok((topic.to_owned(), is_compressed))
        }
    }
}

/// Of several topics the one of the camera of the depth images: with the most parts of its name in common with theirs, from the left. A camera
/// may have more than one, as rectified images beside raw ones, and the first is taken; `None` where they are of different cameras.
fn of_the_camera<'a>(depth: &str, topics: &[&(&'a str, bool)]) -> Option<(&'a str, bool)> {
    let shared = |topic: &str| {
        let both = topic.split('/').zip(depth.split('/'));
        both.take_while(|(one, other)| one == other).count()
    };
    let most = topics.iter().map(|(topic, _)| shared(topic)).max()?;
    let mut nearest = topics.iter().filter(|(topic, _)| shared(topic) == most);
    let first = **nearest.next()?;
    // Without a part in common (a name begins with a slash, so with an empty one) the next part is that of their camera.
    let camera = |topic: &str| topic.split('/').nth(most).map(str::to_owned);
    let is_one = most > 1 || nearest.all(|(topic, _)| camera(topic) == camera(first.0));
    is_one.then_some(first)
}

fn undecided<'a>(several: impl Iterator<Item = &'a (&'a str, bool)>, offer: &Offer<'_>) -> Failure {
    let names: Vec<&str> = several.map(|(topic, _)| *topic).collect();
    Failure::new(format!("{} has {} topics of images", offer.place(), names.len()))
        .fix(format!("choose with --image: {}", names.join(", ")))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The colour images that are chosen for depth images among topics.
    fn colours(depth: &str, images: &[&str]) -> Result<String, String> {
        let topics = images.iter().copied().chain([depth]).map(|topic| (topic, Image::TYPE_NAME));
        let info = depth_info_topic(depth);
        let offer = Offer::of_graph(topics.chain([(info.as_str(), CameraInfo::TYPE_NAME)]));
        let chosen = VisualTopics::choose(&VisualTopicArgs::default(), depth, &info, &offer);
        chosen.map(|topics| topics.image).map_err(|failure| failure.to_string())
    }

    /// Regression: of a bag whose depth images are compressed there was no odometry: it was said to have none.
    #[test]
    fn compressed_depth_images_are_taken_where_there_are_no_others() {
        let (compressed, raw) = ("/cam/depth/image/compressedDepth", "/cam/depth/image");
        let types = [CompressedImage::TYPE_NAME, Image::TYPE_NAME];
        let chosen = |topics: &[(&'static str, &'static str)]| {
            depth_topic(None, &Offer::of_graph(topics.iter().copied())).unwrap()
        };
        assert_eq!(chosen(&[(compressed, types[0])]), compressed);
        assert_eq!(chosen(&[(compressed, types[0]), (raw, types[1])]), raw);
        assert_eq!(depth_info_topic(compressed), "/cam/depth/camera_info");
    }

    /// Regression: of two cameras the images of the first by name were taken, whatever the depth images were.
    #[test]
    fn colours_are_of_the_camera_of_the_depth_images() {
        let both = ["/cam_back/rgb/image_raw", "/cam_front/rgb/image_raw"];
        let chosen = |depth: &str| colours(depth, &both);
        assert_eq!(chosen("/cam_front/depth/image_raw").as_deref(), Ok(both[1]));
        assert_eq!(chosen("/cam_back/depth/image_raw").as_deref(), Ok(both[0]));
        let said = chosen("/kinect/depth/image_raw").unwrap_err();
        assert!(said.contains("choose with --image: /cam_back/rgb/image_raw, "), "{said}");
        // One camera has several, and the usual names have none of a camera.
        let zed = ["/zed/node/left/image_rect_color", "/zed/node/rgb/image_rect_color"];
        let of_zed = colours("/zed/node/depth/depth_registered", &zed);
        assert_eq!(of_zed.as_deref(), Ok(zed[0]));
        let usual = ["/rgb/image_raw", "/rgb/image_rect_color"];
        assert_eq!(colours("/depth/image", &usual).as_deref(), Ok(usual[0]));
    }
}
