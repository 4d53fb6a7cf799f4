//! How a driver's pixels are to be read.

use std::str::FromStr;

use super::BayerPattern;

/// An encoding of `sensor_msgs/Image` that a gray image can be made of; read from its name.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum PixelEncoding {
    /// `mono8`, `8UC1`.
    Mono8,
    /// `mono16`, `16UC1`.
    Mono16,
    /// `rgb8`.
    Rgb8,
    /// `bgr8`, `8UC3`.
    Bgr8,
    /// `rgba8`.
    Rgba8,
    /// `bgra8`, `8UC4`.
    Bgra8,
    /// `bayer_rggb8` and its like.
    Bayer8(BayerPattern),
    /// `bayer_rggb16` and its like.
    Bayer16(BayerPattern),
    /// `yuv422`, `uyvy`: U, Y, V, Y.
    Uyvy,
    /// `yuv422_yuy2`, `yuyv`: Y, U, Y, V.
    Yuyv,
}

/// The encoding is none that a gray image can be made of.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[error(
    "encoding {name:?} is not known: mono8, mono16, rgb8, bgr8, rgba8, bgra8, 8UC1, 16UC1, 8UC3, 8UC4, \
     bayer_{{rggb,bggr,gbrg,grbg}}{{8,16}}, yuv422, uyvy, yuv422_yuy2 and yuyv are"
)]
pub struct UnknownEncoding {
    /// Its name.
    pub name: String,
}

impl FromStr for PixelEncoding {
    type Err = UnknownEncoding;

    fn from_str(name: &str) -> Result<Self, UnknownEncoding> {
        use BayerPattern::{Bggr, Gbrg, Grbg, Rggb};
        Ok(match name {
            "mono8" | "8UC1" => Self::Mono8,
            "mono16" | "16UC1" => Self::Mono16,
            "rgb8" => Self::Rgb8,
            // OpenCV's own order, which nameless channels have.
            "bgr8" | "8UC3" => Self::Bgr8,
            "rgba8" => Self::Rgba8,
            "bgra8" | "8UC4" => Self::Bgra8,
            "bayer_rggb8" => Self::Bayer8(Rggb),
            "bayer_bggr8" => Self::Bayer8(Bggr),
            "bayer_gbrg8" => Self::Bayer8(Gbrg),
            "bayer_grbg8" => Self::Bayer8(Grbg),
            "bayer_rggb16" => Self::Bayer16(Rggb),
            "bayer_bggr16" => Self::Bayer16(Bggr),
            "bayer_gbrg16" => Self::Bayer16(Gbrg),
            "bayer_grbg16" => Self::Bayer16(Grbg),
            "yuv422" | "uyvy" => Self::Uyvy,
            "yuv422_yuy2" | "yuyv" => Self::Yuyv,
            _ => return Err(UnknownEncoding { name: name.to_owned() }),
        })
    }
}

/// The layout of a row.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Samples {
    Gray { bytes: usize },
    Colour { channels: usize, red_first: bool },
    Bayer { pattern: BayerPattern, bytes: usize },
    Pair { brightness_at: usize },
}

impl Samples {
    pub(super) fn come_in_pairs(self) -> bool {
        matches!(self, Self::Pair { .. })
    }
}

impl PixelEncoding {
    /// How many bytes a pixel takes.
    #[must_use]
    pub fn pixel_bytes(self) -> usize {
        match self.samples() {
            Samples::Gray { bytes } | Samples::Bayer { bytes, .. } => bytes,
            Samples::Colour { channels, .. } => channels,
            Samples::Pair { .. } => 2,
        }
    }

    pub(super) fn samples(self) -> Samples {
        match self {
            Self::Mono8 => Samples::Gray { bytes: 1 },
            Self::Mono16 => Samples::Gray { bytes: 2 },
            Self::Rgb8 => Samples::Colour { channels: 3, red_first: true },
            Self::Bgr8 => Samples::Colour { channels: 3, red_first: false },
            Self::Rgba8 => Samples::Colour { channels: 4, red_first: true },
            Self::Bgra8 => Samples::Colour { channels: 4, red_first: false },
            Self::Bayer8(pattern) => Samples::Bayer { pattern, bytes: 1 },
            Self::Bayer16(pattern) => Samples::Bayer { pattern, bytes: 2 },
            Self::Uyvy => Samples::Pair { brightness_at: 1 },
            Self::Yuyv => Samples::Pair { brightness_at: 0 },
        }
    }
}
