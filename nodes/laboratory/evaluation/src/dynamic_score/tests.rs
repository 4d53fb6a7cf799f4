//! A world of a few points on a grid of 10 cm, so small that each figure can be counted by hand.

use std::collections::BTreeMap;
use std::convert::Infallible;

use geometry::{DynamicZone, Stamp, ZoneSource};
use nalgebra::{Isometry3, Point3};

use super::*;
use crate::testing::{cycle, run};
use report::{FirstFound, IdentityScore, StaticVoxels};

const VGA_PX: (usize, usize) = (640, 480);
const PERSON: u16 = 7;

/// The middle of the voxel `(x, y, z)`.
fn voxel(x: i32, y: i32, z: i32) -> Point3<f32> {
    let middle = |cell: i32| (cell as f32 + 0.5) * 0.1;
    Point3::new(middle(x), middle(y), middle(z))
}

fn points(object_id: u16, count: usize, point_in_rig: Point3<f32>) -> Vec<LabelledPoint> {
    vec![LabelledPoint { point_in_rig, object_id }; count]
}

/// A zone that holds the x axis and little more.
fn zone_ahead() -> DynamicZone {
    DynamicZone {
        azimuth_min_rad: -0.1,
        azimuth_max_rad: 0.1,
        peak_std_dev_m: 0.5,
        source: ZoneSource::Measured,
        returns: None,
    }
}

fn with_removed(index: u32, zones: Vec<DynamicZone>, removed: &[Point3<f32>]) -> CycleRecord {
    CycleRecord { zones, dynamic_points_m: removed.to_vec(), ..cycle(index) }
}

/// Scores `run` against one truth for each of its cycles.
fn score(run: &RunRecord, truths: &[Vec<LabelledPoint>]) -> DynamicScore {
    scored_with_surface(run, truths, None)
}

fn scored_with_surface(
    run: &RunRecord,
    truths: &[Vec<LabelledPoint>],
    surface_m: Option<&[Point3<f32>]>,
) -> DynamicScore {
    let mut truths = truths.iter();
    let truth_at =
        |_| Ok::<_, Infallible>(truths.next().map(|t| TruthFrame::from_points(VGA_PX, t.clone())));
    let rules = DynamicScoreRules::default();
    score_dynamic(run, &rules, &BTreeMap::new(), surface_m, truth_at).unwrap()
}

#[test]
fn a_removed_point_is_one_whose_voxel_was_taken_for_moving() {
    // The person: 300 points ahead, removed, and 100 beside them, not; the wall: 50 points of which 10 share a
    // voxel with what was removed. The removed point lies elsewhere in that voxel than the true ones.
    let removed = voxel(20, 0, 0) + nalgebra::Vector3::new(0.02, -0.03, 0.04);
    let run = run(vec![with_removed(0, vec![zone_ahead()], &[removed])]);
    let truth = [
        points(PERSON, 300, voxel(20, 0, 0)),
        points(PERSON, 100, voxel(20, 0, 1)),
        points(0, 40, voxel(40, 0, 0)),
        points(0, 10, voxel(20, 0, 0)),
    ]
    .concat();
    let score = score(&run, &[truth]);
    let person = &score.objects[0];
    assert_eq!((person.points.points, person.points.removed), (400, 300));
    assert_eq!(person.points.share, Some(0.75));
    assert_eq!((score.static_points.points, score.static_points.removed), (50, 10));
    assert_eq!(score.static_points.share, Some(0.2));
    assert_eq!(score.object_points, person.points);
    let only = person.per_cycle[0];
    assert!(only.in_view && only.found && only.removed);
    assert_eq!(only.share_in_zone, 1.0);
}

