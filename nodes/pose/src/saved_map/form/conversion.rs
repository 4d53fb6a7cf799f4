//! Converts the map in memory to records, and back.

use std::sync::Arc;

use estimation::perturbation::is_rigid;
use geometry::{CameraModel, Distortion, Stamp};
use nalgebra::{Isometry3, Point2, Point3, Quaternion, Translation3, Unit, Vector3};

use super::{
    Bits, Head, Pose, SavedCamera, SavedCorner, SavedDistortion, SavedKeyframe, SavedLine,
    SavedOdometry, SavedPoint, SavedSegment,
};
use crate::feature::lines::{LineDescriptor, LineFeature, LineSegment, SegmentInSpace};
use crate::feature::points::{Corner, Descriptor};
use crate::frame::{Frame, MeasuredDepth};
use crate::map::{
    ByOdometry, FoundTimes, KeyframePart, LinePart, MapConfig, MapParts, PointLook, PointPart,
};

impl Head {
    pub(in crate::saved_map) fn of(parts: &MapParts, world_from_map: &Isometry3<f64>) -> Self {
        Self {
            world_from_map: Pose::of(world_from_map),
            scale_factor: parts.config.scale_factor,
            levels: parts.config.levels,
            keyframes_so_far: parts.keyframes_so_far,
            keyframes: parts.keyframes.len() as u64,
            points: parts.points.len() as u64,
            lines: parts.lines.len() as u64,
        }
    }

    pub(in crate::saved_map) fn config(&self) -> MapConfig {
        MapConfig { scale_factor: self.scale_factor, levels: self.levels }
    }

    /// `None` when it is no pose.
    pub(in crate::saved_map) fn world_from_map(&self) -> Option<Isometry3<f64>> {
        let pose = self.world_from_map.isometry();
        is_rigid(&pose).then_some(pose)
    }
}

impl Pose {
    fn of(pose: &Isometry3<f64>) -> Self {
        let [x, y, z] = pose.translation.vector.into();
        let [qx, qy, qz, qw] = pose.rotation.coords.into();
        Self([x, y, z, qx, qy, qz, qw])
    }

    /// To the bit what was saved. Whether it is a pose is checked with the parts.
    fn isometry(self) -> Isometry3<f64> {
        let [x, y, z, qx, qy, qz, qw] = self.0;
        let rotation = Unit::new_unchecked(Quaternion::new(qw, qx, qy, qz));
        Isometry3::from_parts(Translation3::new(x, y, z), rotation)
    }
}

impl From<&KeyframePart> for SavedKeyframe {
    fn from(part: &KeyframePart) -> Self {
        let frame = &part.frame;
        let corners = frame.corners.iter().zip(&frame.corner_depths).zip(&part.points);
        let segments = frame.lines.iter().zip(&frame.lines_in_space).zip(&part.lines);
        Self {
            number: part.number,
            stamp_ns: frame.stamp.as_nanos(),
            camera: SavedCamera::of(&part.camera),
            camera_from_map: Pose::of(&part.camera_from_map),
            parent: part.parent,
            loops: part.loops.iter().map(|(other, pose)| (*other, Pose::of(pose))).collect(),
            odometry: part.by_odometry.as_ref().map(SavedOdometry::of),
            corners: corners
                .map(|((corner, depth), point)| SavedCorner::of(corner, depth.as_ref(), *point))
                .collect(),
            segments: segments
                .map(|((line, in_space), of)| SavedSegment::of(line, in_space.as_ref(), *of))
                .collect(),
        }
    }
}

impl From<SavedKeyframe> for KeyframePart {
    fn from(saved: SavedKeyframe) -> Self {
        let points = saved.corners.iter().map(|corner| corner.point).collect();
        let lines = saved.segments.iter().map(|segment| segment.line).collect();
        let frame = Frame {
            stamp: Stamp::from_nanos(saved.stamp_ns),
            corners: saved.corners.iter().map(SavedCorner::corner).collect(),
            corner_depths: saved.corners.iter().map(SavedCorner::depth).collect(),
            lines: saved.segments.iter().map(SavedSegment::line).collect(),
            lines_in_space: saved.segments.iter().map(SavedSegment::in_space).collect(),
        };
        let loops = saved.loops.into_iter().map(|(other, pose)| (other, pose.isometry()));
        Self {
            number: saved.number,
            camera: saved.camera.model(),
            camera_from_map: saved.camera_from_map.isometry(),
            frame: Arc::new(frame),
            points,
            lines,
            parent: saved.parent,
            loops: loops.collect(),
            by_odometry: saved.odometry.map(|odometry| odometry.by_odometry()),
        }
    }
}

impl SavedOdometry {
    fn of(by: &ByOdometry) -> Self {
        let ByOdometry { leg, camera_from_odom, travelled_m, turned_rad } = *by;
        Self { leg, camera_from_odom: Pose::of(&camera_from_odom), travelled_m, turned_rad }
    }

    fn by_odometry(self) -> ByOdometry {
        let Self { leg, camera_from_odom, travelled_m, turned_rad } = self;
        ByOdometry { leg, camera_from_odom: camera_from_odom.isometry(), travelled_m, turned_rad }
    }
}

impl SavedCamera {
    fn of(camera: &CameraModel) -> Self {
        let CameraModel { width_px, height_px, fx_px, fy_px, cx_px, cy_px, distortion } = *camera;
        // `CameraModel::validate` has both below 2^24.
        let [width_px, height_px] = [width_px, height_px].map(|pixels| pixels as u32);
        let distortion = match distortion {
            Distortion::None => SavedDistortion::None,
            Distortion::PlumbBob(coefficients) => SavedDistortion::PlumbBob(coefficients),
            Distortion::Rational(coefficients) => SavedDistortion::Rational(coefficients),
            Distortion::RationalPrism(coefficients) => SavedDistortion::RationalPrism(coefficients),
            Distortion::Equidistant(coefficients) => SavedDistortion::Equidistant(coefficients),
        };
        let focal_and_principal_px = [fx_px, fy_px, cx_px, cy_px];
        Self { width_px, height_px, focal_and_principal_px, distortion }
    }

