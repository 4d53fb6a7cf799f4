//! A world of points and lines, and what a camera in it sees: frames without images.

use geometry::{CameraModel, Stamp};
use nalgebra::{Isometry3, Point2, Point3, Translation3, UnitQuaternion, Vector3};

use crate::feature::lines::{LineDescriptor, LineFeature, LineSegment, SegmentInSpace};
use crate::feature::points::{Corner, Descriptor};
use crate::frame::{Frame, MeasuredDepth, depth_noise_m};
use crate::solve::testing::{Random, kinect};

/// Standard deviation of the inverse of a depth.
const INVERSE_DEPTH_STD_DEV: f64 = 1.5e-3;
/// Levels of the pyramid, and the factor between them.
const LEVELS: f64 = 8.0;
const SCALE_FACTOR: f64 = 1.2;

pub(crate) struct Thing {
    pub(crate) points: Vec<Landmark>,
    pub(crate) lines: Vec<(Point3<f64>, Point3<f64>, LineDescriptor)>,
}

pub(crate) struct Landmark {
    place_m: Point3<f64>,
    descriptor: Descriptor,
}

/// What a frame is spoilt by.
#[derive(Clone, Copy)]
pub(crate) struct Spoil {
    pub(crate) pixel_px: f64,
    pub(crate) depth_share: f64,
    pub(crate) readout_s: f64,
    pub(crate) has_depth: bool,
    pub(crate) seen_share: f64,
}

impl Default for Spoil {
    fn default() -> Self {
        Self { pixel_px: 0.7, depth_share: 1.0, readout_s: 0.0, has_depth: true, seen_share: 0.9 }
    }
}

impl Thing {
    /// Points and lines all over a box, every one of another look.
    pub(crate) fn boxed(
        middle_m: [f64; 3],
        half_m: [f64; 3],
        points: usize,
        lines: usize,
        seed: u64,
    ) -> Self {
        let mut random = Random::new(seed);
        let place = |random: &mut Random| {
            // On the surface: one axis is at its end.
            let mut at = [0; 3].map(|_| random.between(-1.0, 1.0));
            let axis = random.between(0.0, 3.0) as usize;
            at[axis.min(2)] = if random.between(0.0, 1.0) < 0.5 { -1.0 } else { 1.0 };
            Point3::new(
                middle_m[0] + at[0] * half_m[0],
                middle_m[1] + at[1] * half_m[1],
                middle_m[2] + at[2] * half_m[2],
            )
        };
        let bits = |random: &mut Random| [(); 4].map(|()| random.bits());
        let points = (0..points).map(|_| Landmark {
            place_m: place(&mut random),
            descriptor: Descriptor(bits(&mut random)),
        });
        let points = points.collect();
        let lines = (0..lines).map(|_| {
            let start = place(&mut random);
            let along =
                Vector3::new(random.normal(), random.normal(), random.normal()).normalize() * 0.6;
            (start, start + along, LineDescriptor(bits(&mut random)))
        });
        let lines = lines.collect();
        Self { points, lines }
    }

    /// A room around the origin.
    pub(crate) fn room(points: usize, lines: usize, seed: u64) -> Self {
        Self::boxed([0.0, 0.0, 0.0], [4.0, 2.0, 4.0], points, lines, seed)
    }
}

/// A moving camera.
pub(crate) struct Camera<P: Fn(f64) -> Isometry3<f64>> {
    pub(crate) model: CameraModel,
    pub(crate) map_from_camera: P,
    pub(crate) spoil: Spoil,
    random: Random,
}

impl<P: Fn(f64) -> Isometry3<f64>> Camera<P> {
    pub(crate) fn new(map_from_camera: P, spoil: Spoil, seed: u64) -> Self {
        Self { model: kinect(), map_from_camera, spoil, random: Random::new(seed) }
    }

    /// What the camera sees of things, each with its own motion.
    pub(crate) fn frame(&mut self, time_s: f64, things: &[(&Thing, Isometry3<f64>)]) -> Frame {
        let mut frame = Frame {
            stamp: stamp(time_s),
            corners: Vec::new(),
            corner_depths: Vec::new(),
            lines: Vec::new(),
            lines_in_space: Vec::new(),
        };
        for (thing, map_from_thing) in things {
            for point in &thing.points {
                if self.random.between(0.0, 1.0) < self.spoil.seen_share {
                    self.see_point(time_s, &(map_from_thing * point.place_m), point, &mut frame);
                }
            }
            for (start, end, descriptor) in &thing.lines {
                if self.random.between(0.0, 1.0) < self.spoil.seen_share {
                    let ends = [map_from_thing * start, map_from_thing * end];
                    self.see_line(time_s, ends, *descriptor, &mut frame);
                }
            }
        }
        frame
    }

