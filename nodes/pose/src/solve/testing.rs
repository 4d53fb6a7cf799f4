//! What several tests share: a camera, rooms of points and lines, and noise.

use estimation::perturbation::left::{perturbation_between, perturbed};
use geometry::{CameraModel, Distortion};
use nalgebra::{
    Isometry3, Point2, Point3, Translation3, UnitQuaternion, Vector2, Vector3, Vector6,
};
use proptest::prelude::*;

use super::{LineObservation, PointObservation};

/// The camera of the thesis' platform without its distortion.
pub(crate) fn kinect() -> CameraModel {
    CameraModel {
        width_px: 640,
        height_px: 480,
        fx_px: 522.0,
        fy_px: 518.1,
        cx_px: 305.8,
        cy_px: 248.6,
        distortion: Distortion::None,
    }
}

/// Poses with any rotation, up to 3 m off.
pub(crate) fn any_pose() -> impl Strategy<Value = Isometry3<f64>> {
    prop::array::uniform6(-3.0..3.0_f64).prop_map(|[x, y, z, a, b, c]| {
        let turn = Vector3::new(a, b, c);
        let turn = if turn.norm() > 3.0 { turn.normalize() * 3.0 } else { turn };
        Isometry3::from_parts(Translation3::new(x, y, z), UnitQuaternion::from_scaled_axis(turn))
    })
}

/// Numbers of mean 0 and deviation 1 (Box and Muller: with the tails that a robust estimate must withstand), and others, by a
/// seed.
pub(crate) struct Random(estimation::Random);

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self(estimation::Random::new(seed))
    }

    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0.between(low, high)
    }

    pub(crate) fn bits(&mut self) -> u64 {
        self.0.bits()
    }

    pub(crate) fn normal(&mut self) -> f64 {
        let (first, second) = (self.between(f64::EPSILON, 1.0), self.between(0.0, 1.0));
        (-2.0 * first.ln()).sqrt() * (std::f64::consts::TAU * second).cos()
    }

    /// A perturbation with these standard deviations.
    pub(crate) fn perturbation(&mut self, std_dev_m: f64, std_dev_rad: f64) -> Vector6<f64> {
        Vector6::from_fn(|row, _| self.normal() * if row < 3 { std_dev_m } else { std_dev_rad })
    }
}

/// A pixel of the camera, every one alike.
pub(crate) fn any_pixel(random: &mut Random) -> Point2<f64> {
    Point2::new(random.between(0.0, 639.0), random.between(0.0, 479.0))
}

/// A pose in a room, and what the camera sees of it.
#[derive(Clone)]
pub(crate) struct View {
    pub(crate) camera_from_map: Isometry3<f64>,
    pub(crate) points: Vec<PointObservation>,
    pub(crate) lines: Vec<LineObservation>,
}

/// How well things are seen. `depth` is a standard deviation at 1 m, which grows with the square of the depth.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Noise {
    pub(crate) pixel_px: f64,
    pub(crate) depth_at_1_m: Option<f64>,
}

pub(crate) const KINECT_NOISE: Noise = Noise { pixel_px: 1.0, depth_at_1_m: Some(0.003) };
pub(crate) const NO_DEPTH: Noise = Noise { pixel_px: 1.0, depth_at_1_m: None };

impl View {
    pub(crate) fn empty(seed: u64) -> Self {
        let mut random = Random::new(seed);
        let camera_from_map = perturbed(&Isometry3::identity(), &random.perturbation(1.0, 0.7));
        Self { camera_from_map, points: Vec::new(), lines: Vec::new() }
    }

    /// A room without noise: points and lines all over the image, 1 to 5 m away.
    pub(crate) fn room(points: usize, lines: usize, noise: Noise, seed: u64) -> Self {
        let mut view = Self::empty(seed);
        let mut random = Random::new(seed ^ 0x5eed);
        for _ in 0..points {
            let (pixel, depth_m) = (any_pixel(&mut random), random.between(1.0, 5.0));
            view.see_point(ray_point(&pixel, depth_m), noise);
        }
        for _ in 0..lines {
            let start = ray_point(&any_pixel(&mut random), random.between(1.0, 5.0));
            let end = ray_point(&any_pixel(&mut random), random.between(1.0, 5.0));
            view.see_line(start, end, noise);
        }
        view
    }

