//! The surface: truncated signed distances, their weights and colours (Curless and Levoy, "A volumetric method for building
//! complex models from range images", SIGGRAPH 1996, section 3).
//!
//! Distances are kept at the **corners** of voxels: the node of a voxel is its corner with the least coordinates. So the cell
//! between eight nodes is a voxel, and the surface point of that cell lies in it (module `points`).

mod around;
mod block;
mod blocks;
mod bytes;
mod changes;
mod config;
mod correction;
mod distance;
mod forget;
mod from_points;
mod in_view;
mod last_sights;
mod mesh;
mod node_box;
mod nodes;
mod points;
mod update;
mod waiting;

use estimation::executor::{Executor, Task};
use geometry::{Stamp, VoxelGrid};
use nalgebra::Point3;

use crate::block::BlockKey;
use crate::depth_view::{DepthView, with_projection};
use crate::descent::{Behind, Descent, Judge, Margins, Verdict, block_edge_m};
use crate::layer::Layer;
use crate::levels::{LEVELS, Levels};
use crate::no_return::{SeenBefore, is_missed_long_enough, sees_as_well, shows_none};
use crate::projection::{Extent, Project};
use crate::ticks::Ticks;
use crate::tiled_view::TiledView;
use block::SurfaceBlock;
pub use bytes::BlockFormatError;
pub use changes::{ChangeFollower, LISTENER_TOLERANCE_IN_EDGES, SurfaceChanges};
pub use config::{SurfaceConfig, SurfaceConfigError};
pub use distance::{DistanceConfig, DistanceConfigError, DistanceField, LatticeBox};
use last_sights::LoadedSights;
pub use mesh::{BlockMesh, MeshChange, MeshFollower, MeshJoiner, MeshVertex};
pub use points::{PointRules, SurfacePoint};
use update::{Job, Work};

/// Behind a depth nodes count in full for so many edges at least, as voxblox has it (Oleynikova et al., "Voxblox", IROS 2017,
/// section IV-A),
const FULL_BEHIND_IN_EDGES: f64 = 1.0;
/// and for so many standard deviations of the depth: 99 of 100 depths.
const FULL_BEHIND_IN_SIGMAS: f32 = 2.5;
/// In so many edges more they count nothing: the nodes of a surface that is seen from a low angle are all in it.
const FALLS_BEHIND_IN_EDGES: f64 = 2.0;

/// What one image did to the surface.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct SurfaceUpdate {
    /// Blocks that were compared with the image.
    pub compared_blocks: usize,
    /// Blocks that came to be.
    pub new_blocks: usize,
    /// Blocks that went, since no surface is left in them.
    pub cleared_blocks: usize,
    /// Blocks that would have come to be, had there been room, or had they been allowed to: [`Surface::integrate_where`].
    pub refused_blocks: usize,
    /// Whether the view has more blocks than one image may update; those left out are the farthest.
    pub is_incomplete: bool,
}

/// What is known of surfaces. See the module.
#[derive(Debug)]
pub struct Surface {
    config: SurfaceConfig,
    grid: VoxelGrid,
    /// Blocks are lent to the work on an image, and given back.
    layer: Layer<Option<Box<SurfaceBlock>>>,
    /// Blocks without content, kept for their memory.
    #[expect(clippy::vec_box, reason = "they are lent by moving their boxes")]
    spare: Vec<Box<SurfaceBlock>>,
    /// Blocks of the latest image for which there was no room.
    refused: Vec<(BlockKey, Box<SurfaceBlock>)>,
    work: Vec<Work>,
    levels: Levels,
    /// Blocks that the image shows to be free.
    free: Vec<BlockKey>,
    /// Blocks from whose directions nothing comes back.
    blank: Vec<BlockKey>,
    seen_before: SeenBefore,
    loaded: LoadedSights,
    changed: Vec<BlockKey>,
    removed: Vec<BlockKey>,
    ticks: Ticks,
    /// Nodes near the surface of all blocks.
    near_nodes: usize,
}

impl Surface {
    /// Nothing known.
    ///
    /// # Errors
    /// When a parameter means nothing.
    pub fn new(config: SurfaceConfig) -> Result<Self, SurfaceConfigError> {
        config.validate()?;
        Ok(Self::of_grid(config, VoxelGrid::new(config.edge_m)?))
    }

    /// An empty surface with the same parameters.
    #[must_use]
    pub fn emptied(&self) -> Self {
        Self::of_grid(self.config, self.grid)
    }

    /// An empty surface with the same voxels and times, and room for any number of blocks: for some that are looked at.
    #[must_use]
    pub fn unbounded(&self) -> Self {
        let config = SurfaceConfig { max_blocks: usize::MAX, ..self.config };
        Self { ticks: self.ticks.clone(), ..Self::of_grid(config, self.grid) }
    }

    fn of_grid(config: SurfaceConfig, grid: VoxelGrid) -> Self {
        Self {
            config,
            grid,
            layer: Layer::default(),
            spare: Vec::new(),
            refused: Vec::new(),
            work: Vec::new(),
            levels: Levels::default(),
            free: Vec::new(),
            blank: Vec::new(),
            seen_before: SeenBefore::default(),
            loaded: LoadedSights::default(),
            changed: Vec::new(),
            removed: Vec::new(),
            ticks: Ticks::default(),
            near_nodes: 0,
        }
    }

