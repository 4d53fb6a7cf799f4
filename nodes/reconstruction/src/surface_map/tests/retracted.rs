//! What is known by now to have been of an object that has gone.

use super::*;

#[test]
fn what_is_retracted_is_in_the_map_no_more_and_comes_back_when_it_is_seen_again() {
    let rig = rig_at(0.0, 0.0);
    let person = Scene::room().with_person(0.2);
    let mut map = map(0.04);
    map.follow_changes();
    for index in 0..3 {
        map.integrate(&cycle(&person, index, &rig, None)).unwrap();
    }
    let is_room = |point: &Point3<f32>| Scene::room().nearest(&point.cast()).0 < 0.06;
    let of_person = |map: &Map| -> Vec<Point3<f32>> {
        map.points().into_iter().filter(|point| !is_room(point)).collect()
    };
    let (person_m, all) = (of_person(&map), map.points().len());
    assert!(person_m.len() > 50);
    // He is masked from now on, and still hides what is behind him.
    let masked = masked(&person, cycle(&person, 3, &rig, None), &rig);
    map.integrate(&SegmentedCycle { retracted_m: person_m.clone(), ..masked }).unwrap();
    assert_eq!(of_person(&map), []);
    assert!(map.points().len() + person_m.len() + 200 > all, "the room is there");
    map.integrate(&cycle(&person, 4, &rig, None)).unwrap();
    assert!(of_person(&map).len() > 50);
}
