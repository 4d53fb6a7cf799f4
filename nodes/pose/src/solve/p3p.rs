//! The pose of a camera by three points in the directions in which it sees them.
//!
//! The formulation of Persson and Nordberg 2018, "Lambda Twist: an accurate fast robust perspective three point (P3P)
//! solver": the three distances along the rays satisfy three quadratic equations; a combination of two of them that is a pair of
//! planes splits the problem into quadratic ones, and Newton's method then sharpens the distances.

mod conic;
#[cfg(test)]
mod tests;

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};

use conic::plane_pair;

/// Three points never have more poses.
const MAX_POSES: usize = 4;
/// Newton's method doubles the digits with each step.
const NEWTON_STEPS: usize = 5;
/// The residual of the equations after that, in units of the largest distance between the points (squared): more is no
/// solution.
const LEFT_OVER: f64 = 1e-8;
/// Sides of the triangle that are shorter than this share of the longest, or a triangle that is as flat, make no frame.
const LEAST_WIDTH: f64 = 1e-6;
/// Distances whose sum of differences is a smaller share of them are one solution.
const SAME: f64 = 1e-6;

/// The poses, at most four, from which three points of the map are seen along three rays of the camera frame. The rays point
/// forward; their lengths mean nothing.
///
/// None when the points are on a line, when two rays are one, or when a number is not finite. In the order of no
/// preference; a fourth point decides which is right.
#[must_use]
pub fn p3p(points_in_map_m: &[Point3<f64>; 3], rays: &[Vector3<f64>; 3]) -> Vec<Isometry3<f64>> {
    let mut poses = Vec::with_capacity(MAX_POSES);
    let Some(triangle) = Triangle::new(points_in_map_m, rays) else { return poses };
    for distances in triangle.distances() {
        let seen = [0, 1, 2].map(|index| triangle.rays[index] * distances[index] * triangle.size_m);
        if let Some(rotation) = rotation_between(points_in_map_m, &seen) {
            let translation = Translation3::from(seen[0] - rotation * points_in_map_m[0].coords);
            poses.push(Isometry3::from_parts(translation, rotation));
        }
    }
    poses
}

/// The equations `l' M l = 1` with the distances `l` along the rays, by the squared sides of the triangle.
struct Triangle {
    rays: [Vector3<f64>; 3],
    /// The longest side.
    size_m: f64,
    /// Squared sides between the points 0 and 1, 0 and 2, 1 and 2, in units of the longest squared.
    sides: [f64; 3],
    /// The cosines between their rays.
    cosines: [f64; 3],
}

/// The points of each side.
const SIDES: [[usize; 2]; 3] = [[0, 1], [0, 2], [1, 2]];

impl Triangle {
    fn new(points_m: &[Point3<f64>; 3], rays: &[Vector3<f64>; 3]) -> Option<Self> {
        let squares = SIDES.map(|[one, other]| (points_m[one] - points_m[other]).norm_squared());
        let longest = squares.iter().copied().fold(0.0, f64::max);
        let unit = |ray: &Vector3<f64>| ray.try_normalize(f64::MIN_POSITIVE);
        let rays = [unit(&rays[0])?, unit(&rays[1])?, unit(&rays[2])?];
        let cosines = SIDES.map(|[one, other]| rays[one].dot(&rays[other]));
        let finite = longest.is_finite() && longest > 0.0 && cosines.iter().all(|c| c.is_finite());
        finite.then(|| Self {
            rays,
            size_m: longest.sqrt(),
            sides: squares.map(|square| square / longest),
            cosines,
        })
    }

    /// The quadratic form of a side.
    fn form(&self, side: usize) -> Matrix3<f64> {
        let [one, other] = SIDES[side];
        let mut form = Matrix3::zeros();
        form[(one, one)] = 1.0;
        form[(other, other)] = 1.0;
        form[(one, other)] = -self.cosines[side];
        form[(other, one)] = -self.cosines[side];
        form
    }