    /// Joins an image to the surface. The result is the same on however many threads. An empty view changes nothing.
    pub fn integrate(&mut self, view: &DepthView, executor: &dyn Executor) -> SurfaceUpdate {
        self.integrate_where(view, executor, &|_| true)
    }

    /// The same, where blocks come to be only as far as `may_be_new` says: elsewhere there may be some that cannot be had now.
    pub fn integrate_where(
        &mut self,
        view: &DepthView,
        executor: &dyn Executor,
        may_be_new: &dyn Fn(BlockKey) -> bool,
    ) -> SurfaceUpdate {
        self.changed.clear();
        self.removed.clear();
        self.forget_refused();
        if view.is_empty() {
            return SurfaceUpdate::default();
        }
        let now = self.ticks.advance(view.stamp);
        with_projection!(view.kind, projection => {
            self.integrate_as(view, projection, now, (executor, may_be_new))
        })
    }

    fn integrate_as<P: Project + update::Kernel>(
        &mut self,
        view: &DepthView,
        projection: P,
        now: u32,
        (executor, may_be_new): (&dyn Executor, &dyn Fn(BlockKey) -> bool),
    ) -> SurfaceUpdate {
        let edge_m = self.config.edge_m;
        let margins = self.margins();
        let judge = Judge::new(view, projection, margins, edge_m as f32);
        let mut update =
            SurfaceUpdate { is_incomplete: !self.find_work(&judge), ..SurfaceUpdate::default() };
        update.compared_blocks = self.work.len();
        let colour = self.config.has_colour && !view.colour.is_empty();
        // Colours are those of single pixels.
        let least_level = if colour { 0 } else { self.least_level(&judge, view.pixel_slope()) };
        self.levels.refill(&view.depths_m, view.size_px().into(), &view.noise, least_level);
        let job = Job::new((view, &self.levels), &judge, projection, edge_m, margins, colour);
        let mut work = std::mem::take(&mut self.work);
        let stretch = work.len().div_ceil(executor.threads().get()).max(1);
        // A task each: an executor may leave out those that have not begun, and their blocks stay as they were.
        let job = &job;
        let tasks = work.chunks_mut(stretch);
        executor.run(tasks.map(|stretch| Box::new(|| P::run(job, stretch)) as Task<'_>).collect());
        let hit_from_m = view.map_from_camera.translation.vector.cast::<f32>().into();
        for done in work.drain(..) {
            let middle_m = judge.frame.in_camera_m(&middle_m(done.key, block_edge_m(edge_m)));
            if !done.is_new && !done.is_hit {
                self.blank.push(done.key);
            }
            self.take_back(done, now, (hit_from_m, middle_m), may_be_new, &mut update);
        }
        self.work = work;
        self.clear_free(&mut update);
        let tiled = TiledView::of(view);
        self.clear_blank((view, &tiled), &judge, now, &mut update);
        self.seen_before.take_in(&tiled);
        update
    }

    /// The finest level that a block of the work is compared with.
    fn least_level<P: Project>(&self, judge: &Judge<'_, P>, pixel_slope: f32) -> u32 {
        let levels = self
            .work
            .iter()
            .map(|item| update::level_of_block(item.key, judge, (self.config.edge_m, pixel_slope)));
        levels.min().unwrap_or(LEVELS as u32)
    }

    fn margins(&self) -> Margins {
        let SurfaceConfig { edge_m, truncation_in_edges, reach_m, .. } = self.config;
        let behind = Behind {
            full_m: (FULL_BEHIND_IN_EDGES * edge_m) as f32,
            full_in_sigmas: FULL_BEHIND_IN_SIGMAS,
            falls_in_m: (FALLS_BEHIND_IN_EDGES * edge_m) as f32,
        };
        let before_m = (truncation_in_edges * edge_m) as f32;
        Margins { before_m, behind, reach_m: reach_m as f32 }
    }

    /// Lends the blocks that the image says something about to `work`. Returns whether these are all.
    fn find_work<P: Project>(&mut self, judge: &Judge<'_, P>) -> bool {
        /// Cubes judged for each block that may be updated: those around it, and free ones.
        const JUDGED_A_BLOCK: usize = 16;
        let most = self.config.max_blocks_per_image;
        let block_edge_m = block_edge_m(self.config.edge_m);
        let descent =
            Descent { judge, block_edge_m, most_judged: most.saturating_mul(JUDGED_A_BLOCK) };
        let Self { layer, work, spare, free, blank, .. } = self;
        let mut is_complete = true;
        free.clear();
        blank.clear();
        let is_whole_view = descent.run(|least, level, verdict| {
            if verdict == Verdict::Free {
                layer.for_each_in_cube(least, level, |key, _| free.push(key));
                return;
            }
            if verdict == Verdict::Blank {
                layer.for_each_in_cube(least, level, |key, _| blank.push(key));
                return;
            }
            let middle_m = middle_m(least, block_edge_m);
            // Nodes that are free make no surface, but what a block has they take away.
            let (is_mixed, is_free) = judge.eighths(&middle_m, block_edge_m);
            let has_work = is_mixed || (is_free && layer.get(least).is_some());
            if !has_work {
                return;
            }
            if work.len() < most {
                work.push(Work::new(least));
            } else {
                is_complete = false;
            }
        });
        for item in work.iter_mut() {
            let known = layer.get_mut(item.key);
            item.is_new = known.is_none();
            let lent = known.and_then(Option::take);
            item.block = Some(lent.or_else(|| spare.pop()).unwrap_or_default());
        }
        is_complete && is_whole_view
    }

    fn clear_free(&mut self, update: &mut SurfaceUpdate) {
        let free = std::mem::take(&mut self.free);
        for key in &free {
            let block = self.layer.get_mut(*key).and_then(Option::as_mut);
            if block.is_some_and(|block| !block.evidence.miss()) {
                self.remove(*key, update);
            }
        }
        self.free = free;
    }

    fn clear_blank<P: Project>(
        &mut self,
        (view, tiled): (&DepthView, &TiledView),
        judge: &Judge<'_, P>,
        now: u32,
        update: &mut SurfaceUpdate,
    ) {
        let block_edge_m = block_edge_m(self.config.edge_m);
        let blank = std::mem::take(&mut self.blank);
        for key in &blank {
            let Some(block) = self.layer.get_mut(*key).and_then(Option::as_mut) else { continue };
            let middle_m = middle_m(*key, block_edge_m);
            let Extent::Within(covered) = judge.extent(&middle_m, block_edge_m as f32) else {
                continue;
            };
            let is_all_seen = !covered.is_cut
                || block.was_seen_only_at(judge.frame.in_camera_m(&middle_m), block_edge_m);
            let sighted = self.loaded.sighted(*key, block, now);
            let has_gone = is_all_seen
                && sees_as_well(&tiled.camera_in_map_m(), &sighted.from_m, &middle_m)
                && shows_none(view, &covered, judge.before_m())
                && self.seen_before.would_return(tiled, &covered);
            if !has_gone {
                continue;
            }
            self.loaded.miss(*key, now);
            if !block.evidence.blank() && is_missed_long_enough(sighted.missed_s, sighted.lasted_s)
            {
                self.remove(*key, update);
            }
        }
        self.blank = blank;
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        self.layer = Layer::default();
        self.forget_refused();
        self.changed.clear();
        self.removed.clear();
        self.ticks = Ticks::default();
        self.seen_before = SeenBefore::default();
        self.loaded = LoadedSights::default();
        self.near_nodes = 0;
    }

    /// The grid of the voxels.
    #[must_use]
    pub fn grid(&self) -> &VoxelGrid {
        &self.grid
    }

    /// The parameters.
    #[must_use]
    pub fn config(&self) -> &SurfaceConfig {
        &self.config
    }

    /// How many blocks there are.
    #[must_use]
    pub fn blocks(&self) -> usize {
        self.layer.len()
    }

    /// How many nodes are no farther than half an edge from the surface: about as many as there are points, without the cost of
    /// these.
    #[must_use]
    pub fn near_nodes(&self) -> usize {
        self.near_nodes
    }

    /// All blocks, ascending.
    #[must_use]
    pub fn block_keys(&self) -> Vec<BlockKey> {
        self.layer.sorted_keys()
    }

    /// The blocks in which the latest image changed something, in the order of the update. Points of a block depend on the
    /// next block along each axis, too.
    #[must_use]
    pub fn changed(&self) -> &[BlockKey] {
        &self.changed
    }

    /// The blocks that the latest image cleared, or that [`Surface::forget_around`] did since.
    #[must_use]
    pub fn removed(&self) -> &[BlockKey] {
        &self.removed
    }

    /// When a block was updated first and last.
    #[must_use]
    pub fn seen(&self, key: BlockKey) -> Option<(Stamp, Stamp)> {
        let block = self.block(key)?;
        Some((self.ticks.stamp(block.first_seen)?, self.ticks.stamp(block.last_seen)?))
    }

    /// The memory taken, in bytes.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        let blocks = self.layer.unordered().filter_map(|(_, block)| block.as_ref());
        let blocks = blocks.map(|block| block.memory_bytes()).sum::<usize>();
        let spare = self.spare.iter().chain(self.refused.iter().map(|(_, block)| block));
        let spare = spare.map(|block| block.memory_bytes()).sum::<usize>();
        blocks
            + spare
            + self.layer.table_bytes()
            + self.levels.memory_bytes()
            + self.loaded.memory_bytes()
            + self.work.capacity() * size_of::<Work>()
            + (self.free.capacity() + self.blank.capacity()) * size_of::<BlockKey>()
    }
}

fn middle_m(key: BlockKey, block_edge_m: f64) -> Point3<f64> {
    key.coordinates().map(|along| (f64::from(along) + 0.5) * block_edge_m).into()
}

#[cfg(test)]
mod tests;
