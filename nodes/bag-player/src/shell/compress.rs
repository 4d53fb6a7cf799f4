//! Compression of the published images as by image_transport: depth without loss to a fifth to a
//! half of the bytes, colours to a twentieth, for networks and receive buffers that raw images are too large for.

use std::collections::BTreeMap;
use std::str::FromStr;
use std::sync::Arc;

use msgs::convert::{
    self, COMPRESSED_DEPTH_TOPIC, COMPRESSED_IMAGE_TOPIC, ConvertError, DepthCodec, ImageCodec,
    JpegQualityError, MetresAs,
};
use msgs::sensor_msgs::{CompressedImage, Image};
use msgs::{RosMessage, cdr};

use crate::error::BagError;
use crate::info::BagInfo;
use crate::message::{BagMessage, bare, full_type_name};
use crate::shell::options::PlayOptions;
use crate::shell::play::PlayError;

/// The codec of depth images.
#[derive(clap::ValueEnum, Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum DepthFormat {
    /// The smaller one for structured light, and read by every version of ROS
    #[default]
    Png,
    /// The faster one; ROS 2 reads it since Jazzy
    Rvl,
}

impl From<DepthFormat> for DepthCodec {
    fn from(format: DepthFormat) -> Self {
        match format {
            DepthFormat::Png => Self::Png,
            DepthFormat::Rvl => Self::Rvl,
        }
    }
}

/// A topic of colour or grey images to compress, with the quality.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct ColorCompression {
    /// The topic of the bag.
    pub topic: String,
    /// The encoding of its images.
    pub codec: ImageCodec,
}

/// In place of a quality: without loss.
const PNG: &str = "png";

/// A text that is not of the form `TOPIC`, `TOPIC=QUALITY` or `TOPIC=png`.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
pub enum ColorCompressionError {
    /// There is no topic.
    #[error("accepted is TOPIC or TOPIC=QUALITY, as /camera/color/image_raw=80, or TOPIC=png")]
    Topic,
    /// The quality is invalid.
    #[error(transparent)]
    Quality(#[from] JpegQualityError),
}

impl FromStr for ColorCompression {
    type Err = ColorCompressionError;

    fn from_str(text: &str) -> Result<Self, ColorCompressionError> {
        let (topic, codec) = match text.split_once('=') {
            Some((topic, PNG)) => (topic, ImageCodec::Png),
            Some((topic, quality)) => (topic, ImageCodec::Jpeg(quality.parse()?)),
            None => (text, ImageCodec::default()),
        };
        if topic.is_empty() {
            return Err(ColorCompressionError::Topic);
        }
        Ok(Self { topic: topic.to_owned(), codec })
    }
}

/// The compression of the images of a topic.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Codec {
    Depth(DepthCodec),
    Color(ImageCodec),
}

impl Codec {
    /// The option.
    fn option(self) -> &'static str {
        match self {
            Self::Depth(_) => "compress-depth",
            Self::Color(_) => "compress-color",
        }
    }

    /// The last part of the compressed images' topic.
    fn topic_part(self) -> &'static str {
        match self {
            Self::Depth(_) => COMPRESSED_DEPTH_TOPIC,
            Self::Color(_) => COMPRESSED_IMAGE_TOPIC,
        }
    }

    fn compress(self, image: &Image) -> Result<CompressedImage, ConvertError> {
        match self {
            Self::Depth(codec) => {
                let image = convert::depth_from_message(image)?;
                convert::compressed_message_from_depth_with(&image, codec, MetresAs::default())
            }
            Self::Color(codec) => convert::compressed_message_from_image(image, codec),
        }
    }
}

/// The topics whose images are compressed, by their bare names.
#[derive(Default, Clone, Debug)]
pub(super) struct Compression {
    codecs: Arc<BTreeMap<String, Codec>>,
    type_name: Arc<str>,
}

