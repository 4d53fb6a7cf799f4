//! Memory, time, and input that is none.

use std::num::NonZeroUsize;

use estimation::executor::{Executor, Task};
use proptest::prelude::*;

use super::*;

fn room_view() -> DepthView {
    let camera = testing::camera(160, 120);
    testing::view_of_scene(&Scene::room(), &camera, &Isometry3::identity(), 0.0)
}

#[test]
fn parameters_that_mean_nothing_are_refused() {
    assert!(config(0.001).validate().is_ok() && config(10.0).validate().is_ok());
    for edge_m in [0.0, -1.0, f64::NAN, f64::INFINITY, 0.0009, 10.1] {
        assert!(Surface::new(config(edge_m)).is_err(), "{edge_m}");
    }
    for broken in [
        SurfaceConfig { truncation_in_edges: 0.5, ..config(0.1) },
        SurfaceConfig { reach_m: f64::NAN, ..config(0.1) },
        SurfaceConfig { max_blocks: 0, ..config(0.1) },
        SurfaceConfig { max_blocks_per_image: 0, ..config(0.1) },
    ] {
        assert!(Surface::new(broken).is_err(), "{broken:?}");
    }
}

#[test]
fn blocks_beyond_the_bound_are_refused_and_counted() {
    let mut surface = Surface::new(SurfaceConfig { max_blocks: 20, ..config(0.05) }).unwrap();
    let update = surface.integrate(&room_view(), &Serial);
    assert_eq!((surface.blocks(), update.new_blocks), (20, 20));
    assert!(update.refused_blocks > 50);
}

#[test]
fn the_finest_and_coarsest_edges_have_a_bounded_cost() {
    for (edge_m, blocks) in [(0.001, 2000..2001), (10.0, 1..9)] {
        let config = SurfaceConfig { max_blocks_per_image: 2000, ..config(edge_m) };
        let mut surface = Surface::new(config).unwrap();
        let update = surface.integrate(&room_view(), &Serial);
        assert!(blocks.contains(&update.compared_blocks), "{edge_m} m: {update:?}");
        assert_eq!(update.is_incomplete, edge_m < 1.0);
    }
}

#[test]
fn it_takes_no_more_memory_while_it_sees_the_same() {
    let mut surface = surface(0.05);
    for _ in 0..3 {
        surface.integrate(&room_view(), &Serial);
    }
    let bytes = surface.memory_bytes();
    for _ in 0..10 {
        surface.integrate(&room_view(), &Serial);
    }
    assert_eq!(surface.memory_bytes(), bytes);
    surface.clear();
    assert_eq!((surface.blocks(), surface.points(PointRules::default()).len()), (0, 0));
}

#[test]
fn a_camera_within_a_surface_and_a_pose_that_jumps_do_no_harm() {
    let camera = testing::camera(64, 48);
    let mut surface = surface(0.05);
    for shift in [[0.0; 3], [0.0, 0.0, 3.38], [0.3, 0.2, 2.0], [9e4, -3e4, 1e3], [0.0; 3]] {
        let pose = testing::pose(shift, [0.0; 3]);
        surface
            .integrate(&testing::view_of(&camera, &pose, 0.0, vec![0.4; 64 * 48], None), &Serial);
    }
    assert!(surface.points(PointRules::default()).len() > 100);
}

/// Does every second task.
#[derive(Debug)]
struct EverySecond;

impl Executor for EverySecond {
    fn threads(&self) -> NonZeroUsize {
        NonZeroUsize::new(16).unwrap()
    }

    fn run(&self, tasks: Vec<Task<'_>>) {
        tasks.into_iter().step_by(2).for_each(|task| task());
    }
}

/// A node that ends leaves out what it has not begun.
#[test]
fn blocks_whose_tasks_are_left_out_stay_as_they_were() {
    let (mut whole, mut cut) = (surface(0.05), surface(0.05));
    let all = whole.integrate(&room_view(), &Serial).new_blocks;
    let some = cut.integrate(&room_view(), &EverySecond).new_blocks;
    assert!((1..all).contains(&some), "{some} of {all}");
    for _ in 0..20 {
        whole.integrate(&room_view(), &EverySecond);
    }
    assert_eq!(whole.blocks(), all, "nothing is cleared by what was left out");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn no_image_does_harm(
        depths_m in prop::collection::vec(any::<f32>(), 192),
        shift in prop::array::uniform3(-1e5..1e5_f64),
        turn in prop::array::uniform3(-4.0..4.0_f64),
        edge_m in 0.001..10.0_f64,
    ) {
        let camera = testing::camera(16, 12);
        let mut surface = Surface::new(SurfaceConfig { max_blocks_per_image: 500, ..config(edge_m) }).unwrap();
        let pose = testing::pose(shift.map(|along| along / 2.0), turn);
        let view = testing::view_of(&camera, &pose, 0.0, depths_m, None);
        surface.integrate(&view, &ScopedThreads::new(std::num::NonZeroUsize::new(3).unwrap()));
        let _ = surface.points(PointRules::default());
    }
}
