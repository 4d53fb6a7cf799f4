//! What is known of each place in the map: was it seen free, does something stand there for long.
//!
//! A voxel is judged once a cycle. Where a point of the static scene ends there it is a **hit**; where only
//! rays go through, from the camera to points farther on, it is a **pass**. A hit outweighs any number of
//! passes of its cycle, for rays that graze a surface pass through the voxels that it lies in (the
//! discretisation of Hornung et al., "OctoMap", 2013, section 5.1). Points of moving objects are neither:
//! they say nothing about the background, and must not make one.

mod table;
#[cfg(test)]
mod tests;

use geometry::{Stamp, VoxelGrid, VoxelKey, VoxelRay};
use nalgebra::Point3;

use self::table::CellTable;

/// Cycles in which a place was passed before it counts as free. One may be a depth that was wrong, two
/// may come from one depth image used for two scans.
const MIN_PASSES: u16 = 3;
/// A free place is hit in fewer cycles than one in so many: what noise throws there, not what stands.
const PASSES_PER_HIT_WHERE_FREE: u16 = 15;
/// A place of the background is hit at least once in so many cycles: the surface's own voxels in all of
/// them, those beside it as often as the noise of depth throws a mean over the border.
const PASSES_PER_HIT_IN_BACKGROUND: u16 = 5;
/// Hits below which nothing is background, as for [`MIN_PASSES`].
const MIN_HITS: u16 = 3;
/// Counts are halved when they reach this sum, so that a place which changes is believed after some
/// 10 s at 7 Hz, and a chair that was moved is forgotten.
const MEMORY_CYCLES: u16 = 64;
/// A ray stops so many voxels before its end: the point is a mean over a voxel, and depth noise throws
/// some points a voxel behind the surface.
const END_MARGIN_VOXELS: f64 = 2.0;
/// A pass counts where the ray comes nearer to the voxel's middle than this share of the edge: the ball
/// within the voxel. A ray through a corner says little of what is in the middle.
const PASS_RADIUS_VOXELS: f64 = 0.5;

/// When so much time has passed since the start, 24 days, the start is moved: the milliseconds have 32 bits.
const LONGEST_MS: f64 = (1_u32 << 31) as f64;
/// How far back times are told apart then, 12 days: longer than any `min_background_s`.
const TOLD_APART_MS: f64 = (1_u32 << 30) as f64;

/// What the evidence says of a place.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Known {
    /// Nothing, or not enough.
    Unknown,
    /// It was seen free, cycle after cycle: what stands there now has come.
    Free,
    /// Something has stood there for long.
    Background,
}

/// For how long something has stood in a place of the background.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Stay {
    /// From the first time that it was met to the last, in seconds.
    pub lasted_s: f64,
    /// When it was met last.
    pub last_met: Stamp,
}

/// Bounded evidence over the voxels of the map frame.
#[derive(Clone, Debug)]
pub struct Evidence {
    grid: VoxelGrid,
    reach_m: f64,
    min_background_ms: u32,
    table: CellTable,
    start: Option<Stamp>,
    now_ms: u32,
}

/// How an [`Evidence`] is laid out.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct EvidenceLimits {
    /// The voxels.
    pub grid: VoxelGrid,
    /// Farther from the camera than this nothing is recorded.
    pub reach_m: f64,
    /// A place is background only so long after it was first hit.
    pub min_background_s: f64,
    /// Voxels kept at most; the ones longest unseen are dropped first.
    pub max_voxels: usize,
}

impl Evidence {
    /// Nothing known yet. The limits are those of a validated configuration.
    #[must_use]
    pub fn new(limits: &EvidenceLimits) -> Self {
        Self {
            grid: limits.grid,
            reach_m: limits.reach_m,
            min_background_ms: (limits.min_background_s * 1e3) as u32,
            table: CellTable::new(limits.max_voxels),
            start: None,
            now_ms: 0,
        }
    }

    /// Voxels that something is known of.
    #[must_use]
    pub fn voxels(&self) -> usize {
        self.table.len()
    }

    /// The bound on the memory taken, in bytes.
    #[must_use]
    pub fn max_bytes(&self) -> usize {
        self.table.max_bytes()
    }

