//! The records, as version 1 has them. What they hold may change in memory; here it may not.

mod conversion;

use serde::{Deserialize, Serialize};

/// The header.
#[derive(Serialize, Deserialize)]
pub(super) struct Head {
    world_from_map: Pose,
    scale_factor: f64,
    levels: u8,
    pub(super) keyframes_so_far: u64,
    pub(super) keyframes: u64,
    pub(super) points: u64,
    pub(super) lines: u64,
}

/// Shift in metres, and quaternion with the scalar last.
#[derive(Clone, Copy, Serialize, Deserialize)]
struct Pose([f64; 7]);

/// 256 bits, the four words of memory one after the other, little-endian.
type Bits = [u8; 32];

/// A keyframe and its features.
#[derive(Serialize, Deserialize)]
pub(super) struct SavedKeyframe {
    number: u64,
    stamp_ns: i64,
    camera: SavedCamera,
    camera_from_map: Pose,
    parent: Option<u32>,
    loops: Vec<(u32, Pose)>,
    odometry: Option<SavedOdometry>,
    corners: Vec<SavedCorner>,
    segments: Vec<SavedSegment>,
}

/// The pose of a keyframe by odometry.
#[derive(Serialize, Deserialize)]
struct SavedOdometry {
    leg: u64,
    camera_from_odom: Pose,
    travelled_m: f64,
    turned_rad: f64,
}

/// Focal lengths and principal point in pixels.
#[derive(Serialize, Deserialize)]
struct SavedCamera {
    width_px: u32,
    height_px: u32,
    focal_and_principal_px: [f64; 4],
    distortion: SavedDistortion,
}

/// A rectified camera has none.
#[derive(Serialize, Deserialize)]
enum SavedDistortion {
    None,
    PlumbBob([f64; 5]),
    Rational([f64; 8]),
    RationalPrism([f64; 12]),
    Equidistant([f64; 4]),
}

#[derive(Serialize, Deserialize)]
struct SavedCorner {
    pixel: [f32; 2],
    level: u8,
    angle_rad: f32,
    response: f32,
    descriptor: Bits,
    /// And standard deviation, in metres.
    depth: Option<[f64; 2]>,
    point: Option<u32>,
}

#[derive(Serialize, Deserialize)]
struct SavedSegment {
    start_px: [f32; 2],
    end_px: [f32; 2],
    response: f32,
    descriptor: Bits,
    /// Start, end, standard deviations of their depths, deviation: metres; and the support.
    in_space: Option<[f64; 10]>,
    line: Option<u32>,
}

/// A point of the map.
#[derive(Serialize, Deserialize)]
pub(super) struct SavedPoint {
    position_m: [f64; 3],
    descriptor: Bits,
    towards_cameras: [f64; 3],
    nearest_and_farthest_m: [f64; 2],
    born: u64,
    predicted_and_found: [u32; 2],
}

/// A line of the map.
#[derive(Serialize, Deserialize)]
pub(super) struct SavedLine {
    ends_m: [[f64; 3]; 2],
    descriptor: Bits,
    born: u64,
    predicted_and_found: [u32; 2],
}
