//! The update once more, node by node and without pyramid, images of rows or blocks of work: what the fast one must give to
//! the bit.

use std::collections::BTreeMap;

use proptest::prelude::*;

use super::*;
use crate::levels::Levels;
use crate::projection::{CameraBox, Extent};
use crate::surface::block::FULL;
use crate::surface::update::weight_in;

type Plain = BTreeMap<BlockKey, SurfaceBlock>;

/// What of a plain update differs from one block to the next.
struct PlainImage<'a, P> {
    view: &'a DepthView,
    levels: Levels,
    judge: Judge<'a, P>,
    projection: P,
    config: SurfaceConfig,
}

impl<P: Project> PlainImage<'_, P> {
    fn truncation_m(&self) -> f32 {
        (self.config.truncation_in_edges * self.config.edge_m) as f32
    }

    fn extent(&self, key: BlockKey) -> Extent {
        let edge_m = block_edge_m(self.config.edge_m);
        let middle = Point3::from(key.coordinates().map(|along| (f64::from(along) + 0.5) * edge_m));
        let steps = self.judge.frame.steps_m(1.0);
        let half_m = [0, 1, 2].map(|axis: usize| {
            0.5 * steps.iter().map(|step| step[axis].abs()).sum::<f32>() * edge_m as f32
        });
        self.projection
            .extent(&CameraBox { middle_m: self.judge.frame.in_camera_m(&middle), half_m })
    }

    /// Whether a block is free as a whole: by each pixel of the tiles around what it covers.
    fn is_free(&self, key: BlockKey) -> bool {
        let Extent::Within(covered) = self.extent(key) else { return false };
        let (width_px, height_px) = self.view.size_px();
        let slope = self.projection.pixel_slope();
        let level = crate::levels::level_of(self.config.edge_m as f32, slope, covered.nearest_m);
        let beside = (1_u32 << level) - 1;
        let grown = |[first, last]: [u32; 2], size: usize| {
            [first.saturating_sub(beside), (last + beside).min(size as u32 - 1)]
        };
        let (columns, rows) = (grown(covered.columns, width_px), grown(covered.rows, height_px));
        let (free_to_m, _) = testing::plain_span(self.view, columns, rows);
        !covered.is_cut
            && covered.farthest_m <= self.config.reach_m as f32
            && covered.farthest_m + self.truncation_m() < free_to_m
    }

    /// The block after the image; `None` where it has no surface.
    fn update(&self, key: BlockKey, known: Option<&SurfaceBlock>) -> Option<SurfaceBlock> {
        let mut block = known.cloned().unwrap_or_default();
        let edge_m = block_edge_m(self.config.edge_m);
        let origin = key.coordinates().map(|along| f64::from(along) * edge_m);
        let middle = Point3::from(origin.map(|along_m| along_m + 0.5 * edge_m));
        let [x, y, z] = self.judge.frame.in_camera_m(&middle);
        let middle_m = (x * x + y * y + z * z).sqrt();
        if self.is_free(key) {
            known?;
            return block.evidence.miss().then_some(block);
        }
        let slope = self.projection.pixel_slope();
        let level = crate::levels::level_of(self.config.edge_m as f32, slope, middle_m);
        let projection = self.projection.coarser(level);
        let steps = self.judge.frame.steps_m(self.config.edge_m);
        let start = self.judge.frame.in_camera_m(&Point3::from(origin));
        let mut is_hit = false;
        for index in 0..512 {
            let along = [index % 8, index / 8 % 8, index / 64].map(|along| along as f32);
            let place = [0, 1, 2].map(|axis: usize| {
                start[axis]
                    + along[1] * steps[1][axis]
                    + along[2] * steps[2][axis]
                    + along[0] * steps[0][axis]
            });
            let row = projection.row(place, [0.0; 3]);
            let pixel = self.levels.pixels(level)[row.pixel[0] as usize];
            let depth_m = pixel.depth_m;
            let before_m = depth_m.abs() - row.depth_m[0];
            let truncation_m = self.truncation_m();
            let sigma_m = self.view.noise.sigma_m(depth_m);
            let full_m = (2.5 * sigma_m).max(self.config.edge_m as f32);
            let falls_in_m = 2.0 * self.config.edge_m as f32;
            let ends_m = full_m + falls_in_m;
            let is_free = before_m >= truncation_m;
            let is_beyond = before_m <= -ends_m || row.depth_m[0] > self.config.reach_m as f32;
            if depth_m == 0.0 || is_beyond || (depth_m < 0.0 && !is_free) {
                continue;
            }
            is_hit |= !is_free;
            let [by_column_m, by_row_m] = pixel.slopes_m();
            let [in_column_px, in_row_px] = row.in_pixel_px.map(|in_pixel_px| in_pixel_px[0]);
            let before_m = before_m + (by_column_m * in_column_px + by_row_m * in_row_px);
            let share = (before_m * (1.0 / truncation_m)).clamp(-1.0, 1.0);
            let counts = ((before_m + ends_m) * (1.0 / falls_in_m)).clamp(0.0, 1.0);
            let most_known = if before_m >= full_m { 8.0 } else { f32::INFINITY };
            let weight = (counts * weight_in(depth_m)).max(1.0);
            join(&mut block, index, share, weight, most_known * weight);
        }
        if is_hit {
            block.evidence.hit();
        }
        block.has_surface().then_some(block)
    }

    /// Updates all blocks of the box around the view, and those that are known.
    fn join(&self, plain: &mut Plain, around: i32) {
        let keys = (-around..around).flat_map(|z| {
            (-around..around)
                .flat_map(move |y| (-around..around).map(move |x| BlockKey { x, y, z }))
        });
        for key in keys {
            match self.update(key, plain.get(&key)) {
                Some(block) => plain.insert(key, block),
                None => plain.remove(&key),
            };
        }
    }
}

