//! How many of the true dynamic points a run removed, and how many static ones it lost.
//!
//! The ground truth is one label per depth pixel: 0 is the static scene, any other number an object. A mask
//! derived from the recording itself works as well as a simulator's labels.
//!
//! A true point counts as **removed** when its voxel of the rig frame, on the grid of the reduction, holds
//! a point that segmentation classified as dynamic in that cycle: the reduction leaves one point per voxel, so the
//! voxel is the smallest unit of segmentation.
//!
//! In the map, a voxel belongs to an object when the object's points touched it in some cycle and no static
//! point ever did. Such a voxel should be empty in the final map; a voxel that static points touched in
//! several cycles should have a point of the map within one edge of the mean of these points. So maps of means and maps
//! of surfaces, with voxels of another edge, are measured in the same way. Voxels touched in only one or two cycles are
//! mostly noise of distant pixels, which a moving rig leaves along its path. The accuracies of the benchmarks follow
//! their definitions: they count all touched voxels, and a voxel is kept only if the map has a point inside it.

mod labels;
mod map_score;
mod objects;
mod tally;
#[cfg(test)]
mod tests;

use std::collections::{BTreeMap, HashSet};

use geometry::{Stamp, VoxelEdgeError, VoxelGrid, VoxelKey};
use nalgebra::{Isometry3, Point3};
use report::{CloudDistance, CycleRecord, CycleScore, DynamicScore, DynamicScoreRules, RunRecord};

use self::labels::{accuracy_by_points, accuracy_by_voxels, label_score};
use self::map_score::{MapVoxels, map_score, static_voxels_with_points};
use self::objects::object_score;
use self::tally::{CycleTally, ObjectTally, SceneTally, in_view_points, removed_points};
use crate::score_identities;
use crate::{CloudDistanceError, IdentityCycle, LabelledPoint, ReducedClouds, TruthFrame};

/// The label of the static scene.
const STATIC_LABEL: u16 = geometry::LabelImage::STATIC;

/// The run cannot be scored.
#[derive(Debug, thiserror::Error)]
pub enum ScoreError<E: std::error::Error + 'static> {
    /// The run's voxel edge is not a length.
    #[error("the run cannot be scored on its voxel grid")]
    Edge(#[from] VoxelEdgeError),
    /// The tolerance of the surface is not a length.
    #[error("the map cannot be compared with the true surface")]
    Surface(#[source] CloudDistanceError),
    /// The ground truth of a cycle is not available.
    #[error("no truth for the cloud of cycle {index} at {} ns", stamp.as_nanos())]
    Truth {
        /// The cycle.
        index: u32,
        /// The requested stamp.
        stamp: Stamp,
        /// The reason.
        source: E,
    },
}

/// Scores `run` against the truth that `truth_at` gives for the stamp of each cycle's cloud, or `None` where
/// there is none. `object_names` are the known names of the labels. `surface_m` are points of the true static surface in
/// the frame of the map, in any density, if they are known.
///
/// `truth_at` is called in the order of the cycles, and one frame is held at a time.
///
/// # Errors
/// When the run's voxel edge, or the tolerance of a given surface, is not a positive number, or `truth_at` fails. A map or
/// a surface without finite points is not an error: there is then no distance between the two.
pub fn score_dynamic<E: std::error::Error + 'static>(
    run: &RunRecord,
    rules: &DynamicScoreRules,
    object_names: &BTreeMap<u16, String>,
    surface_m: Option<&[Point3<f32>]>,
    mut truth_at: impl FnMut(Stamp) -> Result<Option<TruthFrame>, E>,
) -> Result<DynamicScore, ScoreError<E>> {
    let grid = VoxelGrid::new(run.voxel_edge_m)?;
    let mut scene = SceneTally::default();
    let mut objects: BTreeMap<u16, ObjectTally> = BTreeMap::new();
    let mut per_cycle = Vec::with_capacity(run.cycles.len());
    let mut identities = Vec::with_capacity(run.cycles.len());
    for cycle in &run.cycles {
        let stamp = cycle.cloud_stamp;
        let truth = truth_at(stamp).map_err(|source| ScoreError::Truth {
            index: cycle.index,
            stamp,
            source,
        })?;
        let Some(truth) = truth else { continue };
        let (score, in_view_m) = score_cycle(cycle, &truth, &grid, rules, &mut scene, &mut objects);
        per_cycle.push(score);
        identities.push(IdentityCycle { objects: in_view_m, tracks: cycle.tracks_m.clone() });
    }
    let has_tracks = run.cycles.iter().any(|cycle| !cycle.tracks_m.is_empty());
    let map_voxels = MapVoxels::of(run, &grid);
    let object_scores: Vec<_> = objects
        .iter()
        .map(|(&id, tally)| object_score(id, tally, object_names.get(&id), &scene, &map_voxels))
        .collect();
    let object_points = removed_points(object_scores.iter().map(|object| object.points));
    let static_points = removed_points(per_cycle.iter().map(|cycle| cycle.static_points));
    let off_borders = per_cycle.iter().map(|cycle| cycle.static_removed_off_borders).sum();
    let mut map = map_score(&scene, &objects, &map_voxels, rules.confirming_cycles);
    if let Some(surface_m) = surface_m {
        map.surface = surface_distance(surface_m, &run.static_map, rules.surface_tolerance_m)
            .map_err(ScoreError::Surface)?;
    }
    Ok(DynamicScore {
        rules: *rules,
        cycles_scored: per_cycle.len(),
        cycles_without_truth: run.cycles.len() - per_cycle.len(),
        object_points,
        static_points,
        labels: label_score(object_points, static_points, off_borders),
        identities: has_tracks.then(|| score_identities(identities)),
        by_points: accuracy_by_points(object_points, static_points),
        by_voxels: accuracy_by_voxels(&map, static_voxels_with_points(&scene, &map_voxels)),
        map,
        objects: object_scores,
        per_cycle,
    })
}

