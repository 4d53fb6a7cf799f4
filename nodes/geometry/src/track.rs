//! A moving object, followed over the cycles.

use nalgebra::{Matrix6, Point3, Vector3};

use crate::Stamp;

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

/// The moving objects of one cycle.
#[derive(Clone, PartialEq, Debug)]
pub struct CycleTracks {
    /// The cycle's number, as detection gave it.
    pub index: u32,
    /// The stamp of its cloud.
    pub stamp: Stamp,
    /// The frame of the tracks: the map.
    pub map_frame_id: String,
    /// The objects, by rising number.
    pub tracks: Vec<Track>,
}
