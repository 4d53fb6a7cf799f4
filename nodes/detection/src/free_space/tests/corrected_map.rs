//! The map of the poses is corrected, as by a loop that is closed: the pose jumps.

use geometry::{MapPath, PathVertex, pose_from_vector};
use nalgebra::Isometry3;

use super::super::testing::{PERIOD_S, room, stamp_of};
use super::world::World;

const CYCLES: u32 = 90;
/// From this cycle on poses are reported in the corrected map.
const CORRECTED: u32 = 45;

/// The reported trajectory at a cycle: a vertex each second, in the map before or after the correction.
fn path(
    pose_at: impl Fn(u32) -> Isometry3<f64>,
    cycle: u32,
    correction: &Isometry3<f64>,
) -> MapPath {
    let vertices = (0..=cycle).step_by(7);
    let vertices = vertices
        .map(|at| PathVertex { stamp: stamp_of(at), map_from_rig: correction * pose_at(at) });
    MapPath::new(stamp_of(cycle), "map", vertices.collect()).unwrap()
}

/// Cycles with a zone in an empty room, whose map is corrected, with or without the paths that say so.
fn false_cycles(correction: &Isometry3<f64>, speed_m_per_s: f64, has_path: bool) -> Vec<u32> {
    let pose_at = |cycle: u32| {
        let time_s = f64::from(cycle) * PERIOD_S;
        pose_from_vector(&[
            speed_m_per_s * time_s,
            0.0,
            0.0,
            0.3 * speed_m_per_s * time_s,
            0.0,
            0.0,
        ])
    };
    let mut world = World::new(3);
    let step = |cycle: u32| {
        let before = Isometry3::identity();
        let correction = if cycle < CORRECTED { &before } else { correction };
        if has_path && (cycle.is_multiple_of(7) || cycle == CORRECTED) {
            world.detector.follow_path(path(pose_at, cycle, correction));
        }
        let reported = correction * pose_at(cycle);
        let detected = world.step(&room(), &pose_at(cycle), &reported);
        assert_eq!(
            detected.cycle.map_from_rig, reported,
            "the cycle has the pose that was reported"
        );
        detected.cycle.zones.len()
    };
    let zones: Vec<usize> = (0..CYCLES).map(step).collect();
    (0..CYCLES).zip(zones).filter(|(_, zones)| *zones > 0).map(|(cycle, _)| cycle).collect()
}

#[test]
fn a_correction_is_not_read_as_motion() {
    for correction in [
        [0.1, -0.05, 0.0, 0.01, 0.0, 0.0],
        [0.25, 0.15, 0.0, 0.03, 0.0, 0.0],
        [-0.3, 0.4, 0.02, -0.05, 0.0, 0.01],
    ] {
        for speed_m_per_s in [0.0, 0.2] {
            let correction = pose_from_vector(&correction);
            let without = false_cycles(&correction, speed_m_per_s, false);
            let with = false_cycles(&correction, speed_m_per_s, true);
            println!(
                "{:.2} m at {speed_m_per_s} m/s: {} cycles with a zone without the path, {} with it",
                correction.translation.vector.norm(),
                without.len(),
                with.len()
            );
            assert!(with.is_empty(), "{with:?}");
        }
    }
    // Without the paths the correction is read as motion, so the test can fail.
    let jump = pose_from_vector(&[0.25, 0.15, 0.0, 0.03, 0.0, 0.0]);
    assert!(
        !false_cycles(&jump, 0.2, false).is_empty() || !false_cycles(&jump, 0.0, false).is_empty()
    );
}

#[test]
fn paths_without_a_correction_change_nothing() {
    let identity = Isometry3::identity();
    assert_eq!(false_cycles(&identity, 0.2, true), false_cycles(&identity, 0.2, false));
}
