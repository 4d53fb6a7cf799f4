//! How far the seen ends of a segment lie from the image of the line of the map, and from the line itself along their rays.
//!
//! It is the seen ends that are compared with the map's line, not the ends of the map's line with the seen one. To first
//! order both say the same when the ends are the same points of the line. But the ends of a segment are where light or
//! another thing cuts it, and a short segment says little of where its line runs farther off: the distance of an end of
//! the map would have to be weighed by how far off it is, and the two distances would not be independent.

use geometry::CameraModel;
use nalgebra::{Point2, Point3, Vector3};

use super::{Block, Errors, MAX_ROWS, NEAREST_M, PIXEL_ROWS, Placed, Term, by_perturbation};
use super::{is_finite_point, is_std_dev};
use crate::solve::{LineObservation, PluckerLine, plucker};

/// The sine of the angle at which a line must be seen: 6 degrees. A line that runs nearly through the camera has an image that
/// swings about with the slightest step; random errors would seem to determine the pose very accurately.
const SHALLOWEST: f64 = 0.1;
/// Half of that during a descent: a line that is used must not come and go with every step.
const SHALLOWEST_USED: f64 = 0.05;

/// A line that can be used.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LineTerm {
    start_in_map_m: Vector3<f64>,
    end_in_map_m: Vector3<f64>,
    ends: [SeenEnd; 2],
    per_px: f64,
    per_m: f64,
}

#[derive(Clone, Copy, Debug)]
struct SeenEnd {
    pixel_px: Point2<f64>,
    /// The ray through the pixel, 1 m deep.
    ray: Vector3<f64>,
    depth_m: Option<f64>,
}

/// Where the ray of a seen end passes the line: the point of the line in the plane that holds the ray and stands upright
/// on the plane through the line and the camera. With the derivatives of its depth.
struct Passing {
    place: Vector3<f64>,
    /// How the depth changes as the line's points move alike.
    by_place: Vector3<f64>,
    /// How it changes with the moment, which tilts the plane.
    by_moment: Vector3<f64>,
}

/// A line of the camera frame.
struct InCamera {
    start: Vector3<f64>,
    direction: Vector3<f64>,
    moment: Vector3<f64>,
}

impl LineTerm {
    pub(crate) fn new(camera: &CameraModel, seen: &LineObservation) -> Option<Self> {
        let depths = [seen.start_depth_m, seen.end_depth_m];
        let line_usable = is_finite_point(&seen.start_in_map_m)
            && is_finite_point(&seen.end_in_map_m)
            && PluckerLine::through(&seen.start_in_map_m, &seen.end_in_map_m).is_some();
        let length_px = (seen.end_px - seen.start_px).norm();
        // Ends that cannot be distinguished are not two.
        let segment_usable = is_std_dev(seen.pixel_std_dev_px)
            && length_px.is_finite()
            && length_px > seen.pixel_std_dev_px;
        let depths_usable = depths.iter().flatten().all(|depth_m| {
            depth_m.is_finite() && *depth_m > NEAREST_M && is_std_dev(seen.depth_std_dev_m)
        });
        let end = |pixel_px: Point2<f64>, depth_m| {
            let ray = camera.ray(&pixel_px)?.push(1.0);
            Some(SeenEnd { pixel_px, ray, depth_m })
        };
        if !(line_usable && segment_usable && depths_usable) {
            return None;
        }
        Some(Self {
            start_in_map_m: seen.start_in_map_m.coords,
            end_in_map_m: seen.end_in_map_m.coords,
            ends: [end(seen.start_px, depths[0])?, end(seen.end_px, depths[1])?],
            per_px: seen.pixel_std_dev_px.recip(),
            per_m: seen.depth_std_dev_m.recip(),
        })
    }

    /// The same, were the line elsewhere: through these two points.
    #[inline]
    pub(crate) fn moved(&self, in_map_m: &[Point3<f64>; 2]) -> Self {
        let [start_in_map_m, end_in_map_m] = in_map_m.map(|point| point.coords);
        Self { start_in_map_m, end_in_map_m, ..*self }
    }

