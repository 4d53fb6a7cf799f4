//! Where a point is, as far as it is known.
//!
//! A place is kept as the camera that first saw it would say it: the ray, and the inverse of the depth along it. In these
//! numbers a place is Gaussian when its depth is hardly known (Civera, Davison and Montiel 2008, "Inverse depth
//! parametrization for monocular SLAM"), and so is what a camera of structured light measures.

use geometry::CameraModel;
use nalgebra::{Isometry3, Matrix2, Matrix2x3, Matrix3, Point2, Point3, Vector2, Vector3};

use super::{LocalMapConfig, View};
use crate::frame::MeasuredDepth;

/// Nothing is thought to be farther: its ray hardly changes any more, and its place stays finite.
const FARTHEST_M: f64 = 1e3;

/// A place that was first seen along a ray.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Place {
    map_from_first: Isometry3<f64>,
    /// x / z, y / z and 1 / z in the camera that first saw it.
    state: Point3<f64>,
    covariance: Matrix3<f64>,
    /// How the state changes with each second that the camera takes longer to read an image than was thought.
    readout_derivative_per_s: Vector3<f64>,
}

/// The uncertainty of a place in the image.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Spread {
    /// Covariance of the column and the row.
    pub(super) image_px2: Matrix2<f64>,
    pub(super) depth_std_dev_m: f64,
}

impl Spread {
    /// Standard deviations in the direction in which the image is least sure, and across it.
    pub(super) fn axes_px(&self) -> [Vector2<f64>; 2] {
        let of_image = &self.image_px2;
        // The direction by half the angle between the difference of the variances and the covariance.
        let (difference, mixed) = (of_image[(0, 0)] - of_image[(1, 1)], 2.0 * of_image[(0, 1)]);
        let (mean, apart) = (0.5 * of_image.trace(), 0.5 * difference.hypot(mixed));
        let (sine, cosine) = (0.5 * mixed.atan2(difference)).sin_cos();
        [
            (mean + apart).sqrt() * Vector2::new(cosine, sine),
            (mean - apart).max(0.0).sqrt() * Vector2::new(-sine, cosine),
        ]
    }
}

/// How the image of a point changes with its place in the camera frame.
pub(crate) fn image_slopes(camera: &CameraModel, in_camera_m: &Point3<f64>) -> Matrix2x3<f64> {
    let (x, y) = (camera.fx_px / in_camera_m.z, camera.fy_px / in_camera_m.z);
    let (toward_x, toward_y) = (in_camera_m.x / in_camera_m.z, in_camera_m.y / in_camera_m.z);
    Matrix2x3::new(x, 0.0, -x * toward_x, 0.0, y, -y * toward_y)
}

/// One over a depth, and its standard deviation, both in 1/m.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct InverseDepth {
    pub(super) mean: f64,
    pub(super) std_dev: f64,
}

impl From<MeasuredDepth> for InverseDepth {
    fn from(depth: MeasuredDepth) -> Self {
        let mean = depth.depth_m.recip();
        Self { mean, std_dev: depth.std_dev_m * mean * mean }
    }
}

impl Place {
    /// At a pixel that is known so well, and at a depth.
    pub(super) fn seen(
        camera: &CameraModel,
        map_from_camera: Isometry3<f64>,
        pixel: &Point2<f64>,
        pixel_std_dev: f64,
        depth: InverseDepth,
    ) -> Option<Self> {
        let ray = camera.ray(pixel)?;
        let ray_std_dev =
            Vector2::new(camera.fx_px, camera.fy_px).map(|focal| pixel_std_dev / focal);
        let variances = ray_std_dev.push(depth.std_dev).map(|std_dev| std_dev * std_dev);
        Some(Self {
            map_from_first: map_from_camera,
            state: ray.push(depth.mean).into(),
            covariance: Matrix3::from_diagonal(&variances),
            readout_derivative_per_s: Vector3::zeros(),
        })
    }

    /// In the map frame.
    pub(super) fn in_map_m(&self) -> Point3<f64> {
        let Point3 { coords } = self.state;
        self.map_from_first
            * Point3::new(coords.x / coords.z, coords.y / coords.z, coords.z.recip())
    }

