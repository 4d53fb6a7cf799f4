//! The method `free_space`: what moves is what is in observed free space.
//!
//! A place before all that the depth image shows is free; what is there later is newly occupied. What is behind an object
//! that goes away was never observed free: it is background that becomes visible, not an object.

mod alignment;
mod classes;
mod groups;
#[cfg(test)]
mod tests;

use geometry::{DetectedCycle, Stamp, VoxelGrid, VoxelKey};
use nalgebra::Point3;
use volume::{DepthInput, DepthNoise, DepthRange, DepthView, Occupancy};

use self::classes::Known;
use crate::continuous::in_map;
use crate::cycle_points::CyclePoints;
use crate::earlier_cycles::{EarlierCycles, StaticPoint, StaticPoints, Voxels};
use crate::floor::Floor;
use crate::growth::{Candidates, PointClass};
use crate::recent_views::RecentViews;
use crate::seeds::{InFreeSpace, KnownOfPoints, seeds_of};
use crate::segmenter::{Judged, SegmenterError};
use crate::tracking::{CycleView, MIN_BIRTH_POINTS, MovingGroup, Tracker, TrackerOutput};
use crate::view::View;
use crate::{FreeSpaceConfig, Step};

/// A stamp so much before the last one is the start of another run, not a late message.
const ANOTHER_RUN_S: f64 = 1.0;

/// What was put down and left by who moved it is static after this share of the longest stop: by default after 10 s, long enough for
/// who puts a thing down to take it up again.
const LEFT_SHARE: f64 = 1.0 / 6.0;

/// The points that were not there before and are beside no surface, but for those of which fewer are connected than a track begins with: noise
/// throws such off a surface that is far away.
fn apart_from_surfaces(classes: &[PointClass], candidates: &Candidates<'_>) -> Vec<usize> {
    let is_apart = |point: usize| classes[point].is_apart_from_surfaces();
    let apart: Vec<usize> = (0..classes.len()).filter(|&point| is_apart(point)).collect();
    let mut groups = candidates.grown_from(&apart, is_apart);
    groups.retain(|group| group.len() >= MIN_BIRTH_POINTS);
    groups.concat()
}

/// Finds the points that move by what earlier cycles saw.
#[derive(Clone, Debug)]
pub struct FreeSpaceSegmenter {
    config: FreeSpaceConfig,
    grid: VoxelGrid,
    occupancy: Occupancy,
    depth_view: DepthView,
    tracker: Tracker,
    view: View,
    recent_views: RecentViews,
    earlier_cycles: EarlierCycles,
    floor: Option<Floor>,
    /// Where objects had points a cycle ago, in the map.
    last_object_voxels: Voxels,
    in_free_space: InFreeSpace,
    last: Option<Stamp>,
    /// Whether the frame that does not jump was another than the map in the last cycle.
    was_apart: bool,
    evidence_is_whole: bool,
}

impl FreeSpaceSegmenter {
    /// One that has seen nothing, of cycles whose points are means of the voxels of `grid`.
    ///
    /// # Errors
    /// When a parameter is out of its range.
    pub fn new(config: FreeSpaceConfig, grid: VoxelGrid) -> Result<Self, SegmenterError> {
        // What is farther shows that it is free up to here.
        let range = DepthRange { max_m: config.evidence_reach_m as f32, ..DepthRange::default() };
        Ok(Self {
            config,
            grid,
            occupancy: Occupancy::new(config.occupancy(grid.edge_m()))?,
            depth_view: DepthView::new(range, DepthNoise::default())?,
            tracker: Tracker::new(config),
            view: View::default(),
            recent_views: RecentViews::new(grid.edge_m()),
            earlier_cycles: EarlierCycles::default(),
            floor: None,
            last_object_voxels: Voxels::default(),
            in_free_space: InFreeSpace::default(),
            last: None,
            was_apart: false,
            evidence_is_whole: true,
        })
    }

    /// Whether all that the last cycle's image showed has joined the evidence; otherwise the bound was met.
    #[must_use]
    pub fn evidence_is_whole(&self) -> bool {
        self.evidence_is_whole
    }

    /// Blocks of evidence held now.
    #[must_use]
    pub fn evidence_blocks(&self) -> usize {
        self.occupancy.blocks()
    }