    /// Adds a point of the camera frame.
    pub(crate) fn see_point(&mut self, in_camera: Point3<f64>, noise: Noise) {
        self.points.push(PointObservation {
            point_in_map_m: self.camera_from_map.inverse() * in_camera,
            pixel_px: pixel_of(&in_camera),
            depth_m: noise.depth_at_1_m.map(|_| in_camera.z),
            pixel_std_dev_px: noise.pixel_px,
            spread_px: Vector2::zeros(),
            depth_std_dev_m: noise.depth_at_1_m.unwrap_or(1.0) * in_camera.z.powi(2),
        });
    }

    /// Adds a line of the camera frame. Other points of it are in the map than are seen.
    pub(crate) fn see_line(&mut self, start: Point3<f64>, end: Point3<f64>, noise: Noise) {
        let map_from_camera = self.camera_from_map.inverse();
        let farther = start.z.max(end.z);
        self.lines.push(LineObservation {
            start_in_map_m: map_from_camera * (start + 0.2 * (end - start)),
            end_in_map_m: map_from_camera * (end + 0.1 * (end - start)),
            start_px: pixel_of(&start),
            end_px: pixel_of(&end),
            pixel_std_dev_px: noise.pixel_px,
            start_depth_m: noise.depth_at_1_m.map(|_| start.z),
            end_depth_m: noise.depth_at_1_m.map(|_| end.z),
            depth_std_dev_m: noise.depth_at_1_m.unwrap_or(1.0) * farther.powi(2),
        });
    }

    /// The same with noise of the stated size, times a factor.
    pub(crate) fn noisy(&self, times: f64, seed: u64) -> Self {
        let mut random = Random::new(seed.wrapping_mul(0x9e37_79b9) ^ 0x0123_4567);
        let mut noisy = self.clone();
        for point in &mut noisy.points {
            let [column, row] = [random.normal(), random.normal()];
            point.pixel_px.x += times * point.pixel_std_dev_px * column;
            point.pixel_px.y += times * point.pixel_std_dev_px * row;
            let off_m = times * point.depth_std_dev_m * random.normal();
            point.depth_m = point.depth_m.map(|depth_m| depth_m + off_m);
        }
        for line in &mut noisy.lines {
            // Across the segment: along it, the depth would change too.
            let along = (line.end_px - line.start_px).normalize();
            for pixel in [&mut line.start_px, &mut line.end_px] {
                let off_px = times * line.pixel_std_dev_px * random.normal();
                *pixel += off_px * nalgebra::Vector2::new(-along.y, along.x);
            }
            for depth in [&mut line.start_depth_m, &mut line.end_depth_m] {
                let off_m = times * line.depth_std_dev_m * random.normal();
                *depth = depth.map(|depth_m| depth_m + off_m);
            }
        }
        noisy
    }

    /// The first share of the points and of the lines is seen anywhere instead.
    pub(crate) fn with_outliers(mut self, share: f64, seed: u64) -> Self {
        let mut random = Random::new(seed ^ 0x0bad);
        let points = (share * self.points.len() as f64).round() as usize;
        for point in self.points.iter_mut().take(points) {
            point.pixel_px = any_pixel(&mut random);
            point.depth_m = point.depth_m.map(|_| random.between(1.0, 5.0));
        }
        let lines = (share * self.lines.len() as f64).round() as usize;
        for line in self.lines.iter_mut().take(lines) {
            (line.start_px, line.end_px) = (any_pixel(&mut random), any_pixel(&mut random));
        }
        self
    }

    /// A guess that is off by this perturbation.
    pub(crate) fn guess(&self, perturbation: &Vector6<f64>) -> Isometry3<f64> {
        perturbed(&self.camera_from_map, perturbation)
    }

    /// The error of a pose: the shift in metres and the turn in radians.
    pub(crate) fn error(&self, camera_from_map: &Isometry3<f64>) -> (f64, f64) {
        let error = perturbation_between(&self.camera_from_map, camera_from_map);
        (error.fixed_rows::<3>(0).norm(), error.fixed_rows::<3>(3).norm())
    }
}

/// The point that a pixel sees at a depth.
pub(crate) fn ray_point(pixel: &Point2<f64>, depth_m: f64) -> Point3<f64> {
    let ray = kinect().ray(pixel).unwrap();
    Point3::new(ray.x * depth_m, ray.y * depth_m, depth_m)
}

/// Where a point appears, in the image or not.
pub(crate) fn pixel_of(point: &Point3<f64>) -> Point2<f64> {
    let camera = kinect();
    let (x, y) = (point.x / point.z, point.y / point.z);
    Point2::new(camera.fx_px * x + camera.cx_px, camera.fy_px * y + camera.cy_px)
}
