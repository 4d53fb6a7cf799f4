//! What a listener has to be told of the surface: points that are new or have moved, and those that have gone, so many at a
//! time.

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use geometry::{BuildVoxelHasher, VoxelGrid, VoxelKey};
use nalgebra::Point3;

use super::waiting::WaitingBlocks;
use super::{PointRules, Surface, SurfacePoint};
use crate::block::{BlockKey, voxel_index};

/// A listener that was told of all changes has each point within this share of an edge.
pub const LISTENER_TOLERANCE_IN_EDGES: f64 = 1.0 / 16.0;
/// Places within a voxel are remembered in steps of this share of the edge.
const STEPS: f64 = 255.0;
/// The bytes of a point that was told of, in a store: index, place, marks.
const TOLD_BYTES: usize = 6;

/// Points that are new, have moved or have a colour now, and voxels whose points have gone. A colour that changes later is not told
/// of: the whole surface has it.
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
    waiting: WaitingBlocks,
    /// Of each block, the points that were told of by the indices of their voxels, ascending. Looked up by key alone.
    told: HashMap<BlockKey, Vec<Told>, BuildVoxelHasher>,
    points: Vec<SurfacePoint>,
}

#[derive(Clone, Copy, PartialEq, Debug)]
struct Told {
    index: u16,
    place: [u8; 3],
    /// [`Told::STALE`], [`Told::COLOURED`].
    marks: u8,
}

impl Told {
    /// Some listeners know it elsewhere: it is told of again in any case.
    const STALE: u8 = 1;
    /// It was told of with a colour. One without is told of again when it has one.
    const COLOURED: u8 = 2;

    fn of(point: &SurfacePoint, grid: &VoxelGrid) -> Self {
        let edge_m = grid.edge_m();
        let VoxelKey { x, y, z } = point.voxel;
        let step = |along_m: f32, cell: i32| {
            // The cast saturates.
            ((f64::from(along_m) / edge_m - f64::from(cell)) * STEPS).round() as u8
        };
        let Point3 { coords } = point.position_m;
        let place = [step(coords.x, x), step(coords.y, y), step(coords.z, z)];
        Self {
            index: voxel_index(point.voxel) as u16,
            place,
            marks: if point.colour.is_some() { Self::COLOURED } else { 0 },
        }
    }

    fn is_far_from(&self, other: &Self) -> bool {
        let has_new_colour = self.marks & Self::COLOURED > other.marks & Self::COLOURED;
        let untold = LISTENER_TOLERANCE_IN_EDGES * STEPS - 2.0;
        let squares =
            self.place.iter().zip(other.place).map(|(a, b)| f64::from(a.abs_diff(b)).powi(2));
        other.marks & Self::STALE > 0 || has_new_colour || squares.sum::<f64>() > untold * untold
    }
}

/// Some listeners know one, others another of these: all are told of again, each voxel once.
fn make_stale(told: &mut Vec<Told>) {
    told.sort_unstable_by_key(|told| told.index);
    told.dedup_by_key(|told| told.index);
    told.iter_mut().for_each(|told| told.marks |= Told::STALE);
}

impl ChangeFollower {
    /// Takes in what the latest image changed. To be called after each.
    pub fn follow(&mut self, surface: &Surface) {
        self.waiting.follow(surface);
    }

    /// A block was removed, or put there, by hand.
    pub fn follow_block(&mut self, key: BlockKey) {
        self.waiting.has_changed(key);
    }

    /// All listeners have these points of a block.
    pub fn know(&mut self, key: BlockKey, points: &[SurfacePoint], grid: &VoxelGrid) {
        if !points.is_empty() {
            self.told.insert(key, points.iter().map(|point| Told::of(point, grid)).collect());
        }
    }

    /// A listener begins with the surface as it is now: [`ChangeFollower::show`] has to follow for each block. What waits is told
    /// of in any case: a point that returns to where it was told would stay elsewhere for that listener, and one that goes
    /// before it was told would stay.
    pub fn begin_to_show(&mut self) {
        for key in self.waiting.iter() {
            self.told.get_mut(key).into_iter().for_each(make_stale);
        }
    }

    /// A listener begins with these points of a block.
    pub fn show(&mut self, key: BlockKey, points: &[SurfacePoint], grid: &VoxelGrid) {
        if self.is_waiting(key) {
            // Without a point, too: what is known may be in a store.
            let told = self.told.entry(key).or_default();
            told.extend(points.iter().map(|point| Told::of(point, grid)));
            make_stale(told);
        }
    }

