//! Where the sensors are mounted on the rig.

use std::f64::consts::FRAC_PI_2;

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3, Vector6};

use crate::{pose_from_vector, pose_vector};

/// A mount that differs by no more than this is the same: a tenth of a scanner's noise, ...
const SAME_M: f64 = 0.001;
/// ... and as much at 1 m.
const SAME_RAD: f64 = 0.001;

/// How the depth camera and the scanner are mounted.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct RigMounts {
    /// The camera's optical frame in the rig.
    pub rig_from_camera: Isometry3<f64>,
    /// The scanner's frame in the rig.
    pub rig_from_lidar: Isometry3<f64>,
}

impl RigMounts {
    /// Takes a point of the scanner's frame to the camera's, with the rig's motion in between.
    #[must_use]
    pub fn camera_from_lidar(&self, image_rig_from_rig: &Isometry3<f64>) -> Isometry3<f64> {
        self.rig_from_camera.inverse() * image_rig_from_rig * self.rig_from_lidar
    }

    /// With the scanner's pose corrected by `[x, y, z, about x, about y, about z]` in metres and radians: its origin moved along
    /// the axes of the rig, and the scanner turned about axes through its own origin that are parallel to the rig's.
    #[must_use]
    pub fn corrected(&self, correction: &Vector6<f64>) -> Self {
        let shift: Vector3<f64> = correction.fixed_rows::<3>(0).into_owned();
        let turn: Vector3<f64> = correction.fixed_rows::<3>(3).into_owned();
        let rig_from_lidar = Isometry3::from_parts(
            Translation3::from(self.rig_from_lidar.translation.vector + shift),
            UnitQuaternion::from_scaled_axis(turn) * self.rig_from_lidar.rotation,
        );
        Self { rig_from_lidar, ..*self }
    }

    /// The camera's optical centre in the rig: where the rays to the points of an image start.
    #[must_use]
    pub fn camera_in_rig_m(&self) -> Point3<f64> {
        self.rig_from_camera.translation.vector.into()
    }

    /// How far a point of the rig is above the plane that the scanner sweeps; negative below it.
    #[must_use]
    pub fn height_above_scan_m(&self, point_in_rig_m: &Point3<f64>) -> f64 {
        self.rig_from_lidar.inverse_transform_point(point_in_rig_m).z
    }
}

impl Default for RigMounts {
    fn default() -> Self {
        RigConfig::default().mounts()
    }
}

/// Whether two mounts are the same, but for noise.
#[must_use]
pub fn is_same_mount(one: &Isometry3<f64>, other: &Isometry3<f64>) -> bool {
    (one.translation.vector - other.translation.vector).norm() <= SAME_M
        && one.rotation.angle_to(&other.rotation) <= SAME_RAD
}

/// A mount as parameters have it, rounded for a reader.
pub(crate) fn mount_text(mount: &Isometry3<f64>) -> String {
    // A zero of either sign is 0.
    let [x_m, y_m, z_m, yaw_rad, pitch_rad, roll_rad] =
        pose_vector(mount).map(|number| (number * 1e4).round() / 1e4 + 0.0);
    format!("[{x_m:.3}, {y_m:.3}, {z_m:.3}, {yaw_rad:.4}, {pitch_rad:.4}, {roll_rad:.4}]")
}

crate::choices! {
    /// Where the poses of camera and scanner in the rig come from.
    pub enum ExtrinsicsSource {
        /// The parameters rig_from_camera and rig_from_lidar.
        Parameters = "parameters",
        /// /tf_static and /tf, by the frames that the scans and the camera's messages carry; rig_from_lidar is not read. Until
        /// tf has the transform, detection drops scans, and reports what is missing in the log and on /diagnostics.
        /// rig_from_camera stays a parameter.
        Tf = "tf",
        /// The same of both: rig_frame_id is a frame of the robot's description, such as base_link, and neither parameter is read.
        TfFromRig = "tf_from_rig",
    }
}

crate::parameters! {
    /// The frames and mounts of the rig, as parameters.
    #[derive(Clone, PartialEq, Debug)]
    pub struct RigConfig {
        /// Frame of the reduced cloud: the rig, x forward, y left, z up; with the default mounts its origin is the camera's
        /// optical centre. It is the frame whose pose is received.
        rig_frame_id: String = "rig".to_owned();
        /// Pose of the camera's optical frame in the rig: [x_m, y_m, z_m, yaw_rad, pitch_rad, roll_rad]. The default only turns
        /// optical axes (x right, y down, z forward) into the rig's. Not read with extrinsics: tf_from_rig.
        // The optical frame of REP-103.
        rig_from_camera: [f64; 6] = [0.0, 0.0, 0.0, -FRAC_PI_2, 0.0, -FRAC_PI_2];
        /// Pose of the scanner in the rig, in the same form: 5 cm below the camera.
        // Rec-HV 3.2.4: the LiDAR's origin lies 5 cm below the camera's.
        rig_from_lidar: [f64; 6] = [0.0, 0.0, -0.05, 0.0, 0.0, 0.0], read_with("extrinsics", "parameters");
        /// Where the poses of camera and scanner in the rig come from.
        extrinsics: ExtrinsicsSource = ExtrinsicsSource::Parameters;
    }
}

impl RigConfig {
    /// The mounts that the parameters give.
    #[must_use]
    pub fn mounts(&self) -> RigMounts {
        RigMounts {
            rig_from_camera: pose_from_vector(&self.rig_from_camera),
            rig_from_lidar: pose_from_vector(&self.rig_from_lidar),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    #[test]
    fn the_height_above_the_scan_is_that_above_its_plane_however_the_scanner_is_turned() {
        let point = Point3::new(3.0, -1.0, -0.6);
        for (roll_rad, sign) in [(0.0, 1.0), (PI, -1.0)] {
            let rig = RigConfig {
                rig_from_lidar: [0.1, 0.2, -0.8, 0.7, 0.0, roll_rad],
                ..RigConfig::default()
            };
            let height_m = rig.mounts().height_above_scan_m(&point);
            assert!((height_m - sign * 0.2).abs() < 1e-12, "{height_m}");
        }
        assert_eq!(RigMounts::default().height_above_scan_m(&point), -0.6 + 0.05);
    }
}
