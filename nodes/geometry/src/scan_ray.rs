//! The rays of a scan, where the platform was when each was measured.

use nalgebra::Point3;

/// A ray of a scan that ended at something, in the rig frame of the cycle's pose: where the platform moves while the scanner
/// turns, each ray starts elsewhere.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ScanRay {
    /// Where it starts.
    pub from_m: Point3<f32>,
    /// Where it ends.
    pub to_m: Point3<f32>,
    /// Whether it ends at something that moves, or may.
    pub is_moving: bool,
    /// Whether the next ray is that of the next beam.
    pub joins_next: bool,
}
