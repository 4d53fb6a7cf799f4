//! The score of a run against the truth. The crate `evaluation` computes it; here it is a part of the
//! run's figures.

use serde::{Deserialize, Serialize};

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
    /// Points of the map and of the true surface that are nearer to each other than this are the same. Both are compared
    /// with a point a voxel of this edge.
    // Summaries that were written before there was one have none.
    #[serde(default = "default_surface_tolerance_m")]
    pub surface_tolerance_m: f64,
}

/// The completeness of maps of RGB-D cameras is stated for 5 cm (Sucar et al. 2021, iMAP, section 4.1).
const SURFACE_TOLERANCE_M: f64 = 0.05;

fn default_surface_tolerance_m() -> f64 {
    SURFACE_TOLERANCE_M
}

/// Noise throws a point of a surface into a voxel behind or before it, now here, now there: it seldom hits the
/// same one twice, hardly ever three times. A real surface is hit whenever it is in view, and a rig that drives
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
            surface_tolerance_m: SURFACE_TOLERANCE_M,
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
    /// The accuracies by voxels: rankings of methods differ between the two. A static voxel is kept when the final map has
    /// a point in this very voxel, which a map of surfaces has not in those beside the surface that noise touched:
    /// [`MapScore::static_kept_share`] measures such a map and one of means alike.
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

/// How well the points that were removed are those that moved.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct LabelScore {
    /// Of the moving points, the share that was removed; none without moving points.
    pub recall: Option<f64>,
    /// Of the removed points, the share that moved, where a static point in a voxel next to one that a moving
    /// point touches in the same cycle does not count: there the border runs through a voxel, or a camera's
    /// pixel mixes both. None where nothing was removed.
    pub precision: Option<f64>,
    /// The same, with these counted.
    pub precision_with_borders: Option<f64>,
    /// Static points that were removed and do not lie at a border.
    pub static_removed_off_borders: u64,
}

/// Static, dynamic and associated accuracy (Zhang et al. 2023, A Dynamic Points Removal Benchmark in Point Cloud
/// Maps, section IV-A): what was kept of the static, what was removed of the moving, and their geometric mean.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct MapAccuracy {
    /// SA: of the static scene, the share that is kept.
    pub static_accuracy: Option<f64>,
    /// DA: of moving objects, the share that is removed.
    pub dynamic_accuracy: Option<f64>,
    /// AA: the square root of their product.
    pub associated_accuracy: Option<f64>,
}

/// What the distances of a map to its reference come to.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct CloudDistance {
    /// Two points nearer than this are the same.
    pub tolerance_m: f64,
    /// Accuracy: the mean distance of the map's points to the reference, none counted farther than five
    /// tolerances.
    pub accuracy_m: f64,
    /// Completeness: the mean distance of the reference's points to the map, likewise.
    pub completeness_m: f64,
    /// Chamfer distance: the mean of the two.
    pub chamfer_m: f64,
    /// Share of the map's points within the tolerance of the reference.
    pub precision: f64,
    /// Share of the reference's points within the tolerance of the map.
    pub recall: f64,
    /// The harmonic mean of the two shares.
    pub f_score: f64,
}

/// The final map against the truth, in voxels of the map frame of the edge of the reduction, whatever the edge of the map is.
///
/// A voxel of the static scene is kept when the map has a point within one edge of the mean of the static points that touched
/// the voxel: noise puts some of them into the voxels beside a surface, where a map of the surface has no point.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct MapScore {
    /// Voxels that objects touched and no static point ever did.
    pub object_only: usize,
    /// Of these, voxels that the map without removal holds.
    pub object_only_without_removal: usize,
    /// Of `object_only`, voxels that the final map still has a point in.
    pub object_only_left: usize,
    /// Voxels that static points ever touched, if only in one cycle: what the static accuracy of the benchmarks
    /// counts.
    pub static_scene: usize,
    /// Of these, voxels that the map without removal keeps.
    pub static_without_removal: usize,
    /// Of `static_scene`, voxels that the final map keeps.
    pub static_kept: usize,
    /// `static_kept / static_scene`; none without a static point.
    pub static_kept_share: Option<f64>,
    /// Of `static_without_removal`, the share that the final map keeps: the loss of the static scene by the removal alone.
    /// `static_kept` has besides what the final map alone keeps.
    pub static_kept_share_of_unfiltered: Option<f64>,
    /// Of `static_scene`, the voxels that are more than noise: see
    /// [`DynamicScoreRules::confirming_cycles`].
    pub static_confirmed: StaticVoxels,
    /// How far map and true surface are apart, where the truth has a surface in the frame of the map.
    #[serde(default)]
    pub surface: Option<CloudDistance>,
}