/// Why an image could not be compressed.
#[derive(Debug, thiserror::Error)]
pub(super) enum CompressError {
    /// It cannot be decoded.
    #[error(transparent)]
    Bag(#[from] BagError),
    /// It is not a valid image.
    #[error("--{option}: an image on {topic} cannot be compressed: {source}")]
    Convert {
        /// The option.
        option: &'static str,
        /// The topic.
        topic: String,
        /// Why.
        source: ConvertError,
    },
    /// The result cannot be encoded.
    #[error("a compressed image for {topic} cannot be encoded: {source}")]
    Encode {
        /// The topic.
        topic: String,
        /// Why.
        source: cdr::CdrError,
    },
}

impl CompressError {
    /// Whether the topic carries images of another kind, so that every one of them fails.
    pub(super) fn is_of_topic(&self) -> bool {
        matches!(self, Self::Convert { source: ConvertError::Encoding { .. }, .. })
    }
}

impl Compression {
    /// The topics in the options.
    ///
    /// # Errors
    /// When the bag has no such topic of images, it is not played, or it is named twice.
    pub(super) fn checked(options: &PlayOptions, info: &BagInfo) -> Result<Self, PlayError> {
        let depth_codec = Codec::Depth(options.depth_format.into());
        let depth = options.compress_depth.iter().map(|topic| (topic, depth_codec));
        let color =
            options.compress_color.iter().map(|asked| (&asked.topic, Codec::Color(asked.codec)));
        let mut codecs = BTreeMap::new();
        for (topic, codec) in depth.chain(color) {
            check(topic, codec, options, info)?;
            if let Some(other) = codecs.insert(bare(topic).to_owned(), codec)
                && other != codec
            {
                return Err(PlayError::CompressTwice { topic: topic.clone() });
            }
        }
        Ok(Self { codecs: Arc::new(codecs), type_name: CompressedImage::TYPE_NAME.into() })
    }

    /// The suffix of the name of a topic whose images are compressed.
    pub(super) fn topic_part(&self, topic: &str) -> Option<&'static str> {
        self.codecs.get(bare(topic)).map(|codec| codec.topic_part())
    }

    /// Compresses a message in place, if its topic is compressed.
    pub(super) fn apply(&self, message: &mut BagMessage) -> Result<(), CompressError> {
        let Some(codec) = self.codecs.get(bare(&message.topic)) else { return Ok(()) };
        if !is_image(&message.type_name) {
            return Ok(());
        }
        let topic = || message.topic.to_string();
        let compressed = codec.compress(&message.decode::<Image>()?).map_err(|source| {
            CompressError::Convert { option: codec.option(), topic: topic(), source }
        })?;
        message.data = cdr::encode(&compressed)
            .map_err(|source| CompressError::Encode { topic: topic(), source })?;
        message.type_name = Arc::clone(&self.type_name);
        Ok(())
    }
}

/// Whether the bag has such a topic, it is played, and carries images.
fn check(
    topic: &str,
    codec: Codec,
    options: &PlayOptions,
    info: &BagInfo,
) -> Result<(), PlayError> {
    let option = codec.option();
    let same = |one: &str| bare(one) == bare(topic);
    let is_played = options.topics.is_empty() || options.topics.iter().any(|one| same(one));
    let known = info.topics.iter().filter(|known| same(&known.topic)).collect::<Vec<_>>();
    if known.is_empty() || !is_played {
        let images = info.topics.iter().filter(|known| is_image(&known.type_name));
        let images: Vec<&str> = images.map(|known| known.topic.as_str()).collect();
        return Err(PlayError::CompressUnplayed {
            option,
            topic: topic.to_owned(),
            images: if images.is_empty() { "none".to_owned() } else { images.join(", ") },
        });
    }
    match known.iter().find(|known| !is_image(&known.type_name)) {
        Some(other) => Err(PlayError::CompressNoImages {
            option,
            topic: topic.to_owned(),
            type_name: other.type_name.clone(),
        }),
        None => Ok(()),
    }
}

fn is_image(type_name: &str) -> bool {
    full_type_name(type_name) == Image::TYPE_NAME
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_topic_may_say_how_well_its_images_are_kept() {
        let parsed = |text: &str| {
            let ColorCompression { topic, codec } = text.parse().unwrap();
            (topic, codec)
        };
        let jpeg = |quality: &str| ImageCodec::Jpeg(quality.parse().unwrap());
        assert_eq!(parsed("/color"), ("/color".to_owned(), jpeg("95")));
        assert_eq!(parsed("color=80"), ("color".to_owned(), jpeg("80")));
        assert_eq!(parsed("color=png"), ("color".to_owned(), ImageCodec::Png));
        for (text, says) in [
            ("", "accepted is TOPIC or TOPIC=QUALITY"),
            ("=80", "accepted is TOPIC or TOPIC=QUALITY"),
            ("/color=0", "\"0\" is no quality of a JPEG picture; 1 (worst) to 100 (best) are"),
            ("/color=", "\"\" is no quality"),
        ] {
            let error = text.parse::<ColorCompression>().unwrap_err().to_string();
            assert!(error.starts_with(says), "{text}: {error}");
        }
    }
}
