//! A camera in a room of points and lines.

mod long;

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use super::*;
use crate::mapping::Mapper;
use crate::tracking::testing::{Camera, PERIOD_S, Spoil, Thing, error, looking_about};
use crate::tracking::{Hints, TrackingState};

fn room() -> Thing {
    Thing::room(2000, 100, 5)
}

fn config() -> SlamConfig {
    let mut config = SlamConfig::default();
    // The tests are quick with a small window, and it is the same code.
    config.mapping.loops.keyframing.window.max_keyframes = 5;
    config.mapping.loops.keyframing.window.max_fixed = 10;
    // This camera's depths are off by chance, each by itself.
    config.mapping.loops.keyframing.window.depths_alike = 1.0;
    config
}

fn follow<M: Mapping>(
    slam: &mut Slam<M>,
    camera: &mut Camera<impl Fn(f64) -> Isometry3<f64>>,
    room: &Thing,
    frames: std::ops::Range<u32>,
) -> Vec<SlamFrame> {
    let step = |index: u32| {
        let time_s = f64::from(index) * PERIOD_S;
        let frame = camera.frame(time_s, &[(room, Isometry3::identity())]);
        slam.step(&frame, &camera.model, &Hints::default())
    };
    frames.map(step).collect()
}

fn rms_m(poses: impl Iterator<Item = (Isometry3<f64>, Isometry3<f64>)>) -> f64 {
    let squares: Vec<f64> = poses.map(|(pose, truth)| error(&pose, &truth).0.powi(2)).collect();
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

#[test]
fn the_camera_is_placed_in_the_map_that_it_makes() {
    let (room, mut camera) = (room(), Camera::new(looking_about, Spoil::default(), 1));
    let mut slam = Slam::inline(&config()).unwrap().with_trajectory();
    let frames = follow(&mut slam, &mut camera, &room, 0..150);
    let map = slam.mapping().map();
    assert_eq!(map.check(), Ok(()));
    let located = frames.iter().filter(|frame| frame.localised.state == MapState::Located).count();
    assert!(located > 140 && map.keyframes().len() >= 3, "{located} {}", map.keyframes().len());
    let truth = |index: usize| looking_about(index as f64 * PERIOD_S);
    let live = frames.iter().enumerate();
    let live = rms_m(live.map(|(at, frame)| (frame.camera_from_map().unwrap(), truth(at))));
    let in_the_end = slam.trajectory().unwrap().in_map(&map);
    assert_eq!(in_the_end.len(), frames.len());
    let in_the_end = in_the_end.iter().enumerate().map(|(at, (_, pose))| (*pose, truth(at)));
    let in_the_end = rms_m(in_the_end);
    let odometry = frames.iter().enumerate();
    let odometry =
        rms_m(odometry.map(|(at, frame)| (frame.tracked.pose.unwrap().camera_from_map, truth(at))));
    println!("odometry {odometry:.4} m, live {live:.4} m, in the end {in_the_end:.4} m");
    // All of them depend on the first frame's measurement of a room whose walls are 4 m off.
    assert!(live < 0.018 && in_the_end < 0.015, "{odometry} {live} {in_the_end}");
}

#[test]
fn a_map_that_is_full_has_no_further_keyframe_and_still_places_the_camera() {
    let (room, mut camera) = (room(), Camera::new(looking_about, Spoil::default(), 1));
    let mut config = config();
    config.localiser.max_keyframes = 2;
    let mut slam = Slam::inline(&config).unwrap();
    let frames = follow(&mut slam, &mut camera, &room, 0..60);
    assert_eq!(slam.mapping().map().keyframes().len(), 2);
    let located = frames.iter().filter(|frame| frame.localised.state == MapState::Located).count();
    assert!(located > 40, "{located}");
    assert!(frames.iter().all(|frame| frame.camera_from_map().is_some()));
}

#[test]
fn the_same_frames_give_the_same_poses_bit_for_bit() {
    let room = room();
    let run = || {
        let mut camera = Camera::new(looking_about, Spoil::default(), 2);
        let mut slam = Slam::inline(&config()).unwrap();
        let frames = follow(&mut slam, &mut camera, &room, 0..40);
        frames.iter().map(|frame| frame.camera_from_map().unwrap()).collect::<Vec<_>>()
    };
    assert_eq!(run(), run());
}

#[cfg(feature = "ros")]
#[test]
fn a_map_in_the_background_is_answered_and_whole() {
    let (room, mut camera) = (room(), Camera::new(looking_about, Spoil::default(), 3));
    let mapper = Mapper::new(config().mapping).unwrap();
    let mut slam =
        Slam::new(&config(), crate::shell::BackgroundMapping::new(mapper).unwrap()).unwrap();
    for index in 0..100 {
        // A camera waits for the next image meanwhile; a test need not, but for work that never ends.
        let until = std::time::Instant::now() + std::time::Duration::from_secs(60);
        while index % 10 == 9 && !slam.mapping().is_idle() {
            assert!(std::time::Instant::now() < until, "mapping does not end");
            std::thread::yield_now();
        }
        let frame = follow(&mut slam, &mut camera, &room, index..index + 1).remove(0);
        let pose = frame.camera_from_map().unwrap();
        let (off_m, _) = error(&pose, &looking_about(f64::from(index) * PERIOD_S));
        assert!(off_m < 0.03, "{index}: {off_m}");
    }
    let (mapping, _) = slam.into_parts();
    let mapper = mapping.finish().unwrap();
    assert_eq!(mapper.map().check(), Ok(()));
    assert!(mapper.map().keyframes().len() >= 3);
}

/// Two views of the room that show nothing in common: a jump from one to the other and back.
fn carried_off(time_s: f64) -> Isometry3<f64> {
    const AWAY_S: std::ops::Range<f64> = 2.0..3.0;
    let behind = UnitQuaternion::from_scaled_axis(Vector3::y() * std::f64::consts::PI);
    if AWAY_S.contains(&time_s) {
        Isometry3::from_parts(Translation3::identity(), behind)
    } else {
        looking_about(if time_s < AWAY_S.start { time_s } else { time_s - 1.0 })
    }
}

#[test]
fn a_camera_that_odometry_has_lost_is_found_in_the_map() {
    let (room, mut camera) = (room(), Camera::new(carried_off, Spoil::default(), 4));
    let mut config = config();
    // Odometry forgets: it cannot find the camera by itself.
    config.tracker.follow.least_relocalised = 100_000;
    let mut slam = Slam::inline(&config).unwrap();
    let frames = follow(&mut slam, &mut camera, &room, 0..110);
    let state = |at: usize| frames[at].localised.state;
    assert_eq!(
        (state(59), state(61), state(89)),
        (MapState::Located, MapState::Lost, MapState::Lost)
    );
    // Back at frame 90: it is found by that frame, and followed from the next one on.
    assert!(frames[90].is_found);
    for (at, frame) in frames.iter().enumerate().skip(91) {
        assert_eq!(frame.tracked.state, TrackingState::Tracking, "{at}");
        let pose = frame.camera_from_map().unwrap();
        let (off_m, _) = error(&pose, &carried_off(at as f64 * PERIOD_S));
        assert!(off_m < 0.02, "{at}: {off_m}");
    }
}

#[test]
fn a_map_that_is_there_places_a_camera_that_begins_elsewhere_and_stays_as_it_is() {
    let (room, mut camera) = (room(), Camera::new(looking_about, Spoil::default(), 6));
    let mut slam = Slam::inline(&config()).unwrap();
    follow(&mut slam, &mut camera, &room, 0..90);
    let (mapping, _) = slam.into_parts();
    let mapper = mapping.mapper().clone();
    let keyframes = mapper.map().keyframes().len();
    // Its odometry begins where the camera is at frame 40: not at the origin of the map.
    let mut config = config();
    config.localiser.is_mapping = false;
    let mut slam = Slam::new(&config, InlineMapping::of(mapper)).unwrap();
    let frames = follow(&mut slam, &mut camera, &room, 40..80);
    let begins = looking_about(40.0 * PERIOD_S);
    let (off_m, off_rad) = error(&Isometry3::identity(), &begins);
    assert!(off_m > 0.1 && off_rad > 0.1, "elsewhere");
    for (at, frame) in (40..80).zip(&frames) {
        let pose = frame.camera_from_map().unwrap();
        let (off_m, _) = error(&pose, &looking_about(f64::from(at) * PERIOD_S));
        assert!(off_m < 0.02, "{at}: {off_m}");
    }
    assert_eq!(slam.mapping().map().keyframes().len(), keyframes);
}

#[test]
fn a_camera_that_stands_for_long_remembers_no_more() {
    let room = room();
    let mut camera = Camera::new(|_| Isometry3::identity(), Spoil::default(), 7);
    let mut slam = Slam::inline(&config()).unwrap();
    follow(&mut slam, &mut camera, &room, 0..20);
    let keyframes = slam.mapping().map().keyframes().len();
    let landmarks = |slam: &Slam<InlineMapping>| {
        let map = slam.mapping().map();
        map.points().len() + map.lines().len()
    };
    follow(&mut slam, &mut camera, &room, 20..80);
    assert!(slam.mapping().map().keyframes().len() <= keyframes + 2, "the view is the same");
    assert!(slam.remembered() <= landmarks(&slam), "{} {}", slam.remembered(), landmarks(&slam));
}

/// Nothing that the camera sees places it in the map.
fn never_placed() -> SlamConfig {
    let mut config = config();
    config.mapping.loops.least_inliers = usize::MAX;
    config
}

/// Regression: each keyframe that was kept by odometry alone doubled the error of the length of `map_from_odom`'s
/// quaternion, which was no rotation any more after 45 of them.
#[test]
fn keyframes_by_odometry_alone_leave_a_rotation() {
    let turning = |time_s: f64| {
        let turn = UnitQuaternion::from_scaled_axis(Vector3::y() * (1.8 * time_s));
        Isometry3::from_parts(Translation3::identity(), turn).inverse()
    };
    let (room, mut camera) = (room(), Camera::new(turning, Spoil::default(), 8));
    let mut config = never_placed();
    config.localiser.frames_beyond_map = 1;
    let mut slam = Slam::inline(&config).unwrap();
    let frames = follow(&mut slam, &mut camera, &room, 0..60);
    let kept = frames.iter().map(|frame| frame.steps.len()).sum::<usize>();
    let length = |frame: &SlamFrame| frame.localised.map_from_odom.unwrap().rotation.norm();
    let off = frames.iter().map(|frame| (length(frame) - 1.0).abs()).fold(0.0, f64::max);
    assert!(kept >= 40 && off < 1e-12, "{kept} keyframes: off by {off}");
}

/// Regression: a camera that the map did not place added a keyframe every ten frames, for as long as it stood.
#[test]
fn a_camera_that_stands_where_the_map_does_not_place_it_keeps_no_further_frame() {
    let room = room();
    let mut camera = Camera::new(|_| Isometry3::identity(), Spoil::default(), 9);
    let mut config = never_placed();
    config.localiser.frames_beyond_map = 2;
    let mut slam = Slam::inline(&config).unwrap();
    let frames = follow(&mut slam, &mut camera, &room, 0..20);
    assert!(frames.iter().all(|frame| frame.camera_from_map().is_some()));
    assert_eq!(slam.mapping().map().keyframes().len(), 1);
}

#[test]
fn bad_parameters_are_named() {
    let mut config = SlamConfig::default();
    config.localiser.frames_beyond_map = 0;
    let refused = Slam::inline(&config).unwrap_err().to_string();
    assert!(refused.starts_with("localiser: parameter frames_beyond_map"), "{refused}");
}
