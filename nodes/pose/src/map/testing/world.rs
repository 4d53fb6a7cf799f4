//! Points and lines that look each like nothing else, and what a camera sees of them.

use std::sync::Arc;

use geometry::Stamp;
use nalgebra::{Isometry3, Point2, Point3, Vector3};

use crate::feature::lines::{LineDescriptor, LineFeature, LineSegment, SegmentInSpace};
use crate::feature::points::{Corner, Descriptor};
use crate::frame::{Frame, MeasuredDepth, depth_noise_m};
use crate::map::{KeyframeId, LineId, Map, MapConfig, NewKeyframe, PointId};
use crate::solve::testing::{Random, kinect};

/// Standard deviation of the inverse of a depth.
const INVERSE_DEPTH_STD_DEV: f64 = 1.5e-3;
const SHORTEST_PX: f64 = 20.0;
/// Bits of a descriptor that change from one view to another.
const FLIPPED_BITS: usize = 12;

pub(crate) struct World {
    pub(crate) points: Vec<(Point3<f64>, Descriptor)>,
    pub(crate) lines: Vec<([Point3<f64>; 2], LineDescriptor)>,
    /// Of a pixel of level 0, and by what the noise of depths is multiplied.
    pub(crate) noise: f64,
}

/// A frame, and which thing of the world each of its features is.
pub(crate) struct Shown {
    pub(crate) frame: Arc<Frame>,
    pub(crate) points: Vec<usize>,
    pub(crate) lines: Vec<usize>,
}

impl World {
    /// A wall of things 2 to 5 m before the origin, `width_m` wide.
    pub(crate) fn wall(points: usize, lines: usize, width_m: f64, noise: f64, seed: u64) -> Self {
        let mut random = Random::new(seed);
        let bits = |random: &mut Random| [(); 4].map(|()| random.bits());
        let place = |random: &mut Random| {
            let half_m = 0.5 * width_m;
            let x = random.between(-half_m, half_m);
            Point3::new(x, random.between(-1.5, 1.5), random.between(2.0, 5.0))
        };
        let points =
            (0..points).map(|_| (place(&mut random), Descriptor(bits(&mut random)))).collect();
        let lines = (0..lines).map(|_| {
            let start = place(&mut random);
            let along = Vector3::new(random.normal(), random.normal(), random.normal()).normalize();
            ([start, start + 0.6 * along], LineDescriptor(bits(&mut random)))
        });
        let lines = lines.collect();
        Self { points, lines, noise }
    }

