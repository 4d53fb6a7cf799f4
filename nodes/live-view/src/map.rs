//! The map as it is shown: points by blocks of voxels, each with the number of its last change.

use std::collections::BTreeMap;
use std::ops::Bound;

use geometry::{ColouredCloud, NO_COLOUR, Stamp, VoxelEdgeError, VoxelGrid, VoxelKey, is_finite};
use nalgebra::Point3;

/// Voxels along the edge of a block: what is sent again when one of its voxels changes, some hundred points.
pub const BLOCK_EDGE_VOXELS: i32 = 16;
/// Blocks along the edge of a tile: what the page draws at once. Positions are steps from the corner of a tile.
pub const TILE_EDGE_BLOCKS: i32 = 4;
/// The finest step of a position: a tenth of the noise of a depth camera, as the report has it.
const FINEST_STEP_M: f64 = 0.001;
/// Steps along the edge of a tile, at most.
const MOST_STEPS: f64 = 65_535.0;

/// A block by its place: its corner is this many of its edges from the origin.
pub type BlockKey = [i32; 3];

/// The map, as the node that makes it has published it.
///
/// A whole map takes the place of what is older than it; an update sets the points of voxels, a removal takes them away, and of two
/// that concern a voxel the one with the later stamp is valid, whichever came first. A whole map that is older than the one before it is
/// of a clock or a recording that began anew: nothing of what was is left then.
#[derive(Clone, PartialEq, Debug)]
pub struct LiveMap {
    grid: VoxelGrid,
    most_voxels: usize,
    blocks: BTreeMap<BlockKey, Block>,
    voxels: usize,
    /// Counts all changes.
    revision: u64,
    /// Counts the grids.
    epoch: u32,
    refused: u64,
    has_colours: bool,
    /// Of the last whole map.
    whole: Option<Stamp>,
}

/// A block with at least one voxel in it, or the trace of one.
#[derive(Clone, PartialEq, Debug, Default)]
struct Block {
    voxels: BTreeMap<u16, Voxel>,
    /// Voxels that have a point.
    points: usize,
    changed: u64,
}

#[derive(Clone, Copy, PartialEq, Debug)]
struct Voxel {
    stamp: Stamp,
    /// None of a voxel that was removed: an update that is older may come after it.
    point: Option<PlacedPoint>,
}

/// A point within its tile.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub struct PlacedPoint {
    /// In steps of [`LiveMap::step_m`] from the corner of the tile.
    pub steps: [u16; 3],
    /// Red, green and blue; [`NO_COLOUR`] where none was seen.
    pub colour: [u8; 3],
}

impl LiveMap {
    /// An empty map of voxels of `voxel_edge_m`, with at most `most_voxels` of them.
    ///
    /// # Errors
    /// When the edge is no length.
    pub fn new(voxel_edge_m: f64, most_voxels: usize) -> Result<Self, VoxelEdgeError> {
        Ok(Self {
            grid: VoxelGrid::new(voxel_edge_m)?,
            most_voxels,
            blocks: BTreeMap::new(),
            voxels: 0,
            revision: 1,
            epoch: 1,
            refused: 0,
            has_colours: false,
            whole: None,
        })
    }

    /// Begins an empty map of voxels of another edge; one of the same edge stays.
    ///
    /// # Errors
    /// When the edge is no length; the map is then as it was.
    pub fn set_voxel_edge(&mut self, voxel_edge_m: f64) -> Result<bool, VoxelEdgeError> {
        if self.grid.edge_m() == voxel_edge_m {
            return Ok(false);
        }
        let (revision, epoch) = (self.revision + 1, self.epoch + 1);
        *self = Self { revision, epoch, ..Self::new(voxel_edge_m, self.most_voxels)? };
        Ok(true)
    }

    /// The edge of the voxels.
    #[must_use]
    pub fn voxel_edge_m(&self) -> f64 {
        self.grid.edge_m()
    }