    /// The image of a point whose row is read when it is read.
    fn image(&self, time_s: f64, in_map_m: &Point3<f64>) -> Option<(Point2<f64>, Point3<f64>)> {
        let mut at_s = time_s;
        let mut seen = None;
        for _ in 0..4 {
            let in_camera_m = (self.map_from_camera)(at_s).inverse() * in_map_m;
            let pixel =
                self.model.project(&in_camera_m).filter(|pixel| self.model.contains(pixel))?;
            at_s = time_s + (pixel.y / self.model.height_px as f64 - 0.5) * self.spoil.readout_s;
            seen = Some((pixel, in_camera_m));
        }
        seen
    }

    fn see_point(
        &mut self,
        time_s: f64,
        in_map_m: &Point3<f64>,
        point: &Landmark,
        frame: &mut Frame,
    ) {
        let Some((pixel, in_camera_m)) = self.image(time_s, in_map_m) else { return };
        // A corner of some size is found on the level that makes it this many pixels.
        let level = (3.0 - (in_camera_m.coords.norm() / 3.0).ln() / SCALE_FACTOR.ln()).round();
        let level = level.clamp(0.0, LEVELS - 1.0);
        let std_dev_px = self.spoil.pixel_px * SCALE_FACTOR.powf(level);
        let noisy = Point2::new(
            pixel.x + std_dev_px * self.random.normal(),
            pixel.y + std_dev_px * self.random.normal(),
        );
        frame.corners.push(Corner {
            pixel: noisy.cast(),
            level: level as u8,
            angle_rad: 0.0,
            response: 20.0,
            descriptor: point.descriptor,
        });
        let std_dev_m = depth_noise_m(in_camera_m.z, INVERSE_DEPTH_STD_DEV);
        let is_measured = self.spoil.has_depth && in_camera_m.z < 8.0;
        let depth_m = in_camera_m.z + self.spoil.depth_share * std_dev_m * self.random.normal();
        frame.corner_depths.push(is_measured.then_some(MeasuredDepth { depth_m, std_dev_m }));
    }

    fn see_line(
        &mut self,
        time_s: f64,
        ends_m: [Point3<f64>; 2],
        descriptor: LineDescriptor,
        frame: &mut Frame,
    ) {
        let seen = ends_m.map(|end| self.image(time_s, &end));
        let [Some(start), Some(end)] = seen else { return };
        let mut noisy = |(pixel, in_camera_m): (Point2<f64>, Point3<f64>)| {
            let pixel = Point2::new(
                pixel.x + self.spoil.pixel_px * self.random.normal(),
                pixel.y + self.spoil.pixel_px * self.random.normal(),
            );
            let std_dev_m = depth_noise_m(in_camera_m.z, INVERSE_DEPTH_STD_DEV);
            let depth_m = in_camera_m.z + self.spoil.depth_share * std_dev_m * self.random.normal();
            let ray = self.model.ray(&pixel).unwrap().push(1.0);
            ([pixel.x as f32, pixel.y as f32], Point3::from(ray * depth_m), std_dev_m)
        };
        let (start_px, start_m, start_std_dev_m) = noisy(start);
        let (end_px, end_m, end_std_dev_m) = noisy(end);
        frame.lines.push(LineFeature {
            segment: LineSegment { start_px, end_px, response: 10.0 },
            descriptor,
        });
        frame.lines_in_space.push(self.spoil.has_depth.then_some(SegmentInSpace {
            start_m,
            end_m,
            start_std_dev_m,
            end_std_dev_m,
            rms_m: start_std_dev_m,
            support: 1.0,
        }));
    }
}

pub(crate) fn stamp(time_s: f64) -> Stamp {
    Stamp::from_nanos(1_000_000_000).plus_seconds(time_s)
}

/// Between two images.
pub(crate) const PERIOD_S: f64 = 1.0 / 30.0;

/// A camera that looks about and sways, from the origin on.
pub(crate) fn looking_about(time_s: f64) -> Isometry3<f64> {
    let turn = Vector3::new(
        0.15 * (1.3 * time_s).sin(),
        0.5 * (0.9 * time_s).sin(),
        0.1 * (1.7 * time_s).sin(),
    );
    let shift = Translation3::new(
        0.3 * (0.8 * time_s).sin(),
        0.1 * (1.1 * time_s).sin(),
        0.4 * (1.0 - (0.7 * time_s).cos()),
    );
    Isometry3::from_parts(shift, UnitQuaternion::from_scaled_axis(turn))
}

/// How far a pose is from the truth: metres and radians.
pub(crate) fn error(
    camera_from_map: &Isometry3<f64>,
    map_from_camera: &Isometry3<f64>,
) -> (f64, f64) {
    let error = camera_from_map * map_from_camera;
    (error.translation.vector.norm(), error.rotation.angle())
}
