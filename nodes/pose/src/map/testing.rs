//! Shared by several tests: frames of nothing but features, and maps of them.

mod fuzz;
mod world;

use std::sync::Arc;

use geometry::Stamp;
use nalgebra::{Isometry3, Point2, Point3};

use super::{KeyframeId, Map, MapConfig, NewKeyframe};
use crate::feature::lines::{LineDescriptor, LineFeature, LineSegment};
use crate::feature::points::{Corner, Descriptor};
use crate::frame::Frame;
use crate::solve::testing::kinect;
pub(crate) use fuzz::Fuzz;
pub(crate) use world::{World, around};

/// A frame with this many corners and segments, all alike.
pub(crate) fn blank_frame(corners: usize, lines: usize) -> Arc<Frame> {
    let corner = Corner {
        pixel: Point2::new(320.0, 240.0),
        level: 0,
        angle_rad: 0.0,
        response: 1.0,
        descriptor: Descriptor::default(),
    };
    let segment = LineSegment { start_px: [10.0, 10.0], end_px: [50.0, 10.0], response: 1.0 };
    let line = LineFeature { segment, descriptor: LineDescriptor::default() };
    Arc::new(Frame {
        stamp: Stamp::from_nanos(0),
        corners: vec![corner; corners],
        corner_depths: vec![None; corners],
        lines: vec![line; lines],
        lines_in_space: vec![None; lines],
    })
}

/// A keyframe at the origin that sees nothing yet.
pub(crate) fn blank(frame: &Arc<Frame>) -> NewKeyframe<'static> {
    NewKeyframe {
        camera: kinect(),
        camera_from_map: Isometry3::identity(),
        frame: Arc::clone(frame),
        points: &[],
        lines: &[],
        by_odometry: None,
    }
}

/// A map of this many keyframes, each with ten corners and five segments that are nothing yet.
pub(crate) fn blank_map(keyframes: usize) -> (Map, Vec<KeyframeId>) {
    let mut map = Map::new(MapConfig::default());
    let frame = blank_frame(10, 5);
    let ids = (0..keyframes).map(|_| map.insert_keyframe(blank(&frame)).unwrap()).collect();
    (map, ids)
}

/// Somewhere in front of the origin.
pub(crate) const PLACE_M: Point3<f64> = Point3::new(0.1, 0.2, 2.0);
