//! Where the map was seen from.

use super::*;

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