    /// What listeners know of a block, as bytes for a store; none where they know nothing.
    #[must_use]
    pub fn known_bytes(&self, key: BlockKey) -> Vec<u8> {
        let told = self.told.get(&key).into_iter().flatten();
        told.flat_map(|told| {
            let ([low, high], [x, y, z]) = (told.index.to_le_bytes(), told.place);
            [low, high, x, y, z, told.marks]
        })
        .collect()
    }

    /// A block has left for a store, and what listeners know of it.
    pub fn left(&mut self, key: BlockKey) {
        self.told.remove(&key);
    }

    /// A block comes back from a store, with the bytes that [`ChangeFollower::known_bytes`] has given.
    pub fn come_back(&mut self, key: BlockKey, bytes: &[u8]) {
        let (told, _) = bytes.as_chunks::<TOLD_BYTES>();
        let told = told.iter().map(|&[low, high, x, y, z, marks]| Told {
            index: u16::from_le_bytes([low, high]),
            place: [x, y, z],
            marks,
        });
        match self.told.entry(key) {
            Entry::Vacant(entry) if !bytes.is_empty() => {
                entry.insert(told.collect());
            }
            Entry::Vacant(_) => {}
            Entry::Occupied(mut entry) => {
                // It was shown while it was away.
                entry.get_mut().extend(told);
                make_stale(entry.get_mut());
            }
        }
    }

    /// Whether a block waits to be looked at.
    #[must_use]
    pub fn is_waiting(&self, key: BlockKey) -> bool {
        self.waiting.contains(key)
    }

    /// The block that is looked at next.
    #[must_use]
    pub fn next_waiting(&self) -> Option<BlockKey> {
        self.waiting.next()
    }

    /// The block that would be looked at next comes after all others.
    pub fn postpone(&mut self) {
        self.waiting.postpone();
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
        while self.take_next(surface, rules, most_points, &mut changes) {}
        changes
    }

    /// The changes of the next block, behind those before it. Returns whether there was one that fits: [`ChangeFollower::take`],
    /// block by block, for a surface of which the next block and those around it must be brought into memory first.
    pub fn take_next(
        &mut self,
        surface: &Surface,
        rules: PointRules,
        most_points: usize,
        changes: &mut SurfaceChanges,
    ) -> bool {
        let Some(key) = self.next_waiting() else { return false };
        let mut points = std::mem::take(&mut self.points);
        points.clear();
        surface.points_of(key, rules, &mut points);
        let is_taken = self.take_block(key, &points, surface.grid(), most_points, changes);
        self.points = points;
        is_taken
    }

    fn take_block(
        &mut self,
        key: BlockKey,
        points: &[SurfacePoint],
        grid: &VoxelGrid,
        most_points: usize,
        changes: &mut SurfaceChanges,
    ) -> bool {
        let before = self.told.get(&key).map_or(&[][..], Vec::as_slice);
        let now: Vec<Told> = points.iter().map(|point| Told::of(point, grid)).collect();
        let told_of = |told: &Told| {
            let index = before.binary_search_by_key(&told.index, |told| told.index).ok();
            index.and_then(|index| before.get(index))
        };
        let is_news = |told: &&Told| told_of(told).is_none_or(|before| told.is_far_from(before));
        let has_gone =
            |told: &&Told| now.binary_search_by_key(&told.index, |told| told.index).is_err();
        let news = now.iter().filter(is_news).count() + before.iter().filter(has_gone).count();
        let taken = changes.updated.len() + changes.removed.len();
        if taken > 0 && taken + news > most_points {
            return false;
        }
        let told: Vec<Told> = now
            .iter()
            .zip(points)
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
        self.waiting.done();
        if told.is_empty() {
            self.told.remove(&key);
        } else {
            self.told.insert(key, told);
        }
        true
    }

    /// The memory taken, in bytes.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        let told = self.told.values().map(|told| told.capacity() * size_of::<Told>());
        told.sum::<usize>()
            + self.told.capacity() * size_of::<(BlockKey, Vec<Told>)>()
            + self.waiting.memory_bytes()
            + self.points.capacity() * size_of::<SurfacePoint>()
    }
}
