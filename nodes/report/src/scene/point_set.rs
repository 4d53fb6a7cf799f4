//! A set of points as the page carries it: coordinates of 16 bits in blocks of 65,536 steps, in the order of a curve that keeps neighbours
//! together.

use std::collections::BTreeMap;

use nalgebra::Point3;
use serde_json::{Value, json};

use crate::payload::{push_colours, push_differences_16};

/// Steps of the coordinates within the spacing of the points: a point is drawn 15 to 45 steps large.
const STEPS_IN_SPACING: f64 = 10.0;
/// The finest step.
const LEAST_STEP_M: f64 = 0.000_1;
/// Steps along an edge of a block.
const STEPS: f64 = 65_536.0;

/// A set of points.
pub(super) struct PointSet {
    /// Its blocks, one after the other, before compression.
    pub(super) bytes: Vec<u8>,
    /// The points of the run, of which the set may have fewer.
    pub(super) total: usize,
    /// How far apart neighbours are.
    spacing_m: f64,
    step_m: f64,
    blocks: Vec<Block>,
    has: Vec<&'static str>,
}

struct Block {
    origin_m: [f64; 3],
    count: usize,
}

/// A point within its block.
struct Placed {
    /// The bits of the three coordinates, interleaved (Morton 1966): neighbours in space are neighbours by this.
    curve: u64,
    steps: [u16; 3],
    extra: u16,
    colour: [u8; 3],
}

impl PointSet {
    /// At most about `most` of `total` points, evenly chosen, with the moments from which on they are shown.
    pub(super) fn thinned(
        spacing_m: f64,
        (total, most): (usize, usize),
        point: impl Fn(usize) -> (Point3<f32>, u16),
    ) -> Self {
        let every = total.div_ceil(most.max(1)).max(1);
        let points = (0..total).step_by(every).map(point);
        let points = points.map(|(point_m, moment)| (point_m, moment, [0; 3]));
        Self::of(spacing_m, total, &["moment"], points)
    }

    /// The same with a colour each: red, green, blue.
    pub(super) fn thinned_with_colours(
        spacing_m: f64,
        (total, most): (usize, usize),
        point: impl Fn(usize) -> (Point3<f32>, u16, [u8; 3]),
    ) -> Self {
        let every = total.div_ceil(most.max(1)).max(1);
        let points = (0..total).step_by(every).map(point);
        Self::of(spacing_m, total, &["moment", "colour"], points)
    }

    /// Points with a class each.
    pub(super) fn of_classes(
        spacing_m: f64,
        points: impl ExactSizeIterator<Item = (Point3<f32>, u8)>,
    ) -> Self {
        let total = points.len();
        let points = points.map(|(point_m, class)| (point_m, u16::from(class), [0; 3]));
        Self::of(spacing_m, total, &["class"], points)
    }

    fn of(
        spacing_m: f64,
        total: usize,
        has: &[&'static str],
        points: impl Iterator<Item = (Point3<f32>, u16, [u8; 3])>,
    ) -> Self {
        let step_m = (spacing_m / STEPS_IN_SPACING).max(LEAST_STEP_M);
        let mut by_block: BTreeMap<[i32; 3], Vec<Placed>> = BTreeMap::new();
        for (point_m, extra, colour) in points.filter(|(point_m, ..)| geometry::is_finite(point_m))
        {
            let all_steps: [f64; 3] =
                point_m.coords.map(|value_m| f64::from(value_m) / step_m).into();
            // The casts saturate: points that far away share the outermost block.
            let block = all_steps.map(|steps| (steps / STEPS).floor() as i32);
            let steps =
                [0, 1, 2].map(|axis| (all_steps[axis] - f64::from(block[axis]) * STEPS) as u16);
            by_block.entry(block).or_default().push(Placed {
                curve: curve(steps),
                steps,
                extra,
                colour,
            });
        }
        let mut bytes = Vec::new();
        let mut blocks = Vec::new();
        for (block, mut placed) in by_block {
            placed.sort_unstable_by_key(|point| (point.curve, point.extra, point.colour));
            for axis in 0..3 {
                push_differences_16(&mut bytes, placed.iter().map(|point| point.steps[axis]));
            }
            if has.contains(&"class") {
                bytes.extend(placed.iter().map(|point| point.extra as u8));
            } else {
                push_differences_16(&mut bytes, placed.iter().map(|point| point.extra));
            }
            if has.contains(&"colour") {
                push_colours(&mut bytes, placed.iter().map(|point| point.colour));
            }
            let origin_m = block.map(|block| f64::from(block) * STEPS * step_m);
            blocks.push(Block { origin_m, count: placed.len() });
        }
        Self { bytes, total, spacing_m, step_m, blocks, has: has.to_vec() }
    }

    pub(super) fn header(&self) -> Value {
        let blocks: Vec<Value> = self
            .blocks
            .iter()
            .map(|block| json!({ "origin_m": block.origin_m, "count": block.count }))
            .collect();
        json!({
            "total": self.total, "step_m": self.step_m, "spacing_m": self.spacing_m, "has": self.has, "blocks": blocks,
        })
    }
}

/// The bits of three coordinates, interleaved: neighbours in space are neighbours by this.
pub(super) fn curve([x, y, z]: [u16; 3]) -> u64 {
    spread(x) | spread(y) << 1 | spread(z) << 2
}

/// The bits of a number with two empty ones after each.
fn spread(number: u16) -> u64 {
    const STEPS: [(u32, u64); 4] = [
        (16, 0x001f_0000_ff00_00ff),
        (8, 0x100f_00f0_0f00_f00f),
        (4, 0x10c3_0c30_c30c_30c3),
        (2, 0x1249_2492_4924_9249),
    ];
    STEPS.iter().fold(u64::from(number), |bits, (shift, mask)| (bits | bits << shift) & mask)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_of_the_three_axes_alternate() {
        assert_eq!(curve([1, 0, 0]), 0b001);
        assert_eq!(curve([0, 1, 2]), 0b100_010);
        assert_eq!(curve([u16::MAX; 3]), (1 << 48) - 1);
    }
}
