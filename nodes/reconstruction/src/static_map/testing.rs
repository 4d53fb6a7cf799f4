//! Clouds for the tests of what a map does with them.

use geometry::{Cloud, Stamp};
use nalgebra::Point3;

pub(super) fn cloud(stamp: Stamp, frame_id: &str, points_m: &[[f32; 3]]) -> Cloud {
    Cloud {
        stamp,
        frame_id: frame_id.to_owned(),
        points_m: points_m.iter().copied().map(Point3::from).collect(),
    }
}
