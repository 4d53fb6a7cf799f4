//! Sensors that measure ranges: the scanners and the depth camera.

use std::f64::consts::TAU;

use geometry::{CameraModel, Distortion};

use super::{
    Checked, MAX_LENGTH_M, ScenarioError, check_pose, not_negative, number, positive, rate, ratio,
};
use crate::{DepthCamera, Lidar, StampError, Velodyne};

/// The largest image: more than 16 times that of a Kinect v1.
pub(super) const MAX_PIXELS: usize = 1 << 23;
/// The largest scan: more than ten beams per degree.
pub(super) const MAX_BEAMS: usize = 1 << 14;
/// The largest clock error.
const MAX_SKEW_S: f64 = 3600.0;

pub(super) fn check_lidar(lidar: &Lidar) -> Checked {
    if !(1..=MAX_BEAMS).contains(&lidar.beams) {
        return Err(ScenarioError::Beams { beams: lidar.beams });
    }
    check_pose(&lidar.rig_from_lidar, "the scanner")?;
    if let Some([first_rad, last_rad]) = lidar.azimuths_rad {
        let span_rad = last_rad - first_rad;
        number(
            "the span of lidar.azimuths_rad",
            span_rad,
            |v| v != 0.0 && v.abs() <= TAU,
            "not 0, at most a full turn",
        )?;
    }
    rate("lidar.turn_rate_hz", lidar.turn_rate_hz)?;
    // A start never deviates by more than 3.47 times this: 0.1 keeps turns in their order.
    number("lidar.turn_jitter", lidar.turn_jitter, |v| (0.0..=0.1).contains(&v), "0 to 0.1")?;
    not_negative("lidar.range_min_m", lidar.range_min_m)?;
    positive("lidar.range_max_m", lidar.range_max_m)?;
    not_negative("lidar.range_noise_m", lidar.range_noise_m)?;
    not_negative("lidar.range_noise_ratio", lidar.range_noise_ratio)?;
    positive("lidar.range_step_m", lidar.range_step_m)?;
    not_negative("lidar.azimuth_spread_rad", lidar.azimuth_spread_rad)?;
    ratio("lidar.dropout_ratio", lidar.dropout_ratio)?;
    positive("lidar.min_signal", lidar.min_signal)?;
    check_stamps("lidar.stamps", &lidar.stamps, lidar.turn_rate_hz)
}

pub(super) fn check_depth_camera(depth: &DepthCamera) -> Checked {
    check_intrinsics("depth_camera", &depth.camera)?;
    check_pose(&depth.rig_from_camera, "the depth camera")?;
    rate("depth_camera.rate_hz", depth.rate_hz)?;
    not_negative("depth_camera.first_image_s", depth.first_image_s)?;
    number(
        "depth_camera.depth_min_m",
        depth.depth_min_m,
        |v| (0.05..10.0).contains(&v),
        "0.05 to 10",
    )?;
    number(
        "depth_camera.depth_max_m",
        depth.depth_max_m,
        |v| v > depth.depth_min_m && v <= 65.535,
        "above depth_min_m and at most 65.535",
    )?;
    number(
        "depth_camera.disparity_step_per_m",
        depth.disparity_step_per_m,
        |v| (1e-4..=1.0).contains(&v),
        "0.0001 to 1",
    )?;
    not_negative("depth_camera.disparity_noise_steps", depth.disparity_noise_steps)?;
    not_negative("depth_camera.projector_baseline_m", depth.projector_baseline_m)?;
    ratio("depth_camera.dropout_ratio", depth.dropout_ratio)?;
    positive("depth_camera.min_signal", depth.min_signal)?;
    check_stamps("depth_camera.stamps", &depth.stamps, depth.rate_hz)
}

pub(super) fn check_velodyne(velodyne: &Velodyne) -> Checked {
    check_pose(&velodyne.rig_from_velodyne, "the 3D scanner")?;
    number(
        "velodyne.turn_rate_hz",
        velodyne.turn_rate_hz,
        // The range of the motors of these models.
        |v| (1.0..=20.0).contains(&v),
        "1 to 20",
    )?;
    not_negative("velodyne.range_min_m", velodyne.range_min_m)?;
    positive("velodyne.range_max_m", velodyne.range_max_m)?;
    not_negative("velodyne.range_noise_m", velodyne.range_noise_m)?;
    positive("velodyne.range_step_m", velodyne.range_step_m)?;
    not_negative("velodyne.intensity_noise", velodyne.intensity_noise)?;
    ratio("velodyne.dropout_ratio", velodyne.dropout_ratio)?;
    positive("velodyne.min_signal", velodyne.min_signal)
}

pub(super) fn check_intrinsics(of: &str, camera: &CameraModel) -> Checked {
    let (width_px, height_px) = (camera.width_px, camera.height_px);
    let pixels = width_px.checked_mul(height_px);
    if !pixels.is_some_and(|pixels| (1..=MAX_PIXELS).contains(&pixels)) {
        return Err(ScenarioError::ImageSize { width_px, height_px });
    }
    if camera.distortion != Distortion::None {
        return Err(ScenarioError::Distorted);
    }
    positive(format!("{of}.camera.fx_px"), camera.fx_px)?;
    positive(format!("{of}.camera.fy_px"), camera.fy_px)?;
    for (name, value) in [("cx_px", camera.cx_px), ("cy_px", camera.cy_px)] {
        let what = format!("{of}.camera.{name}");
        number(&what, value, |v| v.abs() <= MAX_LENGTH_M, "-1e6 to 1e6")?;
    }
    Ok(())
}

fn check_stamps(of: &str, stamps: &StampError, rate_hz: f64) -> Checked {
    let (skew, jitter) = (format!("{of}.skew_s"), format!("{of}.jitter_s"));
    number(&skew, stamps.skew_s, |v| v.abs() <= MAX_SKEW_S, "-3600 to 3600")?;
    number(
        &jitter,
        stamps.jitter_s,
        // A stamp never deviates by more than 3.47 times this: 0.1 keeps stamps in their order.
        |v| v >= 0.0 && v * rate_hz <= 0.1,
        "0 to a tenth of the sensor's period",
    )
}
