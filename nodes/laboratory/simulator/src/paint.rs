//! The appearance of a surface in visible light.

mod lattice;
mod poster;
mod texture;

use serde::{Deserialize, Serialize};

pub(crate) use texture::SurfacePoint;

/// The colour of a surface and the pattern on it.
///
/// Patterns are anchored to the surface, so that a point of it has the same colour from every viewpoint and with every
/// seed of the scenario. Colours are albedos for red, green and blue in `[0, 1]`; linear, not sRGB.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Paint {
    /// The base colour.
    pub colour: [f64; 3],
    /// The pattern on it.
    pub texture: Texture,
    /// The contrast of the fine grain, as a share of the brightness, in `[0, 1]`: noise of several octaves from
    /// `GRAIN_SIZE_M` down. 0 for a surface without grain.
    pub grain: f64,
    /// The seed of the pattern.
    pub seed: u32,
}

/// The largest spots of a grain: a hand's width.
pub(crate) const GRAIN_SIZE_M: f64 = 0.16;

/// A pattern. Lengths are those on the surface, in metres.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Texture {
    /// No pattern.
    #[default]
    Plain,
    /// Value noise of several octaves, with spots of all sizes up to `size_m`.
    Noise {
        /// The largest spots.
        size_m: f64,
        /// Their contrast, as a share of the brightness.
        contrast: f64,
    },
    /// Squares of two colours.
    Checker {
        /// The edge of a square.
        size_m: f64,
        /// The colour of every other square.
        other: [f64; 3],
    },
    /// Boards, tiles or bricks of different brightness, with dark joints between them and grain along the first edge.
    Boards {
        /// The edges of a board.
        size_m: [f64; 2],
        /// The width of the joints.
        joint_m: f64,
        /// The contrast between boards, as a share of the brightness.
        contrast: f64,
        /// Whether each row is shifted against the one before it.
        staggered: bool,
    },
    /// Pictures on a wall, one in some of the squares of a grid: coloured blocks, pages of print, or bands.
    Posters {
        /// The edge of a square of the grid; a picture takes up most of its square.
        spacing_m: f64,
        /// The share of squares with a picture.
        share: f64,
    },
    /// Upright stripes of different widths and colours, each with a label: the backs of books.
    Spines {
        /// The mean width of a stripe.
        width_m: f64,
    },
}

impl Default for Paint {
    /// Light gray without a pattern.
    fn default() -> Self {
        Self::plain([0.6; 3])
    }
}

impl Paint {
    /// One colour, without pattern or grain.
    #[must_use]
    pub const fn plain(colour: [f64; 3]) -> Self {
        Self { colour, texture: Texture::Plain, grain: 0.0, seed: 0 }
    }

    /// One colour with grain.
    #[must_use]
    pub const fn grained(colour: [f64; 3], grain: f64) -> Self {
        Self { colour, texture: Texture::Plain, grain, seed: 0 }
    }

    /// A colour with a pattern on it, and some grain.
    #[must_use]
    pub const fn with(colour: [f64; 3], texture: Texture, grain: f64) -> Self {
        Self { colour, texture, grain, seed: 0 }
    }
}