#[test]
fn a_static_point_next_to_a_moving_one_is_at_the_border() {
    let (person, beside, away) = (voxel(20, 0, 0), voxel(21, 0, 0), voxel(40, 0, 0));
    let run = run(vec![with_removed(0, vec![zone_ahead()], &[person, beside, away])]);
    let truth = [
        points(PERSON, 80, person),
        points(PERSON, 20, voxel(20, 3, 0)),
        points(0, 50, beside),
        points(0, 20, away),
        points(0, 930, voxel(45, 0, 0)),
    ]
    .concat();
    let score = score(&run, &[truth]);
    assert_eq!((score.labels.recall, score.labels.static_removed_off_borders), (Some(0.8), 20));
    assert_eq!(score.labels.precision, Some(0.8));
    assert_eq!(score.labels.precision_with_borders, Some(80.0 / 150.0));
    let by_points = score.by_points;
    assert!((by_points.static_accuracy.unwrap() - 0.93).abs() < 1e-12);
    assert_eq!(by_points.dynamic_accuracy, Some(0.8));
    assert!((by_points.associated_accuracy.unwrap() - (0.93f64 * 0.8).sqrt()).abs() < 1e-12);
    // The map is empty: no ghost, and nothing of the room.
    let by_voxels = score.by_voxels;
    assert_eq!((by_voxels.static_accuracy, by_voxels.dynamic_accuracy), (Some(0.0), Some(1.0)));
}

#[test]
fn in_view_found_and_removed_are_different_things() {
    let ahead = voxel(20, 0, 0);
    let left = voxel(20, 20, 0);
    let cycles = vec![
        // 0: in view, and nothing of it was removed though a zone holds it.
        with_removed(0, vec![zone_ahead()], &[]),
        // 1: found, a quarter removed.
        with_removed(1, vec![zone_ahead()], &[ahead]),
        // 2: half removed, but three quarters lie outside of the zone: removed, not found.
        with_removed(2, vec![zone_ahead()], &[ahead, left]),
        // 3: all removed, but too few points to count.
        with_removed(3, vec![zone_ahead()], &[ahead]),
        // 4: found and removed with exactly the required shares.
        with_removed(4, vec![zone_ahead()], &[ahead]),
    ];
    let truths = [
        points(PERSON, 200, ahead),
        [points(PERSON, 50, ahead), points(PERSON, 150, voxel(20, 0, 5))].concat(),
        [
            points(PERSON, 50, ahead),
            points(PERSON, 50, left),
            points(PERSON, 100, voxel(20, 30, 0)),
        ]
        .concat(),
        points(PERSON, 199, ahead),
        [points(PERSON, 100, ahead), points(PERSON, 100, left)].concat(),
    ];
    let score = score(&run(cycles), &truths);
    let person = &score.objects[0];
    let flags: Vec<_> = person.per_cycle.iter().map(|c| (c.in_view, c.found, c.removed)).collect();
    assert_eq!(
        flags,
        [
            (true, false, false),
            (true, true, false),
            (true, false, true),
            (false, false, false),
            (true, true, true)
        ]
    );
    assert_eq!((person.cycles_in_view, person.cycles_found, person.cycles_removed), (4, 2, 2));
    // In a zone, or removed: neither asks for the other.
    assert_eq!((person.cycles_found_or_removed, person.found_or_removed_share), (3, Some(0.75)));
    assert_eq!(person.first_found, Some(FirstFound { cycle: 1, nth_in_view: 2 }));
    // The cycle out of view still counts among the points.
    assert_eq!((person.points.points, person.points.removed), (999, 449));
}

#[test]
fn what_is_never_found_has_no_first_time() {
    let ahead = voxel(20, 0, 0);
    let never = score(&run(vec![with_removed(0, vec![], &[])]), &[points(PERSON, 300, ahead)]);
    assert_eq!(
        (never.objects[0].first_found, never.objects[0].found_or_removed_share),
        (None, Some(0.0))
    );
    // In view of no cycle: no share of them.
    let run = run(vec![with_removed(0, vec![zone_ahead()], &[ahead])]);
    let unseen = &score(&run, &[points(PERSON, 3, ahead)]).objects[0];
    assert_eq!((unseen.first_found, unseen.found_or_removed_share), (None, None));
}

