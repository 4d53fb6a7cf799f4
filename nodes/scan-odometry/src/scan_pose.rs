//! The result of the odometry for a scan.

use std::fmt;

use geometry::{Stamp, StampedPose, UnusablePose, check_pose, pose_from_vector};
use nalgebra::{Isometry2, Isometry3, Matrix3, Translation3, UnitQuaternion, Vector3};

use crate::observability::Observability;

/// Where the scanner was in the middle of a turn, by its scans.
#[derive(Clone, PartialEq, Debug)]
pub struct ScanPose {
    /// The middle of the turn: the stamp of the scan and half of the time from its first beam to its last.
    pub stamp: Stamp,
    /// Takes a point of the scanner's frame to its frame in the middle of the first turn. What is not known is
    /// predicted by a constant velocity.
    pub odom_from_lidar: Isometry2<f64>,
    /// Of x, y (in the axes of odom, m) and yaw (rad), since the start.
    pub covariance: Matrix3<f64>,
    /// Of the motion since the scan before: x, y and yaw in the scanner's frame.
    pub step_covariance: Matrix3<f64>,
    /// How far the pose depends on this scan.
    pub quality: MatchQuality,
}

/// How far a pose rests on its scan.
#[derive(Clone, PartialEq, Debug)]
pub struct MatchQuality {
    /// The outcome of matching the scan.
    pub outcome: MatchOutcome,
    /// Returns of the scan within reach.
    pub returns: usize,
    /// Lines of the map after the scan.
    pub map_lines: usize,
    /// Share of the returns that are on the map. Moving objects are not, nor are surfaces seen for the first time. 0 when
    /// nothing was matched.
    pub matched_share: f64,
    /// Root mean square of the distances of those from their lines.
    pub residual_rms_m: f64,
    /// The directions that keep the prediction, because the map does not determine them.
    pub degenerate: Vec<DegenerateDirection>,
}

/// The outcome of matching a scan.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum MatchOutcome {
    /// It is the first one; the map begins with it.
    Started,
    /// It is registered to the map.
    Matched,
    /// The pose is a prediction.
    Held(Refusal),
    /// The pose is a prediction, and as nothing has matched for a long time, the map begins anew with this scan.
    BegunAnew(Refusal),
}

/// Why a scan was not matched.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum Refusal {
    /// There are hardly any returns.
    #[error("only {returns} returns within reach, of {needed} that are needed")]
    FewReturns {
        /// The returns within reach.
        returns: usize,
        /// The number needed.
        needed: usize,
    },
    /// The returns are not on the map.
    #[error("only {:.0} % of the returns lie on the map, of {:.0} % that are needed", 100.0 * .share, 100.0 * .needed)]
    FewMatched {
        /// The share that does.
        share: f64,
        /// The share needed.
        needed: f64,
    },
    /// The matched returns determine no direction.
    #[error("the returns determine no direction of the pose")]
    Unconstrained,
    /// The platform cannot get there in the time.
    #[error(
        "the best match lies {step_m:.2} m and {turn_deg:.0} degrees from the scan before: too far for {passed_s:.2} s"
    )]
    TooFar {
        /// How far away.
        step_m: f64,
        /// How much turned.
        turn_deg: f64,
        /// The time since the scan before.
        passed_s: f64,
    },
    /// The scan is no later than the one before it.
    #[error("the scan is {by_s:.3} s older than the one before it")]
    NotLater {
        /// By how much.
        by_s: f64,
    },
}

/// A motion of the platform that the map does not determine.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum DegenerateDirection {
    /// Along a line, such as the axis of a corridor.
    Along {
        /// Its direction from the scanner's x axis, in `(-pi/2, pi/2]`.
        azimuth_rad: f64,
    },
    /// A rotation, as in the middle of a round room.
    Turn,
}

impl fmt::Display for DegenerateDirection {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Along { azimuth_rad } => {
                // A sum with 0 has no negative zero.
                let azimuth_deg = azimuth_rad.to_degrees().round() + 0.0;
                write!(formatter, "along {azimuth_deg} degrees from the scanner's x axis")
            }
            Self::Turn => formatter.write_str("a turn on the spot"),
        }
    }
}

impl DegenerateDirection {
    pub(crate) fn all(observability: &Observability) -> Vec<Self> {
        observability.weak().map(|direction| Self::of(&direction.in_units)).collect()
    }

    fn of(vector: &Vector3<f64>) -> Self {
        let [x, y, turn] = (*vector).into();
        if turn * turn > 0.5 {
            return Self::Turn;
        }
        // A line has no sense of direction.
        let (x, y) = if x < 0.0 || (x == 0.0 && y < 0.0) { (-x, -y) } else { (x, y) };
        Self::Along { azimuth_rad: f64::atan2(y, x) }
    }
}

