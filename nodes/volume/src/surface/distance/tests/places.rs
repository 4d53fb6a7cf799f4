//! What a field says of single places.

use nalgebra::Vector3;

use super::*;

/// The wall at x = 0, seen from greater x, of blocks from -3 to 2 along y and z.
fn wall() -> Surface {
    let mut surface = surface();
    for y in -3..3 {
        for z in -3..3 {
            for x in [-1, 0] {
                let mut block = SurfaceBlock { weight: [1; 512], ..SurfaceBlock::default() };
                for index in 0..512 {
                    let in_edges = 8.0 * x as f32 + (index % 8) as f32 + 0.5;
                    block.distance[index] = ((in_edges / 4.0).clamp(-1.0, 1.0) * FULL) as i16;
                }
                surface.layer.insert(BlockKey { x, y, z }, Some(Box::new(block)));
            }
        }
    }
    surface
}

#[test]
fn away_is_the_normal_of_a_wall_and_the_distance_is_that_of_the_wall() {
    let surface = wall();
    let mut field = DistanceField::of(&surface, DistanceConfig::default()).unwrap();
    let wall_m = -0.5 * MAP_EDGE_M;
    for (x_m, side, place) in [
        (0.07, 1.0, PlaceState::Free),
        (0.4, 1.0, PlaceState::Unknown),
        (1.4, 1.0, PlaceState::Unknown),
        (-0.1, -1.0, PlaceState::Behind),
        (-0.9, -1.0, PlaceState::Unknown),
    ] {
        let at = field.at(&surface, &Point3::new(x_m, 0.03, -0.11));
        let nearest = at.nearest.unwrap();
        let true_m: f64 = x_m - wall_m;
        assert!((f64::from(nearest.distance_m) - true_m.abs()).abs() < 0.006, "{x_m}: {at:?}");
        assert!(nearest.away.unwrap().x * side > 0.98, "{x_m}: {at:?}");
        assert_eq!(at.place, place, "{x_m}");
    }
}

/// In single precision nodes 5 cm apart are 5.08 cm apart 10 km from the origin: more than the bound from the next node allowed, and
/// there was no obstacle at all.
#[test]
fn far_from_the_origin_obstacles_are_as_far_away_as_at_it() {
    for far in [0, 40_000, 250_000] {
        let mut surface = surface();
        put(&mut surface, BlockKey { x: far, y: far, z: 0 }, |index| index % 8 < 4);
        let points = surface.points(PointRules::default());
        let config = DistanceConfig::default();
        let mut field = DistanceField::of(&surface, config).unwrap();
        let first_m = f64::from(far) * 8.0 * MAP_EDGE_M;
        for step in 0..40 {
            let place = Point3::new(first_m + 0.1 + 0.04 * f64::from(step), first_m + 0.1, 0.1);
            let error_m = error_m(&field.at(&surface, &place), &points, &place, config);
            assert!(error_m <= half_diagonal_m(config), "block {far}, {step}: {error_m} m");
        }
    }
}

#[test]
fn between_two_points_the_distance_grows_in_no_direction_of_theirs() {
    let mut surface = surface();
    for x in [0, 5] {
        put(&mut surface, BlockKey { x, y: 0, z: 0 }, |index| index == 64 * 3 + 8 * 3 + 3);
    }
    let places = surface.points(PointRules::default());
    let sum = places.iter().fold(Vector3::zeros(), |sum, point| sum + point.position_m.coords);
    let middle = Point3::from(sum.cast::<f64>() / places.len() as f64);
    // Along x the middle of the ridge is in the middle of a cell.
    let config = DistanceConfig { edge_m: middle.x / 10.5, ..DistanceConfig::default() };
    let mut field = DistanceField::of(&surface, config).unwrap();
    let away = field.at(&surface, &middle).nearest.unwrap().away;
    assert!(away.is_none_or(|away| away.x.abs() < 0.1), "{away:?}");
}

#[test]
fn beyond_the_bound_and_not_finite_there_is_no_obstacle() {
    let surface = wall();
    let config = DistanceConfig { max_distance_m: 0.5, ..DistanceConfig::default() };
    let mut field = DistanceField::of(&surface, config).unwrap();
    let at = |field: &mut DistanceField, x_m| field.at(&surface, &Point3::new(x_m, 0.0, 0.0));
    assert!(at(&mut field, 0.47).nearest.is_some());
    for x_m in [0.52, 1.0, 1e3, 1e9, 1e30, -1e30, f64::NAN, f64::INFINITY] {
        assert_eq!(at(&mut field, x_m), DistanceAt::default(), "{x_m}");
    }
    let nothing = surface.emptied();
    let mut field = DistanceField::of(&nothing, config).unwrap();
    assert_eq!(field.at(&nothing, &Point3::origin()), DistanceAt::default());
}

#[test]
fn more_blocks_than_the_bound_are_forgotten_and_computed_again() {
    let surface = wall();
    let unbounded = DistanceConfig::default();
    let mut field =
        DistanceField::of(&surface, DistanceConfig { max_blocks: 3, ..unbounded }).unwrap();
    let mut all = DistanceField::of(&surface, unbounded).unwrap();
    let mut noise = Noise::new(5);
    for _ in 0..200 {
        let place = Point3::from([0; 3].map(|_| 2.0 * noise.uniform() - 1.0));
        assert_eq!(field.at(&surface, &place), all.at(&surface, &place));
        assert!(field.blocks() <= 3);
    }
    assert!(all.blocks() > 50 && all.memory_bytes() > 50 * 2_900, "{}", all.memory_bytes());
}

#[test]
fn a_lattice_has_the_nodes_of_a_box_or_the_nearest_layer() {
    let field = DistanceField::of(&surface(), DistanceConfig::default()).unwrap();
    let lattice = |least: [f64; 3], most: [f64; 3]| field.lattice(&least.into(), &most.into());
    let box_of = lattice([-0.12, 0.0, 0.02], [0.12, 0.21, 0.02]);
    assert_eq!(box_of, LatticeBox { first: VoxelKey { x: -2, y: 0, z: 0 }, size: [5, 5, 1] });
    assert_eq!((box_of.nodes(), field.node_m(box_of.first)), (25, Point3::new(-0.1, 0.0, 0.0)));
    assert_eq!(lattice([0.0; 3], [0.0, 0.0, 0.026]).first.z, 0);
    assert_eq!(lattice([0.0, 0.0, 0.026], [0.0, 0.0, 0.026]).first.z, 1);
    assert!(lattice([-1e30; 3], [1e30; 3]).nodes() > 1 << 60);
}

#[test]
fn parameters_that_mean_nothing_are_errors() {
    let good = DistanceConfig::default();
    let refused =
        |config: DistanceConfig| DistanceField::of(&surface(), config).err().unwrap().to_string();
    for edge_m in [0.0, -1.0, f64::NAN, 2.0] {
        assert!(refused(DistanceConfig { edge_m, ..good }).contains("from 0.01 m to 1 m"));
    }
    for max_distance_m in [0.0, f64::INFINITY, f64::NAN] {
        assert!(refused(DistanceConfig { max_distance_m, ..good }).contains("from 0.1 m to 10 m"));
    }
    assert!(refused(DistanceConfig { max_blocks: 0, ..good }).contains("at least one"));
}
