use geometry::{Method, PipelineConfig, Stamp};
use nalgebra::{Isometry3, Translation3, UnitQuaternion};

use super::super::testing;
use super::*;
use crate::{AtMaxVoxels, ReconstructionConfig};

const EDGE_M: f64 = 0.08;
/// Where something stood; no other returns come from behind it.
const GHOST: [f32; 3] = [3.02, 0.02, 0.02];

fn map() -> StaticMap {
    StaticMap::new(ReconstructionConfig {
        pipeline: PipelineConfig::new(Method::FreeSpace, EDGE_M),
        max_voxels: 100_000,
        at_max_voxels: AtMaxVoxels::Refuse,
        ..ReconstructionConfig::default()
    })
    .unwrap()
}

/// What a rig in this pose sees; the points are of the map.
fn seen_from(map_from_rig: Isometry3<f64>, still: &[[f32; 3]]) -> SegmentedCycle {
    SegmentedCycle { map_from_rig, ..testing::cycle(Stamp::from_nanos(1), still, &[]) }
}

fn seen(still: &[[f32; 3]]) -> SegmentedCycle {
    seen_from(Isometry3::identity(), still)
}

fn at(x_m: f64, y_m: f64) -> Isometry3<f64> {
    Translation3::new(x_m, y_m, 0.0).into()
}

/// A post far to the side, so that the camera is not blind.
const POST: [f32; 3] = [3.0, 1.5, 0.0];

/// The cycles until the ghost is gone, after so many that hit it and with this one from then on.
fn cycles_until_gone(hits: usize, hit: &SegmentedCycle, then: &SegmentedCycle) -> Option<usize> {
    let mut map = map();
    for number in 0..hits {
        map.integrate(&in_cycle(number, hit)).unwrap();
    }
    let ghost = map.grid().key(&GHOST.into());
    assert!(map.voxel(ghost).is_some());
    (1..=40).find(|cycles| {
        map.integrate(&in_cycle(hits + cycles, then)).unwrap();
        map.voxel(ghost).is_none()
    })
}

/// The same at another time: five cycles a second.
fn in_cycle(number: usize, cycle: &SegmentedCycle) -> SegmentedCycle {
    let mut cycle = cycle.clone();
    cycle.static_cloud.stamp = Stamp::from_nanos(1).plus_seconds(number as f64 / 5.0);
    cycle
}

#[test]
fn what_stood_before_nothing_goes_when_it_is_no_longer_seen() {
    let hit = seen(&[GHOST, POST]);
    for (hits, cycles) in [(1, 5), (2, 9), (5, 18), (51, 18)] {
        assert_eq!(cycles_until_gone(hits, &hit, &seen(&[POST])), Some(cycles), "{hits} hits");
    }
}

#[test]
fn what_stood_there_for_long_does_not_go() {
    let hit = seen(&[GHOST, POST]);
    assert_eq!(cycles_until_gone(52, &hit, &seen(&[POST])), None);
}

#[test]
fn a_direction_that_is_not_clearly_blank_says_nothing() {
    let hit = seen(&[GHOST, POST]);
    for (name, then) in [
        ("the camera is blind", seen(&[])),
        ("it is seen a little beside", seen(&[[3.05, 0.07, 0.02], POST])),
        ("something hides it", seen(&[[1.5, 0.01, 0.01], POST])),
        ("it is in the projector's shadow of what is nearer", seen(&[[1.5, 0.1, 0.01], POST])),
        ("it is farther away than it was", seen_from(at(-0.1, 0.0), &[POST])),
        ("it is seen from another side", seen_from(at(1.0, 0.9), &[POST])),
        ("it is behind the camera", seen_from(at(4.0, 0.0), &[[6.0, 1.5, 0.0]])),
        ("it is too near to be measured", seen_from(at(2.3, 0.0), &[POST, [5.0, 1.5, 0.0]])),
    ] {
        assert_eq!(cycles_until_gone(5, &hit, &then), None, "{name}");
    }
    for (name, then) in [
        ("nearer by", seen_from(at(0.5, 0.0), &[POST])),
        ("a thing far beside it", seen(&[[1.5, 0.4, 0.0], POST])),
        ("a thing not far before and beside it", seen(&[[2.7, 0.23, 0.01], POST])),
        ("a thing above it", seen(&[[1.5, 0.0, 0.2], POST])),
        ("a surface beside it", seen(&[[2.95, 0.17, 0.02], POST])),
    ] {
        assert_eq!(cycles_until_gone(5, &hit, &then), Some(18), "{name}");
    }
}

/// What a turning platform has before its own lens, nearer than it can measure, hides what it turns to.
#[test]
fn a_direction_from_which_nothing_ever_came_says_nothing() {
    let turned = |angle_rad: f64| {
        let turn = UnitQuaternion::from_axis_angle(&nalgebra::Vector3::z_axis(), angle_rad);
        Isometry3::from_parts(Translation3::identity(), turn)
    };
    // 25 degrees to the right, where the mast is in the image.
    let hit = seen(&[GHOST, POST]);
    let then = seen_from(turned(0.44), &[POST]);
    assert_eq!(cycles_until_gone(5, &hit, &then), None);
    // Something has come from there before, as far away as that.
    let hit = seen(&[GHOST, POST, [2.8, -1.32, 0.02]]);
    assert_eq!(cycles_until_gone(5, &hit, &then), Some(18));
    // Nearer things do not tell that it is free behind.
    let hit = seen(&[GHOST, POST, [1.8, -0.85, 0.02]]);
    assert_eq!(cycles_until_gone(5, &hit, &then), None);
}

#[test]
fn a_surface_that_is_seen_now_and_then_stays() {
    let (hit, blank) = (seen(&[GHOST, POST]), seen(&[POST]));
    let mut map = map();
    for number in 0..45 {
        map.integrate(if number % 5 == 0 { &hit } else { &blank }).unwrap();
        assert!(map.voxel(map.grid().key(&GHOST.into())).is_some(), "cycle {number}");
    }
}

#[test]
fn what_was_loaded_does_not_hang_on_it() {
    let mut map = map();
    map.replace(&[GHOST.into()], "map").unwrap();
    // The direction is known: something else came from it.
    map.integrate(&seen(&[[3.3, 0.0, 0.0], POST])).unwrap();
    for _ in 0..40 {
        map.integrate(&seen(&[POST])).unwrap();
    }
    assert!(map.voxel(map.grid().key(&GHOST.into())).is_some());
}

#[test]
fn poses_and_points_without_measure_do_no_harm() {
    let mut map = map();
    for x_m in [1e300, -1e300, f64::NAN, f64::INFINITY] {
        let far = [f32::MAX, f32::MIN, 1.0];
        map.integrate(&seen_from(at(x_m, 0.0), &[GHOST, far])).unwrap();
        let mut nowhere = seen(&[GHOST, far, [0.11, 1e30, -1e30]]);
        nowhere.setup = testing::camera_at(Point3::new(x_m, 0.0, 0.0));
        map.integrate(&nowhere).unwrap();
    }
    assert!(map.voxel(map.grid().key(&GHOST.into())).is_some());
}
