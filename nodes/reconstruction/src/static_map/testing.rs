//! Cycles for the tests of what a map does with them.

use geometry::{Cloud, CycleSetup, SegmentedCycle, Stamp};
use nalgebra::{Isometry3, Point3};

pub(super) fn cloud(stamp: Stamp, frame_id: &str, points_m: &[[f32; 3]]) -> Cloud {
    Cloud {
        stamp,
        frame_id: frame_id.to_owned(),
        points_m: points_m.iter().copied().map(Point3::from).collect(),
    }
}

/// A cycle whose rig and camera are at the origin of the map.
pub(super) fn cycle(stamp: Stamp, still: &[[f32; 3]], moving: &[[f32; 3]]) -> SegmentedCycle {
    SegmentedCycle {
        depth: None,
        index: 0,
        static_cloud: cloud(stamp, "map", still),
        dynamic_cloud: cloud(stamp, "rig", moving),
        map_from_rig: Isometry3::identity(),
        setup: CycleSetup::default(),
    }
}

/// What a cycle is made with whose camera is at a place of the rig.
pub(super) fn camera_at(camera_in_rig_m: Point3<f64>) -> CycleSetup {
    let mut setup = CycleSetup::default();
    setup.mounts.rig_from_camera.translation.vector = camera_in_rig_m.coords;
    setup
}
