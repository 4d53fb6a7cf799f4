//! Against the twin, whatever comes and goes.

use estimation::executor::Serial;
use nalgebra::Isometry3;
use proptest::prelude::*;

use super::*;
use crate::testing::{self, Scene};

/// Blocks from `-HALF` to `HALF` an axis, this one not included.
const HALF: i32 = 6;

fn any_key(noise: &mut Noise) -> BlockKey {
    let mut along = || ((noise.uniform() * 2.0 - 1.0) * f64::from(HALF)).floor() as i32;
    BlockKey { x: along(), y: along(), z: along() }
}

fn any_place(noise: &mut Noise) -> Point3<f64> {
    let half_m = 1.2 * f64::from(HALF) * block_edge_m(MAP_EDGE_M);
    Point3::from([0; 3].map(|_| (noise.uniform() * 2.0 - 1.0) * half_m))
}

/// Something changes in a block.
fn change(surface: &mut Surface, noise: &mut Noise) -> BlockKey {
    let key = any_key(noise);
    if noise.uniform() < 0.4 {
        surface.remove_block(key);
    } else {
        let behind: Vec<usize> = (0..3).map(|_| (noise.uniform() * 512.0) as usize).collect();
        put(surface, key, |index| behind.contains(&index));
    }
    key
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    /// After each change the error is at most half a voxel's diagonal, at nodes none, and the answers are those of a field of the
    /// surface as it is now, to the bit.
    #[test]
    fn the_error_is_at_most_half_a_diagonal_after_any_changes(
        seed in any::<u64>(), edge_m in 0.01..0.1_f64, max_distance_m in 0.1..2.0_f64,
    ) {
        let config = DistanceConfig { edge_m, max_distance_m, ..DistanceConfig::default() };
        let (mut surface, mut noise) = (surface(), Noise::new(seed));
        let mut field = DistanceField::of(&surface, config).unwrap();
        // The same ones each time: what was computed before a change is asked for after it.
        let places: Vec<_> = (0..60).map(|_| any_place(&mut noise)).collect();
        for _ in 0..8 {
            for _ in 0..1 + (noise.uniform() * 4.0) as usize {
                field.follow_block(change(&mut surface, &mut noise));
            }
            let points = surface.points(PointRules::default());
            let mut anew = DistanceField::of(&surface, config).unwrap();
            for &place in &places {
                let at = field.at(&surface, &place);
                prop_assert_eq!(at, anew.at(&surface, &place));
                let error = error_m(&at, &points, &place, config);
                prop_assert!(error <= half_diagonal_m(config) + 1e-5, "{} m at {}", error, place);

                let node = field.lattice(&place, &place).first;
                let node_m = field.node_m(node);
                let at = field.at(&surface, &node_m);
                let error = error_m(&at, &points, &node_m, config);
                prop_assert!(error < 1e-5, "{} m at the node {}", error, node_m);
            }
        }
    }
}

fn look(surface: &mut Surface, scene: &Scene, time_s: f64) {
    let camera = testing::camera(160, 120);
    let view = testing::view_of_scene(scene, &camera, &Isometry3::identity(), time_s);
    surface.integrate(&view, &Serial);
}

#[test]
fn it_follows_images_and_what_they_clear() {
    let mut surface = surface();
    look(&mut surface, &Scene::wall(1.0), 0.0);
    let mut field = DistanceField::of(&surface, DistanceConfig::default()).unwrap();
    let before_wall = Point3::new(0.02, -0.04, 0.6);
    let distance_m = |field: &mut DistanceField, surface: &Surface| {
        f64::from(field.at(surface, &before_wall).nearest.unwrap().distance_m)
    };
    assert!((distance_m(&mut field, &surface) - 0.4).abs() < 0.01);
    // The wall is a metre farther away now.
    for image in 1..15 {
        look(&mut surface, &Scene::wall(2.0), 0.1 * f64::from(image));
        field.follow(&surface);
    }
    assert!((distance_m(&mut field, &surface) - 1.4).abs() < 0.02);
    let mut anew = DistanceField::of(&surface, DistanceConfig::default()).unwrap();
    let mut noise = Noise::new(3);
    for _ in 0..500 {
        let place = any_place(&mut noise) + nalgebra::Vector3::z();
        assert_eq!(field.at(&surface, &place), anew.at(&surface, &place));
    }
}

/// A block of distances is computed again only if what has changed is no farther from it than its own obstacles are.
#[test]
fn what_cannot_have_an_influence_is_kept() {
    let mut surface = surface();
    let key = |x| BlockKey { x, y: 0, z: 0 };
    for x in [0, 4] {
        put(&mut surface, key(x), |index| index == 100);
    }
    let mut field = DistanceField::of(&surface, DistanceConfig::default()).unwrap();
    let beside_first = Point3::new(0.1, 0.1, 0.1);
    field.at(&surface, &beside_first);
    let beside_other = Point3::new(1.1, 0.1, 0.1);
    field.at(&surface, &beside_other);
    assert_eq!(field.blocks(), 2);
    // A metre away from the first.
    put(&mut surface, key(4), |index| index == 101);
    field.follow_block(key(4));
    assert_eq!((field.update(&surface), field.blocks()), (1, 1));
    assert_eq!(field.needed_for(&beside_first), None);
    assert!(field.needed_for(&beside_other).is_some());
    // The same points as before.
    field.follow_block(key(4));
    assert_eq!(field.update(&surface), 0);
}

#[test]
fn what_has_left_for_a_store_stays_an_obstacle_where_distances_are_known() {
    let mut surface = surface();
    let key = BlockKey::default();
    put(&mut surface, key, |index| index == 100);
    let bytes = surface.block_bytes(key).unwrap();
    let mut field = DistanceField::of(&surface, DistanceConfig::default()).unwrap();
    let (place, other) = (Point3::new(0.1, 0.1, 0.1), Point3::new(0.7, 0.1, 0.1));
    let before = field.at(&surface, &place);
    surface.remove_block(key);
    field.left(key);
    assert_eq!(field.at(&surface, &place).nearest, before.nearest);
    assert!(field.needed_for(&other).unwrap().contains(key));
    surface.put_block(&bytes).unwrap();
    field.follow_block(key);
    let points = surface.points(PointRules::default());
    let at = field.at(&surface, &other);
    assert!(error_m(&at, &points, &other, *field.config()) < 0.02);
}
