//! What one cycle says of what moves.

use geometry::{DetectedCycle, MaskedDepth, MovingBeam, RigMounts, RobotBox, Stamp, Track};
use nalgebra::{Isometry3, Point3, Vector3};

use crate::Segmented;
use crate::floor::Floor;

/// A point so far beside a track's box still belongs to it: the box is that of the means of voxels.
const BESIDE_TRACK_M: f64 = 0.2;

/// What moves in a cycle, and how fast.
#[derive(Clone, PartialEq, Debug)]
pub struct Verdict {
    /// The scan of the cycle.
    pub(super) scan_stamp: Stamp,
    /// The image or cloud of the cycle.
    pub(super) view_stamp: Stamp,
    /// The pose of the rig at that stamp.
    pub(super) map_from_rig: Isometry3<f64>,
    pub(super) mounts: RigMounts,
    /// Where the colour camera is.
    pub(super) colour_from_depth: Isometry3<f64>,
    /// The box around the robot itself.
    pub(super) robot: Option<RobotBox>,
    /// The beams of the scan that hit what moves, by rising index.
    pub(super) beams: Vec<MovingBeam>,
    /// The points of the reduced cloud that move.
    pub(super) points: Vec<MovingPoint>,
    /// The floor as the rig saw it, where one is known.
    pub(super) floor_in_rig: Option<Floor>,
    /// The mask on the cycle's own image, where there is one.
    pub(super) depth: Option<MaskedDepth>,
}

/// A point that moves.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct MovingPoint {
    pub(super) in_rig_m: Point3<f32>,
    pub(super) in_map_m: Point3<f64>,
    /// That of its track; zero without one.
    pub(super) velocity_m_per_s: Vector3<f64>,
}

impl Verdict {
    /// Of a cycle as it was detected and segmented.
    #[must_use]
    pub fn of(detected: &DetectedCycle, segmented: &Segmented) -> Self {
        let cycle = &segmented.cycle;
        let moving = |in_rig_m: &Point3<f32>| {
            let in_map_m = cycle.map_from_rig * in_rig_m.cast::<f64>();
            let velocity_m_per_s = velocity_at(&segmented.tracks, &in_map_m);
            MovingPoint { in_rig_m: *in_rig_m, in_map_m, velocity_m_per_s }
        };
        Self {
            scan_stamp: detected.scan_stamp,
            view_stamp: detected.reduced_cloud.stamp,
            map_from_rig: cycle.map_from_rig,
            mounts: cycle.setup.mounts,
            colour_from_depth: cycle.setup.colour_from_depth,
            robot: cycle.setup.robot,
            beams: detected.moving_beams.clone(),
            points: cycle.dynamic_cloud.points_m.iter().map(moving).collect(),
            floor_in_rig: segmented.floor_in_rig,
            depth: cycle.depth.clone(),
        }
    }
}

/// The velocity of the track that a place is of: of several that of the nearest.
fn velocity_at(tracks: &[Track], in_map_m: &Point3<f64>) -> Vector3<f64> {
    let offset_m = |track: &Track| in_map_m - track.position_m;
    let holds = |track: &&Track| {
        let half_m = 0.5 * track.extent_m + Vector3::repeat(BESIDE_TRACK_M);
        let offset_m = offset_m(track).abs();
        track.unseen_cycles == 0 && (0..3).all(|axis| offset_m[axis] <= half_m[axis])
    };
    tracks
        .iter()
        .filter(holds)
        .min_by(|a, b| offset_m(a).norm().total_cmp(&offset_m(b).norm()))
        .map_or_else(Vector3::zeros, |track| track.velocity_m_per_s)
}
