//! What the node can be told.

use msgs::convert::{
    CompressedImageError, DepthCodec, ImageCodec, InverseDepth, JpegQuality, JpegQualityError,
    MetresAs,
};
use node_shell::parameters::NodeParameters;

geometry::choices! {
    /// Which images are compressed.
    pub enum Images {
        /// Depth images.
        Depth = "depth",
        /// Colour or gray images.
        Color = "color",
        /// All.
        Both = "both",
    }
}

impl Images {
    pub(crate) fn has_depth(self) -> bool {
        self != Self::Color
    }

    pub(crate) fn has_color(self) -> bool {
        self != Self::Depth
    }
}

geometry::choices! {
    /// How depth images are coded.
    pub enum DepthFormat {
        /// The smaller one for structured light, and read by every version of ROS 2.
        Png = "png",
        /// Takes a fifth of the time; ROS 2 reads it since Jazzy.
        Rvl = "rvl",
    }
}

geometry::choices! {
    /// What depths in metres are stored as.
    pub enum DepthMetres {
        /// 16UC1: rounded to millimetres.
        Millimetres = "millimetres",
        /// 32FC1: quantised inverse depth.
        InverseDepth = "inverse_depth",
    }
}

geometry::choices! {
    /// How colour images are coded.
    pub enum ColorFormat {
        /// A twentieth of the bytes, with loss.
        Jpeg = "jpeg",
        /// Half of the bytes, without loss.
        Png = "png",
    }
}

/// With these bounds all numbers of a message are finite.
const LITTLE: f64 = 1e-3;
const MUCH: f64 = 1e6;

geometry::parameters! {
    /// The parameters of the node; the names of `image_transport` behind those of the suite's own. All but what its topics are
    /// made by may change while it runs.
    #[derive(Clone, PartialEq, Debug)]
    pub struct CompressionParameters {
        /// Which images are compressed.
        images: Images = Images::Depth;
        /// How depth images are compressed.
        depth_format: DepthFormat = DepthFormat::Png, changeable;
        /// What depths in metres (32FC1) are stored as.
        depth_metres: DepthMetres = DepthMetres::Millimetres, changeable;
        /// Depths of this many metres and beyond are lost.
        // That of compressed_depth_image_transport.
        depth_max_m: f64 = 10.0, between(LITTLE, MUCH), changeable, read_with("depth_metres", "inverse_depth");
        /// How finely near depths are kept: more is finer.
        // That of compressed_depth_image_transport.
        depth_quantization: f64 = 100.0, between(LITTLE, MUCH), changeable, read_with("depth_metres", "inverse_depth");
        /// How colour images are compressed.
        color_format: ColorFormat = ColorFormat::Jpeg, changeable;
        /// The quality of JPEG images: more is better, and larger.
        jpeg_quality: u8 = JpegQuality::default().get(), whole(1, 100), changeable, read_with("color_format", "jpeg");
        /// Whether lost images are sent again. Subscribers that ask for reliable delivery, as those of image_transport do by
        /// default, get nothing from a best effort publisher.
        reliable: bool = false;
    }
}

impl NodeParameters for CompressionParameters {}

impl CompressionParameters {
    pub(crate) fn depth_codec(&self) -> Result<(DepthCodec, MetresAs), CompressedImageError> {
        let codec = match self.depth_format {
            DepthFormat::Png => DepthCodec::Png,
            DepthFormat::Rvl => DepthCodec::Rvl,
        };
        let metres = match self.depth_metres {
            DepthMetres::Millimetres => MetresAs::Millimetres,
            DepthMetres::InverseDepth => MetresAs::InverseDepth(InverseDepth::new(
                self.depth_max_m as f32,
                self.depth_quantization as f32,
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