    /// Whether hardly anything ever ended in a place, and no surface is beside it.
    #[must_use]
    pub fn is_untouched(&self, point_in_map: &Point3<f64>) -> bool {
        let key = self.voxel(point_in_map).and_then(table::key_of);
        let hits = key.and_then(|key| self.table.get(key)).map_or(0, |cell| cell.hits);
        hits < MIN_HITS && !self.is_beside_surface(point_in_map)
    }

    /// What is known of the place of a point of the map.
    #[must_use]
    pub fn known(&self, point_in_map: &Point3<f64>) -> Known {
        self.known_at(self.voxel(point_in_map))
    }

    /// For how long something has stood in a place; `None` where that is no background.
    #[must_use]
    pub fn stay(&self, point_in_map: &Point3<f64>) -> Option<Stay> {
        let voxel = self.voxel(point_in_map)?;
        let cell = self.table.get(table::key_of(voxel)?)?;
        let is_background = self.known_of(cell) == Known::Background;
        is_background.then_some(Stay {
            lasted_s: f64::from(cell.last_hit_ms.saturating_sub(cell.first_hit_ms)) / 1e3,
            last_met: self.start?.plus_seconds(f64::from(cell.last_hit_ms) / 1e3),
        })
    }

    /// Whether one of the 26 voxels around a place is of a surface: background, or what may become so. A
    /// surface's own voxels are not all hit in each cycle where the pose is unsure or the rig moves, and rays
    /// that graze it pass them; so a place beside one is free only for what hangs together with more.
    #[must_use]
    pub fn is_beside_surface(&self, point_in_map: &Point3<f64>) -> bool {
        self.is_near_surface(point_in_map, 1)
    }

    /// The same of the voxels no more than `steps` away along each axis.
    #[must_use]
    pub fn is_near_surface(&self, point_in_map: &Point3<f64>, steps: i32) -> bool {
        let Some(voxel) = self.voxel(point_in_map) else { return false };
        voxel.within(steps).any(|beside| beside != voxel && self.is_surface_at(beside))
    }

    fn is_surface_at(&self, voxel: VoxelKey) -> bool {
        /// A single hit may be noise.
        const MIN_SURFACE_HITS: u16 = 2;
        table::key_of(voxel).and_then(|key| self.table.get(key)).is_some_and(|cell| {
            cell.hits >= MIN_SURFACE_HITS && cell.hits * PASSES_PER_HIT_IN_BACKGROUND >= cell.passes
        })
    }

    fn known_at(&self, voxel: Option<VoxelKey>) -> Known {
        let cell = voxel.and_then(table::key_of).and_then(|key| self.table.get(key));
        cell.map_or(Known::Unknown, |cell| self.known_of(cell))
    }

    fn known_of(&self, cell: &table::Cell) -> Known {
        if cell.passes >= MIN_PASSES && cell.hits * PASSES_PER_HIT_WHERE_FREE <= cell.passes {
            return Known::Free;
        }
        let for_long = self.now_ms.saturating_sub(cell.first_hit_ms) >= self.min_background_ms;
        if for_long
            && cell.hits >= MIN_HITS
            && cell.hits * PASSES_PER_HIT_IN_BACKGROUND >= cell.passes
        {
            return Known::Background;
        }
        Known::Unknown
    }

    /// Sets the time. What is known stays, however long ago it was learned.
    pub fn begin_cycle(&mut self, stamp: Stamp) {
        let start = self.start.get_or_insert(stamp);
        let elapsed_ms = stamp.seconds_since(*start) * 1e3;
        if elapsed_ms >= LONGEST_MS {
            let later_ms = (elapsed_ms - TOLD_APART_MS) as i64;
            let later_ns = later_ms.saturating_mul(1_000_000);
            *start = Stamp::from_nanos(start.as_nanos().saturating_add(later_ns));
            self.table.start_later(u32::try_from(later_ms).unwrap_or(u32::MAX));
        }
        // The cast saturates: a time before the start is the start.
        self.now_ms = (stamp.seconds_since(*start) * 1e3) as u32;
        self.table.begin_cycle();
    }

    /// Records one cycle: where static points end, where moving ones do, and what the rays to all of
    /// them pass.
    pub fn record(
        &mut self,
        camera_in_map: &Point3<f64>,
        points_in_map: &[Point3<f64>],
        is_dynamic: &[bool],
    ) {
        let within = |point: &Point3<f64>, reach_m: f64| (point - camera_in_map).norm() <= reach_m;
        for (point, &dynamic) in points_in_map.iter().zip(is_dynamic) {
            if within(point, self.reach_m)
                && let Some(key) = self.voxel(point).and_then(table::key_of)
            {
                self.end_at(key, dynamic);
            }
        }
        for point in points_in_map {
            self.pass(camera_in_map, point);
        }
    }

