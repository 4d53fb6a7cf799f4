//! How much of the truly moving points a run removed, and what that cost the static scene.
//!
//! The truth is one label per depth pixel: 0 is the static scene, any other number an object. A mask
//! derived from the recording itself does the same service as a simulator's labels.
//!
//! A true point counts as **removed** when its voxel of the rig frame, on the grid of the reduction, holds
//! a point that segmentation took for moving in that cycle: the reduction leaves one point a voxel, so the
//! voxel is the finest part that segmentation can take or leave.
//!
//! In the map, a voxel is an object's own when the object's points touched it in some cycle and no static
//! point ever did. Such a voxel should be empty in the final map; a voxel that static points touched in
//! several cycles should be there. What they touched in one or two is mostly where noise throws the far
//! pixels of a surface, and a rig on the move leaves a trail of it: the accuracies of the benchmarks count it
//! all the same, as they are defined.

mod found;
mod labels;
mod map_score;
mod objects;
mod tally;
#[cfg(test)]
mod tests;

use std::collections::{BTreeMap, HashSet};

use geometry::{Stamp, VoxelEdgeError, VoxelGrid, VoxelKey};
use nalgebra::{Isometry3, Point3};
use serde::{Deserialize, Serialize};

pub use self::found::FirstFound;
pub use self::labels::{LabelScore, MapAccuracy};
pub use self::map_score::{MapScore, StaticVoxels};
use self::map_score::{MapVoxels, map_score};
use self::objects::object_score;
pub use self::objects::{ObjectCycleScore, ObjectScore};
use self::tally::{CycleTally, ObjectTally, SceneTally};
use crate::{
    CycleRecord, IdentityCycle, IdentityScore, LabelledPoint, RunRecord, TruthFrame,
    score_identities,
};

/// The label of the static scene.
const STATIC_LABEL: u16 = geometry::LabelImage::STATIC;

/// The thresholds of the score. They are written beside the figures, which mean little without them.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DynamicScoreRules {
    /// An object is in view of a cycle when at least this many of its pixels have a depth, at 640 x 480;
    /// in proportion to the pixels of another image size, rounded up, and never less than 1.
    pub in_view_px_at_640x480: f64,
    /// An object is found when zones hold at least this share of its points and some of them were removed.
    pub found_share_in_zone: f64,
    /// An object is removed when at least this share of its points was.
    pub removed_share: f64,
    /// A voxel of the map is confirmed as one of the static scene when static points touched it in at least
    /// this many cycles.
    pub confirming_cycles: u32,
}

/// Noise throws a point of a surface into a voxel behind or before it, now here, now there: it seldom hits the
/// same one twice, hardly ever three times. What is there is met whenever it is in view, and a rig that drives
/// past at walking speed has it in view for many cycles.
const CONFIRMING_CYCLES: u32 = 3;

impl Default for DynamicScoreRules {
    fn default() -> Self {
        // 200 px is a patch of 14 x 14: a hand at 3 m from a Kinect.
        Self {
            in_view_px_at_640x480: 200.0,
            found_share_in_zone: 0.5,
            removed_share: 0.5,
            confirming_cycles: CONFIRMING_CYCLES,
        }
    }
}

/// True points of a kind, and how many of them were removed.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct RemovedPoints {
    /// True points: labelled pixels with a depth.
    pub points: u64,
    /// Of these, points in a voxel that was removed.
    pub removed: u64,
    /// `removed / points`; none without points.
    pub share: Option<f64>,
}

/// The score of a run against the truth.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct DynamicScore {
    /// The thresholds behind the figures.
    pub rules: DynamicScoreRules,
    /// Cycles that were compared with a truth.
    pub cycles_scored: usize,
    /// Cycles for which there was no truth.
    pub cycles_without_truth: usize,
    /// Each object by its label, smallest first.
    pub objects: Vec<ObjectScore>,
    /// The points of all objects together, over all scored cycles.
    pub object_points: RemovedPoints,
    /// The points of the static scene over all scored cycles: what is removed of them is removed wrongly.
    pub static_points: RemovedPoints,
    /// Of each point, whether it was rightly taken for moving.
    pub labels: LabelScore,
    /// Whether tracks keep to their objects; none where the run has no track at all, as by a method that follows
    /// nothing.
    pub identities: Option<IdentityScore>,
    /// The final map against the truth.
    pub map: MapScore,
    /// The accuracies by points.
    pub by_points: MapAccuracy,
    /// The accuracies by voxels: rankings of methods differ between the two.
    pub by_voxels: MapAccuracy,
    /// Each scored cycle.
    pub per_cycle: Vec<CycleScore>,
}

