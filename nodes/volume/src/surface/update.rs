//! How a block's nodes change with an image.
//!
//! - A node is compared with the pixel that it projects to, in the coarsest image whose pixels are no larger than a voxel. Its
//!   signed distance is the depth there less its own: before the surface positive. (Along the optical axis; it is 0 where the
//!   distance to the surface is, from however low an angle the surface is seen.) The depth is that of the plane through the
//!   pixel at the node's place within it: a camera that stands would have steps of a pixel in the map for ever.
//! - Within the truncation it joins the weighted mean (Curless and Levoy, eq. 3 and 4). The weight falls with the variance of
//!   the depth, to which an error of the pose adds, and at a low angle what the depth changes within a pixel.
//! - Nearer than the truncation, it joins as the full truncation: what is before a surface is free, and what was there goes in
//!   time: nodes that are before it by more than it may be wrong by, and a voxel, forget what they were ([`MOST_BEFORE_FREE`]).
//!   Farther behind than the depth may be wrong by, and a voxel, it counts less and less ([`Behind`]); from there on nothing
//!   is known, and nothing changes.
//! - What moves and what is out of range is no surface: only that it is free before it counts, from the truncation on. The
//!   nodes near it keep what they are.
//! - Where nothing came back no node changes; see [`super::no_return`].
//!
//! A block that is free as a whole is not compared: the evidence for it falls ([`crate::evidence`]), and when there is none
//! left the block goes. It is free as a whole where all pixels that it may cover show that it is. Rays that graze a surface
//! end on it, and then some of these pixels do not: so a low angle clears nothing.

use geometry::NO_COLOUR;
use multiversion::multiversion;
use nalgebra::Point3;

use super::block::{FULL, SurfaceBlock};
use crate::block::{BLOCK_EDGE, BLOCK_VOXELS, BlockKey};
use crate::depth_view::DepthView;
use crate::descent::{Behind, Judge, Margins, block_edge_m};
use crate::levels::{LEVELS, LevelPixel, Levels, WEIGHT_BITS, level_of};
use crate::noise::{DepthNoise, FULL_WEIGHT};
use crate::projection::{LANES, Pinhole, Project, Row, Spherical, nearest};

/// Weights end here, at 32 of the best depths.
const MOST_WEIGHT: f32 = 32.0 * FULL_WEIGHT;
/// Where a depth shows a node to be free for sure, what is known of the node counts as no more than so many such depths: what
/// was there for however long is gone after nine, as a block is that is free as a whole ([`crate::evidence`]).
const MOST_BEFORE_FREE: f32 = 8.0;
/// Colours follow with at least this share of what is new.
const LEAST_COLOUR_SHARE: f32 = 1.0 / 16.0;
/// Shares of colours are whole numbers of this part.
const SHARES: f32 = 256.0;
const SHARE_BITS: u32 = 8;
/// Nodes no farther before and behind the depth than this have its colour. A point lies between nodes that are less than two
/// edges from the surface.
const COLOUR_REACH_IN_EDGES: f64 = 2.0;

/// A block that is compared with an image, node by node.
#[derive(Clone, Debug)]
pub(super) struct Work {
    pub(super) key: BlockKey,
    pub(super) block: Option<Box<SurfaceBlock>>,
    pub(super) is_new: bool,
    /// Whether a node changed.
    pub(super) is_changed: bool,
    /// Whether the image shows a surface in it.
    pub(super) is_hit: bool,
}

impl Work {
    /// To be compared.
    pub(super) fn new(key: BlockKey) -> Self {
        Self { key, block: None, is_new: false, is_changed: false, is_hit: false }
    }
}

/// What all blocks of an image share.
pub(super) struct Job<'a, P> {
    view: &'a DepthView,
    levels: &'a Levels,
    judge: &'a Judge<'a, P>,
    projections: [P; LEVELS],
    edge_m: f64,
    steps_m: [[f32; 3]; 3],
    truncation_m: f32,
    behind: Behind,
    noise: DepthNoise,
    reach_m: f32,
    pixel_slope: f32,
    has_colour: bool,
    colour_reach_m: f32,
}

impl<'a, P: Project> Job<'a, P> {
    pub(super) fn new(
        (view, levels): (&'a DepthView, &'a Levels),
        judge: &'a Judge<'a, P>,
        projection: P,
        edge_m: f64,
        margins: Margins,
        has_colour: bool,
    ) -> Self {
        Self {
            view,
            levels,
            judge,
            projections: [0, 1, 2, 3].map(|level| projection.coarser(level)),
            edge_m,
            steps_m: judge.frame.steps_m(edge_m),
            truncation_m: margins.before_m,
            behind: margins.behind,
            noise: view.noise,
            reach_m: margins.reach_m,
            pixel_slope: projection.pixel_slope(),
            has_colour,
            colour_reach_m: (COLOUR_REACH_IN_EDGES * edge_m) as f32,
        }
    }
}