    /// What a camera sees, with noise.
    pub(crate) fn frame(&self, camera_from_map: &Isometry3<f64>, random: &mut Random) -> Shown {
        let (camera, noise) = (kinect(), self.noise);
        let mut frame = Frame {
            stamp: Stamp::from_nanos(0),
            corners: Vec::new(),
            corner_depths: Vec::new(),
            lines: Vec::new(),
            lines_in_space: Vec::new(),
        };
        let (mut points, mut lines) = (Vec::new(), Vec::new());
        let image = |place: &Point3<f64>, random: &mut Random, std_dev_px: f64| {
            let in_camera = camera_from_map * place;
            let pixel = camera.project(&in_camera).filter(|pixel| camera.contains(pixel))?;
            let off = nalgebra::Vector2::new(random.normal(), random.normal());
            let std_dev_m = depth_noise_m(in_camera.z, INVERSE_DEPTH_STD_DEV);
            let depth_m = in_camera.z + noise * std_dev_m * random.normal();
            Some((pixel + noise * std_dev_px * off, MeasuredDepth { depth_m, std_dev_m }))
        };
        for (index, (place, descriptor)) in self.points.iter().enumerate() {
            let Some((pixel, depth)) = image(place, random, 1.0) else { continue };
            let mut descriptor = *descriptor;
            for _ in 0..FLIPPED_BITS {
                let bit = random.bits() % 256;
                descriptor.0[(bit / 64) as usize] ^= 1 << (bit % 64);
            }
            frame.corners.push(Corner {
                pixel: pixel.cast(),
                level: 0,
                angle_rad: 0.0,
                response: 20.0,
                descriptor,
            });
            frame.corner_depths.push(Some(depth));
            points.push(index);
        }
        for (index, (ends, descriptor)) in self.lines.iter().enumerate() {
            let seen = ends.map(|end| image(&end, random, 0.7));
            let [Some((start_px, start)), Some((end_px, end))] = seen else { continue };
            // A line that is seen along itself is a dot, which no detector takes for a segment.
            if (end_px - start_px).norm() < SHORTEST_PX {
                continue;
            }
            let in_space = |pixel: &Point2<f64>, depth: &MeasuredDepth| {
                Point3::from(camera.ray(pixel).unwrap().push(1.0) * depth.depth_m)
            };
            let segment = LineSegment {
                start_px: [start_px.x as f32, start_px.y as f32],
                end_px: [end_px.x as f32, end_px.y as f32],
                response: 10.0,
            };
            frame.lines.push(LineFeature { segment, descriptor: *descriptor });
            frame.lines_in_space.push(Some(SegmentInSpace {
                start_m: in_space(&start_px, &start),
                end_m: in_space(&end_px, &end),
                start_std_dev_m: start.std_dev_m,
                end_std_dev_m: end.std_dev_m,
                rms_m: start.std_dev_m,
                support: 1.0,
            }));
            lines.push(index);
        }
        Shown { frame: Arc::new(frame), points, lines }
    }

    /// A map whose keyframes are where `poses` has them and see what they see; points and lines are where they are.
    pub(crate) fn map(&self, poses: &[Isometry3<f64>], seed: u64) -> (Map, Vec<KeyframeId>) {
        let mut map = Map::new(MapConfig::default());
        let mut random = Random::new(seed);
        let mut points: Vec<Option<PointId>> = vec![None; self.points.len()];
        let mut lines: Vec<Option<LineId>> = vec![None; self.lines.len()];
        let mut keyframes = Vec::new();
        for pose in poses {
            let shown = self.frame(pose, &mut random);
            let known = shown.points.iter().enumerate();
            let known: Vec<_> =
                known.filter_map(|(at, index)| Some((at, points[*index]?))).collect();
            let known_lines = shown.lines.iter().enumerate();
            let known_lines: Vec<_> =
                known_lines.filter_map(|(at, index)| Some((at, lines[*index]?))).collect();
            let keyframe = map
                .insert_keyframe(NewKeyframe {
                    camera: kinect(),
                    camera_from_map: *pose,
                    frame: Arc::clone(&shown.frame),
                    points: &known,
                    lines: &known_lines,
                    by_odometry: None,
                })
                .unwrap();
            for (corner, index) in shown.points.iter().enumerate() {
                if points[*index].is_none() {
                    let place = self.points[*index].0;
                    points[*index] = Some(map.insert_point(keyframe, corner, &place).unwrap());
                }
            }
            for (segment, index) in shown.lines.iter().enumerate() {
                if lines[*index].is_none() {
                    let ends = self.lines[*index].0;
                    lines[*index] = Some(map.insert_line(keyframe, segment, &ends).unwrap());
                }
            }
            keyframes.push(keyframe);
        }
        (map, keyframes)
    }
}

/// Poses that go along a wall by this step and look about.
pub(crate) fn around(poses: usize, step_m: f64) -> Vec<Isometry3<f64>> {
    let half_m = 0.5 * step_m * (poses.max(1) - 1) as f64;
    let pose = |index: usize| {
        let along = index as f64;
        let place = Vector3::new(step_m * along - half_m, 0.1 * along.sin(), 0.2 * along.cos());
        let turn =
            Vector3::new(0.05 * (1.3 * along).sin(), 0.1 * (0.7 * along).sin(), 0.05 * along.cos());
        Isometry3::new(place, turn).inverse()
    };
    (0..poses).map(pose).collect()
}
