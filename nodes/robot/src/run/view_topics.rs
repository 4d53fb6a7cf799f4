//! The topics of depth images, raw or compressed, or of clouds, and the images in their messages.

use bag_player::{BagError, BagMessage};
use detection::shell::CloudInput;
use geometry::DepthImage;
use msgs::convert::{self, COMPRESSED_DEPTH_TOPIC, ConvertError};
use msgs::sensor_msgs::{CompressedImage, Image};

/// The name that detection knows compressed depth images by.
pub(crate) const COMPRESSED_DEPTH: &str = "depth/image/compressedDepth";

/// Where the points come from.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum ViewTopics {
    /// A depth image and its calibration.
    Depth {
        /// The topic of the images; one of compressed images has its usual name, see [`ViewTopics::is_compressed`].
        image: String,
        /// The topic of their calibration.
        camera_info: String,
    },
    /// A ready cloud.
    Points(String),
}

impl ViewTopics {
    /// Whether a topic has the calibration of the depth images.
    pub(crate) fn has_camera_info(&self, topic: &str) -> bool {
        matches!(self, Self::Depth { camera_info, .. } if camera_info == topic)
    }

    /// The value of detection's parameter `input`.
    pub(crate) fn input(&self) -> CloudInput {
        match self {
            Self::Depth { .. } if self.is_compressed() => CloudInput::CompressedDepth,
            Self::Depth { .. } => CloudInput::Depth,
            Self::Points(_) => CloudInput::Points,
        }
    }

    /// The same as a text.
    pub(crate) fn kind(&self) -> &'static str {
        match self.input() {
            CloudInput::CompressedDepth => "compressed_depth",
            CloudInput::Depth => "depth",
            CloudInput::Points => "points",
        }
    }

    /// Whether the depth images are compressed ones (`compressedDepth` of `image_transport`).
    #[must_use]
    pub fn is_compressed(&self) -> bool {
        matches!(self, Self::Depth { image, .. } if raw_name(image).is_some())
    }
}

/// The name of the raw images of a topic of compressed depth images; `None` of other topics.
pub(crate) fn raw_name(topic: &str) -> Option<&str> {
    topic.strip_suffix(COMPRESSED_DEPTH_TOPIC)?.strip_suffix('/')
}

/// A message is no depth image.
#[derive(Debug, thiserror::Error)]
pub enum DepthImageError {
    /// It is damaged.
    #[error(transparent)]
    Message(#[from] BagError),
    /// It cannot be used.
    #[error(transparent)]
    Image(#[from] ConvertError),
}

/// The depth image of a message of [`ViewTopics::Depth`], raw or compressed.
///
/// # Errors
/// When it is damaged, or no depth image.
pub fn depth_image(message: &BagMessage) -> Result<DepthImage, DepthImageError> {
    Ok(match raw_name(&message.topic) {
        Some(_) => convert::compressed_depth_from_message(&message.decode::<CompressedImage>()?)?,
        None => convert::depth_from_message(&message.decode::<Image>()?)?,
    })
}