    /// Judges the points of a cycle, whose pose and zones are checked, and learns from it.
    ///
    /// "Map" is here the frame that does not jump when the map is corrected; tracks are reported where the map has them.
    pub fn step(&mut self, cycle: &DetectedCycle, observe: &mut impl FnMut(Step)) -> Judged {
        let stamp = cycle.reduced_cloud.stamp;
        // A scanner that is faster than the camera makes several cycles of one image, which is seen once all the same.
        let is_new_image = self.last != Some(stamp);
        self.begin(stamp, cycle);
        if is_new_image {
            self.in_free_space.begin_image();
        }
        let points = &CyclePoints::of(cycle, &self.grid);
        self.view.widen(points);
        self.floor = self.floor_under(points);
        let known = self.known_places(points);
        let mut classes = self.classes(points, &known);
        self.leave_what_a_turn_explains(points, &mut classes);
        let moving_in_place = self.find_moving_in_place(points);
        for &point in &moving_in_place {
            self.occupancy.take_for_free(points.voxels[point]);
            classes[point] = PointClass::InFreeSpace;
        }
        observe(Step::Evidence);

        let candidates = Candidates::new(&classes, &points.voxels);
        let expected = self.tracker.predict(stamp);
        let has_stopped = |point: usize| self.occupancy.cell(points.voxels[point]).has_stopped();
        let continues_background =
            |point: usize| self.continues_background(points.voxels[point], &classes, &candidates);
        let known_of_points = KnownOfPoints {
            classes: &classes,
            has_stopped: &has_stopped,
            continues_background: &continues_background,
        };
        let before = &self.in_free_space;
        let seeds = seeds_of(&self.config, points, known_of_points, &candidates, &expected, before);
        observe(Step::Angular);

        let mut groups = self.groups(points, &classes, &candidates, (&seeds, &moving_in_place));
        self.hold(points, &mut groups, stamp);
        observe(Step::DepthClustering);

        let (view, floor, cell_m) = (self.view, self.floor, self.grid.edge_m());
        let seen = CycleView { points, view, floor, cell_m };
        let is_beside_stopped = |point: usize| {
            let mut beside = points.voxels[point].with_neighbours();
            beside.any(|voxel| self.occupancy.cell(voxel).has_stopped())
        };
        let TrackerOutput { mut tracks, settled, left } =
            self.tracker.update(&seen, &groups, &is_beside_stopped);
        if let Some(map_from_continuous) = &cycle.map_from_continuous {
            tracks.iter_mut().for_each(|track| *track = in_map(track, map_from_continuous));
        }
        observe(Step::Tracking);

        left.iter().for_each(|&point| self.occupancy.leave(points.voxels[point]));
        let mut is_dynamic = vec![false; classes.len()];
        for &point in groups.iter().flat_map(|group| &group.points) {
            is_dynamic[point] = true;
        }
        for point in self.kept_from_last_cycle(&known, &classes, &points.voxels) {
            is_dynamic[point] = true;
        }
        for &point in &settled {
            is_dynamic[point] = false;
        }
        // Without the points that were kept from the last cycle: they would be kept for ever.
        let of_groups = groups.iter().flat_map(|group| &group.points);
        let of_groups = of_groups.map(|&point| points.voxels[point]).collect();
        let objects_before = std::mem::replace(&mut self.last_object_voxels, of_groups);
        let newly_occupied = (0..classes.len())
            .filter(|&point| is_dynamic[point] && classes[point] == PointClass::SeenEmpty)
            .map(|point| points.voxels[point]);
        newly_occupied.for_each(|voxel| self.occupancy.take_for_free(voxel));
        self.in_free_space.see(points, &classes);
        if is_new_image {
            self.record(points, &is_dynamic);
        }
        // What is newly occupied is not background before it has stayed: it counts as a hit in the evidence, and is left
        // out of the static scene until the evidence says background.
        for point in apart_from_surfaces(&classes, &candidates) {
            is_dynamic[point] = true;
        }
        for &point in &settled {
            is_dynamic[point] = false;
        }
        let long_ago = stamp.plus_seconds(-self.config.min_background_s);
        for &point in &settled {
            self.occupancy.take_for_occupied(points.voxels[point], long_ago);
        }
        let retracted_m = self.retract(
            (points, &classes),
            (&groups, &moving_in_place, &is_dynamic),
            &objects_before,
        );
        observe(Step::Evidence);
        let floor_in_rig = floor.map(|floor| floor.seen_from(&cycle.continuous_from_rig()));
        Judged { is_dynamic, tracks, in_zone: seeds.in_zone, retracted_m, floor_in_rig }
    }