    /// How it moves in the map when the state changes.
    fn slopes(&self) -> Matrix3<f64> {
        let (x, y, z) = (self.state.x, self.state.y, self.state.z.recip());
        let in_first = Matrix3::new(z, 0.0, -x * z * z, 0.0, z, -y * z * z, 0.0, 0.0, -z * z);
        self.map_from_first.rotation.to_rotation_matrix().into_inner() * in_first
    }

    /// Covariance in the map frame, to first order.
    pub(super) fn covariance_m2(&self) -> Matrix3<f64> {
        let slopes = self.slopes();
        slopes * self.covariance * slopes.transpose()
    }

    /// Whether its depth is known, and not only its ray.
    pub(super) fn is_located(&self, config: &LocalMapConfig) -> bool {
        self.covariance[(2, 2)].sqrt() <= config.located_share * self.state.z
    }

    /// The factor of its standard deviations in the image when it contributes to the camera's pose.
    pub(super) fn error_factor(&self, config: &LocalMapConfig) -> f64 {
        if self.is_located(config) { 1.0 } else { config.unlocated_error_factor }
    }

    /// The uncertainty of the place in an image.
    pub(super) fn spread(&self, view: &View<'_>) -> Spread {
        let View { camera, camera_from_map, .. } = view;
        let rotation = camera_from_map.rotation.to_rotation_matrix().into_inner();
        let in_camera_m = camera_from_map * self.in_map_m();
        let in_camera = rotation * self.covariance_m2() * rotation.transpose();
        let slopes = image_slopes(camera, &in_camera_m);
        Spread {
            image_px2: slopes * in_camera * slopes.transpose(),
            depth_std_dev_m: in_camera[(2, 2)].max(0.0).sqrt(),
        }
    }

    /// How it moves in the map with each second that the camera takes longer to read an image.
    pub(super) fn readout_derivative_m_per_s(&self) -> Vector3<f64> {
        self.slopes() * self.readout_derivative_per_s
    }

    /// Sets its derivative by the readout time, in the map.
    pub(super) fn set_readout_derivative(&mut self, readout_derivative_m_per_s: &Vector3<f64>) {
        let to_state = self.slopes().try_inverse();
        self.readout_derivative_per_s =
            to_state.map_or_else(Vector3::zeros, |to_state| to_state * readout_derivative_m_per_s);
    }

    /// A step of the Kalman filter with one number, which has this slope by the place in the map and this residual, as
    /// measured at a place with this derivative by the readout time.
    pub(super) fn correct(
        &mut self,
        slope_in_map: &Vector3<f64>,
        off: f64,
        variance: f64,
        readout_derivative_m_per_s: &Vector3<f64>,
    ) {
        let slope = self.slopes().transpose() * slope_in_map;
        let leans = slope_in_map.dot(readout_derivative_m_per_s)
            - slope.dot(&self.readout_derivative_per_s);
        let carried = self.covariance * slope;
        let gain = carried / (slope.dot(&carried) + variance);
        self.state += gain * off;
        self.covariance -= gain * carried.transpose();
        self.readout_derivative_per_s += gain * leans;
        self.hold();
    }

    /// The same with its depth in a camera.
    pub(super) fn correct_depth(
        &mut self,
        camera_from_map: &Isometry3<f64>,
        depth: MeasuredDepth,
        readout_derivative_m_per_s: &Vector3<f64>,
    ) {
        let measured = InverseDepth::from(depth);
        let expected = (camera_from_map * self.in_map_m()).z.recip();
        let toward = camera_from_map.rotation.inverse() * Vector3::z();
        let slope = -expected * expected * toward;
        self.correct(
            &slope,
            measured.mean - expected,
            measured.std_dev.powi(2),
            readout_derivative_m_per_s,
        );
    }

    /// Moves it to where it is when the camera takes this much longer to read an image.
    pub(super) fn correct_readout(&mut self, longer_s: f64) {
        self.state += longer_s * self.readout_derivative_per_s;
        self.hold();
    }

