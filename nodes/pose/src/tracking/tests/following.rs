//! A camera in a static room.

use super::*;

fn farthest(room: &Thing, seed: u64) -> (f64, f64) {
    let still = Isometry3::identity();
    worst_error(&mut tracker(), &mut at_ease(seed), 0..240, |camera, time_s| {
        camera.frame(time_s, &[(room, still)])
    })
}

#[test]
fn a_camera_that_looks_about_is_followed_by_points_by_lines_and_by_both() {
    let points = farthest(&Thing::room(4000, 0, 1), 10);
    let lines = farthest(&Thing::room(0, 1500, 2), 11);
    let both = farthest(&Thing::room(4000, 800, 3), 12);
    for (what, (off_m, off_rad)) in [("points", points), ("lines", lines), ("both", both)] {
        assert!(off_m < 0.03 && off_rad < 0.008, "{what}: {off_m} m, {off_rad} rad");
    }
}

#[test]
fn few_points_are_enough() {
    let (off_m, off_rad) = farthest(&Thing::room(1000, 150, 4), 13);
    assert!(off_m < 0.04 && off_rad < 0.012, "{off_m} m, {off_rad} rad");
}

#[test]
fn the_same_frames_give_the_same_poses() {
    let room = Thing::room(3000, 400, 5);
    let run = || {
        let (mut tracker, mut camera) = (tracker(), at_ease(14));
        let step = |index: u32| {
            let frame =
                camera.frame(f64::from(index) * PERIOD_S, &[(&room, Isometry3::identity())]);
            tracker.step(&frame, &camera.model, &Hints::default())
        };
        (0..20).map(step).collect::<Vec<Tracked>>()
    };
    assert_eq!(run(), run());
}

#[test]
fn the_map_stays_within_its_bound() {
    let mut config = TrackerConfig::default();
    (config.map.max_points, config.map.max_lines) = (300, 30);
    let mut tracker = Tracker::new(config).unwrap();
    let room = Thing::room(8000, 800, 6);
    let mut camera = at_ease(15);
    worst_error(&mut tracker, &mut camera, 0..60, |camera, time_s| {
        camera.frame(time_s, &[(&room, Isometry3::identity())])
    });
    assert_eq!((tracker.map().points().len(), tracker.map().lines().len()), (300, 30));
}