    #[inline]
    fn placed(&self, pose: &Placed) -> InCamera {
        let start = pose.in_camera(&self.start_in_map_m);
        let direction = pose.rotation * (self.end_in_map_m - self.start_in_map_m);
        InCamera { start, direction, moment: start.cross(&direction) }
    }
}

impl InCamera {
    /// `None` where the ray runs nearly along the line, or passes it behind the camera.
    #[inline]
    fn passing(&self, ray: &Vector3<f64>, shallowest: f64) -> Option<Passing> {
        let plane = ray.cross(&self.moment);
        let slant = plane.dot(&self.direction);
        let least2 = shallowest * shallowest * plane.norm_squared() * self.direction.norm_squared();
        if slant * slant < least2 {
            return None;
        }
        let along = -plane.dot(&self.start) / slant;
        let place = self.start + along * self.direction;
        // NaN and infinity are not in front either.
        if !(place.z > NEAREST_M && place.z.is_finite()) {
            return None;
        }
        let slope = -self.direction.z / slant;
        Some(Passing {
            place,
            by_place: Vector3::z() + slope * plane,
            by_moment: slope * place.cross(ray),
        })
    }

    /// The derivative by the perturbation of what changes so as the moment does: the moment moves by
    /// `v x direction + w x moment`.
    #[inline]
    fn by_perturbation(&self, by_moment: &Vector3<f64>) -> [f64; 6] {
        let (shift, turn) = (self.direction.cross(by_moment), self.moment.cross(by_moment));
        [shift.x, shift.y, shift.z, turn.x, turn.y, turn.z]
    }
}

impl Term for LineTerm {
    fn rows(&self) -> usize {
        PIXEL_ROWS + self.ends.iter().filter(|end| end.depth_m.is_some()).count()
    }

    #[inline]
    fn errors(&self, camera: &CameraModel, pose: &Placed) -> Option<Errors> {
        let line = self.placed(pose);
        let (mut pixel_chi2, mut depth_chi2) = (0.0, 0.0);
        for end in &self.ends {
            let (distance_px, _) = plucker::distance_px(camera, &line.moment, &end.pixel_px)?;
            pixel_chi2 += (distance_px * self.per_px).powi(2);
            let depth_there_m = line.passing(&end.ray, SHALLOWEST)?.place.z;
            let off_m = end.depth_m.map_or(0.0, |depth_m| depth_there_m - depth_m);
            depth_chi2 += (off_m * self.per_m).powi(2);
        }
        Some(Errors { pixel_chi2, chi2: pixel_chi2 + depth_chi2 })
    }

    #[inline]
    fn block(&self, camera: &CameraModel, pose: &Placed) -> Option<Block> {
        let line = self.placed(pose);
        let mut block =
            Block { errors: [0.0; MAX_ROWS], jacobian: [[0.0; 6]; MAX_ROWS], rows: PIXEL_ROWS };
        for (row, end) in self.ends.iter().enumerate() {
            let (distance_px, by_moment) =
                plucker::distance_px(camera, &line.moment, &end.pixel_px)?;
            block.errors[row] = distance_px * self.per_px;
            block.jacobian[row] = line.by_perturbation(&(by_moment * self.per_px));
            let passing = line.passing(&end.ray, SHALLOWEST_USED)?;
            if let Some(depth_m) = end.depth_m {
                let straight = by_perturbation(&passing.place, &(passing.by_place * self.per_m));
                let tilted = line.by_perturbation(&(passing.by_moment * self.per_m));
                block.errors[block.rows] = (passing.place.z - depth_m) * self.per_m;
                block.jacobian[block.rows] =
                    std::array::from_fn(|column| straight[column] + tilted[column]);
                block.rows += 1;
            }
        }
        Some(block)
    }
}