/// Voxels of the static scene, by outcome.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct StaticVoxels {
    /// How many.
    pub voxels: usize,
    /// Of these, voxels that the map without removal keeps.
    pub without_removal: usize,
    /// Of these, voxels that the final map keeps.
    pub kept: usize,
    /// `kept / voxels`; none without a voxel.
    pub kept_share: Option<f64>,
    /// Of `without_removal`, the share that the final map keeps: the loss by the removal alone. `kept` has besides what the
    /// final map alone keeps.
    pub kept_share_of_unfiltered: Option<f64>,
}

/// The score of one object.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct ObjectScore {
    /// The object's label in the truth.
    pub object_id: u16,
    /// Its kind, where that is known.
    pub name: Option<String>,
    /// Cycles in which it was in view.
    pub cycles_in_view: usize,
    /// Of these, cycles in which it was found in a zone.
    pub cycles_found: usize,
    /// Of those in view, cycles in which it was removed, whether or not a zone held it.
    pub cycles_removed: usize,
    /// Of those in view, cycles in which it was found in a zone or removed: a zone is as wide as the part that the scanner
    /// hits, and an object that leaves the camera's view feet last is found by its track.
    pub cycles_found_or_removed: usize,
    /// `cycles_found_or_removed / cycles_in_view`; none of what was never in view.
    pub found_or_removed_share: Option<f64>,
    /// The first of the cycles in which it was found in a zone or removed.
    pub first_found: Option<FirstFound>,
    /// Its points over all scored cycles, those in which too little of it was in view included.
    pub points: RemovedPoints,
    /// Voxels of the map that this object touched and no static point ever did.
    pub own_voxels: usize,
    /// Of these, voxels that the map without removal holds.
    pub own_voxels_without_removal: usize,
    /// Of its own voxels, those that the final map still holds.
    pub own_voxels_left: usize,
    /// Each cycle in which it has a point.
    pub per_cycle: Vec<ObjectCycleScore>,
}

/// The score of one object in one cycle.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct ObjectCycleScore {
    /// The cycle's number.
    pub index: u32,
    /// Its points.
    pub points: RemovedPoints,
    /// Share of its points whose direction is in a zone.
    pub share_in_zone: f64,
    /// The true bearing: azimuth of the mean of its points in the rig frame.
    pub azimuth_rad: f64,
    /// Whether enough of it was seen to count.
    pub in_view: bool,
    /// Whether it was in view and found.
    pub found: bool,
    /// Whether it was in view and removed.
    pub removed: bool,
}

impl ObjectCycleScore {
    /// Whether it was in view, and a zone held it or it was removed.
    #[must_use]
    pub fn is_found_or_removed(&self) -> bool {
        self.found || self.removed
    }
}

/// The first cycle in which an object was found.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct FirstFound {
    /// The cycle's number.
    pub cycle: u32,
    /// Which of the cycles in which the object is in view it is: 1 is the first, found at once.
    pub nth_in_view: usize,
}

/// A track farther from an object than this, in the horizontal plane, is not its own: half of the width of a
/// person with arms and legs astride.
pub const IDENTITY_GATE_M: f64 = 0.6;

/// How well tracks keep to their objects.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
pub struct IdentityScore {
    /// How often an object was in view, over all objects and cycles.
    pub sightings: usize,
    /// Of these, how often a track followed it.
    pub followed: usize,
    /// How often an object got another track than it had when it was last followed.
    pub switches: usize,
}