#[test]
fn tracks_are_held_against_where_the_objects_are_seen_in_the_map() {
    // The rig drives on by 1 m a cycle and sees the person 2.05 m ahead: 2.05, 3.05 and 4.05 m in the map.
    let tracked = |index: u32, tracks: &[(u32, f64)]| {
        let mut cycle = cycle(index);
        cycle.map_from_rig = Isometry3::translation(f64::from(index), 0.0, 0.0);
        let at = |x_m: f64| Point3::new(x_m, 0.0, 0.4);
        cycle.tracks_m = tracks.iter().map(|(id, x_m)| (*id, at(*x_m))).collect();
        cycle
    };
    let truths = || vec![points(PERSON, 300, voxel(20, 0, 0)); 3];
    let identities = |cycles: Vec<CycleRecord>| score(&run(cycles), &truths()).identities;
    let kept =
        [tracked(0, &[(7, 2.0)]), tracked(1, &[(7, 3.0), (8, 2.0)]), tracked(2, &[(7, 4.0)])];
    let all = IdentityScore { sightings: 3, followed: 3, switches: 0 };
    assert_eq!(identities(kept.to_vec()), Some(all));
    let renumbered = [kept[0].clone(), tracked(1, &[]), tracked(2, &[(9, 4.0)])];
    let switched = IdentityScore { sightings: 3, followed: 2, switches: 1 };
    assert_eq!(identities(renumbered.to_vec()), Some(switched));
    // Nothing is followed at all: there is nothing to be said of identities.
    assert_eq!(identities((0..3).map(|index| tracked(index, &[])).collect()), None);
}

#[test]
fn the_threshold_of_view_goes_with_the_image_size() {
    let rules = DynamicScoreRules::default();
    assert_eq!(in_view_points(&rules, (640, 480)), 200);
    assert_eq!(in_view_points(&rules, (320, 240)), 50);
    // Kinect v2: 217,088 pixels, 141.3 of them.
    assert_eq!(in_view_points(&rules, (512, 424)), 142);
    assert_eq!(in_view_points(&rules, (0, 0)), 1);
}

#[test]
fn the_map_is_judged_by_who_touched_its_voxels() {
    // Voxels of the map: a and b only the person touched, shared both, wall and floor only the scene.
    let (a, b, shared) = (voxel(20, 0, 0), voxel(20, 1, 0), voxel(20, 2, 0));
    let (wall, floor) = (voxel(40, 0, 0), voxel(10, 0, -5));
    let mut run = run(vec![cycle(0), cycle(1)]);
    run.unfiltered_map = vec![a, b, shared, wall];
    run.static_map = vec![b, shared, wall];
    let truths = [
        [points(PERSON, 5, a), points(PERSON, 5, b), points(PERSON, 5, shared), points(0, 5, wall)]
            .concat(),
        [points(0, 5, shared), points(0, 5, wall), points(0, 5, floor)].concat(),
    ];
    let map = score(&run, &truths).map;
    assert_eq!((map.object_only, map.object_only_without_removal, map.object_only_left), (2, 2, 1));
    assert_eq!((map.static_scene, map.static_without_removal, map.static_kept), (3, 2, 2));
    assert_eq!(map.static_kept_share, Some(2.0 / 3.0));
    assert_eq!(map.static_kept_share_of_unfiltered, Some(1.0));
}

/// The floor of a room, a point every 2.5 cm; measured with noise, so that half of it is in the voxels below.
#[test]
fn a_map_of_the_surface_keeps_the_voxels_beside_it_that_noise_touched() {
    let floor = |z_m: f32| -> Vec<Point3<f32>> {
        let place = |index: u16| {
            [f32::from(index / 40), f32::from(index % 40)].map(|step| 0.025 * step + 2.0)
        };
        (0..1600).map(place).map(|[x, y]| Point3::new(x, y, z_m)).collect()
    };
    let measured = |z_m: f32| floor(z_m).iter().flat_map(|point| points(0, 1, *point)).collect();
    let truths: Vec<Vec<_>> = [0.03, -0.03, 0.03, -0.03, 0.03, -0.03].map(measured).to_vec();
    let mut run = run((0..6).map(cycle).collect());
    run.static_map = floor(0.004);
    run.unfiltered_map = floor(-0.03);
    let scored = |run: &RunRecord, surface_m: Option<&[Point3<f32>]>| {
        scored_with_surface(run, &truths, surface_m).map
    };
    let map = scored(&run, Some(&floor(0.0)));
    assert_eq!((map.static_scene, map.static_kept, map.static_without_removal), (200, 200, 200));
    // The benchmarks' accuracy is of the voxels themselves, and half of them have no point.
    let accuracies = scored_with_surface(&run, &truths, None).by_voxels;
    assert_eq!(accuracies.static_accuracy, Some(0.5));
    let surface = map.surface.unwrap();
    assert!((surface.accuracy_m - 0.004).abs() < 1e-6 && surface.f_score == 1.0, "{surface:?}");
    assert_eq!(surface.tolerance_m, 0.05);
    // Half of the map is elsewhere.
    run.static_map = [&floor(0.0)[..800], &floor(1.0)[800..]].concat();
    let map = scored(&run, Some(&floor(0.0)));
    assert!((100..=120).contains(&map.static_kept), "{} voxels", map.static_kept);
    let surface = map.surface.unwrap();
    assert!(
        (surface.precision - 0.5).abs() < 1e-6 && (0.5..0.56).contains(&surface.recall),
        "{surface:?}"
    );
    assert_eq!(scored(&run, None).surface, None);
    // A surface without a finite point, or a map without one, has no distance. It once cost the whole score.
    let nowhere = [Point3::new(f32::NAN, 0.0, 0.0)];
    assert_eq!(scored(&run, Some(&nowhere)), scored(&run, None));
    assert_eq!(scored(&run, Some(&[])), scored(&run, None));
    run.static_map = nowhere.to_vec();
    assert_eq!(scored(&run, Some(&floor(0.0))).surface, None);
    run.static_map.clear();
    assert_eq!(scored(&run, Some(&floor(0.0))).surface, None);
}