    /// All solutions with three positive distances.
    fn distances(&self) -> Vec<Vector3<f64>> {
        let mut found: Vec<Vector3<f64>> = Vec::with_capacity(MAX_POSES);
        // Two combinations without a right side, and one of these that is a pair of planes.
        let last = self.form(2);
        let first = self.sides[2] * self.form(0) - self.sides[0] * last;
        let second = self.sides[2] * self.form(1) - self.sides[1] * last;
        let Some((planes, other)) = plane_pair(&first, &second) else { return found };
        for plane in planes {
            for direction in conic::in_plane(&plane, &other) {
                let Some(distances) =
                    self.scaled(&direction).and_then(|start| self.sharpened(start))
                else {
                    continue;
                };
                let known =
                    |known: &Vector3<f64>| (known - distances).abs().sum() < SAME * distances.sum();
                if !found.iter().any(known) {
                    found.push(distances);
                }
            }
        }
        found.truncate(MAX_POSES);
        found
    }

    /// The length that a direction of the distances must have. `None` when one of them would be behind the camera.
    fn scaled(&self, direction: &Vector3<f64>) -> Option<Vector3<f64>> {
        let forward = if direction.sum() < 0.0 { -direction } else { *direction };
        // All three sides at once: each alone may be short.
        let square: f64 = (0..3).map(|side| forward.dot(&(self.form(side) * forward))).sum();
        let distances = forward * (self.sides.iter().sum::<f64>() / square).sqrt();
        distances
            .iter()
            .all(|distance| *distance > 0.0 && distance.is_finite())
            .then_some(distances)
    }

    /// Newton's method on the three equations. `None` when it leads nowhere.
    fn sharpened(&self, mut distances: Vector3<f64>) -> Option<Vector3<f64>> {
        for _ in 0..NEWTON_STEPS {
            let (errors, slopes) = self.errors(&distances);
            // Where the equations touch there is no inverse: what has been reached must do.
            let Some(inverse) = slopes.try_inverse() else { break };
            let next = distances - inverse * errors;
            if self.errors(&next).0.norm_squared() >= errors.norm_squared() {
                break;
            }
            distances = next;
        }
        let solved = self.errors(&distances).0.amax() < LEFT_OVER;
        (solved && distances.iter().all(|distance| *distance > 0.0)).then_some(distances)
    }

    fn errors(&self, distances: &Vector3<f64>) -> (Vector3<f64>, Matrix3<f64>) {
        let mut slopes = Matrix3::zeros();
        let errors = Vector3::from_fn(|side, _| {
            let [one, other] = SIDES[side];
            let (a, b, cosine) = (distances[one], distances[other], self.cosines[side]);
            slopes[(side, one)] = 2.0 * (a - cosine * b);
            slopes[(side, other)] = 2.0 * (b - cosine * a);
            a * a + b * b - 2.0 * cosine * a * b - self.sides[side]
        });
        (errors, slopes)
    }
}

/// The rotation that turns a triangle to another one of the same sides.
fn rotation_between(
    points_in_map_m: &[Point3<f64>; 3],
    seen_m: &[Vector3<f64>; 3],
) -> Option<UnitQuaternion<f64>> {
    let in_map =
        frame(points_in_map_m[1] - points_in_map_m[0], points_in_map_m[2] - points_in_map_m[0])?;
    let in_camera = frame(seen_m[1] - seen_m[0], seen_m[2] - seen_m[0])?;
    let rotation = Rotation3::from_matrix_unchecked(in_camera * in_map.transpose());
    Some(UnitQuaternion::from_rotation_matrix(&rotation))
}

/// Axes along a side and across the triangle. `None` for one that is flat.
fn frame(first: Vector3<f64>, second: Vector3<f64>) -> Option<Matrix3<f64>> {
    let normal = first.cross(&second);
    let size = first.norm().max(second.norm());
    let along = first.try_normalize(LEAST_WIDTH * size)?;
    let normal = normal.try_normalize(LEAST_WIDTH * size * size)?;
    Some(Matrix3::from_columns(&[along, normal.cross(&along), normal]))
}
