//! A set of points as the page carries it: coordinates of 16 bits in blocks of 65 m, in the order of a curve that keeps neighbours
//! together.

use std::collections::BTreeMap;

use nalgebra::Point3;
use serde_json::{Value, json};

use crate::payload::{push_differences_8, push_differences_16};

/// A step of the coordinates: a tenth of the noise of a depth camera.
const STEP_M: f64 = 0.001;
/// Steps along an edge of a block.
const STEPS: f64 = 65_536.0;

/// A set of points.
pub(super) struct PointSet {
    /// Its blocks, one after the other, before compression.
    pub(super) bytes: Vec<u8>,
    /// The points of the run, of which the set may have fewer.
    pub(super) total: usize,
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
        total: usize,
        most: usize,
        point: impl Fn(usize) -> (Point3<f32>, u16),
    ) -> Self {
        let every = total.div_ceil(most.max(1)).max(1);
        let points = (0..total).step_by(every).map(point);
        Self::of(total, &["moment"], points.map(|(point_m, moment)| (point_m, moment, [0; 3])))
    }

    /// The same with a colour each: red, green, blue.
    pub(super) fn thinned_with_colours(
        total: usize,
        most: usize,
        point: impl Fn(usize) -> (Point3<f32>, u16, [u8; 3]),
    ) -> Self {
        let every = total.div_ceil(most.max(1)).max(1);
        Self::of(total, &["moment", "colour"], (0..total).step_by(every).map(point))
    }

    /// Points with a class each.
    pub(super) fn of_classes(points: impl ExactSizeIterator<Item = (Point3<f32>, u8)>) -> Self {
        let total = points.len();
        let points = points.map(|(point_m, class)| (point_m, u16::from(class), [0; 3]));
        Self::of(total, &["class"], points)
    }

    fn of(
        total: usize,
        has: &[&'static str],
        points: impl Iterator<Item = (Point3<f32>, u16, [u8; 3])>,
    ) -> Self {
        let mut by_block: BTreeMap<[i32; 3], Vec<Placed>> = BTreeMap::new();
        for (point_m, extra, colour) in points.filter(|(point_m, ..)| geometry::is_finite(point_m))
        {
            let all_steps: [f64; 3] =
                point_m.coords.map(|value_m| f64::from(value_m) / STEP_M).into();
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
                for part in 0..3 {
                    push_differences_8(&mut bytes, placed.iter().map(|point| point.colour[part]));
                }
            }
            let origin_m = block.map(|block| f64::from(block) * STEPS * STEP_M);
            blocks.push(Block { origin_m, count: placed.len() });
        }
        Self { bytes, total, blocks, has: has.to_vec() }
    }

    pub(super) fn header(&self, spacing_m: f64) -> Value {
        let blocks: Vec<Value> = self
            .blocks
            .iter()
            .map(|block| json!({ "origin_m": block.origin_m, "count": block.count }))
            .collect();
        json!({ "total": self.total, "step_m": STEP_M, "spacing_m": spacing_m, "has": self.has, "blocks": blocks })
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