    /// The edge of a block.
    #[must_use]
    pub fn block_edge_m(&self) -> f64 {
        self.grid.edge_m() * f64::from(BLOCK_EDGE_VOXELS)
    }

    /// A step of the positions.
    #[must_use]
    pub fn step_m(&self) -> f64 {
        (self.block_edge_m() * f64::from(TILE_EDGE_BLOCKS) / MOST_STEPS).max(FINEST_STEP_M)
    }

    /// How many points there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.blocks.values().map(|block| block.points).sum()
    }

    /// Whether there is no point.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// How many points were left out since the map was full.
    #[must_use]
    pub fn refused(&self) -> u64 {
        self.refused
    }

    /// Whether any point has come with a colour.
    #[must_use]
    pub fn has_colours(&self) -> bool {
        self.has_colours
    }

    /// Counts the changes.
    #[must_use]
    pub fn revision(&self) -> u64 {
        self.revision
    }

    /// Counts the grids: what was shown of another one is of no use.
    #[must_use]
    pub fn epoch(&self) -> u32 {
        self.epoch
    }

    /// The blocks of a range of keys that have points, each with the number of its last change.
    pub(crate) fn blocks_in(
        &self,
        range: (Bound<BlockKey>, Bound<BlockKey>),
    ) -> impl Iterator<Item = (BlockKey, u64)> {
        let shown = self.blocks.range(range).filter(|(_, block)| block.points > 0);
        shown.map(|(key, block)| (*key, block.changed))
    }

    /// The blocks that have points.
    pub fn block_keys(&self) -> impl Iterator<Item = BlockKey> {
        self.blocks_in((Bound::Unbounded, Bound::Unbounded)).map(|(key, _)| key)
    }

    /// How many points a block has.
    #[must_use]
    pub fn point_count(&self, key: &BlockKey) -> usize {
        self.blocks.get(key).map_or(0, |block| block.points)
    }

    /// The number of the last change of a block that has points.
    #[must_use]
    pub fn changed(&self, key: &BlockKey) -> Option<u64> {
        self.blocks.get(key).filter(|block| block.points > 0).map(|block| block.changed)
    }

    /// The points of a block, in the order of their voxels.
    pub fn points(&self, key: &BlockKey) -> impl Iterator<Item = PlacedPoint> + Clone {
        self.blocks
            .get(key)
            .into_iter()
            .flat_map(|block| block.voxels.values().filter_map(|voxel| voxel.point))
    }

    /// Forgets all points.
    pub fn clear(&mut self) {
        self.blocks.clear();
        (self.voxels, self.refused) = (0, 0);
        self.has_colours = false;
        self.revision += 1;
    }

    /// Takes a whole map: what is not in it has gone, but for what is newer.
    pub fn replace(&mut self, whole: &ColouredCloud) {
        let stamp = whole.cloud.stamp;
        if self.whole.replace(stamp).is_some_and(|before| before > stamp) {
            self.clear();
        }
        let mut former = std::mem::take(&mut self.blocks);
        self.voxels = 0;
        self.refused = 0;
        self.has_colours |= !whole.colours.is_empty();
        for (key, local, point) in self.placed(whole) {
            self.put(key, local, Voxel { stamp, point: Some(point) });
        }
        for (key, block) in &former {
            for (local, voxel) in block.voxels.iter().filter(|(_, voxel)| voxel.stamp > stamp) {
                self.put(*key, *local, *voxel);
            }
        }
        self.revision += 1;
        for (key, block) in &mut self.blocks {
            let before = former.remove(key);
            block.changed = match before {
                Some(before) if shows_the_same(&before, block) => before.changed,
                _ => self.revision,
            };
        }
    }

    /// Takes points that are new or have moved.
    pub fn update(&mut self, updated: &ColouredCloud) {
        self.has_colours |= !updated.colours.is_empty();
        let stamp = updated.cloud.stamp;
        for (key, local, point) in self.placed(updated) {
            self.apply(key, local, Voxel { stamp, point: Some(point) });
        }
    }

    /// Takes the points of voxels that have gone.
    pub fn remove(&mut self, stamp: Stamp, points_m: &[Point3<f32>]) {
        for point_m in points_m.iter().filter(|point_m| is_finite(point_m)) {
            let (key, local) = place(self.grid.key(point_m));
            self.apply(key, local, Voxel { stamp, point: None });
        }
    }

    /// Sets a voxel unless what is known of it is newer.
    fn apply(&mut self, key: BlockKey, local: u16, voxel: Voxel) {
        let before = self.blocks.get(&key).and_then(|block| block.voxels.get(&local));
        if before.is_some_and(|before| before.stamp > voxel.stamp) {
            return;
        }
        let shown = before.and_then(|before| before.point);
        if self.put(key, local, voxel) && shown != voxel.point {
            self.revision += 1;
            if let Some(block) = self.blocks.get_mut(&key) {
                block.changed = self.revision;
            }
        }
    }

    /// Sets a voxel where there is room for it.
    fn put(&mut self, key: BlockKey, local: u16, voxel: Voxel) -> bool {
        let is_new = self.blocks.get(&key).is_none_or(|block| !block.voxels.contains_key(&local));
        if is_new && self.voxels >= self.most_voxels {
            self.refused += 1;
            return false;
        }
        let block = self.blocks.entry(key).or_default();
        let before = block.voxels.insert(local, voxel);
        self.voxels += usize::from(before.is_none());
        let had_point = before.is_some_and(|before| before.point.is_some());
        block.points += usize::from(voxel.point.is_some());
        block.points -= usize::from(had_point);
        true
    }

    /// The points of a cloud with their voxels.
    fn placed(&self, cloud: &ColouredCloud) -> Vec<(BlockKey, u16, PlacedPoint)> {
        let colours = cloud.colours.iter().copied().chain(std::iter::repeat(NO_COLOUR));
        let points = cloud.cloud.points_m.iter().zip(colours);
        points
            .filter(|(point_m, _)| is_finite(point_m))
            .map(|(point_m, colour)| {
                let (key, local) = place(self.grid.key(point_m));
                (key, local, PlacedPoint { steps: self.steps(key, point_m), colour })
            })
            .collect()
    }

    fn steps(&self, key: BlockKey, point_m: &Point3<f32>) -> [u16; 3] {
        let corner_m = self.tile_corner_m(key);
        [0, 1, 2].map(|axis| {
            let steps = (f64::from(point_m[axis]) - corner_m[axis]) / self.step_m();
            // The cast saturates: a point beyond the reach of the keys is in the outermost tile.
            steps.round().clamp(0.0, MOST_STEPS) as u16
        })
    }

    /// The lowest corner of the tile that a block is in.
    #[must_use]
    pub fn tile_corner_m(&self, key: BlockKey) -> [f64; 3] {
        let tile_edge_m = self.block_edge_m() * f64::from(TILE_EDGE_BLOCKS);
        key.map(|along| f64::from(along.div_euclid(TILE_EDGE_BLOCKS)) * tile_edge_m)
    }
}

/// The block of a voxel, and the voxel's number within it.
fn place(VoxelKey { x, y, z }: VoxelKey) -> (BlockKey, u16) {
    let key = [x, y, z].map(|along| along.div_euclid(BLOCK_EDGE_VOXELS));
    let local = [x, y, z].map(|along| along.rem_euclid(BLOCK_EDGE_VOXELS));
    // Below the cube of the edge, 4096.
    let number = (local[2] * BLOCK_EDGE_VOXELS + local[1]) * BLOCK_EDGE_VOXELS + local[0];
    (key, number as u16)
}

fn shows_the_same(one: &Block, other: &Block) -> bool {
    let shown = |block: &Block| {
        let points = block.voxels.iter().filter_map(|(local, voxel)| Some((*local, voxel.point?)));
        points.collect::<Vec<_>>()
    };
    one.points == other.points && shown(one) == shown(other)
}