/// The share was more than 1, and the loss negative, where the final map kept what the other one did not.
#[test]
fn what_the_final_map_alone_keeps_is_not_counted_among_what_both_keep() {
    let [a, b, c] = [0, 9, 18].map(|y| voxel(40, y, 0));
    let mut run = run((0..3).map(cycle).collect());
    run.unfiltered_map = vec![a, b];
    run.static_map = vec![b, c];
    let truth = [a, b, c].map(|at| points(0, 1, at)).concat();
    let map = score(&run, &vec![truth; 3]).map;
    assert_eq!((map.static_scene, map.static_without_removal, map.static_kept), (3, 2, 2));
    assert_eq!(map.static_kept_share_of_unfiltered, Some(0.5));
    let confirmed = map.static_confirmed;
    assert_eq!((confirmed.voxels, confirmed.without_removal, confirmed.kept), (3, 2, 2));
    assert_eq!(confirmed.kept_share_of_unfiltered, Some(0.5));
}

#[test]
fn what_noise_touched_once_or_twice_is_no_part_of_the_confirmed_scene() {
    let (wall, gone) = (voxel(40, 0, 0), voxel(40, 9, 0));
    let mut run = run((0..4).map(cycle).collect());
    let noise = |cycle: i32| voxel(43, cycle, 0);
    run.unfiltered_map = (0..4).map(noise).chain([wall, gone]).collect();
    run.static_map = vec![wall];
    // A voxel counts once a cycle, however many points touch it and wherever others lie between them. The noise of
    // the first cycle comes again in the last, so that it is touched in two.
    let truths: Vec<_> = (0..4)
        .map(|index| {
            let again = points(0, 1, noise(if index == 3 { 0 } else { index }));
            [points(0, 5, wall), points(0, 5, gone), again, points(0, 5, wall)].concat()
        })
        .collect();
    let score = score(&run, &truths);
    assert_eq!(score.rules.confirming_cycles, 3);
    let confirmed = score.map.static_confirmed;
    assert_eq!((confirmed.voxels, confirmed.without_removal, confirmed.kept), (2, 2, 1));
    assert_eq!((confirmed.kept_share, confirmed.kept_share_of_unfiltered), (Some(0.5), Some(0.5)));
    // The benchmarks' accuracy counts all that was touched.
    assert_eq!((score.map.static_scene, score.map.static_kept), (5, 1));
    assert_eq!(score.by_voxels.static_accuracy, Some(0.2));
}

#[test]
fn a_voxel_is_confirmed_by_the_third_cycle_and_not_by_the_points_of_one() {
    let wall = voxel(40, 0, 0);
    let confirmed_after = |cycles: u32| {
        let mut run = run((0..cycles).map(cycle).collect());
        run.static_map = vec![wall];
        let beside = || points(0, 1, voxel(40, 1, 0));
        let one = [points(0, 9, wall), beside(), points(0, 9, wall)].concat();
        score(&run, &vec![one; cycles as usize]).map.static_confirmed
    };
    assert_eq!(confirmed_after(2), StaticVoxels::default());
    assert_eq!((confirmed_after(3).voxels, confirmed_after(3).kept), (2, 1));
}

