//! Problems are reported, and do not last.

use super::*;
use crate::tracking::testing::stamp;

struct Run<P: Fn(f64) -> Isometry3<f64>> {
    tracker: Tracker,
    camera: Camera<P>,
    room: Thing,
}

fn running() -> Run<impl Fn(f64) -> Isometry3<f64>> {
    running_in(Thing::room(3000, 300, 20))
}

fn running_in(room: Thing) -> Run<impl Fn(f64) -> Isometry3<f64>> {
    let mut run = Run { tracker: tracker(), camera: at_ease(20), room };
    for index in 0..30 {
        assert_eq!(run.see(index).trouble, None);
    }
    run
}

impl<P: Fn(f64) -> Isometry3<f64>> Run<P> {
    fn frame(&mut self, time_s: f64) -> Frame {
        self.camera.frame(time_s, &[(&self.room, Isometry3::identity())])
    }

    fn take(&mut self, frame: &Frame) -> Tracked {
        self.tracker.step(frame, &self.camera.model, &Hints::default())
    }

    fn see(&mut self, index: u32) -> Tracked {
        let frame = self.frame(f64::from(index) * PERIOD_S);
        self.take(&frame)
    }

    /// Sees a frame, and is where the camera is.
    fn is_right(&mut self, index: u32) -> Tracked {
        let tracked = self.see(index);
        let off = tracked.pose.map(|pose| {
            let truth = (self.camera.map_from_camera)(f64::from(index) * PERIOD_S);
            error(&pose.camera_from_map, &truth).0
        });
        assert!(off.is_some_and(|off_m| off_m < 0.03), "{index}: {off:?} {:?}", tracked.trouble);
        tracked
    }
}

fn black(time_s: f64) -> Frame {
    Frame {
        stamp: stamp(time_s),
        corners: Vec::new(),
        corner_depths: Vec::new(),
        lines: Vec::new(),
        lines_in_space: Vec::new(),
    }
}

#[test]
fn in_the_dark_the_camera_is_lost_and_in_the_light_it_is_found_again() {
    let mut run = running();
    for index in 30..60 {
        let tracked = run.take(&black(f64::from(index) * PERIOD_S));
        assert_eq!((tracked.state, tracked.pose), (TrackingState::Lost, None));
        assert_eq!(tracked.trouble, Some(Trouble::TooFewFeatures { corners: 0, lines: 0 }));
    }
    assert!(run.is_right(60).is_relocalised);
    assert!(!run.is_right(61).is_relocalised);
    assert_eq!(run.is_right(62).trouble, None);
}

#[test]
fn a_camera_that_sees_lines_alone_is_found_again_by_them() {
    let mut run = running_in(Thing::room(0, 1500, 22));
    for index in 30..60 {
        assert_eq!(run.take(&black(f64::from(index) * PERIOD_S)).state, TrackingState::Lost);
    }
    assert!(run.is_right(60).is_relocalised);
    assert_eq!(run.is_right(61).trouble, None);
    run.room = Thing::room(0, 1500, 23);
    for index in 62..70 {
        let tracked = run.see(index);
        assert_eq!((tracked.state, tracked.pose), (TrackingState::Lost, None), "{index}");
    }
}

#[test]
fn without_any_depth_nothing_begins_and_nothing_ends() {
    let mut run = running();
    run.camera.spoil.has_depth = false;
    for index in 30..40 {
        run.is_right(index);
    }
    let mut tracker = tracker();
    let frame = run.frame(2.0);
    let tracked = tracker.step(&frame, &run.camera.model, &Hints::default());
    assert_eq!((tracked.state, tracked.pose), (TrackingState::Initialising, None));
    let is_said = |trouble| matches!(trouble, Some(Trouble::TooFewDepths { measured: 0, .. }));
    assert!(is_said(tracked.trouble), "{:?}", tracked.trouble);
    run.camera.spoil.has_depth = true;
    let frame = run.frame(2.1);
    let tracked = tracker.step(&frame, &run.camera.model, &Hints::default());
    assert_eq!(tracked.state, TrackingState::Tracking);
}

#[test]
fn two_frames_that_come_swapped_cost_one() {
    let mut run = running();
    run.is_right(31);
    let late = run.see(30);
    assert_eq!((late.state, late.pose), (TrackingState::Tracking, None));
    assert!(
        matches!(late.trouble, Some(Trouble::OutOfOrder { by_s }) if (by_s - PERIOD_S).abs() < 1e-6)
    );
    assert_eq!(run.is_right(32).trouble, None);
}

#[test]
fn a_gap_and_a_clock_that_jumps_back_are_said_and_survived() {
    let mut run = running();
    let after = run.is_right(330);
    assert!(matches!(after.trouble, Some(Trouble::Gap { gap_s }) if gap_s > 9.0), "{after:?}");
    assert_eq!(run.is_right(331).trouble, None);
    let back = run.is_right(0);
    assert!(matches!(back.trouble, Some(Trouble::TimeWentBack { by_s }) if by_s > 10.0));
    assert_eq!(run.is_right(1).trouble, None);
}

#[test]
fn time_that_runs_backwards_costs_the_first_frames() {
    let mut run = running();
    let lost = (1..29).rev().filter(|index| run.see(*index).pose.is_none()).count();
    // Two of three are dropped: each that is taken is again the latest.
    assert!(lost <= 20, "{lost}");
    run.is_right(40);
}

#[test]
fn another_place_is_not_taken_for_a_known_one() {
    let mut run = running();
    let known = std::mem::replace(&mut run.room, Thing::room(3000, 300, 21));
    for index in 30..40 {
        let tracked = run.see(index);
        assert_eq!((tracked.state, tracked.pose), (TrackingState::Lost, None), "{index}");
        assert!(matches!(tracked.trouble, Some(Trouble::TooFewInliers { .. })));
    }
    run.room = known;
    assert!(run.is_right(40).is_relocalised);
}