    fn model(&self) -> CameraModel {
        let [fx_px, fy_px, cx_px, cy_px] = self.focal_and_principal_px;
        let [width_px, height_px] = [self.width_px, self.height_px].map(|pixels| pixels as usize);
        let distortion = match self.distortion {
            SavedDistortion::None => Distortion::None,
            SavedDistortion::PlumbBob(coefficients) => Distortion::PlumbBob(coefficients),
            SavedDistortion::Rational(coefficients) => Distortion::Rational(coefficients),
            SavedDistortion::RationalPrism(coefficients) => Distortion::RationalPrism(coefficients),
            SavedDistortion::Equidistant(coefficients) => Distortion::Equidistant(coefficients),
        };
        CameraModel { width_px, height_px, fx_px, fy_px, cx_px, cy_px, distortion }
    }
}

impl SavedCorner {
    fn of(corner: &Corner, depth: Option<&MeasuredDepth>, point: Option<u32>) -> Self {
        Self {
            pixel: corner.pixel.into(),
            level: corner.level,
            angle_rad: corner.angle_rad,
            response: corner.response,
            descriptor: bytes_of(&corner.descriptor.0),
            depth: depth.map(|depth| [depth.depth_m, depth.std_dev_m]),
            point,
        }
    }

    fn corner(&self) -> Corner {
        Corner {
            pixel: Point2::from(self.pixel),
            level: self.level,
            angle_rad: self.angle_rad,
            response: self.response,
            descriptor: Descriptor(words_of(&self.descriptor)),
        }
    }

    fn depth(&self) -> Option<MeasuredDepth> {
        self.depth.map(|[depth_m, std_dev_m]| MeasuredDepth { depth_m, std_dev_m })
    }
}

impl SavedSegment {
    fn of(feature: &LineFeature, in_space: Option<&SegmentInSpace>, line: Option<u32>) -> Self {
        let LineSegment { start_px, end_px, response } = feature.segment;
        let in_space = in_space.map(|found| {
            let ([x, y, z], [u, v, w]) = (found.start_m.into(), found.end_m.into());
            let deviations = [found.start_std_dev_m, found.end_std_dev_m, found.rms_m];
            let [start, end, rms] = deviations;
            [x, y, z, u, v, w, start, end, rms, found.support]
        });
        let descriptor = bytes_of(&feature.descriptor.0);
        Self { start_px, end_px, response, descriptor, in_space, line }
    }

    fn line(&self) -> LineFeature {
        let Self { start_px, end_px, response, .. } = *self;
        LineFeature {
            segment: LineSegment { start_px, end_px, response },
            descriptor: LineDescriptor(words_of(&self.descriptor)),
        }
    }

    fn in_space(&self) -> Option<SegmentInSpace> {
        let [x, y, z, u, v, w, start_std_dev_m, end_std_dev_m, rms_m, support] = self.in_space?;
        let (start_m, end_m) = (Point3::new(x, y, z), Point3::new(u, v, w));
        Some(SegmentInSpace { start_m, end_m, start_std_dev_m, end_std_dev_m, rms_m, support })
    }
}

impl From<&PointPart> for SavedPoint {
    fn from(part: &PointPart) -> Self {
        let PointLook { descriptor, towards_cameras, nearest_m, farthest_m } = part.look;
        Self {
            position_m: part.position_m.into(),
            descriptor: bytes_of(&descriptor.0),
            towards_cameras: towards_cameras.into(),
            nearest_and_farthest_m: [nearest_m, farthest_m],
            born: part.born,
            predicted_and_found: [part.times.expected, part.times.found],
        }
    }
}

impl From<SavedPoint> for PointPart {
    fn from(saved: SavedPoint) -> Self {
        let [nearest_m, farthest_m] = saved.nearest_and_farthest_m;
        let look = PointLook {
            descriptor: Descriptor(words_of(&saved.descriptor)),
            towards_cameras: Vector3::from(saved.towards_cameras),
            nearest_m,
            farthest_m,
        };
        let [expected, found] = saved.predicted_and_found;
        let times = FoundTimes { expected, found };
        Self { position_m: Point3::from(saved.position_m), look, born: saved.born, times }
    }
}

impl From<&LinePart> for SavedLine {
    fn from(part: &LinePart) -> Self {
        Self {
            ends_m: part.ends_m.map(Into::into),
            descriptor: bytes_of(&part.descriptor.0),
            born: part.born,
            predicted_and_found: [part.times.expected, part.times.found],
        }
    }
}

impl From<SavedLine> for LinePart {
    fn from(saved: SavedLine) -> Self {
        let [expected, found] = saved.predicted_and_found;
        Self {
            ends_m: saved.ends_m.map(Point3::from),
            descriptor: LineDescriptor(words_of(&saved.descriptor)),
            born: saved.born,
            times: FoundTimes { expected, found },
        }
    }
}

fn bytes_of(words: &[u64; 4]) -> Bits {
    let mut bytes = Bits::default();
    for (bytes, word) in bytes.as_chunks_mut::<8>().0.iter_mut().zip(words) {
        *bytes = word.to_le_bytes();
    }
    bytes
}

fn words_of(bytes: &Bits) -> [u64; 4] {
    let mut words = [0; 4];
    for (word, bytes) in words.iter_mut().zip(bytes.as_chunks::<8>().0) {
        *word = u64::from_le_bytes(*bytes);
    }
    words
}