#[test]
fn voxels_of_the_map_follow_the_pose() {
    // The rig has moved by 1 m: the person stands in the voxel of the map where the wall was seen before.
    let mut moved = cycle(1);
    moved.map_from_rig = Isometry3::translation(1.0, 0.0, 0.0);
    let truths = [points(0, 5, voxel(40, 0, 0)), points(PERSON, 5, voxel(30, 0, 0))];
    let score = score(&run(vec![cycle(0), moved]), &truths);
    assert_eq!((score.map.object_only, score.map.static_scene), (0, 1));
}

#[test]
fn two_objects_are_told_apart_and_a_voxel_of_both_is_counted_once_in_the_map() {
    let (a, b) = (voxel(20, 0, 0), voxel(20, 1, 0));
    let mut run = run(vec![cycle(0)]);
    run.static_map = vec![a];
    run.unfiltered_map = vec![a, b];
    let truth = [points(3, 250, a), points(9, 300, a), points(9, 50, b)].concat();
    let names = BTreeMap::from([(9, "robot".to_owned())]);
    let truth_at = |_| Ok::<_, Infallible>(Some(TruthFrame::from_points(VGA_PX, truth.clone())));
    let score = score_dynamic(&run, &DynamicScoreRules::default(), &names, None, truth_at).unwrap();
    let labels: Vec<_> =
        score.objects.iter().map(|o| (o.object_id, o.name.as_deref(), o.points.points)).collect();
    assert_eq!(labels, [(3, None, 250), (9, Some("robot"), 350)]);
    let own: Vec<_> = score.objects.iter().map(|o| (o.own_voxels, o.own_voxels_left)).collect();
    assert_eq!(own, [(1, 1), (2, 1)]);
    assert_eq!((score.map.object_only, score.map.object_only_left), (2, 1));
}

#[test]
fn a_cycle_without_truth_is_counted_and_left_out() {
    let score = score(&run(vec![cycle(0), cycle(1), cycle(2)]), &[points(0, 5, voxel(1, 1, 1))]);
    assert_eq!((score.cycles_scored, score.cycles_without_truth), (1, 2));
    assert!(score.objects.is_empty());
    assert_eq!(score.object_points.share, None);
}

#[test]
fn the_truth_is_asked_for_at_the_clouds_stamp() {
    let mut late = cycle(4);
    late.cloud_stamp = Stamp::from_nanos(123);
    let mut asked = Vec::new();
    let truth_at = |stamp| {
        asked.push(stamp);
        Ok::<_, Infallible>(None)
    };
    score_dynamic(
        &run(vec![late]),
        &DynamicScoreRules::default(),
        &BTreeMap::new(),
        None,
        truth_at,
    )
    .unwrap();
    assert_eq!(asked, [Stamp::from_nanos(123)]);
}

#[test]
fn the_true_bearing_is_that_of_the_objects_middle() {
    let truth =
        [points(PERSON, 100, voxel(10, 5, 0)), points(PERSON, 100, voxel(10, 15, 0))].concat();
    let score = score(&run(vec![cycle(0)]), &[truth]);
    // The middle lies at x = 1.05 m, y = 1.05 m.
    let azimuth_rad = score.objects[0].per_cycle[0].azimuth_rad;
    assert!((azimuth_rad - std::f64::consts::FRAC_PI_4).abs() < 1e-6, "{azimuth_rad}");
}

#[test]
fn what_goes_wrong_is_told_with_its_cycle() {
    #[derive(Debug, thiserror::Error)]
    #[error("the label image is missing")]
    struct Missing;
    let rules = DynamicScoreRules::default();
    let error =
        score_dynamic(&run(vec![cycle(5)]), &rules, &BTreeMap::new(), None, |_| Err(Missing));
    assert!(error.unwrap_err().to_string().contains("cycle 5"));
    let mut no_edge = run(vec![]);
    no_edge.voxel_edge_m = 0.0;
    let truth_at = |_| Ok::<_, Infallible>(None);
    let error = score_dynamic(&no_edge, &rules, &BTreeMap::new(), None, truth_at);
    assert!(matches!(error, Err(ScoreError::Edge(_))));
    let rules = DynamicScoreRules { surface_tolerance_m: -1.0, ..rules };
    let wall = [voxel(1, 0, 0)];
    let error = score_dynamic(&run(vec![]), &rules, &BTreeMap::new(), Some(&wall), truth_at);
    assert!(matches!(error, Err(ScoreError::Surface(CloudDistanceError::Tolerance(_)))));
}
