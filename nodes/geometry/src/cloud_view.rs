//! The depths that the camera of one cycle measured by direction, and so what it would have seen elsewhere.
//!
//! A camera that has seen a thing from here sees it again, while it is there. A direction from which nothing comes back
//! any more says that it has gone, if less surely than a ray that passes.

#[cfg(test)]
mod tests;

use nalgebra::{Isometry3, Point3, Vector2};

use crate::view::{DepthByDirection, slopes_from};

/// Nearer by, a camera with structured light is blind: the Kinect from 0.8 m on, later ones from less.
pub const NEAREST_SEEN_M: f64 = 0.8;
/// Farther than this they see nothing that can be relied on.
pub const FARTHEST_SEEN_M: f64 = 8.0;
/// A surface that was hit for longer than this, from the first hit to the last, stays in the map, although nothing comes back from
/// it later: a person right before the lens, nearer than the camera can measure, blanks out everything behind.
pub const LONGEST_STAY_S: f64 = 10.0;

/// A place that the camera saw from this many times the distance is seen as well now: the margin is the noise of poses.
pub const AS_NEAR: f64 = 1.02;
/// The cosine of the angle by which the side from which a surface is seen may have turned: 20 degrees.
const SAME_SIDE_COSINE: f64 = 0.94;
/// The largest baseline of projector and camera: 0.075 m in the Kinect v1, 0.095 m in the widest of its successors.
const BASELINE_M: f64 = 0.1;
/// An object 0.4 m away casts its shadow over this many squares of directions, onto surfaces far behind; nearer objects are not
/// seen.
const SHADOW_SQUARES: u8 = 10;
/// A point hides directions this far around it: half the diagonal of its voxel's face.
const HALF_DIAGONAL_IN_EDGES: f64 = std::f64::consts::FRAC_1_SQRT_2;
/// Points that are nearer or farther by at most this are of the same surface: a point is the mean over a voxel.
const SAME_SURFACE_IN_EDGES: f64 = 1.5;

/// The depths that the camera of one cycle measured, by direction.
#[derive(Clone, Debug)]
pub struct CloudView {
    /// The pose of the rig.
    pub map_from_rig: Isometry3<f64>,
    /// The camera's optical centre in the rig frame.
    pub camera_in_rig_m: Point3<f64>,
    /// The edge of the voxels that the points are means of, in metres.
    pub edge_m: f64,
    nearest: DepthByDirection,
    farthest_m: f64,
}

/// Direction and depth of a place as seen by the camera.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Bearing {
    /// How far to the left and up for each metre forward.
    pub slopes: Vector2<f64>,
    /// How far forward, in metres.
    pub depth_m: f64,
    /// How far around the place its voxel hides what is behind, in slopes.
    pub hides: Vector2<f64>,
}

impl CloudView {
    /// Nothing measured yet. The voxels' edge is positive.
    #[must_use]
    pub fn new(map_from_rig: Isometry3<f64>, camera_in_rig_m: Point3<f64>, edge_m: f64) -> Self {
        let nearest = DepthByDirection::default();
        Self { map_from_rig, camera_in_rig_m, edge_m, nearest, farthest_m: 0.0 }
    }

    /// Adds a measured point of the rig frame. Returns its bearing; `None` where the camera cannot have measured it.
    pub fn meet(&mut self, point_in_rig: &Point3<f64>) -> Option<Bearing> {
        let bearing = self.bearing(point_in_rig)?;
        self.nearest.keep_nearest(&bearing.slopes, &bearing.hides, bearing.depth_m);
        self.farthest_m = self.farthest_m.max(bearing.depth_m);
        Some(bearing)
    }

