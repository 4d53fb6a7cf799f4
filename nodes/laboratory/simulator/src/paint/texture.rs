//! The colour of a point of a surface.

use super::lattice::{bits, floor, octaves, share, unit};
use super::poster::{picture, vivid};
use super::{GRAIN_SIZE_M, Paint, Texture};

/// A point on a surface, in the surface's own coordinates.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SurfacePoint {
    /// Along the surface; on upright ones the second coordinate is the height.
    pub(crate) uv_m: [f32; 2],
    /// The hash of the surface, the seed of its pattern.
    pub(crate) seed: u32,
    /// The distance between the points of neighbouring pixels: finer noise is left out.
    pub(crate) footprint_m: f32,
}

/// The colour of joints, as a share of their boards'.
const JOINT_SHADE: f32 = 0.25;
/// The ratio of length to width of the grain of wood.
const WOOD_STRETCH: f32 = 12.0;
/// The shift of each row of boards, as a share of a board.
const STAGGER: f32 = 0.382;
/// Distinguishes the noise of the grain from that of the pattern.
const GRAIN_SEED: u32 = 0x6a1;

impl Paint {
    /// The albedo of a point for red, green and blue without the smooth part: only the edges of the pattern.
    pub(crate) fn ground(&self, point: &SurfacePoint) -> [f32; 3] {
        let ground = single(self.colour);
        let [u_m, v_m] = point.uv_m;
        match self.texture {
            Texture::Plain | Texture::Noise { .. } => ground,
            Texture::Checker { size_m, other } => {
                let [column, row] = [u_m, v_m].map(|m| floor(m / size_m as f32));
                if (column ^ row) & 1 == 0 { ground } else { single(other) }
            }
            Texture::Boards { size_m, joint_m, contrast, staggered } => {
                let board = Board::at(point.uv_m, size_m, staggered);
                let shade = if board.into_m.iter().any(|&m| m < joint_m as f32) {
                    JOINT_SHADE
                } else {
                    1.0 + contrast as f32 * (2.0 * share(board.bits(self.pattern(point))) - 1.0)
                };
                ground.map(|channel| channel * shade)
            }
            Texture::Posters { spacing_m, share } => {
                let [s, t] = [u_m, v_m].map(|m| m / spacing_m as f32);
                let square = [floor(s), floor(t)];
                let at = [s - square[0] as f32, t - square[1] as f32];
                picture(square, at, share as f32, self.pattern(point)).unwrap_or(ground)
            }
            Texture::Spines { width_m } => spine(u_m / width_m as f32, v_m, self.pattern(point)),
        }
    }

    /// Whether the base colour is the same everywhere.
    pub(crate) fn is_even(&self) -> bool {
        matches!(self.texture, Texture::Plain | Texture::Noise { .. })
    }

    /// The smooth part: the ratio of a point's brightness to the base colour's.
    pub(crate) fn shade(&self, point: &SurfacePoint) -> f32 {
        let [u_m, v_m] = point.uv_m;
        let seed = self.pattern(point);
        let finest_m = point.footprint_m;
        let pattern = match self.texture {
            Texture::Noise { size_m, contrast } => {
                1.0 + contrast as f32 * octaves(u_m, v_m, size_m as f32, finest_m, seed)
            }
            Texture::Boards { size_m, contrast, staggered, .. } => {
                let board = Board::at(point.uv_m, size_m, staggered).bits(seed);
                let (along_m, width_m) = (u_m / WOOD_STRETCH, size_m[1] as f32);
                1.0 + 0.5 * contrast as f32 * octaves(along_m, v_m, width_m, finest_m, board)
            }
            _ => 1.0,
        };
        if self.grain > 0.0 {
            let grain = octaves(u_m, v_m, GRAIN_SIZE_M as f32, finest_m, seed ^ GRAIN_SEED);
            pattern * (1.0 + self.grain as f32 * grain)
        } else {
            pattern
        }
    }

    fn pattern(&self, point: &SurfacePoint) -> u32 {
        point.seed ^ self.seed.wrapping_mul(0x27d4_eb2f)
    }
}

/// The board at a position.
struct Board {
    column: i32,
    row: i32,
    /// The distance of the position from its first edges.
    into_m: [f32; 2],
}

impl Board {
    fn at([u_m, v_m]: [f32; 2], size_m: [f64; 2], staggered: bool) -> Self {
        let size_m = size_m.map(|m| m as f32);
        let row = floor(v_m / size_m[1]);
        let shift = if staggered { row as f32 * STAGGER } else { 0.0 };
        let along = u_m / size_m[0] + shift;
        let column = floor(along);
        let into_m = [(along - column as f32) * size_m[0], v_m - row as f32 * size_m[1]];
        Self { column, row, into_m }
    }

    fn bits(&self, seed: u32) -> u32 {
        bits(self.column, self.row, seed)
    }
}

/// The back of a book: stripes whose edges lie anywhere near whole numbers.
fn spine(across: f32, v_m: f32, seed: u32) -> [f32; 3] {
    let edge = |index: f32| index + 0.7 * (unit(index as i32, 1, seed) - 0.5);
    let near = across.round();
    let index = if across < edge(near) { near - 1.0 } else { near };
    let (left, right) = (edge(index), edge(index + 1.0));
    let key = bits(index as i32, 2, seed);
    let label_m = 0.08 * (share(key) - 0.5);
    let inside = (across - left).min(right - across) > 0.18 * (right - left);
    if inside && (v_m - label_m).abs() < 0.02 {
        return [0.75, 0.72, 0.62];
    }
    if across - left < 0.06 { [0.02; 3] } else { vivid(key) }
}

fn single(colour: [f64; 3]) -> [f32; 3] {
    colour.map(|channel| channel as f32)
}
