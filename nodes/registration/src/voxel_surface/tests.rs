use super::*;
use crate::testing::Random;

#[test]
fn a_voxel_is_the_mean_of_its_points_and_normals() {
    let mut surface = VoxelSurface::new(1.0);
    let mut random = Random::new(1);
    let (mut sum, mut normals) = (Vector3::zeros(), Symmetric3::default());
    for _ in 0..50 {
        let place = Vector3::new(
            random.between(3.0, 4.0),
            random.between(-1.0, 0.0),
            random.between(0.0, 1.0),
        );
        let normal = random.direction();
        surface.add(&place, &normal, u32::MAX, 0);
        sum += place / 50.0;
        normals = normals.plus(0.02, &Symmetric3::outer(&normal));
    }
    assert_eq!(surface.len(), 1);
    let found = surface.corresponding(&Vector3::new(3.9, -0.9, 0.9), 5.0, None).unwrap();
    let element = surface.element(found);
    assert!((element.place_m - sum).norm() < 1e-12);
    assert!((element.normals.matrix() - normals.matrix()).norm() < 1e-12);
    // From the empty voxel beside it, and no farther than the limit.
    assert_eq!(surface.corresponding(&Vector3::new(4.2, -0.5, 0.5), 5.0, None), Some(found));
    assert_eq!(surface.corresponding(&Vector3::new(4.2, -0.5, 0.5), 0.1, None), None);
    assert_eq!(surface.corresponding(&Vector3::new(5.2, -0.5, 0.5), 5.0, None), None);
}

#[test]
fn what_a_voxel_saw_long_ago_fades() {
    let mut surface = VoxelSurface::new(1.0);
    for step in 0..200 {
        let height_m = if step < 100 { 0.2 } else { 0.8 };
        surface.add(&Vector3::new(0.5, 0.5, height_m), &Vector3::z(), 10, 0);
    }
    let mean = surface.element(0).place_m;
    assert!((mean.z - 0.8).abs() < 1e-3, "{mean}");
}

#[test]
fn the_nearest_and_the_newest_are_kept() {
    let mut surface = VoxelSurface::new(1.0);
    for step in 0..20_u32 {
        let travelled_m = f64::from(step) + 0.5;
        surface.add(&Vector3::new(travelled_m, 0.5, 0.5), &Vector3::z(), 10, u64::from(step));
    }
    surface.keep_near(&Vector3::new(10.5, 0.5, 0.5), 5.1, 100);
    assert_eq!(surface.len(), 11);
    surface.keep_near(&Vector3::new(10.5, 0.5, 0.5), 5.1, 4);
    assert_eq!(surface.len(), 4);
    for step in 0..20_u32 {
        let place = Vector3::new(f64::from(step) + 0.5, 0.5, 0.5);
        assert_eq!(surface.corresponding(&place, 0.1, None).is_some(), (12..16).contains(&step));
    }
}

#[test]
fn places_beyond_all_numbers_are_only_far_away() {
    let mut surface = VoxelSurface::new(0.1);
    for far in [1e300, -1e300, f64::MAX] {
        let place = Vector3::new(far, far, far);
        surface.add(&place, &Vector3::z(), 10, 0);
        let _ = surface.corresponding(&place, 1.0, None);
    }
    assert!(surface.len() <= 3);
}