/// The distance of the map from the true surface, both reduced to voxels of the tolerance; `None` when one of them has no
/// points.
fn surface_distance(
    surface_m: &[Point3<f32>],
    map_m: &[Point3<f32>],
    tolerance_m: f64,
) -> Result<Option<CloudDistance>, CloudDistanceError> {
    match ReducedClouds::of(surface_m, map_m, tolerance_m)?.distance(tolerance_m) {
        Ok(distance) => Ok(Some(distance)),
        Err(CloudDistanceError::Empty { .. }) => Ok(None),
        Err(error @ CloudDistanceError::Tolerance(_)) => Err(error),
    }
}

/// Compares one cycle with its ground truth and adds it to the tallies of the map. Returns the positions of the visible
/// objects in the map frame.
fn score_cycle(
    cycle: &CycleRecord,
    truth: &TruthFrame,
    grid: &VoxelGrid,
    rules: &DynamicScoreRules,
    scene: &mut SceneTally,
    objects: &mut BTreeMap<u16, ObjectTally>,
) -> (CycleScore, BTreeMap<u16, Point3<f64>>) {
    let dynamic: HashSet<VoxelKey> =
        cycle.dynamic_points_m.iter().map(|point| grid.key(point)).collect();
    let map_from_rig: Isometry3<f32> = cycle.map_from_rig.cast();
    scene.begin_cycle();
    let mut static_now = CycleTally::default();
    let mut objects_now: BTreeMap<u16, CycleTally> = BTreeMap::new();
    let of_objects = |point: &&LabelledPoint| point.object_id != STATIC_LABEL;
    let borders = labels::with_neighbours(
        &truth.points().iter().filter(of_objects).map(|p| grid.key(&p.point_in_rig)).collect(),
    );
    let mut static_removed_off_borders = 0;
    for point in truth.points() {
        let key = grid.key(&point.point_in_rig);
        let removed = dynamic.contains(&key);
        let point_in_map = map_from_rig * point.point_in_rig;
        let map_key = grid.key(&point_in_map);
        if point.object_id == STATIC_LABEL {
            static_now.add_static(removed);
            static_removed_off_borders += u64::from(removed && !borders.contains(&key));
            scene.touch(map_key, &point_in_map);
        } else {
            let tally = objects_now.entry(point.object_id).or_default();
            tally.add_object(&point.point_in_rig, removed, &cycle.zones);
            objects.entry(point.object_id).or_default().region.touch(map_key);
        }
    }
    let in_view_points = in_view_points(rules, truth.image_size_px());
    let mut in_view_m = BTreeMap::new();
    for (&id, tally) in &objects_now {
        let score = tally.object_cycle_score(cycle.index, rules, in_view_points);
        if let (true, Some(mean_in_rig)) = (score.in_view, tally.mean_in_rig()) {
            in_view_m.insert(id, cycle.map_from_rig * mean_in_rig);
        }
        objects.entry(id).or_default().per_cycle.push(score);
    }
    let score = CycleScore {
        index: cycle.index,
        object_points: removed_points(objects_now.values().map(CycleTally::removed_points)),
        static_points: static_now.removed_points(),
        static_removed_off_borders,
    };
    (score, in_view_m)
}
