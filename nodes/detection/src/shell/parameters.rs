//! What the node says of its parameters to those outside.

use std::f64::consts::{PI, TAU};

use node_shell::NodeFailure;
use node_shell::parameters::{NodeParameters, Range};

use super::{DetectionParameters, extrinsics};

/// Seconds that [`crate::StillmapConfig`] can count.
const LONGEST_S: f64 = 1e6;
const BELOW_ONE: f64 = 1.0_f64.next_down();
const ABOVE_ZERO: f64 = 0.0_f64.next_up();

impl NodeParameters for DetectionParameters {
    const FILE: &'static str = include_str!("../../../../config/detection.yaml");
    const RANGES: &'static [(&'static str, Range)] = &[
        ("extrinsics_check_period_s", Range::NOT_NEGATIVE),
        ("extrinsics_limit_m", Range::POSITIVE),
        ("aperture_rad", Range::real(ABOVE_ZERO, TAU)),
        ("window_scans", Range::whole(2, 1000)),
        ("min_std_dev_m", Range::NOT_NEGATIVE),
        ("high_variability_share", Range::real(0.0, BELOW_ONE)),
        ("zone_tolerance_rad", Range::real(0.0, PI)),
        ("max_held_cycles", Range::whole(0, u32::MAX as i64)),
        ("voxel_edge_m", Range::POSITIVE),
        ("max_cloud_offset_s", Range::POSITIVE),
        ("max_pose_gap_s", Range::POSITIVE),
        ("max_wait_s", Range::POSITIVE),
        ("max_waiting_scans", Range::at_least(1)),
        ("max_waiting_clouds", Range::at_least(1)),
        ("max_waiting_poses", Range::at_least(2)),
        ("evidence_cell_m", Range::POSITIVE),
        ("evidence_extent_m", Range::POSITIVE),
        ("evidence_reach_m", Range::POSITIVE),
        ("evidence_memory_s", Range::real(ABOVE_ZERO, LONGEST_S)),
        ("stopped_object_s", Range::real(ABOVE_ZERO, LONGEST_S)),
        ("min_passes", Range::whole(1, 50)),
        ("range_noise_m", Range::NOT_NEGATIVE),
        ("range_noise_ratio", Range::real(0.0, BELOW_ONE)),
        ("pose_noise_m", Range::NOT_NEGATIVE),
        ("pose_noise_rad", Range::real(0.0, PI)),
        ("smallest_object_m", Range::NOT_NEGATIVE),
        ("max_platform_speed_m_per_s", Range::POSITIVE),
        ("max_platform_turn_rad_per_s", Range::POSITIVE),
    ];
    /// What the evidence and the waiting messages stand on stays.
    const CHANGEABLE: &'static [&'static str] =
        &["extrinsics_check_period_s", "extrinsics_limit_m"];

    fn validate(&self) -> Result<(), NodeFailure> {
        self.config.validate()?;
        extrinsics::validate(self)?;
        Ok(())
    }
}
