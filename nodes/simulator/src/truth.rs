//! What is true beside what the sensors read.

use geometry::Stamp;
use nalgebra::{Isometry3, Point3};

/// Where every moving object is when a depth image is taken.
#[derive(Clone, PartialEq, Debug)]
pub struct ObjectPoses {
    /// The stamp of the depth image.
    pub stamp: Stamp,
    /// The frame that the poses lead to.
    pub frame_id: String,
    /// One for each object of the scene, in its order, whether seen or not.
    pub objects: Vec<ObjectPose>,
}

/// Where an object is, and what the depth image shows of it.
#[derive(Clone, PartialEq, Debug)]
pub struct ObjectPose {
    /// Its label.
    pub id: u16,
    /// Its name.
    pub name: String,
    /// Takes a point of the object's frame (on the floor under it, x in its direction) to the map.
    pub map_from_object: Isometry3<f64>,
    /// Pixels of the depth image that carry its label.
    pub visible_pixels: usize,
    /// The mean of its true surface points at these pixels, in the map; `None` when there are none.
    pub visible_centroid_m: Option<Point3<f64>>,
}
