//! The faults that are planted in bags.

mod frames;
mod inputs;
mod time;
mod values;

use super::bags::Fault;

const SCAN: &str = "/scan";
const DEPTH: &str = "/camera/depth/image_raw";
const INFO: &str = "/camera/depth/camera_info";
const POSE: &str = "/pose";
const IMU: &str = "/imu/data_raw";
const CLOUD: &str = "/velodyne_points";

/// All of them.
pub(super) fn faults() -> impl Iterator<Item = &'static Fault> {
    [inputs::FAULTS, time::FAULTS, frames::FAULTS, values::FAULTS].into_iter().flatten()
}