    /// Where a point of the rig frame lies; `None` beside or behind the camera.
    #[must_use]
    pub fn bearing(&self, point_in_rig: &Point3<f64>) -> Option<Bearing> {
        let slopes = slopes_from(&self.camera_in_rig_m, point_in_rig)?;
        let depth_m = point_in_rig.x - self.camera_in_rig_m.x;
        let hides = Vector2::repeat(HALF_DIAGONAL_IN_EDGES * self.edge_m / depth_m);
        Some(Bearing { slopes, depth_m, hides })
    }

    /// The same of a point of the map.
    #[must_use]
    pub fn bearing_in_map(&self, place_in_map: &Point3<f64>) -> Option<Bearing> {
        self.bearing(&self.map_from_rig.inverse_transform_point(place_in_map))
    }

    /// The nearest depth that was measured in each direction.
    #[must_use]
    pub fn nearest(&self) -> &DepthByDirection {
        &self.nearest
    }

    /// The farthest depth that was measured at all, in metres; 0 where nothing was.
    #[must_use]
    pub fn farthest_m(&self) -> f64 {
        self.farthest_m
    }

    /// The camera's optical centre.
    #[must_use]
    pub fn camera_in_map_m(&self) -> Point3<f64> {
        self.map_from_rig * self.camera_in_rig_m
    }

    /// How much nearer or farther a point may be and still be of the same surface, in metres.
    #[must_use]
    pub fn same_surface_m(&self) -> f64 {
        SAME_SURFACE_IN_EDGES * self.edge_m
    }

    /// Whether no return came back from around a place, though it is neither too near nor too far for depth cameras
    /// and no nearer surface is so close beside it that the projector's shadow may fall there. `farthest` holds the farthest depth
    /// that the camera ever measured by direction: where that is never as far away, a part of the platform may be before it,
    /// or the image ends.
    #[must_use]
    pub fn is_blank(&self, place: &Bearing, farthest: &DepthByDirection) -> bool {
        let reaches = |hit_m: f64| hit_m + self.same_surface_m() >= place.depth_m;
        (NEAREST_SEEN_M..=FARTHEST_SEEN_M).contains(&place.depth_m)
            && farthest.depth_m(&place.slopes).is_some_and(reaches)
            && self.nearest.depth_m(&place.slopes).is_none()
            && !self.may_be_in_shadow(place)
    }

    /// Whether the depth measured in the direction of a place is clearly behind it.
    #[must_use]
    pub fn sees_past(&self, place: &Bearing) -> bool {
        let hit_m = self.nearest.depth_m(&place.slopes);
        hit_m.is_some_and(|hit_m| hit_m > place.depth_m + self.same_surface_m())
    }

    /// Whether a place of the map is seen as well as by a camera elsewhere: no farther away, and from the same side. A
    /// dark surface that slants comes back from one place and not from another.
    #[must_use]
    pub fn sees_as_well_as(&self, other_in_map: &Point3<f64>, place_in_map: &Point3<f64>) -> bool {
        let (other, own) = (other_in_map - place_in_map, self.camera_in_map_m() - place_in_map);
        own.norm() <= AS_NEAR * other.norm()
            && own.dot(&other) >= SAME_SIDE_COSINE * own.norm() * other.norm()
    }

    /// Whether a nearer surface is so close beside a direction that it may hide a place there from the projector.
    fn may_be_in_shadow(&self, place: &Bearing) -> bool {
        let before_m = place.depth_m - self.same_surface_m();
        (1..=SHADOW_SQUARES).any(|squares| {
            let aside = f64::from(squares) * DepthByDirection::SQUARE_SLOPE;
            // Both may lie anywhere in their squares.
            let at_least = aside - DepthByDirection::SQUARE_SLOPE;
            [aside, -aside].into_iter().any(|aside| {
                let beside = place.slopes + Vector2::new(aside, 0.0);
                self.nearest.depth_m(&beside).is_some_and(|hit_m| {
                    hit_m < before_m && at_least <= BASELINE_M * (1.0 / hit_m - 1.0 / place.depth_m)
                })
            })
        })
    }
}
