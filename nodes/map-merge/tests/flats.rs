//! Maps of simulated flats: of another day, turned, of a part, without normals, and of another flat. `examples/flats.rs` does the same for as
//! many seeds as one likes.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may stop where it stands")]

#[path = "flats/mapping.rs"]
mod mapping;

use estimation::Serial;
use map_merge::{Merge, MergeError, SavedMap, merge};
use mapping::{Mapping, Visit, altered, bare, score, visit};
use nalgebra::{Isometry3, Point3, Vector3};
use simulator::Home;

const MAPPING: Mapping = Mapping {
    edge_m: 0.06,
    size_px: (120, 90),
    position_noise_m: 0.005,
    rotation_noise_rad: 0.002,
};

/// A flat, and the same after half of its furniture was moved, taken away or replaced.
fn two_days(seed: u64) -> [Visit; 2] {
    let before = Home::new(seed).furnished(1000 + seed);
    let after = before.rearranged(2000 + seed, 0.5);
    let rooms = Visit::all_rooms(&before);
    [visit(&before, &rooms, 10 * seed, MAPPING), visit(&after, &rooms, 10 * seed + 1, MAPPING)]
}

fn merged(a: &SavedMap, b: &SavedMap) -> Result<Merge, MergeError> {
    merge(a, b, None, &Serial, &|| false)
}

/// The second map lies where it lies in truth.
fn check_pose(found: &Isometry3<f64>, a: &Visit, b: &Visit, new_from_b: &Isometry3<f64>) {
    let expected = a.map_from_room * b.map_from_room.inverse() * new_from_b.inverse();
    let middle_m = new_from_b * b.map_from_room * Point3::new(5.0, 0.0, 1.0);
    let metres = (found * middle_m - expected * middle_m).norm();
    let degrees = found.rotation.angle_to(&expected.rotation).to_degrees();
    assert!(metres < 0.03 && degrees < 0.3, "{metres} m, {degrees} degrees");
}

#[test]
fn what_was_moved_is_found_and_both_maps_become_one() {
    let [a, b] = two_days(3);
    let turn = Isometry3::new(Vector3::new(31.0, -7.0, 0.4), Vector3::new(0.01, -0.02, 2.0));
    let map_b = altered(&b.map, &turn);
    let Merge { alignment, changes, merged } = merged(&a.map, &map_b).unwrap();
    check_pose(&alignment.a_from_b, &a, &b, &turn);
    for (own, other, groups) in [(&a, &b, &changes.gone), (&b, &a, &changes.added)] {
        let score = score(own, other, groups);
        assert!(score.changed_and_seen > 1000, "{score:?}");
        assert!(score.precision() > 0.9 && score.recall() > 0.9, "{score:?}");
        assert!(score.recall_of_all() > 0.8, "{score:?}");
    }
    assert!(changes.only_in_a.is_empty() && changes.only_in_b.is_empty());
    assert_eq!(merged.points.normals.len(), merged.points.points_m.len());
    assert!(merged.views.len() > a.map.views.len());
    // What has gone is not in the merged map.
    let gone: usize = changes.gone.iter().map(|group| group.points.len()).sum();
    let new = merged.points.points_m.len() + gone - a.map.points.points_m.len();
    assert!(new * 3 < b.map.points.points_m.len(), "{new} of {}", b.map.points.points_m.len());
}

#[test]
fn a_part_and_maps_of_other_programs_are_aligned_too_and_say_no_more_than_they_know() {
    let [a, b] = two_days(6);
    let here = Isometry3::identity();
    let part = visit(&b.home, &[0, 1, 2], 77, MAPPING);
    let of_part = merged(&a.map, &part.map).unwrap();
    check_pose(&of_part.alignment.a_from_b, &a, &part, &here);
    let gone = score(&a, &part, &of_part.changes.gone);
    assert!(gone.precision() > 0.85, "{gone:?}");
    // Of what the second visit did not see it says nothing: the rest of the flat is kept.
    assert!(of_part.merged.points.points_m.len() + gone.found >= a.map.points.points_m.len());
    let of_bare = merged(&bare(&a.map, 0.06), &bare(&b.map, 0.08)).unwrap();
    check_pose(&of_bare.alignment.a_from_b, &a, &b, &here);
    let changes = of_bare.changes;
    assert!(changes.gone.is_empty() && changes.added.is_empty());
    assert!(!changes.only_in_a.is_empty() && !changes.only_in_b.is_empty());
    assert!(of_bare.merged.points.points_m.len() >= a.map.points.points_m.len());
}

#[test]
fn another_flat_is_refused_with_the_numbers() {
    let rooms = [0, 1, 2];
    let [a, b] = [(3, 30), (4, 40)]
        .map(|(layout, seed)| visit(&Home::new(layout).furnished(seed), &rooms, seed, MAPPING));
    for (a, b) in [(&a.map, &b.map), (&bare(&a.map, 0.06), &bare(&b.map, 0.06))] {
        let error = merged(a, b).unwrap_err();
        assert!(matches!(error, MergeError::NoAgreement { .. }), "{error}");
        assert!(error.to_string().contains("% of the upright surfaces"), "{error}");
    }
}
