//! Places that are set to unknown.

use std::collections::BTreeSet;

use proptest::prelude::*;

use super::*;
use crate::ChangeFollower;

const BALL_M: ([f64; 3], f64) = ([0.0, 0.0, 1.5], 0.2);

fn after(edge_m: f64) -> Surface {
    let scene = Scene { balls: vec![(BALL_M.0.into(), BALL_M.1)], ..Scene::wall(3.0) };
    let (mut surface, camera) = (surface(edge_m), testing::camera(160, 120));
    for index in 0..4 {
        let pose = testing::pose([0.0; 3], [0.0; 3]);
        surface.integrate(&testing::view_of_scene(&scene, &camera, &pose, index as f64), &Serial);
    }
    surface
}

#[test]
fn what_was_at_these_places_has_no_points_any_more_and_all_else_has() {
    for edge_m in [0.02, 0.05, 0.1] {
        let mut surface = after(edge_m);
        let is_of_ball = |point: &SurfacePoint| point.position_m.z < 2.0;
        let (ball, wall): (Vec<_>, Vec<_>) = points(&surface).into_iter().partition(is_of_ball);
        assert!(ball.len() > 10 && wall.len() > 100);
        let places: Vec<Point3<f32>> = ball.iter().map(|point| point.position_m).collect();
        let before = surface.near_nodes();
        surface.forget_around(&places, 0.08);
        assert_eq!(points(&surface), wall, "edge {edge_m} m");
        assert!(surface.near_nodes() < before);
        let counted = surface.near_nodes();
        surface.count_near_nodes();
        assert_eq!(surface.near_nodes(), counted);
    }
}

#[test]
fn who_follows_the_changes_is_told() {
    let mut surface = after(0.05);
    let mut follower = ChangeFollower::default();
    follower.follow(&surface);
    let (changed, removed) = (surface.changed().len(), surface.removed().len());
    // All of a block: it goes.
    assert!(surface.forget_around(&[Point3::new(0.0, 0.0, 1.3)], 0.5) > 0);
    assert!(surface.changed().len() + surface.removed().len() >= changed + removed);
    let both = surface.changed().iter().filter(|key| surface.removed().contains(key));
    assert_eq!(both.count(), 0, "a block that has gone has not changed");
    let unique: BTreeSet<_> = surface.changed().iter().collect();
    assert_eq!(unique.len(), surface.changed().len());
}

#[test]
fn places_that_are_none_change_nothing() {
    let mut surface = after(0.05);
    let before = contents(&surface);
    for place in
        [[f32::NAN, 0.0, 1.3], [0.0, f32::INFINITY, 0.0], [1e30, 0.0, 0.0], [50.0, 50.0, 50.0]]
    {
        assert_eq!(surface.forget_around(&[place.into()], 0.1), 0);
    }
    assert_eq!(surface.forget_around(&[Point3::new(0.0, 0.0, 1.3)], f64::NAN), 0);
    assert!(contents(&surface) == before);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Each node, one after the other.
    #[test]
    fn the_nodes_within_reach_are_unknown_and_the_others_as_they_were(
        place in (-0.4_f32..0.4, -0.4_f32..0.4, 1.0_f32..3.2),
        reach_m in 0.06..0.4,
    ) {
        let place: [f32; 3] = place.into();
        let mut surface = after(0.05);
        let before = contents(&surface);
        surface.forget_around(&[place.into()], reach_m);
        for (key, block) in before {
            for index in 0..crate::BLOCK_VOXELS {
                let node = key.voxel(index);
                let is_within = [node.x, node.y, node.z].into_iter().zip(place).all(|(node, along_m)| {
                    (f64::from(node) * 0.05 - f64::from(along_m)).abs() <= reach_m
                });
                let weight = surface.block(key).map(|now| now.weight[index]);
                if is_within {
                    prop_assert!(weight.is_none_or(|weight| weight == 0));
                } else if let Some(weight) = weight {
                    prop_assert_eq!(weight, block.weight[index]);
                }
            }
        }
    }
}
