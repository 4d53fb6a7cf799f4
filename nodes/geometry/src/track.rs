//! A moving object, followed over the cycles.

use nalgebra::{Matrix6, Point3, Vector3};

/// The state of a moving object in one cycle.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Track {
    /// The object's number; never used for another object of the same run.
    pub id: u32,
    /// The centre of the object in the map.
    pub position_m: Point3<f64>,
    /// Its velocity in the map, in m/s.
    pub velocity_m_per_s: Vector3<f64>,
    /// Its edge lengths along the axes of the map.
    pub extent_m: Vector3<f64>,
    /// Covariance of position and velocity, in the order x, y, z, vx, vy, vz.
    pub covariance: Matrix6<f64>,
    /// Time since it was first seen.
    pub age_s: f64,
    /// Cycles since it was last seen; 0 when this cycle saw it.
    pub unseen_cycles: u32,
}
