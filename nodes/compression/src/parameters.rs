//! What the node can be told.

use msgs::convert::{
    CompressedImageError, DepthCodec, ImageCodec, InverseDepth, JpegQuality, JpegQualityError,
    MetresAs,
};
use node_shell::NodeFailure;
use node_shell::parameters::{NodeParameters, Range};
use serde::{Deserialize, Serialize};

/// Which images are compressed.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Images {
    /// Those of depth.
    #[default]
    Depth,
    /// Those of colours or greys.
    Color,
    /// All.
    Both,
}

impl Images {
    pub(crate) fn has_depth(self) -> bool {
        self != Self::Color
    }

    pub(crate) fn has_color(self) -> bool {
        self != Self::Depth
    }
}

/// How depth images are coded.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DepthFormat {
    /// The smaller one for structured light, and read by every version of ROS.
    #[default]
    Png,
    /// Four times as fast; ROS 2 reads it since Jazzy.
    Rvl,
}

/// What becomes of depths in metres.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DepthMetres {
    /// They are rounded, and `16UC1`.
    #[default]
    Millimetres,
    /// They stay `32FC1`, as quantised inverse depth.
    InverseDepth,
}

/// How colour images are coded.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ColorFormat {
    /// A twentieth of the bytes, and not quite the same.
    #[default]
    Jpeg,
    /// Half of the bytes, and the same to the last bit.
    Png,
}

/// The parameters of the node; the names of `image_transport` behind those of the suite's own.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default)]
pub struct CompressionParameters {
    /// Which images are compressed.
    pub images: Images,
    /// How depth images are.
    pub depth_format: DepthFormat,
    /// What becomes of depths in metres.
    pub depth_metres: DepthMetres,
    /// With `inverse_depth`: depths of this many metres and beyond are lost.
    pub depth_max_m: f32,
    /// With `inverse_depth`: how finely near depths are kept.
    pub depth_quantization: f32,
    /// How colour images are compressed.
    pub color_format: ColorFormat,
    /// How well JPEG keeps them, 1 .. 100.
    pub jpeg_quality: u8,
    /// Whether compressed images are sent again where they are lost. Subscribers that insist on that,
    /// as those of `image_transport` do where nobody tells them otherwise, get nothing without it.
    pub reliable: bool,
}

impl Default for CompressionParameters {
    fn default() -> Self {
        Self {
            images: Images::default(),
            depth_format: DepthFormat::default(),
            depth_metres: DepthMetres::default(),
            // Those of compressed_depth_image_transport.
            depth_max_m: 10.0,
            depth_quantization: 100.0,
            color_format: ColorFormat::default(),
            jpeg_quality: JpegQuality::default().get(),
            reliable: false,
        }
    }
}

impl NodeParameters for CompressionParameters {
    const FILE: &'static str = include_str!("../../../config/compression.yaml");
    const RANGES: &'static [(&'static str, Range)] = &[("jpeg_quality", Range::whole(1, 100))];
    /// All but what its topics are made by.
    const CHANGEABLE: &'static [&'static str] = &[
        "depth_format",
        "depth_metres",
        "depth_max_m",
        "depth_quantization",
        "color_format",
        "jpeg_quality",
    ];

    fn validate(&self) -> Result<(), NodeFailure> {
        self.depth_codec()?;
        self.color_codec()?;
        Ok(())
    }
}

impl CompressionParameters {
    pub(crate) fn depth_codec(&self) -> Result<(DepthCodec, MetresAs), CompressedImageError> {
        let codec = match self.depth_format {
            DepthFormat::Png => DepthCodec::Png,
            DepthFormat::Rvl => DepthCodec::Rvl,
        };
        let metres = match self.depth_metres {
            DepthMetres::Millimetres => MetresAs::Millimetres,
            DepthMetres::InverseDepth => MetresAs::InverseDepth(InverseDepth::new(
                self.depth_max_m,
                self.depth_quantization,
            )?),
        };
        Ok((codec, metres))
    }

    pub(crate) fn color_codec(&self) -> Result<ImageCodec, JpegQualityError> {
        Ok(match self.color_format {
            ColorFormat::Jpeg => ImageCodec::Jpeg(JpegQuality::new(self.jpeg_quality)?),
            ColorFormat::Png => ImageCodec::Png,
        })
    }
}
