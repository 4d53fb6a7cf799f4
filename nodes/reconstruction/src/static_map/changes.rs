//! What listeners have to be told of: the voxels that are new, those whose mean has moved, and those that have
//! gone.

#[cfg(test)]
mod tests;

use std::collections::{HashMap, VecDeque};

use geometry::{BuildVoxelHasher, Cloud, VoxelGrid, VoxelKey};
use nalgebra::Point3;

use super::StaticMap;
use crate::tiles::TileError;

/// A listener that has been told of all changes holds each mean within this share of the voxel's edge:
/// 5 mm of 8 cm, the noise of one depth reading at 1.5 m.
pub const LISTENER_TOLERANCE_IN_EDGES: f64 = 1.0 / 16.0;

/// A mean that has moved by no more than this share since it was told of is not told of again. Half of the
/// tolerance: a listener may have come with a whole map that showed the mean at one end of the way, and then
/// it moves to the other one.
const UNTOLD_IN_EDGES: f64 = LISTENER_TOLERANCE_IN_EDGES / 2.0;

/// Steps of a voxel's edge in which a [`Place`] counts.
const STEPS: f64 = u16::MAX as f64;

/// The square of the way, in steps, that is not told of. Each end of the way is rounded by half a step an
/// axis, so that in space the way may be longer by the square root of 3.
const UNTOLD_STEPS_SQUARED: i64 = {
    let steps = (UNTOLD_IN_EDGES * STEPS) as i64 - 2;
    steps * steps
};

/// Where in its voxel a mean stands, in 65535ths of the edge from the lower corner: all that has to be
/// remembered of what was told, in six bytes that a voxel has to spare. Packed, so that two more bytes fit beside.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[repr(Rust, packed)]
pub(super) struct Place([u16; 3]);

impl Place {
    pub(super) fn of(mean: &Point3<f32>, key: VoxelKey, grid: &VoxelGrid) -> Self {
        let step = |coordinate: f32, cell: i32| {
            let share = f64::from(coordinate) / grid.edge_m() - f64::from(cell);
            // The cast saturates.
            (share * STEPS).round() as u16
        };
        Self([step(mean.x, key.x), step(mean.y, key.y), step(mean.z, key.z)])
    }

    /// Whether the way between the two has to be told of.
    fn is_far_from(self, other: Self) -> bool {
        let squares = self.0.into_iter().zip(other.0).map(|(a, b)| {
            let steps = i64::from(a) - i64::from(b);
            steps * steps
        });
        squares.sum::<i64>() > UNTOLD_STEPS_SQUARED
    }
}

/// What listeners know of a voxel. Means nothing while changes are not followed.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Told {
    place: Place,
    /// Two flags in one byte, so that the evidence has room in what a voxel takes.
    flags: u8,
}

/// All listeners know of the voxel, and were told that its mean stands at `place`.
const IS_TOLD: u8 = 1;
/// The voxel stands in the queue.
const IS_WAITING: u8 = 2;

impl Told {
    /// Nobody knows of the voxel as it is now, and it stands in the queue.
    const WAITING: Self = Self { place: Place([0; 3]), flags: IS_WAITING };

    /// The voxel leaves the memory. One that waits is told of at its turn, whatever listeners know: who gets the
    /// whole map meanwhile may see it elsewhere.
    pub(super) fn leave(&mut self) {
        if self.is_waiting() {
            *self = Self::WAITING;
        }
    }

    /// Appends it to the bytes of a tile.
    pub(super) fn push_to(self, bytes: &mut Vec<u8>) {
        bytes.push(self.flags);
        if self.flags & IS_TOLD != 0 {
            let Place(along) = self.place;
            bytes.extend(along.into_iter().flat_map(u16::to_le_bytes));
        }
    }

    /// As it was written; `next` gives the numbers behind the flags.
    pub(super) fn read<E>(flags: u8, mut next: impl FnMut() -> Result<u16, E>) -> Result<Self, E> {
        let flags = flags & (IS_TOLD | IS_WAITING);
        let place = match flags & IS_TOLD {
            0 => Place::default(),
            _ => Place([next()?, next()?, next()?]),
        };
        Ok(Self { place, flags })
    }

    pub(super) fn tell(&mut self, place: Place) {
        *self = Self { place, flags: IS_TOLD };
    }

    fn is_news(&self, place: Place) -> bool {
        self.flags & IS_TOLD == 0 || place.is_far_from(self.place)
    }

    fn is_waiting(&self) -> bool {
        self.flags & IS_WAITING != 0
    }
}

/// What a listener has to do to its copy of the map, as two clouds of the map's frame and stamp.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct MapChanges {
    /// Points that are new or have moved: each takes the place of the listener's point of its voxel.
    pub updated: Cloud,
    /// Where voxels have gone, each by the mean that it had last: the listener's point of its voxel goes. The
    /// listener may have none.
    pub removed: Cloud,
    /// More voxels went than could be remembered, `max_voxels`: listeners need the whole map.
    pub is_incomplete: bool,
}

/// The voxels that points have come to, or that have gone, each once, in the order in which they first did:
/// who waits longest is told of first. Whether a mean has moved is looked at when its turn comes, so that a
/// cycle pays next to nothing, and a voxel that is seen again and again until then is told of once.
#[derive(Clone, Debug, Default)]
pub(super) struct Changes {
    waiting: VecDeque<VoxelKey>,
    /// Those in the queue that are not in the map any more, with their last means. Looked up by key alone.
    gone: HashMap<VoxelKey, Point3<f32>, BuildVoxelHasher>,
    is_incomplete: bool,
}

