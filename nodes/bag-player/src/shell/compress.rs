//! Depth images as PNG: a fifth to a half of the bytes, for a network or a kernel that raw ones are too
//! large for.

use std::sync::Arc;

use msgs::convert::{self, ConvertError};
use msgs::sensor_msgs::{CompressedImage, Image};
use msgs::{RosMessage, cdr};

use crate::error::BagError;
use crate::info::BagInfo;
use crate::message::{BagMessage, bare, full_type_name};
use crate::shell::options::PlayOptions;
use crate::shell::play::PlayError;

/// The topics whose depth images are compressed.
#[derive(Clone, Debug, Default)]
pub(super) struct DepthCompression {
    topics: Arc<[String]>,
    type_name: Arc<str>,
}

/// Why an image could not be compressed.
#[derive(Debug, thiserror::Error)]
pub(super) enum CompressError {
    /// It cannot be decoded.
    #[error(transparent)]
    Bag(#[from] BagError),
    /// It is not what it claims to be.
    #[error("an image on {topic} cannot be compressed: {source}")]
    Convert {
        /// The topic.
        topic: String,
        /// Why.
        source: ConvertError,
    },
    /// What came of it cannot be encoded.
    #[error("a compressed image for {topic} cannot be encoded: {source}")]
    Encode {
        /// The topic.
        topic: String,
        /// Why.
        source: cdr::CdrError,
    },
}

impl CompressError {
    /// Whether the topic carries other images: then every one of them fails.
    pub(super) fn is_no_depth(&self) -> bool {
        matches!(self, Self::Convert { source: ConvertError::Encoding { .. }, .. })
    }
}

impl DepthCompression {
    /// The topics that the options name.
    ///
    /// # Errors
    /// When the bag has no such topic of images, or it is not played.
    pub(super) fn checked(options: &PlayOptions, info: &BagInfo) -> Result<Self, PlayError> {
        for topic in &options.compress_depth {
            let same = |one: &str| bare(one) == bare(topic);
            let is_played = options.topics.is_empty() || options.topics.iter().any(|one| same(one));
            let known = info.topics.iter().filter(|known| same(&known.topic)).collect::<Vec<_>>();
            if known.is_empty() || !is_played {
                let images = info.topics.iter().filter(|known| is_image(&known.type_name));
                let images: Vec<&str> = images.map(|known| known.topic.as_str()).collect();
                return Err(PlayError::CompressUnplayed {
                    topic: topic.clone(),
                    images: if images.is_empty() { "none".to_owned() } else { images.join(", ") },
                });
            }
            if let Some(other) = known.iter().find(|known| !is_image(&known.type_name)) {
                return Err(PlayError::CompressNoImages {
                    topic: topic.clone(),
                    type_name: other.type_name.clone(),
                });
            }
        }
        Ok(Self {
            topics: options.compress_depth.clone().into(),
            type_name: CompressedImage::TYPE_NAME.into(),
        })
    }

    /// Whether a topic's images are compressed.
    pub(super) fn includes(&self, topic: &str) -> bool {
        self.topics.iter().any(|one| bare(one) == bare(topic))
    }

    /// Compresses a message in place, if it is one of those that are compressed.
    pub(super) fn apply(&self, message: &mut BagMessage) -> Result<(), CompressError> {
        if !self.includes(&message.topic) || !is_image(&message.type_name) {
            return Ok(());
        }
        let topic = || message.topic.to_string();
        let image = message.decode::<Image>()?;
        let compressed = convert::depth_from_message(&image)
            .and_then(|image| convert::compressed_message_from_depth(&image))
            .map_err(|source| CompressError::Convert { topic: topic(), source })?;
        message.data = cdr::encode(&compressed)
            .map_err(|source| CompressError::Encode { topic: topic(), source })?;
        message.type_name = Arc::clone(&self.type_name);
        Ok(())
    }
}

fn is_image(type_name: &str) -> bool {
    full_type_name(type_name) == Image::TYPE_NAME
}