impl ScanPose {
    /// Whether the pose was measured, in some direction at least, or is the origin.
    #[must_use]
    pub fn is_measured(&self) -> bool {
        matches!(self.quality.outcome, MatchOutcome::Started | MatchOutcome::Matched)
    }

    /// The pose of a rig that carries the scanner at `rig_from_lidar`: `[x_m, y_m, z_m, yaw_rad, pitch_rad,
    /// roll_rad]` (Rec-HV eq. 8). Its parent is the rig's frame in the middle of the first revolution, which gets the name
    /// `frame_id`. The motion is one in the scanner's own plane, whichever way up that is mounted.
    ///
    /// # Errors
    /// When a number of the mount is not finite, or the pose lies too far from the start.
    pub fn stamped_pose(
        &self,
        rig_from_lidar: &[f64; 6],
        frame_id: &str,
    ) -> Result<StampedPose, UnusablePose> {
        let mount = pose_from_vector(rig_from_lidar);
        let Isometry2 { translation, rotation } = self.odom_from_lidar;
        let moved = Isometry3::from_parts(
            Translation3::new(translation.x, translation.y, 0.0),
            UnitQuaternion::from_axis_angle(&Vector3::z_axis(), rotation.angle()),
        );
        let map_from_rig = mount * moved * mount.inverse();
        check_pose(&map_from_rig)?;
        Ok(StampedPose { stamp: self.stamp, frame_id: frame_id.to_owned(), map_from_rig })
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, PI};

    use nalgebra::{Point3, Vector2};

    use super::*;

    fn pose(odom_from_lidar: Isometry2<f64>) -> ScanPose {
        ScanPose {
            stamp: Stamp::from_nanos(7),
            odom_from_lidar,
            covariance: Matrix3::zeros(),
            step_covariance: Matrix3::zeros(),
            quality: MatchQuality {
                outcome: MatchOutcome::Matched,
                returns: 0,
                map_lines: 0,
                matched_share: 1.0,
                residual_rms_m: 0.0,
                degenerate: Vec::new(),
            },
        }
    }

    #[test]
    fn the_rig_moves_with_the_scanner_on_it() {
        // The scanner sits at the front, turned to the left: it goes ahead when the rig goes to its right.
        let mount = [0.5, 0.0, 0.2, FRAC_PI_2, 0.0, 0.0];
        let moved = pose(Isometry2::translation(1.0, 0.0)).stamped_pose(&mount, "map").unwrap();
        assert_eq!((moved.stamp, moved.frame_id.as_str()), (Stamp::from_nanos(7), "map"));
        let at = moved.map_from_rig * Point3::origin();
        assert!((at - Point3::new(0.0, 1.0, 0.0)).norm() < 1e-12, "{at}");
        // A quarter turn about the scanner carries the rig's origin around it.
        let turned = pose(Isometry2::rotation(FRAC_PI_2)).stamped_pose(&mount, "map").unwrap();
        let at = turned.map_from_rig * Point3::origin();
        assert!((at - Point3::new(0.5, -0.5, 0.0)).norm() < 1e-12, "{at}");
    }

    #[test]
    fn a_scanner_upside_down_sees_left_turns_as_right_ones() {
        let mount = [0.0, 0.0, 0.3, 0.0, 0.0, PI];
        let moved =
            pose(Isometry2::new(Vector2::new(1.0, 0.5), -0.3)).stamped_pose(&mount, "map").unwrap();
        let (_, _, yaw_rad) = moved.map_from_rig.rotation.euler_angles();
        assert!((yaw_rad - 0.3).abs() < 1e-12);
        assert!(
            (moved.map_from_rig.translation.vector - Vector3::new(1.0, -0.5, 0.0)).norm() < 1e-12
        );
    }

    #[test]
    fn the_start_is_the_identity_and_a_bad_mount_is_an_error() {
        let start = pose(Isometry2::identity());
        let mount = [0.1, -0.2, 0.3, 0.4, 0.5, 0.6];
        let at_start = start.stamped_pose(&mount, "map").unwrap().map_from_rig;
        assert!(at_start.translation.vector.norm() < 1e-12 && at_start.rotation.angle() < 1e-7);
        let bad = start.stamped_pose(&[0.0, f64::NAN, 0.0, 0.0, 0.0, 0.0], "map");
        assert_eq!(bad, Err(UnusablePose::NotFinite));
    }

    #[test]
    fn directions_have_names() {
        let named = |x: f64, y: f64, turn: f64| {
            DegenerateDirection::of(&Vector3::new(x, y, turn)).to_string()
        };
        assert_eq!(named(-1.0, 0.0, 0.1), "along 0 degrees from the scanner's x axis");
        assert_eq!(named(0.0, -1.0, 0.0), "along 90 degrees from the scanner's x axis");
        assert_eq!(named(0.1, 0.0, -0.99), "a turn on the spot");
    }
}
