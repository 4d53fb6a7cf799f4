//! The ground truth of the readings.

use geometry::Stamp;
use nalgebra::{Isometry3, Point3, Vector3};

use crate::solid::Solid;

/// The pose of every moving object at a depth image.
#[derive(Clone, PartialEq, Debug)]
pub struct ObjectPoses {
    /// The stamp of the depth image.
    pub stamp: Stamp,
    /// The parent frame of the poses.
    pub frame_id: String,
    /// One for each object of the scene, in its order, visible or not.
    pub objects: Vec<ObjectPose>,
}

/// The pose of an object, and its pixels in the depth image.
#[derive(Clone, PartialEq, Debug)]
pub struct ObjectPose {
    /// Its label.
    pub id: u16,
    /// Its name.
    pub name: String,
    /// The transform from the object's frame (on the floor under it, x in its direction) to the map.
    pub map_from_object: Isometry3<f64>,
    /// The centre of the whole object in the map frame: of its bounding box along the axes of the map.
    pub centre_m: Point3<f64>,
    /// The edge lengths of that box along the axes of the map.
    pub extent_m: Vector3<f64>,
    /// The velocity of that centre in the map frame, as of a rigid body (swinging limbs do not count).
    pub velocity_m_per_s: Vector3<f64>,
    /// Pixels of the depth image with its label.
    pub visible_pixels: usize,
    /// The mean of its true surface points at these pixels, in the map frame; `None` when there are none.
    pub visible_centroid_m: Option<Point3<f64>>,
}

/// The bounding box of an object along the axes of the map. Each part counts with its own cuboid.
pub(crate) struct Hull {
    pub(crate) centre_m: Point3<f64>,
    pub(crate) extent_m: Vector3<f64>,
}

impl Hull {
    /// The bounding box of an object's parts; without parts, a point in the map's origin.
    pub(crate) fn of(solids: &[Solid], map_from_room: &Isometry3<f64>) -> Self {
        let bounds = solids.iter().map(|solid| {
            let map_from_solid = map_from_room * solid.solid_from_room.inverse();
            let half_m =
                map_from_solid.rotation.to_rotation_matrix().matrix().abs() * solid.half_extent_m();
            let middle_m = map_from_solid.translation.vector;
            (middle_m - half_m, middle_m + half_m)
        });
        let (least_m, most_m) = bounds
            .reduce(|(least, most), (low, high)| (least.inf(&low), most.sup(&high)))
            .unwrap_or_default();
        Self { centre_m: Point3::from((least_m + most_m) / 2.0), extent_m: most_m - least_m }
    }
}
