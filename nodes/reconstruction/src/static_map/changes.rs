//! What listeners have to be told of: the voxels that are new, and those whose mean has moved.

#[cfg(test)]
mod tests;

use std::collections::VecDeque;

use geometry::{Cloud, VoxelGrid, VoxelKey};
use nalgebra::Point3;

use super::StaticMap;
use crate::MapChanges;

/// A listener that has been told of all changes has each mean within this share of the voxel's edge:
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

/// Where in its voxel a mean is, in 65535ths of the edge from the lower corner: all that has to be
/// remembered of what was told.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
struct Place([u16; 3]);

impl Place {
    fn of(mean: &Point3<f32>, key: VoxelKey, grid: &VoxelGrid) -> Self {
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
    /// All listeners know of the voxel, and were told that its mean is at `place`.
    is_told: bool,
    /// The voxel is in the queue.
    is_waiting: bool,
}

impl Told {
    fn tell(&mut self, place: Place) {
        *self = Self { place, is_told: true, is_waiting: false };
    }

    fn is_news(&self, place: Place) -> bool {
        !self.is_told || place.is_far_from(self.place)
    }
}

/// The voxels that points have come to, each once, in the order in which they first did: who waits longest is told of first.
/// Whether a mean has moved is looked at when its turn comes, so that a cycle pays next to nothing, and a voxel that is seen
/// again and again until then is told of once.
#[derive(Clone, Debug, Default)]
pub(super) struct Changes {
    waiting: VecDeque<VoxelKey>,
    is_incomplete: bool,
}

impl Changes {
    /// Points have come to the voxel.
    pub(super) fn touched(&mut self, key: VoxelKey, told: &mut Told) {
        if !told.is_waiting {
            told.is_waiting = true;
            self.waiting.push_back(key);
        }
    }

    pub(super) fn memory_bytes(&self) -> usize {
        self.waiting.capacity() * size_of::<VoxelKey>()
    }
}

impl StaticMap {
    /// Follows the changes from now on, for listeners that get the map as it is now, or later, by
    /// [`StaticMap::cloud_for_listeners`]. Costs by the voxels of the map, as that cloud does.
    pub fn follow_changes(&mut self) {
        for (key, voxel) in &mut self.voxels {
            voxel.told.tell(Place::of(&voxel.mean(), *key, &self.grid));
        }
        self.changes = Some(Changes::default());
    }

    /// What listeners know cannot be corrected by changes: follows anew, for listeners that need the whole map.
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
    /// would be elsewhere for this listener.
    pub fn cloud_for_listeners(&mut self) -> Cloud {
        for key in self.changes.iter().flat_map(|changes| &changes.waiting) {
            if let Some(voxel) = self.voxels.get_mut(key) {
                voxel.told.is_told = false;
            }
        }
        self.cloud()
    }

    /// The points of the next voxels, at most so many, that are new or have moved since they
    /// were last taken here (or since [`StaticMap::follow_changes`]), in the order in which they first changed;
    /// none when changes are not followed. What does not fit waits, and comes before what changes later. Frame
    /// and stamp are the map's.
    ///
    /// A point replaces the listener's point of the same voxel, which is `floor(coordinate / edge)`
    /// along each axis, taken in 64 bits: [`VoxelGrid::key`]. A mean lies in the voxel that it stands for.
    /// Once nothing waits, a listener that started with the whole map and has applied all changes since has
    /// every voxel and no other, and each mean within [`LISTENER_TOLERANCE_IN_EDGES`]. Clouds that were made between the same
    /// two cycles have the same stamp, and no voxel changes then: of two that have the same voxel the one with the later stamp
    /// is right.
    pub fn take_changes(&mut self, most_points: usize) -> MapChanges {
        let (mut updated, mut is_incomplete) = (Vec::new(), false);
        if let Some(changes) = &mut self.changes {
            is_incomplete = std::mem::take(&mut changes.is_incomplete);
            updated.reserve_exact(most_points.min(changes.waiting.len()));
            while updated.len() < most_points {
                let Some(key) = changes.waiting.pop_front() else { break };
                let Some(voxel) = self.voxels.get_mut(&key) else { continue };
                voxel.told.is_waiting = false;
                let mean = voxel.mean();
                let place = Place::of(&mean, key, &self.grid);
                if voxel.told.is_news(place) {
                    voxel.told.tell(place);
                    updated.push(mean);
                }
            }
        }
        let (updated, removed) = (self.cloud_of(updated), self.cloud_of(Vec::new()));
        MapChanges { updated, removed, is_incomplete, updated_colours: Vec::new() }
    }

    /// The voxels that wait to be looked at by [`StaticMap::take_changes`].
    #[must_use]
    pub fn waiting_changes(&self) -> usize {
        self.changes.as_ref().map_or(0, |changes| changes.waiting.len())
    }
}