    /// What an object that was found in this cycle left in earlier ones, in the map; see [`crate::earlier_cycles`]. Of one that moves in
    /// its place also where it is: until now that was background.
    fn retract(
        &mut self,
        (points, classes): (&CyclePoints<'_>, &[PointClass]),
        (groups, moving_in_place, is_dynamic): (&[MovingGroup], &[usize], &[bool]),
        objects_before: &Voxels,
    ) -> Vec<Point3<f32>> {
        let of_groups =
            groups.iter().map(|group| group.points.iter().map(|&point| points.voxels[point]));
        let of_static = self.static_points(points, classes, is_dynamic);
        let retracted = match self.recent_views.latest() {
            Some(view) => {
                let (seen, edge_m) = ((view, &of_static), self.grid.edge_m());
                self.earlier_cycles.of_objects(of_groups, objects_before, seen, edge_m)
            }
            None => Vec::new(),
        };
        for point in &retracted {
            self.occupancy.forget(self.grid.key(point));
        }
        self.earlier_cycles.remember(of_static);
        let map_from_continuous = points.cycle.map_from_continuous.unwrap_or_default();
        let in_place = moving_in_place.iter().map(|&point| &points.in_map[point]);
        let all = retracted.iter().chain(in_place);
        all.map(|point| (map_from_continuous * point).cast()).collect()
    }

    fn static_points(
        &self,
        points: &CyclePoints<'_>,
        classes: &[PointClass],
        is_dynamic: &[bool],
    ) -> StaticPoints {
        let mut of_static = StaticPoints::default();
        for point in (0..classes.len()).filter(|&point| !is_dynamic[point]) {
            let (voxel, in_map) = (points.voxels[point], &points.in_map[point]);
            if classes[point] == PointClass::Unknown {
                of_static.of_unknown.push(StaticPoint { voxel, in_map_m: in_map.cast() });
            }
            if !self.is_on_floor(in_map) {
                of_static.above_floor.push(voxel);
            }
        }
        of_static
    }

    /// Whether a point is no more than a voxel above the floor: there it may be of the floor by the noise of depths.
    fn is_on_floor(&self, point: &Point3<f64>) -> bool {
        self.floor.is_some_and(|floor| floor.height_above_m(point) <= self.grid.edge_m())
    }

    fn begin(&mut self, stamp: Stamp, cycle: &DetectedCycle) {
        // Detection has begun anew, or has forgotten what it saw: the frame that does not jump is the map again.
        let is_apart = cycle.map_from_continuous.is_some();
        let is_another_frame = std::mem::replace(&mut self.was_apart, is_apart) && !is_apart;
        let is_another_run =
            self.last.is_some_and(|last| last.seconds_since(stamp) > ANOTHER_RUN_S);
        if is_another_run || is_another_frame {
            self.occupancy.clear();
            self.tracker.forget();
            (self.view, self.floor) = (View::default(), None);
            self.last_object_voxels.clear();
            self.recent_views.clear();
            self.earlier_cycles.clear();
            self.in_free_space = InFreeSpace::default();
        }
        self.last = Some(stamp);
        self.occupancy.begin_cycle(stamp);
    }

    /// Learns from a cycle: where static points end, and what is free before all that the image shows.
    fn record(&mut self, points: &CyclePoints<'_>, is_dynamic: &[bool]) {
        let cycle = points.cycle;
        let filled = cycle.depth.as_ref().map(|frame| {
            let map_from_camera = cycle.continuous_from_rig() * cycle.setup.mounts.rig_from_camera;
            // Without a mask: space is free before what moves as before anything else.
            self.depth_view.fill_tiles(&DepthInput::new(frame, &map_from_camera))
        });
        if matches!(filled, Some(Ok(()))) {
            self.recent_views.remember(&self.depth_view);
        } else {
            // Without an image, or when the mount's pose is not finite, nothing is observed free.
            self.depth_view.clear();
        }
        let is_hit = |point: &usize| !is_dynamic[*point] && self.is_in_reach(points, *point);
        let hits = (0..points.count()).filter(is_hit).map(|point| points.voxels[point]);
        let hits: Vec<VoxelKey> = hits.collect();
        let update = self.occupancy.integrate(&self.depth_view, hits);
        self.evidence_is_whole = !update.is_incomplete;
    }

    /// Points where an object had some a cycle ago, and of whose places nothing else is known: the last sliver of one that
    /// leaves the view, a foot that was taken for floor in one cycle. They belong to the object for this one cycle.
    fn kept_from_last_cycle(
        &self,
        known: &[Known],
        classes: &[PointClass],
        voxels: &[VoxelKey],
    ) -> Vec<usize> {
        let is_kept = |&point: &usize| {
            matches!(classes[point], PointClass::Unknown | PointClass::Background)
                && self.last_object_voxels.contains(&voxels[point])
                && known[point] != Known::Background
        };
        (0..classes.len()).filter(is_kept).collect()
    }

    /// Notes in the evidence where objects are now, and which of them have stayed in their places, seen or unseen, since long ago.
    fn hold(&mut self, points: &CyclePoints<'_>, groups: &mut [MovingGroup], now: Stamp) {
        let max_stop_s = points.cycle.setup.max_stop_s;
        for group in groups {
            let has_stayed = |point: &&usize| {
                let voxel = points.voxels[**point];
                let since = self.occupancy.hold_moving(voxel);
                let is_left = self.occupancy.cell(voxel).is_left();
                let longest_s = if is_left { LEFT_SHARE * max_stop_s } else { max_stop_s };
                since.is_some_and(|since| now.seconds_since(since) >= longest_s)
            };
            group.has_stayed =
                2 * group.points.iter().filter(has_stayed).count() >= group.points.len();
        }
    }
}