    /// Increases its covariance, by this much along each axis of the map.
    pub(super) fn loosen(&mut self, std_dev_m: f64) {
        let inverse_depth = self.state.z;
        let across = std_dev_m * inverse_depth;
        let variances =
            Vector3::new(across, across, across * inverse_depth).map(|std_dev| std_dev * std_dev);
        self.covariance += Matrix3::from_diagonal(&variances);
    }

    fn hold(&mut self) {
        self.state.z = self.state.z.max(FARTHEST_M.recip());
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Translation3, UnitQuaternion};
    use proptest::prelude::*;

    use super::*;
    use crate::solve::testing::{Random, kinect};

    const PIXEL_STD_DEV: f64 = 1.0;
    const INVERSE_DEPTH_STD_DEV: f64 = 0.01;

    /// The observation of a point by a camera there, with noise.
    fn seen(
        camera_from_map: &Isometry3<f64>,
        point_m: &Point3<f64>,
        random: &mut Random,
    ) -> (Point2<f64>, MeasuredDepth) {
        let in_camera_m = camera_from_map * point_m;
        let noise_px = PIXEL_STD_DEV * Vector2::new(random.normal(), random.normal());
        let inverse = in_camera_m.z.recip() + INVERSE_DEPTH_STD_DEV * random.normal();
        let depth_m = inverse.recip();
        let std_dev_m = INVERSE_DEPTH_STD_DEV * depth_m * depth_m;
        (kinect().project(&in_camera_m).unwrap() + noise_px, MeasuredDepth { depth_m, std_dev_m })
    }

    #[test]
    fn a_place_that_was_seen_from_six_poses_is_as_far_off_as_it_says() {
        const RUNS: u64 = 500;
        let point_m = Point3::new(0.3, -0.2, 4.0);
        let mut sum = 0.0;
        for seed in 0..RUNS {
            let mut random = Random::new(seed);
            let first = Isometry3::identity();
            let (pixel, depth) = seen(&first, &point_m, &mut random);
            let mut place =
                Place::seen(&kinect(), first.inverse(), &pixel, PIXEL_STD_DEV, depth.into())
                    .unwrap();
            for step in 1..6 {
                let camera_from_map = Isometry3::from_parts(
                    Translation3::new(-0.1 * f64::from(step), 0.02, 0.05 * f64::from(step)),
                    UnitQuaternion::from_euler_angles(0.02, 0.01 * f64::from(step), 0.05),
                );
                let (pixel, depth) = seen(&camera_from_map, &point_m, &mut random);
                let rotation = camera_from_map.rotation.to_rotation_matrix().into_inner();
                for row in 0..2 {
                    let in_camera_m = camera_from_map * place.in_map_m();
                    let slopes = image_slopes(&kinect(), &in_camera_m) * rotation;
                    let off = pixel - kinect().project(&in_camera_m).unwrap();
                    let slope = slopes.row(row).transpose();
                    place.correct(&slope, off[row], PIXEL_STD_DEV.powi(2), &Vector3::zeros());
                }
                place.correct_depth(&camera_from_map, depth, &Vector3::zeros());
            }
            let error = place.in_map_m() - point_m;
            sum += error.dot(&(place.covariance_m2().try_inverse().unwrap() * error));
        }
        // The mean of 500 sums of three squares: 95 % of them are within 3 +- 0.21.
        let nees = sum / RUNS as f64;
        assert!((2.7..3.3).contains(&nees), "{nees}");
    }

    proptest! {
        #[test]
        fn the_axes_of_a_spread_make_its_covariance(
            (x, y) in (-9.0..9.0_f64, -9.0..9.0_f64),
            (across_x, across_y) in (-2.0..2.0_f64, -2.0..2.0_f64),
        ) {
            let (one, other) = (Vector2::new(x, y), Vector2::new(across_x, across_y));
            let image_px2 = one * one.transpose() + other * other.transpose();
            let [along, across] = Spread { image_px2, depth_std_dev_m: 0.0 }.axes_px();
            let made = along * along.transpose() + across * across.transpose();
            prop_assert!((made - image_px2).norm() < 1e-9 * (1.0 + image_px2.norm()));
            prop_assert!(along.norm() + 1e-9 >= across.norm());
        }
    }
}