impl Changes {
    /// Points have come to the voxel.
    pub(super) fn touched(&mut self, key: VoxelKey, told: &mut Told) {
        if !told.is_waiting() {
            told.flags |= IS_WAITING;
            self.waiting.push_back(key);
        }
    }

    /// What listeners know of a voxel that the map has not had until now, or has again.
    pub(super) fn told_of_new(&mut self, key: VoxelKey) -> Told {
        let is_back = !self.gone.is_empty() && self.gone.remove(&key).is_some();
        if is_back { Told::WAITING } else { Told::default() }
    }

    /// The voxel has gone.
    pub(super) fn removed(&mut self, key: VoxelKey, told: &Told, mean: Point3<f32>) {
        self.gone.insert(key, mean);
        if !told.is_waiting() {
            self.waiting.push_back(key);
        }
    }

    /// Those that have gone and that listeners have not been told of.
    pub(super) fn gone(&self) -> usize {
        self.gone.len()
    }

    pub(super) fn memory_bytes(&self) -> usize {
        let gone = self.gone.capacity() * size_of::<(VoxelKey, Point3<f32>)>();
        self.waiting.capacity() * size_of::<VoxelKey>() + gone
    }
}

impl StaticMap {
    /// Follows the changes from now on, for listeners that get the map as it is now, or later, by
    /// [`StaticMap::cloud_for_listeners`]. Costs by the voxels of the map, as that cloud does.
    pub fn follow_changes(&mut self) {
        for (key, voxel) in &mut self.voxels {
            voxel.told.tell(Place::of(&voxel.mean(), *key, &self.grid));
        }
        self.follow_spilled();
        self.changes = Some(Changes::default());
    }

    /// More went than may be remembered: follows anew, for listeners that need the whole map.
    pub(super) fn follow_changes_anew(&mut self) {
        self.follow_changes();
        self.changes = Some(Changes { is_incomplete: true, ..Changes::default() });
    }

    /// There are no listeners any more.
    pub fn unfollow_changes(&mut self) {
        self.changes = None;
    }

    /// The map as a cloud, as [`StaticMap::cloud`], for a listener to start with: those changes that it
    /// shows and that were not told yet are told in any case, or a mean that returns to where it was told
    /// would stand elsewhere for this listener. Where a tile is lost, the cloud is what is left.
    ///
    /// # Errors
    /// When a spilled tile cannot be read for now: without its points a listener would take it for empty.
    pub fn cloud_for_listeners(&mut self) -> Result<Cloud, TileError> {
        let points_m = self.whole_or_failing_tile()?;
        for key in self.changes.iter().flat_map(|changes| &changes.waiting) {
            if let Some(voxel) = self.voxels.get_mut(key) {
                voxel.told.flags &= !IS_TOLD;
            }
        }
        Ok(self.cloud_of(points_m))
    }

    /// The points of the next voxels, at most so many, that are new or have moved, or have gone, since they
    /// were last taken here (or since [`StaticMap::follow_changes`]), in the order in which they first changed;
    /// none when changes are not followed. What does not fit waits, and comes before what changes later. Frame
    /// and stamp are the map's.
    ///
    /// A point takes the place of the listener's point of the same voxel, which is `floor(coordinate / edge)`
    /// along each axis, taken in 64 bits: [`VoxelGrid::key`]. A mean lies in the voxel that it stands for.
    /// Once nothing waits, a listener that started with the whole map and has applied all changes since has
    /// every voxel and no other, and each mean within [`LISTENER_TOLERANCE_IN_EDGES`].
    ///
    /// A voxel stands in one of the two clouds at most. A voxel that goes and comes back between two of these
    /// calls stands in neither as gone. Clouds that were made between the same two cycles have the same stamp, and
    /// no voxel changes then: of two that tell of the same voxel the one with the later stamp is right.
    pub fn take_changes(&mut self, most_points: usize) -> MapChanges {
        self.begin_round();
        let (mut updated, mut removed, mut unreadable) = (Vec::new(), Vec::new(), Vec::new());
        let mut is_incomplete = self.take_is_incomplete();
        let waiting = self.waiting_changes();
        updated.reserve_exact(most_points.min(waiting));
        while updated.len() + removed.len() + unreadable.len() < most_points {
            let Some(changes) = &mut self.changes else { break };
            let Some(key) = changes.waiting.pop_front() else { break };
            if let Some(mean) = changes.gone.remove(&key) {
                removed.push(mean);
                continue;
            }
            // It may have been spilled since.
            let is_here = self.fetch(key);
            if self.take_is_incomplete() {
                // Its tile was lost, and nothing waits any more: the whole map has to tell.
                is_incomplete = true;
                unreadable.clear();
            } else if !is_here {
                unreadable.push(key);
                continue;
            }
            let Some(voxel) = self.voxels.get_mut(&key) else { continue };
            voxel.told.flags &= !IS_WAITING;
            let mean = voxel.mean();
            let place = Place::of(&mean, key, &self.grid);
            if voxel.told.is_news(place) {
                voxel.told.tell(place);
                updated.push(mean);
            }
        }
        if let Some(changes) = &mut self.changes {
            changes.waiting.extend(unreadable);
        }
        MapChanges {
            updated: self.cloud_of(updated),
            removed: self.cloud_of(removed),
            is_incomplete,
        }
    }

    fn take_is_incomplete(&mut self) -> bool {
        self.changes.as_mut().is_some_and(|changes| std::mem::take(&mut changes.is_incomplete))
    }

    /// The voxels that wait to be looked at by [`StaticMap::take_changes`].
    #[must_use]
    pub fn waiting_changes(&self) -> usize {
        self.changes.as_ref().map_or(0, |changes| changes.waiting.len())
    }
}
