//! Which topics of a bag the pose node reads.

use bag_player::BagInfo;
use clap::Args;
use msgs::RosMessage;
use msgs::nav_msgs::Odometry;
use msgs::sensor_msgs::{CameraInfo, CompressedImage, Image, Imu};

use crate::failure::Failure;
use crate::run::inputs::{is_input, unread};

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
    /// Chooses the topics of a bag: those that the user named, else those with the usual names. Depth images that are
    /// registered need no calibration of their own, and many bags have one for both.
    pub fn choose(
        args: &VisualTopicArgs,
        depth: &str,
        depth_info: &str,
        info: &BagInfo,
    ) -> Result<Self, Failure> {
        let (image, is_compressed) = color_image(args, depth, info)?;
        let camera_info = match &args.image_info {
            Some(named) => info.recorded_name(named).to_owned(),
            None => {
                let beside = |image: &str| {
                    let parent = image.rsplit_once('/').map_or("", |(parent, _)| parent);
                    format!("{parent}/camera_info")
                };
                let base = image.strip_suffix("/compressed").unwrap_or(&image);
                let own = beside(base);
                let has_own = of_type(info, CameraInfo::TYPE_NAME).any(|topic| topic == own);
                if has_own { own } else { depth_info.to_owned() }
            }
        };
        let is_there = of_type(info, CameraInfo::TYPE_NAME).any(|topic| topic == camera_info);
        if !is_there {
            return Err(Failure::new(format!("the bag has no camera_info on {camera_info}"))
                .fix("--image-info names the topic of the colour camera's calibration"));
        }
        let first = |type_name: &'static str| of_type(info, type_name).next().map(str::to_owned);
        Ok(Self {
            image,
            is_compressed,
            camera_info,
            depth: depth.to_owned(),
            imu: first(Imu::TYPE_NAME),
            wheels: first(Odometry::TYPE_NAME),
        })
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

/// The topic of the depth images: the named one, or the only one there is.
pub fn depth_topic(named: Option<&str>, info: &BagInfo) -> Result<String, Failure> {
    if let Some(named) = named {
        return Ok(info.recorded_name(named).to_owned());
    }
    let mut found = of_type(info, Image::TYPE_NAME).filter(|topic| topic.contains("depth"));
    match (found.next(), found.next()) {
        (Some(only), None) => Ok(only.to_owned()),
        (None, _) => Err(Failure::new(format!("the bag has no depth images{}", unread(info)))
            .fix("--depth names their topic; `stillmap info` lists what the bag holds")),
        (Some(one), Some(other)) => {
            Err(Failure::new("the bag has several topics of depth images".to_owned())
                .fix(format!("choose with --depth: {one}, {other}, ...")))
        }
    }
}

/// The topic of a depth camera's calibration: beside its images.
pub fn depth_info_topic(depth: &str) -> String {
    let parent = depth.rsplit_once('/').map_or("", |(parent, _)| parent);
    format!("{parent}/camera_info")
}

/// The colour image, and whether it is compressed.
fn color_image(
    args: &VisualTopicArgs,
    depth: &str,
    info: &BagInfo,
) -> Result<(String, bool), Failure> {
    let compressed = CompressedImage::TYPE_NAME;
    if let Some(named) = &args.image {
        return match info.topic(named) {
            Some(topic) if topic.type_name == Image::TYPE_NAME => Ok((topic.topic.clone(), false)),
            Some(topic) if topic.type_name == compressed => Ok((topic.topic.clone(), true)),
            Some(topic) => {
                Err(Failure::new(format!("topic {named} carries {}, no image", topic.type_name)))
            }
            None => Err(Failure::new(format!("the bag has no topic {named}"))
                .fix("`stillmap info` lists what the bag holds")),
        };
    }
    let is_color = |topic: &&str| *topic != depth && !topic.contains("depth");
    let raw = of_type(info, Image::TYPE_NAME).filter(is_color).map(|topic| (topic, false));
    let packed = of_type(info, compressed).filter(is_color).map(|topic| (topic, true));
    let candidates: Vec<(&str, bool)> = raw.chain(packed).collect();
    let usual = |(topic, _): &&(&str, bool)| {
        ["rgb", "color", "colour"].iter().any(|name| topic.contains(name))
    };
    let usual: Vec<&(&str, bool)> = candidates.iter().filter(usual).collect();
    match (candidates.as_slice(), usual.as_slice()) {
        ([], _) => Err(Failure::new(format!("the bag has no colour images{}", unread(info))).fix(
            "visual odometry takes sensor_msgs/Image or CompressedImage beside the depth images",
        )),
        ([(topic, is_compressed)], _) => Ok(((*topic).to_owned(), *is_compressed)),
        (_, [(topic, is_compressed), ..]) => Ok(((*topic).to_owned(), *is_compressed)),
        (several, []) => {
            let names: Vec<&str> = several.iter().map(|(topic, _)| *topic).collect();
            Err(Failure::new(format!("the bag has {} topics of images", several.len()))
                .fix(format!("choose with --image: {}", names.join(", "))))
        }
    }
}

/// The topics of a type that could be an input: the truth is none.
fn of_type<'a>(info: &'a BagInfo, type_name: &'a str) -> impl Iterator<Item = &'a str> {
    info.topics
        .iter()
        .filter(move |topic| is_input(topic, type_name))
        .map(|topic| topic.topic.as_str())
        .filter(|topic| !topic.starts_with("/truth/"))
}
