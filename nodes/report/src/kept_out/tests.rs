use geometry::{CameraModel, Distortion};
use nalgebra::UnitQuaternion;

use super::*;
use crate::cycle_view::cloud_steps;
use crate::run_record::tests::{cycle, run};
use crate::{CycleRecord, SmallDepth};

const EDGE_M: f64 = 0.1;
const SIZE: (usize, usize) = (16, 12);

/// A camera at the rig's origin that looks along x.
fn camera() -> RigCamera {
    let model = CameraModel {
        width_px: SIZE.0,
        height_px: SIZE.1,
        fx_px: 16.0,
        fy_px: 16.0,
        cx_px: 8.0,
        cy_px: 6.0,
        distortion: Distortion::None,
    };
    let quarter = std::f64::consts::FRAC_PI_2;
    let turn = UnitQuaternion::from_euler_angles(-quarter, 0.0, -quarter);
    RigCamera { model, rig_from_camera: Isometry3::from_parts([0.0; 3].into(), turn) }
}

fn seen_by_camera(run: RunRecord) -> RunRecord {
    let RigCamera { model, rig_from_camera } = camera();
    RunRecord { camera: Some(model), rig_from_camera: Some(rig_from_camera), ..run }
}

/// A cycle that sees `points_m`, and in all of its image one depth.
fn seeing(index: u32, points_m: &[[f32; 3]], depth_mm: u16) -> CycleRecord {
    let depths_mm = vec![depth_mm; SIZE.0 * SIZE.1];
    let depth = SmallDepth { columns: SIZE.0, rows: SIZE.1, pixel_step: 1, depths_mm };
    let cloud = points_m.iter().map(|point| cloud_steps(&Point3::from(*point)).unwrap()).collect();
    let view = CycleView { scan: None, cloud, depth: Some(depth) };
    CycleRecord { view: Some(view), ..cycle(index) }
}

fn causes(cycles: Vec<CycleRecord>, map: &[[f32; 3]], all: &[[f32; 3]]) -> Vec<KeptOutCause> {
    let points = |of: &[[f32; 3]]| of.iter().map(|point| Point3::from(*point)).collect();
    let run = RunRecord {
        static_map: points(map),
        unfiltered_map: points(all),
        ..seen_by_camera(run(cycles))
    };
    let grid = VoxelGrid::new(EDGE_M).unwrap();
    kept_out(&run, &grid).iter().map(|voxel| voxel.cause).collect()
}

const WALL: [f32; 3] = [3.05, 0.05, 0.05];
const HERE: [f32; 3] = [2.05, 0.05, 0.05];

#[test]
fn what_the_map_holds_is_not_kept_out() {
    assert_eq!(causes(vec![seeing(0, &[WALL], 3050)], &[WALL], &[WALL]), []);
}

#[test]
fn each_cause_is_found() {
    let beside = [3.05, 0.15, 0.05];
    for (cycles, expected, point) in [
        (vec![seeing(0, &[HERE], 2050), seeing(1, &[WALL], 3050)], KeptOutCause::SeenThrough, HERE),
        (vec![seeing(0, &[HERE], 2050), seeing(1, &[], 0)], KeptOutCause::NoReturn, HERE),
        (vec![seeing(0, &[HERE], 2050)], KeptOutCause::SeenOnce, HERE),
        (vec![seeing(0, &[HERE], 2050), seeing(1, &[HERE], 2040)], KeptOutCause::Uncertain, HERE),
        (vec![seeing(0, &[WALL, beside], 3050)], KeptOutCause::BesideSurface, beside),
    ] {
        assert_eq!(causes(cycles, &[WALL], &[WALL, point]), [expected]);
    }
}

/// Regression: what a full map had dropped was said to have had no return.
#[test]
fn what_the_map_had_no_room_for_is_told_from_what_was_not_seen() {
    for (second_mm, expected) in [(0, KeptOutCause::NoRoom), (3050, KeptOutCause::SeenThrough)] {
        let run = RunRecord {
            unfiltered_map: vec![Point3::from(HERE)],
            lacked_room: true,
            ..seen_by_camera(run(vec![seeing(0, &[HERE], 2050), seeing(1, &[], second_mm)]))
        };
        let [voxel] = kept_out(&run, &VoxelGrid::new(EDGE_M).unwrap())[..] else { panic!("one") };
        assert_eq!(voxel.cause, expected);
    }
}

#[test]
fn what_moved_is_told_from_what_did_not() {
    let mut moving = seeing(0, &[HERE, WALL], 2050);
    moving.dynamic_points_m = vec![Point3::from(HERE)];
    let edge_of_it = [2.05, 0.15, 0.05];
    let elsewhere = [1.05, 0.05, 0.05];
    assert_eq!(
        causes(vec![moving], &[WALL], &[HERE, edge_of_it, elsewhere]),
        [KeptOutCause::Moved, KeptOutCause::Moved, KeptOutCause::SeenThrough]
    );
}

#[test]
fn a_run_without_views_has_causes_nevertheless() {
    assert_eq!(causes(vec![cycle(0)], &[WALL], &[HERE]), [KeptOutCause::SeenOnce]);
}
