//! The parameters of detection, their defaults, and where these come from.

mod free_space;

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use geometry::{ParameterError, PipelineConfig, PoseBuffer, RobotBox};

pub use free_space::FreeSpaceConfig;

geometry::choices! {
    /// Which beam of a run of high variability bounds the zone.
    pub enum RunBound {
        /// The beam of the largest deviation, as published (Rec-HV 3.3.2.2).
        Peak = "peak",
        /// The beam at the run's outer end. The leading edge of the object lies anywhere within the leading run, so that the
        /// peak may cut a slice off the object; the outer end never does.
        OuterEnd = "outer_end",
    }
}

geometry::parameters! {
    /// The parameters that only the method `rec_hv` reads.
    #[derive(Clone, Copy, PartialEq, Debug)]
    pub struct RecHvConfig {
        /// A beam is of high variability above this share of the scan's largest deviation.
        // Rec-HV 3.3.2.2: half of the largest deviation of the cycle.
        high_variability_share: f64 = 0.5, from_below(0.0, 1.0);
        /// Which beam of a run of high variability bounds the zone.
        run_bound: RunBound = RunBound::Peak;
    }
}

geometry::parameters! {
    /// The parameters of [`crate::Detector`] and [`crate::Matcher`].
    #[derive(Clone, PartialEq, Debug)]
    pub struct DetectionConfig {
        /// What detection shares with the other nodes of the pipeline.
        pipeline: PipelineConfig as flatten;
        /// Width of the forward aperture whose beams are used: 90 degrees. With `free_space`, all are where the camera looks beside it.
        // Rec-HV 3.2.1: of the 360 degrees only 90 are analysed.
        aperture_rad: f64 = FRAC_PI_2, above_to(0.0, TAU);
        /// Box of the rig in which everything is the robot itself: [x_min_m, y_min_m, z_min_m, x_max_m, y_max_m, z_max_m]. What the sensors see
        /// in it, a bumper, an arm, the posts before the scanner, is in no map, moves nothing, and is taken out of what segmentation publishes of
        /// scans, depth images and clouds. Zeros: there is none.
        robot_box_m: [f64; 6] = [0.0; 6];
        /// Scans in the moving window.
        // n. Rec-HV experiment 2: of 2 .. 7, the value that keeps the object's shape.
        window_scans: usize = 3, whole(2, 1000);
        /// The largest standard deviation of a scan must exceed this for anything to be moving.
        // Rec-HV conclusions: moving edges exceed 0.6 m, static clutter stays at or below 0.4 m.
        min_std_dev_m: f64 = 0.4, not_negative;
        /// Added to the zone at each side: 1 degree.
        // Rec-HV 3.4.1: 1 degree, 2 to 6 cm at the depths in question.
        zone_tolerance_rad: f64 = PI / 180.0, between(0.0, PI);
        /// Cycles for which a zone outlives its last measurement; 0 turns holding off. With the method free_space, on a platform
        /// that moves, for no more cycles than it was measured in.
        // Rec-HV is silent. One second at the RPLIDAR A1's 7 Hz: longer than a walker's pause between two steps; what rests
        // longer is furniture to this method anyway.
        max_held_cycles: u32 = 7;
        /// A cloud belongs to a scan only within this difference of their stamps.
        // Half a period of a 5 Hz camera; of one of 30 Hz two images in a row may be lost.
        max_cloud_offset_s: f64 = 0.1, positive;
        /// The pose is interpolated only between poses at most this far apart.
        max_pose_gap_s: f64 = PoseBuffer::DEFAULT_MAX_GAP_S, positive;
        /// A scan is dropped when the newest stamp received is this much later than its own.
        // Three periods of the LiDAR: odometry a few frames late still makes it.
        max_wait_s: f64 = 0.5, positive;
        /// Scans that may wait for their cloud and pose. This and the next two parameters bound the memory.
        // Scanners of up to 100 Hz within `max_wait_s`.
        max_waiting_scans: usize = 64, at_least(1.0);
        /// Clouds or depth images that are kept for scans to come.
        // A 30 Hz camera sends 18 images in `max_wait_s` + `max_cloud_offset_s`.
        max_waiting_clouds: usize = 32, at_least(1.0);
        /// Poses that are kept.
        // One second of poses at 1 kHz.
        max_waiting_poses: usize = 1024, at_least(2.0);
        /// What only the method `rec_hv` reads.
        rec_hv: RecHvConfig as flatten, read_with("method", "rec_hv");
        /// What only the method `free_space` reads.
        free_space: FreeSpaceConfig as flatten, read_with("method", "free_space");
    }
    check = Self::check_robot;
}

impl DetectionConfig {
    /// The box around the robot, where there is one.
    ///
    /// # Errors
    /// When the parameter describes none.
    pub fn robot(&self) -> Result<Option<RobotBox>, ParameterError> {
        RobotBox::of_corners(&self.robot_box_m)
    }

    fn check_robot(&self) -> Result<(), ParameterError> {
        self.robot().map(|_| ())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_are_valid_and_are_the_published_constants() {
        let config = DetectionConfig::default();
        assert_eq!(config.validate(), Ok(()));
        assert_eq!(
            (config.window_scans, config.min_std_dev_m, config.pipeline.voxel_edge_m),
            (3, 0.4, 0.08)
        );
        assert!((config.zone_tolerance_rad.to_degrees() - 1.0).abs() < 1e-12);
        assert!((config.aperture_rad.to_degrees() - 90.0).abs() < 1e-12);
    }

    #[test]
    fn each_bad_parameter_is_named() {
        type Spoil = fn(&mut DetectionConfig);
        let cases: [(&str, Spoil); 14] = [
            ("robot_box_m", |c| c.robot_box_m = [0.1, 0.0, 0.0, 0.0, 0.1, 0.1]),
            ("aperture_rad", |c| c.aperture_rad = 7.0),
            ("window_scans", |c| c.window_scans = 1),
            ("min_std_dev_m", |c| c.min_std_dev_m = f64::NAN),
            ("high_variability_share", |c| c.rec_hv.high_variability_share = 1.0),
            ("zone_tolerance_rad", |c| c.zone_tolerance_rad = -0.1),
            ("voxel_edge_m", |c| c.pipeline.voxel_edge_m = 0.0),
            ("rig_from_camera", |c| c.pipeline.rig.rig_from_camera[3] = f64::INFINITY),
            ("rig_from_lidar", |c| c.pipeline.rig.rig_from_lidar[0] = f64::NAN),
            ("max_cloud_offset_s", |c| c.max_cloud_offset_s = 0.0),
            ("max_pose_gap_s", |c| c.max_pose_gap_s = -1.0),
            ("max_wait_s", |c| c.max_wait_s = f64::INFINITY),
            ("max_waiting_scans", |c| c.max_waiting_scans = 0),
            ("max_waiting_poses", |c| c.max_waiting_poses = 1),
        ];
        for (name, spoil) in cases {
            let mut config = DetectionConfig::default();
            spoil(&mut config);
            let message = config.validate().unwrap_err().to_string();
            assert!(message.contains(name), "{message} does not name {name}");
        }
    }
}
