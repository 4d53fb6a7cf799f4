//! What a listener has to be told of the surface: points that are new or have moved, and those that have gone, so many at a
//! time.

use std::collections::{HashMap, HashSet, VecDeque};

use geometry::{BuildVoxelHasher, VoxelKey};
use nalgebra::Point3;

use super::{PointRules, Surface, SurfacePoint};
use crate::block::{BlockKey, voxel_index};

/// A listener that was told of all changes has each point within this share of an edge.
pub const LISTENER_TOLERANCE_IN_EDGES: f64 = 1.0 / 16.0;
/// Places within a voxel are remembered in steps of this share of the edge.
const STEPS: f64 = 255.0;

/// Points that are new or have moved, and voxels whose points have gone.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct SurfaceChanges {
    /// Each takes the place of the listener's point of its voxel.
    pub updated: Vec<SurfacePoint>,
    /// The listener's points of these voxels go.
    pub removed: Vec<VoxelKey>,
}

/// What one listener, or all of them, know of a surface. Blocks wait in the order in which they changed first.
#[derive(Clone, Debug, Default)]
pub struct ChangeFollower {
    waiting: VecDeque<BlockKey>,
    is_waiting: HashSet<BlockKey, BuildVoxelHasher>,
    /// Of each block, the points that were told of by the indices of their voxels, ascending. Looked up by key alone.
    told: HashMap<BlockKey, Vec<Told>, BuildVoxelHasher>,
    points: Vec<SurfacePoint>,
}

#[derive(Clone, Copy, PartialEq, Debug)]
struct Told {
    index: u16,
    place: [u8; 3],
    /// Some listeners know it elsewhere: it is told of again in any case.
    is_stale: bool,
}

impl Told {
    fn of(point: &SurfacePoint, edge_m: f64) -> Self {
        let VoxelKey { x, y, z } = point.voxel;
        let step = |along_m: f32, cell: i32| {
            // The cast saturates.
            ((f64::from(along_m) / edge_m - f64::from(cell)) * STEPS).round() as u8
        };
        let Point3 { coords } = point.position_m;
        let place = [step(coords.x, x), step(coords.y, y), step(coords.z, z)];
        Self { index: voxel_index(point.voxel) as u16, place, is_stale: false }
    }

    fn is_far_from(&self, other: &Self) -> bool {
        let untold = LISTENER_TOLERANCE_IN_EDGES * STEPS - 2.0;
        let squares =
            self.place.iter().zip(other.place).map(|(a, b)| f64::from(a.abs_diff(b)).powi(2));
        other.is_stale || squares.sum::<f64>() > untold * untold
    }
}

impl ChangeFollower {
    /// Takes in what the latest image changed. To be called after each.
    pub fn follow(&mut self, surface: &Surface) {
        for key in surface.changed().iter().chain(surface.removed()) {
            self.wait(*key);
        }
    }

    /// The whole surface has changed: a correction, a map that was loaded.
    pub fn follow_all(&mut self, surface: &Surface) {
        let mut keys: Vec<BlockKey> =
            self.told.keys().copied().chain(surface.block_keys()).collect();
        keys.sort_unstable();
        keys.into_iter().for_each(|key| self.wait(key));
    }

    /// A block was removed, or put there, by hand.
    pub fn follow_block(&mut self, key: BlockKey) {
        self.wait(key);
    }

    /// A listener begins with the surface as it is now. What waits is told of in any case: a point that returns to where it was
    /// told would stay elsewhere for that listener, and one that goes before it was told would stay.
    pub fn show_whole(&mut self, surface: &Surface, rules: PointRules) {
        let edge_m = surface.grid().edge_m();
        let mut points = Vec::new();
        for key in &self.waiting {
            points.clear();
            surface.points_of(*key, rules, &mut points);
            let told = self.told.entry(*key).or_default();
            told.extend(points.iter().map(|point| Told::of(point, edge_m)));
            told.sort_unstable_by_key(|told| told.index);
            told.dedup_by_key(|told| told.index);
            told.iter_mut().for_each(|told| told.is_stale = true);
            if told.is_empty() {
                self.told.remove(key);
            }
        }
    }

    /// A block's points lie between its nodes and those of the next blocks: they change with these, too.
    fn wait(&mut self, key: BlockKey) {
        for step in 0..8 {
            let before = key.offset(-(step & 1), -(step >> 1 & 1), -(step >> 2));
            if self.is_waiting.insert(before) {
                self.waiting.push_back(before);
            }
        }
    }

    /// How many blocks wait to be looked at.
    #[must_use]
    pub fn waiting(&self) -> usize {
        self.waiting.len()
    }

    /// The next changes: of so many blocks that there are no more than `most_points` points, or of one block. What does not fit
    /// waits, and comes before what changes later.
    pub fn take(
        &mut self,
        surface: &Surface,
        rules: PointRules,
        most_points: usize,
    ) -> SurfaceChanges {
        let mut changes = SurfaceChanges::default();
        let mut points = std::mem::take(&mut self.points);
        while let Some(&key) = self.waiting.front() {
            points.clear();
            surface.points_of(key, rules, &mut points);
            let before = self.told.get(&key).map_or(&[][..], Vec::as_slice);
            let edge_m = surface.grid().edge_m();
            let now: Vec<Told> = points.iter().map(|point| Told::of(point, edge_m)).collect();
            let told_of = |told: &Told| {
                let index = before.binary_search_by_key(&told.index, |told| told.index).ok();
                index.and_then(|index| before.get(index))
            };
            let is_news =
                |told: &&Told| told_of(told).is_none_or(|before| told.is_far_from(before));
            let has_gone =
                |told: &&Told| now.binary_search_by_key(&told.index, |told| told.index).is_err();
            let news = now.iter().filter(is_news).count() + before.iter().filter(has_gone).count();
            let taken = changes.updated.len() + changes.removed.len();
            if taken > 0 && taken + news > most_points {
                break;
            }
            let told: Vec<Told> = now
                .iter()
                .zip(&points)
                .map(|(told, point)| match told_of(told) {
                    Some(before) if !told.is_far_from(before) => *before,
                    _ => {
                        changes.updated.push(*point);
                        *told
                    }
                })
                .collect();
            let gone = before.iter().filter(has_gone);
            changes.removed.extend(gone.map(|told| key.voxel(usize::from(told.index))));
            self.waiting.pop_front();
            self.is_waiting.remove(&key);
            if told.is_empty() {
                self.told.remove(&key);
            } else {
                self.told.insert(key, told);
            }
        }
        self.points = points;
        changes
    }

    /// The memory taken, in bytes.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        let told = self.told.values().map(|told| told.capacity() * size_of::<Told>());
        told.sum::<usize>()
            + self.told.capacity() * size_of::<(BlockKey, Vec<Told>)>()
            + (self.waiting.capacity() + self.is_waiting.capacity()) * size_of::<BlockKey>()
            + self.points.capacity() * size_of::<SurfacePoint>()
    }
}