    /// Takes places for free at once: the camera would have seen what stands there now.
    pub fn take_for_free<'a>(&mut self, points_in_map: impl IntoIterator<Item = &'a Point3<f64>>) {
        for point in points_in_map {
            let key = self.voxel(point).and_then(table::key_of);
            if let Some(cell) = key.and_then(|key| self.table.entry(key)) {
                cell.passes = cell.passes.max(MIN_PASSES);
                cell.hits = 0;
            }
        }
    }

    /// Takes a place for one of which nothing is known.
    pub fn forget(&mut self, point_in_map: &Point3<f64>) {
        let key = self.voxel(point_in_map).and_then(table::key_of);
        if let Some(cell) = key.and_then(|key| self.table.entry(key)) {
            (cell.hits, cell.passes) = (0, 0);
        }
    }

    /// Takes places for background at once: what stands there was followed, and has stopped for good.
    pub fn adopt<'a>(&mut self, points_in_map: impl IntoIterator<Item = &'a Point3<f64>>) {
        let long_ago_ms = self.now_ms.saturating_sub(self.min_background_ms);
        for point in points_in_map {
            let key = self.voxel(point).and_then(table::key_of);
            if let Some(cell) = key.and_then(|key| self.table.entry(key)) {
                cell.hits = MEMORY_CYCLES / 2;
                cell.passes = 0;
                (cell.first_hit_ms, cell.last_hit_ms) = (long_ago_ms, self.now_ms);
            }
        }
    }

    fn voxel(&self, point_in_map: &Point3<f64>) -> Option<VoxelKey> {
        // The casts saturate; what lies beyond the table's keys has none.
        let [x, y, z]: [f64; 3] = point_in_map.coords.into();
        (x.is_finite() && y.is_finite() && z.is_finite())
            .then(|| [x, y, z].map(|value_m| (value_m / self.grid.edge_m()).floor() as i32))
            .map(|[x, y, z]| VoxelKey { x, y, z })
    }

    fn end_at(&mut self, key: u64, dynamic: bool) {
        let (mark, now_ms) = (self.table.mark(), self.now_ms);
        let Some(cell) = self.table.entry(key) else { return };
        if cell.seen == mark {
            return;
        }
        cell.seen = mark;
        if dynamic {
            return;
        }
        if cell.hits == 0 {
            cell.first_hit_ms = now_ms;
        }
        cell.hits += 1;
        cell.last_hit_ms = now_ms;
        cell.fade();
    }

    fn pass(&mut self, camera_in_map: &Point3<f64>, point_in_map: &Point3<f64>) {
        let starts_in_reach = self.voxel(camera_in_map).and_then(table::key_of).is_some();
        let Some(ray) = VoxelRay::between(camera_in_map, point_in_map) else { return };
        let edge_m = self.grid.edge_m();
        // A point beyond the reach still says that the way to it is free, as far as the reach goes.
        let end_m = (ray.length_m() - END_MARGIN_VOXELS * edge_m).min(self.reach_m);
        if !starts_in_reach || end_m <= 0.0 {
            return;
        }
        let radius_m = PASS_RADIUS_VOXELS * edge_m;
        let mark = self.table.mark();
        for key in ray.cells(&self.grid, end_m) {
            // A middle behind the start or beyond the end was not passed.
            let (along_m, aside_m2) = ray.along_and_aside(&self.grid.middle_m(key));
            if along_m <= 0.0 || along_m >= end_m || aside_m2 > radius_m * radius_m {
                continue;
            }
            let Some(cell) = table::key_of(key).and_then(|key| self.table.entry(key)) else {
                continue;
            };
            if cell.seen != mark {
                cell.seen = mark;
                cell.passes += 1;
                cell.fade();
            }
        }
    }
}

impl table::Cell {
    /// Halves the counts when they are full.
    fn fade(&mut self) {
        if self.hits + self.passes >= MEMORY_CYCLES {
            self.hits /= 2;
            self.passes /= 2;
        }
    }
}