/// The score of one cycle.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct CycleScore {
    /// The cycle's number.
    pub index: u32,
    /// The points of all objects.
    pub object_points: RemovedPoints,
    /// The points of the static scene.
    pub static_points: RemovedPoints,
    /// Of these, points that were removed and are not next to a moving one.
    pub static_removed_off_borders: u64,
}

/// The run cannot be scored.
#[derive(Debug, thiserror::Error)]
pub enum ScoreError<E: std::error::Error + 'static> {
    /// The run's voxel edge is no length.
    #[error("the run cannot be scored on its voxel grid")]
    Edge(#[from] VoxelEdgeError),
    /// The truth of a cycle could not be had.
    #[error("no truth for the cloud of cycle {index} at {} ns", stamp.as_nanos())]
    Truth {
        /// The cycle.
        index: u32,
        /// The stamp that was asked for.
        stamp: Stamp,
        /// Why.
        source: E,
    },
}

/// Scores `run` against the truth that `truth_at` gives for the stamp of each cycle's cloud, or `None` where
/// there is none. `object_names` says what the labels stand for, as far as that is known.
///
/// The truth is asked for in the order of the cycles and one frame is held at a time.
///
/// # Errors
/// When the run's voxel edge is not a positive number, or `truth_at` fails.
pub fn score_dynamic<E: std::error::Error + 'static>(
    run: &RunRecord,
    rules: &DynamicScoreRules,
    object_names: &BTreeMap<u16, String>,
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
    let map = MapVoxels::of(run, &grid);
    let object_scores: Vec<_> = objects
        .iter()
        .map(|(&id, tally)| object_score(id, tally, object_names.get(&id), &scene, &map))
        .collect();
    let object_points = RemovedPoints::sum(object_scores.iter().map(|object| object.points));
    let static_points = RemovedPoints::sum(per_cycle.iter().map(|cycle| cycle.static_points));
    let off_borders = per_cycle.iter().map(|cycle| cycle.static_removed_off_borders).sum();
    let map = map_score(&scene, &objects, &map, rules.confirming_cycles);
    Ok(DynamicScore {
        rules: *rules,
        cycles_scored: per_cycle.len(),
        cycles_without_truth: run.cycles.len() - per_cycle.len(),
        object_points,
        static_points,
        labels: LabelScore::of(object_points, static_points, off_borders),
        identities: has_tracks.then(|| score_identities(identities)),
        by_points: MapAccuracy::by_points(object_points, static_points),
        by_voxels: MapAccuracy::by_voxels(&map),
        map,
        objects: object_scores,
        per_cycle,
    })
}

/// Compares one cycle with its truth and adds what was seen to the tallies of the map. Tells where the objects in
/// view are, in the map.
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
        let map_key = grid.key(&(map_from_rig * point.point_in_rig));
        if point.object_id == STATIC_LABEL {
            static_now.add_static(removed);
            static_removed_off_borders += u64::from(removed && !borders.contains(&key));
            scene.touch(map_key);
        } else {
            let tally = objects_now.entry(point.object_id).or_default();
            tally.add_object(&point.point_in_rig, removed, &cycle.zones);
            objects.entry(point.object_id).or_default().region.touch(map_key);
        }
    }
    let in_view_points = rules.in_view_points(truth.image_size_px());
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
        object_points: RemovedPoints::sum(objects_now.values().map(CycleTally::removed_points)),
        static_points: static_now.removed_points(),
        static_removed_off_borders,
    };
    (score, in_view_m)
}
