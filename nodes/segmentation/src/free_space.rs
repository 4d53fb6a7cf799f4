//! The method `free_space`: what moves is what stands where free space was seen.
//!
//! A ray that passed a place says that it was free; what stands there later has come. What is behind an
//! object that goes away was never seen free: it is background uncovered, not an object.

#[cfg(test)]
mod tests;

use std::collections::HashSet;

use geometry::{AS_NEAR, DetectedCycle, LONGEST_STAY_S, Stamp, View, VoxelGrid, VoxelKey};
use nalgebra::{Point3, distance};

use crate::evidence::{Evidence, EvidenceLimits, Known};
use crate::floor::Floor;
use crate::growth::{Candidates, Standing};
use crate::recent_views::RecentViews;
use crate::seeds::{Seeds, seeds_of};
use crate::segmenter::Judged;
use crate::tracking::{CycleCloud, Followings, MovingGroup, Tracker};
use crate::view;
use crate::{FreeSpaceConfig, Step};

/// A stamp so much before the last one is the start of another run, not a late message.
const ANOTHER_RUN_S: f64 = 1.0;

/// What comes into range goes on from what was seen of its surface before. A camera at 0.5 m/s and 7 Hz comes a
/// voxel of the thesis closer in a cycle, and a surface is known by two.
const BORDER_VOXELS: i32 = 3;

/// Tells moving points by what earlier cycles saw.
#[derive(Clone, Debug)]
pub struct FreeSpaceSegmenter {
    config: FreeSpaceConfig,
    grid: VoxelGrid,
    evidence: Evidence,
    tracker: Tracker,
    view: View,
    recent_views: RecentViews,
    floor: Option<Floor>,
    /// Where objects had points a cycle ago, in the map.
    of_objects: HashSet<VoxelKey>,
    last: Option<Stamp>,
}

impl FreeSpaceSegmenter {
    /// One that has seen nothing, of cycles whose points are means of the voxels of `grid`; `config` has been validated.
    #[must_use]
    pub fn new(config: FreeSpaceConfig, grid: VoxelGrid) -> Self {
        Self {
            config,
            grid,
            evidence: evidence_of(&config, grid),
            tracker: Tracker::new(config),
            view: View::default(),
            recent_views: RecentViews::default(),
            floor: None,
            of_objects: HashSet::new(),
            last: None,
        }
    }

    /// The bound on the memory that the evidence takes, in bytes.
    #[must_use]
    pub fn max_evidence_bytes(&self) -> usize {
        self.evidence.max_bytes()
    }

    /// Voxels of evidence held now.
    #[must_use]
    pub fn evidence_voxels(&self) -> usize {
        self.evidence.voxels()
    }

    /// Judges the points of a cycle, whose pose and zones are checked, and learns from it.
    pub fn step(&mut self, cycle: &DetectedCycle, observe: &mut impl FnMut(Step)) -> Judged {
        let stamp = cycle.reduced_cloud.stamp;
        self.begin(stamp);
        let points_in_map: Vec<Point3<f64>> = cycle
            .reduced_cloud
            .points_m
            .iter()
            .map(|point| cycle.map_from_rig * point.cast::<f64>())
            .collect();
        let camera_in_map = cycle.map_from_rig * cycle.setup.mounts.camera_in_rig_m();
        view::widen(&mut self.view, cycle);
        self.floor = self.floor_under(&points_in_map, &camera_in_map);
        self.forget_what_has_gone(&points_in_map, &camera_in_map);
        let standings = self.standings(&points_in_map, &camera_in_map);
        observe(Step::Evidence);

        let voxels: Vec<VoxelKey> =
            points_in_map.iter().map(|point| self.grid.key(&point.cast::<f32>())).collect();
        let candidates = Candidates::new(&standings, &voxels);
        let expected = self.tracker.expect(stamp);
        let seeds =
            seeds_of(&self.config, cycle, &points_in_map, &standings, &candidates, &expected);
        observe(Step::Angular);

        let groups = self.groups(&points_in_map, &standings, &candidates, &seeds);
        observe(Step::DepthClustering);

        let cell_m = self.grid.edge_m();
        let points_in_map = &points_in_map;
        let cloud = CycleCloud { cycle, points_in_map, camera_in_map, view: self.view, cell_m };
        let Followings { tracks, settled } = self.tracker.follow(&cloud, &groups);
        observe(Step::Tracking);

        let mut is_dynamic = vec![false; standings.len()];
        for &point in groups.iter().flat_map(|group| &group.points) {
            is_dynamic[point] = true;
        }
        for point in self.lingering(points_in_map, &standings, &voxels) {
            is_dynamic[point] = true;
        }
        for &point in &settled {
            is_dynamic[point] = false;
        }
        // What lingers is not among them: it would stay for ever.
        let of_groups = groups.iter().flat_map(|group| &group.points);
        self.of_objects = of_groups.map(|&point| voxels[point]).collect();
        let arrived = (0..standings.len())
            .filter(|&point| is_dynamic[point] && standings[point] == Standing::Arrived)
            .map(|point| &points_in_map[point]);
        self.evidence.take_for_free(arrived);
        self.recent_views.remember(cycle, cell_m);
        self.evidence.record(&camera_in_map, points_in_map, &is_dynamic);
        // What has come to a place is no background before it has stayed: it ends there in the evidence, and
        // is left out of the static scene until that knows it.
        for (dynamic, standing) in is_dynamic.iter_mut().zip(&standings) {
            *dynamic |= standing.came_alone();
        }
        for &point in &settled {
            is_dynamic[point] = false;
        }
        self.evidence.adopt(settled.iter().map(|&point| &points_in_map[point]));
        observe(Step::Evidence);
        Judged { is_dynamic, tracks, in_zone: seeds.in_zone }
    }

