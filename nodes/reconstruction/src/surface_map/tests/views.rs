//! Where the map was seen from.

use geometry::{MapView, Stamp};

use super::*;
use crate::AtMaxVoxels;

#[test]
fn the_map_has_the_places_of_its_images_where_a_correction_puts_them() {
    let mut map = map(0.05);
    map.follow_path(&path_at(0.0)).unwrap();
    let places_m = [0.0, 0.0, 0.1, 0.6];
    for (index, shift_m) in (0..).zip(places_m) {
        map.integrate(&cycle(&Scene::room(), index, &rig_at(shift_m, 0.0), None)).unwrap();
    }
    let views = map.whole().views;
    assert_eq!(views.len(), 2, "one of 0 and 0.1 m, and one of 0.6 m: {views:?}");
    map.follow_path(&path_at(0.5)).unwrap();
    let shift = rig_at(0.5, 0.0) * rig_at(0.0, 0.0).inverse();
    for (before, after) in views.iter().zip(&map.whole().views) {
        let error = (shift * before.map_from_camera).inverse() * after.map_from_camera;
        assert!(error.translation.vector.norm() < 1e-9 && error.rotation.angle() < 1e-9);
    }
    // Measured before the correction, received after it: of a place that is known by now.
    map.integrate(&cycle(&Scene::room(), 4, &rig_at(0.0, 0.0), None)).unwrap();
    assert_eq!(map.whole().views.len(), 2);
    let before = map.cloud_for_listeners().unwrap().cloud;
    map.clear();
    assert_eq!(map.whole().views, []);
    // Who shows the map is told in the frame that he knows.
    let emptied = map.cloud_for_listeners().unwrap().cloud;
    assert_eq!(emptied, geometry::Cloud { points_m: vec![], ..before });
}

/// Regression: a map that had dropped walls kept the views of them, which saw through where they had stood: a merge took the
/// walls of the other map for gone.
#[test]
fn the_views_of_dropped_blocks_are_dropped_with_them() {
    let at_max_voxels = AtMaxVoxels::DropOldest;
    let config = ReconstructionConfig { max_map_blocks: 400, at_max_voxels, ..config(0.05) };
    let mut map = Map::new(config, None).unwrap();
    let mut taken = Vec::new();
    let mut dropped = 0;
    for index in 0..12 {
        let rig = rig_at(0.0, 0.4 * f64::from(index));
        let cycle = cycle(&Scene::room(), index, &rig, None);
        taken.push(cycle.static_cloud.stamp);
        dropped += map.integrate(&cycle).unwrap().dropped_voxels;
    }
    let views: Vec<Stamp> = map.whole().views.iter().map(|view| view.stamp).collect();
    assert!(dropped > 0 && !views.is_empty(), "{dropped} dropped, {views:?}");
    assert!(!views.contains(&taken[0]), "what it saw has gone: {views:?}");
}

/// Regression: an image whose blocks were refused, or which was cut, was a view of what the map does not have.
#[test]
fn an_image_of_which_a_part_was_left_out_is_no_view() {
    let few = ReconstructionConfig { max_map_blocks: 60, ..config(0.05) };
    for (config, is_cut) in [(few, false), (config(0.001), true)] {
        let mut map = Map::new(config, None).unwrap();
        let view = scene::sized_cycle(&Scene::room(), 0, &rig_at(0.0, 0.0), None, (64, 48));
        let done = map.integrate(&view).unwrap();
        assert_eq!((done.is_view_cut, done.refused_points > 0), (is_cut, !is_cut));
        assert_eq!(map.whole().views, []);
    }
}

/// Regression: an image without depths kept out the views of those that came later from there.
#[test]
fn an_image_without_depths_is_no_view() {
    let mut map = map(0.05);
    map.integrate(&scene::blind_cycle(0)).unwrap();
    assert_eq!(map.whole().views, []);
    map.integrate(&cycle(&Scene::room(), 1, &rig_at(0.0, 0.0), None)).unwrap();
    assert_eq!(map.whole().views.len(), 1);
}

/// Regression: the views of a loaded map moved by corrections of a path that was not theirs, while its points stayed.
#[test]
fn the_views_of_a_loaded_map_stay_with_its_points() {
    let mut saved = map(0.05);
    saved.integrate(&cycle(&Scene::room(), 0, &rig_at(0.0, 0.0), None)).unwrap();
    let saved = saved.whole();
    let mut map = map(0.05);
    map.replace(&saved.points.points_m, &saved.points.normals, "map").unwrap();
    map.add_views(saved.views.clone());
    let before = map.points();
    map.follow_path(&path_at(0.0)).unwrap();
    map.integrate(&cycle(&Scene::room(), 1, &rig_at(2.0, 0.0), None)).unwrap();
    let own = map.whole().views;
    map.follow_path(&path_at(0.5)).unwrap();
    let moved: Vec<MapView> = map.whole().views;
    assert_eq!((&moved[..1], &own[..1]), (&saved.views[..], &saved.views[..]));
    assert_eq!(moved.len(), 2);
    assert_ne!(moved[1].map_from_camera, own[1].map_from_camera);
    let stayed = before.iter().filter(|point| map.points().contains(point)).count();
    assert!(2 * stayed > before.len(), "{stayed} of {}", before.len());
}
