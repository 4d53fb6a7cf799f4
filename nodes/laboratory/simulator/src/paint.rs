//! What a surface looks like in visible light.

mod lattice;
mod poster;
mod texture;

use serde::{Deserialize, Serialize};

pub(crate) use texture::SurfacePoint;

/// The colour of a surface and the pattern on it.
///
/// Patterns are anchored to the surface, so that a point of it has the same colour from everywhere, and the
/// same whatever the seed of the scenario. Colours are shares of the light that is scattered, red, green
/// and blue, in `[0, 1]`; linear, not as a display wants them.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Paint {
    /// The colour of the ground.
    pub colour: [f64; 3],
    /// What is on it.
    pub texture: Texture,
    /// How much fine grain varies the brightness, as a share of it, in `[0, 1]`: noise of several octaves from
    /// `GRAIN_SIZE_M` down. 0 for a surface without any.
    pub grain: f64,
    /// Another number is another pattern of the same kind.
    pub seed: u32,
}

/// The largest spots of a grain: a hand's width.
pub(crate) const GRAIN_SIZE_M: f64 = 0.16;

/// A pattern. Lengths are those on the surface, in metres.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Texture {
    /// None.
    #[default]
    Plain,
    /// Spots of all sizes up to `size_m`: value noise of several octaves.
    Noise {
        /// The largest spots.
        size_m: f64,
        /// How much they vary the brightness, as a share of it.
        contrast: f64,
    },
    /// Squares of two colours.
    Checker {
        /// The edge of a square.
        size_m: f64,
        /// The colour of every other square.
        other: [f64; 3],
    },
    /// Boards, tiles or bricks, each of its own shade, with dark joints between them and grain along the first edge.
    Boards {
        /// The edges of a board.
        size_m: [f64; 2],
        /// The width of the joints.
        joint_m: f64,
        /// How much the shades of boards differ, as a share of the brightness.
        contrast: f64,
        /// Whether each row is shifted beside the one before it.
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
    /// Light gray without any pattern.
    fn default() -> Self {
        Self::plain([0.6; 3])
    }
}

impl Paint {
    /// One colour, without any pattern or grain.
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
