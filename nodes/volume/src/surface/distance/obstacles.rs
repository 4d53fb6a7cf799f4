//! The obstacles: the points of the surface, by the blocks of the map.

use super::bounds::{Bounds, square_m2};
use crate::block::{BlockBox, BlockKey};
use crate::layer::Layer;
use crate::projection::LANES;
use crate::surface::SurfacePoint;

/// As many points as are compared at a time; the last ones of a block are filled up with its last point.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Points {
    x_m: [f32; LANES],
    y_m: [f32; LANES],
    z_m: [f32; LANES],
}

/// The points of one block of the map.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct BlockPoints {
    pub(super) bounds: Bounds,
    points: Vec<Points>,
}

impl BlockPoints {
    /// `None` of no points.
    fn of(points: &[SurfacePoint]) -> Option<Self> {
        let bounds = points.iter().fold(Bounds::EMPTY, |bounds, point| {
            bounds.with(&Bounds::of_point(point.position_m.into()))
        });
        let groups = points.chunks(LANES).filter_map(|group| {
            let last = group.last()?;
            let along = |axis: usize| {
                let mut along_m = [last.position_m[axis]; LANES];
                along_m.iter_mut().zip(group).for_each(|(m, point)| *m = point.position_m[axis]);
                along_m
            };
            Some(Points { x_m: along(0), y_m: along(1), z_m: along(2) })
        });
        let points: Vec<Points> = groups.collect();
        (!points.is_empty()).then_some(Self { bounds, points })
    }

    /// The square of the distance from a place to the nearest point, if that is less than `below_m2`, and otherwise this.
    #[inline(always)]
    pub(super) fn nearest_m2(&self, place_m: [f32; 3], below_m2: f32) -> f32 {
        let mut nearest_m2 = [below_m2; LANES];
        for Points { x_m, y_m, z_m } in &self.points {
            for lane in 0..LANES {
                let away_m =
                    [x_m[lane] - place_m[0], y_m[lane] - place_m[1], z_m[lane] - place_m[2]];
                let away_m2 = square_m2(away_m);
                nearest_m2[lane] =
                    if away_m2 < nearest_m2[lane] { away_m2 } else { nearest_m2[lane] };
            }
        }
        nearest_m2.into_iter().fold(below_m2, f32::min)
    }
}

/// See the module.
#[derive(Clone, Debug, Default)]
pub(super) struct Obstacles(Layer<BlockPoints>);

impl Obstacles {
    /// Takes these points for those of a block. Returns a box around all that has come or gone.
    pub(super) fn put(&mut self, key: BlockKey, points: &[SurfacePoint]) -> Option<Bounds> {
        let now = BlockPoints::of(points);
        if now.as_ref() == self.0.get(key) {
            return None;
        }
        let now_at = now.as_ref().map(|points| points.bounds);
        let before = match now {
            Some(now) => self.0.insert(key, now),
            None => self.0.remove(key),
        };
        let before_at = before.map(|points| points.bounds);
        match (before_at, now_at) {
            (Some(before), Some(now)) => Some(before.with(&now)),
            (before, now) => before.or(now),
        }
    }

    /// Forgets those of a block, which stay where they are.
    pub(super) fn forget(&mut self, key: BlockKey) {
        self.0.remove(key);
    }

    /// Calls `visit` with the blocks of a box, and perhaps with others: in whichever way is the shorter one.
    pub(super) fn for_each_in<'a>(
        &'a self,
        within: BlockBox,
        mut visit: impl FnMut(&'a BlockPoints),
    ) {
        /// Blocks of the box that are looked up at a time, 4 an axis.
        const LOOKED_UP: u64 = 64;
        if within.blocks() / LOOKED_UP > self.0.len() as u64 {
            self.0.unordered().for_each(|(_, points)| visit(points));
        } else {
            self.0.for_each_in(within, |_, slot| {
                self.0.at(slot).into_iter().for_each(&mut visit);
            });
        }
    }

    pub(super) fn memory_bytes(&self) -> usize {
        let points = self.0.unordered().map(|(_, block)| block.points.capacity());
        points.sum::<usize>() * size_of::<Points>() + self.0.table_bytes()
    }
}