/// The loop over blocks, compiled for each kind of image and each set of instructions.
pub(super) trait Kernel: Project {
    fn run(job: &Job<'_, Self>, work: &mut [Work]);
}

impl Kernel for Pinhole {
    fn run(job: &Job<'_, Self>, work: &mut [Work]) {
        run_pinhole(job, work);
    }
}

impl Kernel for Spherical {
    fn run(job: &Job<'_, Self>, work: &mut [Work]) {
        run_blocks(job, work);
    }
}

#[multiversion(targets("x86_64+avx2"))]
fn run_pinhole(job: &Job<'_, Pinhole>, work: &mut [Work]) {
    run_blocks(job, work);
}

#[inline(always)]
fn run_blocks<P: Project>(job: &Job<'_, P>, work: &mut [Work]) {
    for item in work {
        let Some(block) = &mut item.block else { continue };
        (item.is_changed, item.is_hit) = compare(job, item.key, block);
    }
}

/// The level that a block is compared with.
#[inline(always)]
pub(super) fn level_of_block<P: Project>(
    key: BlockKey,
    judge: &Judge<'_, P>,
    (edge_m, pixel_slope): (f64, f32),
) -> u32 {
    let middle_m = super::middle_m(key, block_edge_m(edge_m));
    let [x, y, z] = judge.frame.in_camera_m(&middle_m);
    level_of(edge_m as f32, pixel_slope, (x * x + y * y + z * z).sqrt())
}

/// The weight that stands in the lowest bits of a depth.
#[inline(always)]
pub(super) fn weight_in(depth_m: f32) -> f32 {
    (depth_m.to_bits() & WEIGHT_BITS) as i32 as f32
}

/// The nearest integer, of a magnitude below 4 million: the cast of a float saturates, and costs more than the rest.
#[inline(always)]
fn integer(value: f32) -> i32 {
    nearest(value) as i32
}

#[inline(always)]
fn compare<P: Project>(job: &Job<'_, P>, key: BlockKey, block: &mut SurfaceBlock) -> (bool, bool) {
    let block_edge_m = block_edge_m(job.edge_m);
    let origin_in_map = key.coordinates().map(|along| f64::from(along) * block_edge_m);
    let origin_m = job.judge.frame.in_camera_m(&Point3::from(origin_in_map));
    let level = level_of_block(key, job.judge, (job.edge_m, job.pixel_slope));
    let (projection, pixels) = (&job.projections[level as usize], job.levels.pixels(level));
    let [step_x, step_y, step_z] = job.steps_m;
    let rows = block.distance.as_chunks_mut::<LANES>().0.iter_mut();
    let rows = rows.zip(block.weight.as_chunks_mut::<LANES>().0);
    let (mut is_changed, mut is_hit) = (false, false);
    for (index, (distance, weight)) in rows.enumerate() {
        let along_y = (index % BLOCK_EDGE) as f32;
        let along_z = (index / BLOCK_EDGE) as f32;
        let start_m = [0, 1, 2]
            .map(|axis: usize| origin_m[axis] + along_y * step_y[axis] + along_z * step_z[axis]);
        let row = projection.row(start_m, step_x);
        let seen = row.pixel.map(|pixel| pixels.get(pixel as usize).copied().unwrap_or_default());
        let joined = join(job, &row, &seen, distance, weight);
        is_changed |= joined.is_any;
        is_hit |= joined.is_near;
        if job.has_colour && joined.is_close {
            let colour = block.colour.get_or_insert_with(|| Box::new([[0; 3]; BLOCK_VOXELS]));
            if let Some(colour) = colour.as_chunks_mut::<LANES>().0.get_mut(index) {
                join_colour(job, start_m, &row, weight, colour);
            }
        }
    }
    (is_changed, is_hit)
}

struct Joined {
    is_any: bool,
    /// Whether a node is near the surface.
    is_near: bool,
    /// Whether a node is so close to it that it may have its colour.
    is_close: bool,
}

/// Joins a row of nodes with the depths that they project to.
#[inline(always)]
fn join<P>(
    job: &Job<'_, P>,
    row: &Row,
    seen: &[LevelPixel; LANES],
    distance: &mut [i16; LANES],
    weight: &mut [u16; LANES],
) -> Joined {
    let truncation_m = job.truncation_m;
    let by_truncation = 1.0 / truncation_m;
    let by_fall = 1.0 / job.behind.falls_in_m;
    let mut joins = [false; LANES];
    let mut shares = [0.0_f32; LANES];
    let mut weights = [0.0_f32; LANES];
    let mut most_known = [0.0_f32; LANES];
    let (mut is_any, mut is_near, mut is_close) = (false, false, false);
    for lane in 0..LANES {
        let depth_m = seen[lane].depth_m;
        // Which nodes a pixel joins is said by its own depth, as it is of whole blocks.
        let before_m = depth_m.abs() - row.depth_m[lane];
        let ends_m = job.behind.ends_m(depth_m, &job.noise);
        let is_near_here = (depth_m > 0.0) & (before_m > -ends_m) & (before_m < truncation_m);
        let is_free = (depth_m != 0.0) & (before_m >= truncation_m);
        joins[lane] = (is_near_here | is_free) & (row.depth_m[lane] <= job.reach_m);
        is_any |= joins[lane];
        is_near |= is_near_here & joins[lane];
        is_close |= is_near_here & joins[lane] & (before_m.abs() < job.colour_reach_m);
        let [by_column_m, by_row_m] = seen[lane].slopes_m();
        let before_m = before_m
            + (by_column_m * row.in_pixel_px[0][lane] + by_row_m * row.in_pixel_px[1][lane]);
        shares[lane] = (before_m * by_truncation).clamp(-1.0, 1.0);
        let counts = ((before_m + ends_m) * by_fall).clamp(0.0, 1.0);
        weights[lane] = (counts * weight_in(depth_m)).max(1.0);
        let is_free_for_sure = before_m >= job.behind.full_to_m(depth_m, &job.noise);
        most_known[lane] =
            if is_free_for_sure { MOST_BEFORE_FREE * weights[lane] } else { MOST_WEIGHT };
    }
    if !is_any {
        return Joined { is_any, is_near, is_close };
    }
    for lane in 0..LANES {
        let weight_here = weights[lane];
        let known = f32::from(weight[lane]).min(most_known[lane]);
        // Where nothing joins there may be no weight at all, and the mean is not used.
        let sum = known + weight_here;
        let mean = (f32::from(distance[lane]) * known + FULL * shares[lane] * weight_here) / sum;
        let mean = integer(mean) as i16;
        let sum = integer(sum.min(MOST_WEIGHT)) as u16;
        distance[lane] = if joins[lane] { mean } else { distance[lane] };
        weight[lane] = if joins[lane] { sum } else { weight[lane] };
    }
    Joined { is_any, is_near, is_close }
}

/// Joins the colours of the nodes close to the surface, each of the one pixel that it projects to: a mean over pixels would be a
/// colour of nothing, and may be of what moves. The weights are those after the distances were joined.
#[inline(always)]
fn join_colour<P: Project>(
    job: &Job<'_, P>,
    start_m: [f32; 3],
    row: &Row,
    weight: &[u16; LANES],
    colour: &mut [[u8; 3]; LANES],
) {
    let [finest, ..] = &job.projections;
    let pixels = finest.row(start_m, job.steps_m[0]).pixel;
    let finest = job.levels.pixels(0);
    let seen_m = pixels.map(|pixel| finest.get(pixel as usize).map_or(0.0, |seen| seen.depth_m));
    let mut joins = [false; LANES];
    let mut shares = [0_i32; LANES];
    for lane in 0..LANES {
        let before_m = seen_m[lane] - row.depth_m[lane];
        let is_close = (seen_m[lane] > 0.0) & (before_m.abs() < job.colour_reach_m);
        // A node of which nothing is known has no colour: its bytes have none.
        joins[lane] = is_close & (weight[lane] > 0);
        let share = weight_in(seen_m[lane]) / f32::from(weight[lane]).max(1.0);
        shares[lane] = integer(SHARES * share.clamp(LEAST_COLOUR_SHARE, 1.0));
    }
    for lane in 0..LANES {
        let Some(&seen) = job.view.colour.get(pixels[lane] as usize).filter(|_| joins[lane]) else {
            continue;
        };
        if seen == NO_COLOUR {
            continue;
        }
        let kept = &mut colour[lane];
        if *kept == NO_COLOUR {
            *kept = seen;
            continue;
        }
        for (kept, seen) in kept.iter_mut().zip(seen) {
            // Rounded; between the two.
            let change = (i32::from(seen) - i32::from(*kept)) * shares[lane];
            *kept = (i32::from(*kept) + ((change + SHARES as i32 / 2) >> SHARE_BITS)) as u8;
        }
    }
}
