//! The map of the poses is corrected, as by a loop that is closed: the pose jumps, and nothing has moved.

use estimation::Random;
use geometry::{ContinuousFrame, MapPath, PathVertex, pose_from_vector};

use super::*;

const CYCLES: u32 = 30;
/// From this cycle on poses are told in the corrected map.
const CORRECTED: u32 = 18;

/// What becomes of a room whose map is corrected, cycle by cycle, with or without the paths that say so.
fn run_of(
    correction: &Isometry3<f64>,
    moving: &dyn Fn(f64) -> Vec<Solid>,
    has_path: bool,
) -> Vec<(room::View, Segmented)> {
    let mut segmenter = Segmenter::new(config()).unwrap();
    let mut continuous = ContinuousFrame::default();
    let mut random = Random::new(21);
    let before = Isometry3::identity();
    let step = |index: u32| {
        let mut solids = furnished();
        solids.extend(moving(f64::from(index) * CYCLE_S));
        let map_from_rig = if index < CORRECTED { &before } else { correction };
        let mut view = look(&solids, index, &rig_at(0.0, 0.0, 0.0), *map_from_rig, &mut random);
        if moving(0.0).is_empty() {
            view.cycle.zones.clear();
        }
        let stamp = view.cycle.reduced_cloud.stamp;
        if has_path {
            let vertex = PathVertex { stamp: Stamp::default(), map_from_rig: *map_from_rig };
            let map = view.cycle.map_frame_id.clone();
            continuous.take(MapPath::new(stamp, &map, vec![vertex]).unwrap());
            view.cycle.map_from_continuous = continuous.map_from_continuous(stamp, &map);
        }
        let segmented = segmenter.step(&view.cycle, |_| ()).unwrap();
        assert_eq!(segmented.cycle.map_from_rig, *map_from_rig, "as it was told");
        (view, segmented)
    };
    (0..CYCLES).map(step).collect()
}

#[test]
fn a_correction_makes_no_object() {
    let check = |correction: [f64; 6], has_path: bool| {
        let run = run_of(&pose_from_vector(&correction), &|_| Vec::new(), has_path);
        let cut: usize = run.iter().map(|(_, segmented)| segmented.counts.dynamic).sum();
        let tracks: usize = run.iter().map(|(_, segmented)| segmented.tracks.len()).sum();
        println!("{correction:?}: {cut} points cut out, {tracks} tracks; told: {has_path}");
        (cut, tracks)
    };
    let [small, middle, large] = [
        [0.1, -0.05, 0.0, 0.01, 0.0, 0.0],
        [0.25, 0.15, 0.0, 0.03, 0.0, 0.0],
        [-0.3, 0.4, 0.02, -0.05, 0.0, 0.01],
    ];
    for correction in [small, middle, large] {
        assert_eq!(check(correction, true), (0, 0));
    }
    // No turn of the image explains a shift.
    let (cut, tracks) = check([-0.5, 0.0, 0.0, 0.0, 0.0, 0.0], false);
    assert!(cut > 100 && tracks > 0, "this test sees what it is to see");
}

#[test]
fn a_track_goes_on_in_the_corrected_map() {
    let correction = pose_from_vector(&[-0.3, 0.4, 0.02, -0.05, 0.0, 0.01]);
    let walking = |time_s: f64| walker(1, 2.6, across_m(time_s, -2.2, 0.8));
    let run = run_of(&correction, &walking, true);
    let seen = run.iter().skip(15).take(12);
    let tracks: Vec<(u32, f64)> = seen
        .map(|(view, segmented)| {
            let [track] = &segmented.tracks[..] else { panic!("{:?}", segmented.tracks) };
            let (centre_m, _) = view.centres_m[&1];
            (track.id, (track.position_m - centre_m).norm())
        })
        .collect();
    println!("{tracks:?}");
    assert!(tracks.iter().all(|(id, off_m)| *id == tracks[0].0 && *off_m < 0.1), "{tracks:?}");
}

/// Regression: the frame that does not jump is the corrected map again when detection begins anew, or forgets what it saw: what
/// was known in the former one is elsewhere.
#[test]
fn a_frame_that_begins_anew_after_a_correction_makes_no_object() {
    // No turn of the image explains a shift.
    let correction = pose_from_vector(&[-0.5, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let cut_after = |restarts: bool, frame_then: Option<Isometry3<f64>>| {
        let mut segmenter = Segmenter::new(config()).unwrap();
        let mut random = Random::new(21);
        let cycles = (0..2 * CYCLES).map(|index| {
            let is_corrected = index >= CORRECTED;
            let map_from_rig = if is_corrected { correction } else { Isometry3::identity() };
            let rig = rig_at(0.0, 0.0, 0.0);
            let mut view = look(&furnished(), index, &rig, map_from_rig, &mut random);
            view.cycle.zones.clear();
            view.cycle.map_from_continuous = is_corrected.then_some(correction);
            if index >= CYCLES {
                view.cycle.map_from_continuous = frame_then;
                view.cycle.index -= if restarts { CYCLES } else { 0 };
            }
            segmenter.step(&view.cycle, |_| ()).unwrap().counts.dynamic
        });
        cycles.sum::<usize>()
    };
    for restarts in [true, false] {
        assert_eq!(cut_after(restarts, None), 0, "restarts: {restarts}");
    }
    let unnoticed = cut_after(false, Some(Isometry3::identity()));
    assert!(unnoticed > 100, "this test sees what it is to see: {unnoticed}");
}
