use std::collections::BTreeSet;

use proptest::prelude::*;

use super::*;

fn line(count: usize, offset_m: f32) -> Vec<Point3<f32>> {
    (0..count).map(|at| Point3::new(at as f32, offset_m, 0.0)).collect()
}

#[test]
fn the_same_cloud_has_no_distance() {
    let same = cloud_distance(&line(9, 0.0), &line(9, 0.0), 0.1).unwrap();
    assert_eq!((same.accuracy_m, same.completeness_m, same.chamfer_m), (0.0, 0.0, 0.0));
    assert_eq!((same.precision, same.recall, same.f_score), (1.0, 1.0, 1.0));
}

#[test]
fn what_is_missing_costs_recall_and_what_is_too_much_costs_precision() {
    let less = cloud_distance(&line(10, 0.0), &line(8, 0.0), 0.1).unwrap();
    assert_eq!((less.precision, less.recall), (1.0, 0.8));
    assert_eq!((less.accuracy_m, less.completeness_m), (0.0, 0.1));
    let more = cloud_distance(&line(8, 0.0), &line(10, 0.0), 0.1).unwrap();
    assert_eq!((more.precision, more.recall), (0.8, 1.0));
    assert!((more.f_score - 1.6 / 1.8).abs() < 1e-12);
}

#[test]
fn a_shift_is_measured() {
    let near = cloud_distance(&line(5, 0.0), &line(5, 0.0625), 0.125).unwrap();
    assert_eq!((near.accuracy_m, near.chamfer_m, near.f_score), (0.0625, 0.0625, 1.0));
    let far = cloud_distance(&line(5, 0.0), &line(5, 0.25), 0.125).unwrap();
    assert_eq!((far.accuracy_m, far.f_score), (0.25, 0.0));
    // Farther than five tolerances counts as five.
    let lost = cloud_distance(&line(5, 0.0), &line(5, 50.0), 0.125).unwrap();
    assert_eq!(lost.chamfer_m, 0.625);
}

#[test]
fn without_points_there_is_nothing_to_compare() {
    let nowhere = [Point3::new(f32::NAN, 0.0, 0.0)];
    let error = cloud_distance(&nowhere, &line(2, 0.0), 0.1).unwrap_err();
    assert_eq!(error, CloudDistanceError::Empty { which: "reference" });
    let error = cloud_distance(&line(2, 0.0), &[], 0.1).unwrap_err();
    assert_eq!(error, CloudDistanceError::Empty { which: "map" });
    assert!(cloud_distance(&line(2, 0.0), &line(2, 0.0), -1.0).is_err());
}

#[test]
fn a_reference_with_many_points_in_a_voxel_counts_each_place_once() {
    // Half of the surface was observed a hundred times as often: the map still has half of it.
    let often = (0..100).flat_map(|_| line(10, 0.0));
    let rare = line(10, 5.0);
    let reference: Vec<_> = often.chain(rare.clone()).collect();
    let clouds = ReducedClouds::of(&reference, &rare, 0.1).unwrap();
    assert_eq!((clouds.reference_m.len(), clouds.map_m.len()), (20, 10));
    assert_eq!(clouds.distance(0.1).unwrap().recall, 0.5);
    assert!(ReducedClouds::of(&reference, &rare, 0.0).is_err());
}

#[test]
fn rings_fill_a_cube_and_share_no_cell() {
    let centre = VoxelKey { x: 1, y: -2, z: 3 };
    let cells: Vec<VoxelKey> = (0..=2).flat_map(|ring| ring_of(centre, ring)).collect();
    assert_eq!(cells.len(), 125);
    assert_eq!(cells.iter().copied().collect::<BTreeSet<_>>().len(), 125);
}

proptest! {
    /// Against brute force.
    #[test]
    fn the_nearest_point_is_found(
        cloud in prop::collection::vec(prop::array::uniform3(-1.0f32..1.0), 1..60),
        asked in prop::array::uniform3(-1.5f32..1.5),
    ) {
        let cloud: Vec<Point3<f32>> = cloud.into_iter().map(Point3::from).collect();
        let asked = Point3::from(asked);
        let plain_m = cloud
            .iter()
            .map(|point| (point.cast::<f64>() - asked.cast::<f64>()).norm())
            .fold(f64::INFINITY, f64::min)
            .min(1.0);
        let found_m = Neighbours::of(&cloud, 0.2).unwrap().distance_m(&asked);
        prop_assert!((found_m - plain_m).abs() < 1e-12, "{} for {}", found_m, plain_m);
    }
}