fn join(block: &mut SurfaceBlock, index: usize, share: f32, weight: f32, most_known: f32) {
    let known = f32::from(block.weight[index]).min(most_known);
    let mean =
        (f32::from(block.distance[index]) * known + FULL * share * weight) / (known + weight);
    block.distance[index] = mean.round_ties_even() as i16;
    block.weight[index] = (known + weight).min(8160.0).round_ties_even() as u16;
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]
    /// Whole cubes that are decided by the pyramid are decided as their nodes would be.
    #[test]
    fn the_update_is_that_of_each_node_alone(
        shifts in prop::collection::vec(prop::array::uniform3(-0.3..0.3_f64), 1..4),
        turns in prop::array::uniform3(-0.5..0.5_f64),
        seed in any::<u64>(),
        holes in 0.0..0.7_f64,
    ) {
        let camera = testing::camera(64, 48);
        let config = SurfaceConfig { reach_m: 3.0, ..config(0.05) };
        let mut fast = Surface::new(config).unwrap();
        let mut plain = Plain::new();
        let mut noise = testing::Noise::new(seed);
        for (index, shift) in shifts.into_iter().enumerate() {
            let pose = testing::pose(shift, turns);
            let mut depths_m = Scene::room().depths_m(&camera, &pose);
            let mut is_moving = vec![false; depths_m.len()];
            for (depth_m, is_moving) in depths_m.iter_mut().zip(&mut is_moving) {
                *depth_m += 0.02 * noise.normal() as f32;
                *is_moving = noise.uniform() < 0.1;
                if noise.uniform() < holes * noise.uniform() {
                    *depth_m = 0.0;
                }
            }
            let view = testing::view_of(&camera, &pose, index as f64, depths_m, Some(&is_moving));
            fast.integrate(&view, &Serial);
            let crate::depth_view::Kind::Pinhole(projection) = view.kind else { unreachable!() };
            let margins = fast.margins();
            let judge = Judge::new(&view, projection, margins, config.edge_m as f32);
            let mut levels = Levels::default();
            levels.refill(&view.depths_m, view.size_px().into(), &view.noise, 0);
            PlainImage { view: &view, levels, judge, projection, config }.join(&mut plain, 14);
        }
        let fast = contents(&fast);
        prop_assert_eq!(fast.len(), plain.len());
        for ((key, fast), (plain_key, plain)) in fast.iter().zip(&plain) {
            prop_assert_eq!(key, plain_key);
            let is_same = fast.distance == plain.distance
                && fast.weight == plain.weight
                && fast.evidence == plain.evidence;
            prop_assert!(is_same, "block {:?}", key);
        }
    }
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let camera = testing::camera(160, 120);
    let mut contents_of = [Vec::new(), Vec::new()];
    let executors: [&dyn Executor; 2] =
        [&Serial, &ScopedThreads::new(std::num::NonZeroUsize::new(3).unwrap())];
    for (contents_of, executor) in contents_of.iter_mut().zip(executors) {
        let mut surface = surface(0.04);
        for step in 0..4 {
            let pose = testing::pose([0.05 * f64::from(step), 0.0, 0.0], [0.0, 0.1, 0.0]);
            let view = testing::view_of_scene(&Scene::room(), &camera, &pose, f64::from(step));
            surface.integrate(&view, executor);
        }
        *contents_of = contents(&surface);
    }
    let [one, three] = contents_of;
    assert!(!one.is_empty() && one == three);
}