    fn begin(&mut self, stamp: Stamp) {
        if self.last.is_some_and(|last| last.seconds_since(stamp) > ANOTHER_RUN_S) {
            self.evidence = evidence_of(&self.config, self.grid);
            self.tracker.forget();
            (self.view, self.floor) = (View::default(), None);
            self.of_objects.clear();
            self.recent_views.clear();
        }
        self.last = Some(stamp);
        self.evidence.begin_cycle(stamp);
    }

    /// The floor that this cycle shows, or else the one known, unless things lie below that.
    fn floor_under(&self, points_in_map: &[Point3<f64>], camera: &Point3<f64>) -> Option<Floor> {
        let near: Vec<Point3<f64>> = points_in_map
            .iter()
            .filter(|point| (*point - camera).norm() <= self.config.evidence_reach_m)
            .copied()
            .collect();
        Floor::of(&near).or(self.floor.filter(|known| known.is_under(&near)))
    }

    /// Takes the places of points for unknown where the background has gone and left nothing that rays come back from:
    /// someone stood there before a doorway or a hall. What is there now is another.
    fn forget_what_has_gone(&mut self, points_in_map: &[Point3<f64>], camera: &Point3<f64>) {
        for point in points_in_map {
            let has_gone = self.evidence.stay(point).is_some_and(|stay| {
                stay.lasted_s <= LONGEST_STAY_S
                    && self.recent_views.has_gone(point, stay.last_met, camera)
            });
            if has_gone {
                self.evidence.forget(point);
            }
        }
    }

    /// How each point stands to what is known of its place.
    fn standings(&self, points_in_map: &[Point3<f64>], camera: &Point3<f64>) -> Vec<Standing> {
        // A foot's lowest voxel holds more of the floor than of the foot.
        let sole_m = self.grid.edge_m() / 2.0;
        points_in_map
            .iter()
            .map(|point| {
                let in_reach = (point - camera).norm() <= self.config.evidence_reach_m;
                let is_floor =
                    self.floor.is_some_and(|floor| floor.height_above_m(point).abs() <= sole_m);
                if !in_reach {
                    return Standing::Still;
                }
                if is_floor {
                    // Where the floor itself is too dark to be seen, all of that voxel is the foot's: no floor has
                    // been met there or beside, whether or not rays to what is behind have passed over it.
                    let is_foot = self.evidence.known(point) != Known::Background
                        && self.has_arrived(point, camera);
                    return if is_foot { Standing::Arrived } else { Standing::Still };
                }
                match self.evidence.known(point) {
                    Known::Background => Standing::Still,
                    Known::Unknown if self.has_arrived(point, camera) => Standing::Arrived,
                    Known::Unknown => Standing::New,
                    Known::Free if self.evidence.is_beside_surface(point) => {
                        Standing::CameBesideSurface
                    }
                    Known::Free => Standing::Came,
                }
            })
            .collect()
    }

    fn has_arrived(&self, point_in_map: &Point3<f64>, camera: &Point3<f64>) -> bool {
        let was_empty = |blank_reach_m: f64| {
            self.recent_views.was_empty(point_in_map, &self.view, blank_reach_m)
        };
        self.evidence.is_untouched(point_in_map)
            && was_empty(f64::INFINITY)
            && (was_empty(AS_NEAR * distance(point_in_map, camera))
                || !self.evidence.is_near_surface(point_in_map, BORDER_VOXELS))
    }

    /// Points where an object had some a cycle ago, of whose places nothing else is known: the last sliver of one that
    /// goes out of view, a foot that was floor for once. They are the object's for this one cycle.
    fn lingering(
        &self,
        points_in_map: &[Point3<f64>],
        standings: &[Standing],
        voxels: &[VoxelKey],
    ) -> Vec<usize> {
        let lingers = |&point: &usize| {
            matches!(standings[point], Standing::New | Standing::Still)
                && self.of_objects.contains(&voxels[point])
                && self.evidence.known(&points_in_map[point]) != Known::Background
        };
        (0..standings.len()).filter(lingers).collect()
    }

    /// Grows the objects from their seeds. Through what has come they grow without bound; through places of
    /// which nothing is known only as far as a body reaches.
    fn groups(
        &self,
        points_in_map: &[Point3<f64>],
        standings: &[Standing],
        candidates: &Candidates<'_>,
        seeds: &Seeds,
    ) -> Vec<MovingGroup> {
        let reach_m = self.config.max_object_width_m / 2.0;
        let within_a_body = |point: &Point3<f64>| {
            seeds.points.iter().any(|&seed| {
                let seed = &points_in_map[seed];
                (point.xy() - seed.xy()).norm() <= reach_m
                    && (point.z - seed.z).abs() <= self.config.max_object_height_m
            })
        };
        let is_low_enough = |point: &Point3<f64>| {
            self.floor
                .is_none_or(|floor| floor.height_above_m(point) <= self.config.max_object_height_m)
        };
        candidates
            .grown_from(&seeds.points, |index| {
                let point = &points_in_map[index];
                standings[index].came() || (is_low_enough(point) && within_a_body(point))
            })
            .into_iter()
            .map(|points| {
                let is_alone = |point: &&usize| standings[**point].came_alone();
                let came = points.iter().filter(is_alone).count();
                MovingGroup {
                    in_zone: points.iter().any(|&point| seeds.is_of_zone[point]),
                    came: 2 * came >= points.len(),
                    points,
                }
            })
            .collect()
    }
}

fn evidence_of(config: &FreeSpaceConfig, grid: VoxelGrid) -> Evidence {
    Evidence::new(&EvidenceLimits {
        grid,
        reach_m: config.evidence_reach_m,
        min_background_s: config.min_background_s,
        max_voxels: config.max_evidence_voxels,
    })
}
