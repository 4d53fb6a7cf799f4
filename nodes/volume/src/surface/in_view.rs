//! Which blocks an image can change, before it does: what must be in memory for it.

use super::Surface;
use crate::block::BlockBox;
use crate::depth_view::{DepthView, with_projection};
use crate::descent::{Judge, block_edge_m};
use crate::projection::{Extent, Project};

/// A block that changes has a point in the hull of what the image shows: a block more on each side, for the rounding.
const BESIDE_HULL_BLOCKS: i32 = 1;

impl Surface {
    /// A box with all blocks that an image can change; `None` where it changes nothing.
    #[must_use]
    pub fn view_box(&self, view: &DepthView) -> Option<BlockBox> {
        let reach_m = self.config.reach_m as f32;
        let hull_m = with_projection!(view.kind, projection => projection.hull_m(reach_m));
        let edge_m = block_edge_m(self.config.edge_m);
        let [least_m, most_m] = hull_m
            .map(|corner| view.map_from_camera * nalgebra::Point3::from(corner).cast::<f64>())
            .into_iter()
            .fold([[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]], |[least, most], corner| {
                let along = [0, 1, 2];
                [
                    along.map(|axis: usize| least[axis].min(corner[axis])),
                    along.map(|axis: usize| most[axis].max(corner[axis])),
                ]
            });
        // The casts saturate.
        let block = |along_m: f64| (along_m / edge_m).floor() as i32;
        let hull = BlockBox { least: least_m.map(block).into(), most: most_m.map(block).into() };
        (!view.is_empty()).then(|| hull.grown(BESIDE_HULL_BLOCKS))
    }

    /// Whether an image can change a block of a box. It may say so where it changes none.
    #[must_use]
    pub fn is_in_view(&self, view: &DepthView, blocks: BlockBox) -> bool {
        with_projection!(view.kind, projection => self.is_within(view, projection, blocks))
    }

    fn is_within<P: Project>(&self, view: &DepthView, projection: P, blocks: BlockBox) -> bool {
        let edge_m = block_edge_m(self.config.edge_m);
        let margins = self.margins();
        let judge = Judge::new(view, projection, margins, self.config.edge_m as f32);
        let (least, most) = (blocks.least.coordinates(), blocks.most.coordinates());
        let ends =
            [0, 1, 2].map(|axis: usize| [f64::from(least[axis]), f64::from(most[axis]) + 1.0]);
        let middle_m = ends.map(|[from, to]| 0.5 * (from + to) * edge_m);
        let longest = ends.iter().map(|[from, to]| to - from).fold(0.0, f64::max);
        match judge.extent(&middle_m.into(), (longest * edge_m) as f32) {
            Extent::Outside => false,
            Extent::Undecided => true,
            Extent::Within(covered) => covered.nearest_m <= margins.reach_m,
        }
    }
}
