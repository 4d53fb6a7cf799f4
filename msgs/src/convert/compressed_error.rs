//! Why an image cannot be compressed, or a compressed one not be read.

use super::compressed_depth::RvlError;

/// An image could not be compressed, or a compressed one is not what it claims to be.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
pub enum CompressedImageError {
    /// A compressed image of another kind.
    #[error(
        "CompressedImage: format {format:?} is no compressed depth image; \"16UC1; compressedDepth \
         png\" and \"32FC1; compressedDepth rvl\", for instance, are"
    )]
    NoDepthFormat {
        /// The format, the start of it.
        format: String,
    },
    /// A depth image by a codec that is not known.
    #[error(
        "CompressedImage: depth images by the codec {codec:?} are not read, those by png and rvl are; \
         set the publisher's parameter compressedDepth.format to one of them"
    )]
    DepthCodec {
        /// The codec.
        codec: String,
    },
    /// A compressed depth image, where one of colours or greys was wanted.
    #[error(
        "CompressedImage: format {format:?} is that of a depth image; subscribe to the topic of the \
         colour images, which ends in /compressed"
    )]
    DepthFormat {
        /// The format, the start of it.
        format: String,
    },
    /// Data that is neither of the two pictures that are known.
    #[error(
        "CompressedImage: the data of format {format:?} is neither a JPEG nor a PNG picture; set the \
         publisher's parameter compressed.format to one of them"
    )]
    PictureFormat {
        /// The format, the start of it.
        format: String,
    },
    /// A compressed depth image without the header before the picture.
    #[error(
        "CompressedImage: data has {data_bytes} bytes, less than the {header_bytes} before a {codec:?} picture"
    )]
    Header {
        /// The codec.
        codec: &'static str,
        /// The bytes there are.
        data_bytes: usize,
        /// The bytes needed.
        header_bytes: usize,
    },
    /// A header that no depth can be had by.
    #[error(
        "CompressedImage: the parameters {a} and {b} of quantised depths are invalid; both must be \
         finite, and the first above 0"
    )]
    Quantisation {
        /// The first parameter.
        a: f32,
        /// The second.
        b: f32,
    },
    /// The picture is damaged, or none.
    #[error("CompressedImage: the {codec:?} picture cannot be read: {reason}")]
    Picture {
        /// The codec.
        codec: &'static str,
        /// The decoder's error.
        reason: String,
    },
    /// An RVL picture that is damaged, or none.
    #[error("CompressedImage: the \"rvl\" picture cannot be read: {0}; the message is damaged")]
    Rvl(#[from] RvlError),
    /// A picture of other pixels.
    #[error("CompressedImage: the pixels are {found}; wanted are those of {wanted}")]
    OtherPixels {
        /// Their kind.
        found: String,
        /// The kind needed.
        wanted: &'static str,
    },
    /// A picture that cannot be in the data.
    #[error(
        "CompressedImage: a {codec:?} picture of {width} x {height} px cannot come out of \
         {data_bytes} bytes; the message is damaged"
    )]
    BeyondData {
        /// The codec.
        codec: &'static str,
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
        /// The bytes there are.
        data_bytes: usize,
    },
    /// A picture that is larger than those of any camera.
    #[error(
        "CompressedImage: a {codec:?} picture of {width} x {height} px is more than the {most_pixels} \
         pixels that are read; the message is damaged"
    )]
    TooLarge {
        /// The codec.
        codec: &'static str,
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
        /// The most that there can be.
        most_pixels: usize,
    },
    /// An image that cannot be a picture.
    #[error("an image of {width_px} x {height_px} px cannot become a {codec:?} picture: {reason}")]
    NoPicture {
        /// The codec.
        codec: &'static str,
        /// Columns.
        width_px: usize,
        /// Rows.
        height_px: usize,
        /// The encoder's error.
        reason: String,
    },
}
