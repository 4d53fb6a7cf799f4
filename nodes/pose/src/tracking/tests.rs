mod covariance;
mod following;
mod moving;
mod shutter;
mod trouble;

use nalgebra::Isometry3;

use super::testing::{Camera, PERIOD_S, Spoil, Thing, error, looking_about};
use super::{FeatureStatus, Hints, Tracked, Tracker, TrackerConfig, TrackingState, Trouble};
use crate::frame::Frame;

fn tracker() -> Tracker {
    Tracker::new(TrackerConfig::default()).unwrap()
}

/// A camera that begins at the origin, where the map begins too.
fn at_ease(seed: u64) -> Camera<impl Fn(f64) -> Isometry3<f64>> {
    Camera::new(looking_about, Spoil::default(), seed)
}

/// The farthest errors over some frames: metres and radians.
fn worst_error<P: Fn(f64) -> Isometry3<f64>>(
    tracker: &mut Tracker,
    camera: &mut Camera<P>,
    frames: std::ops::Range<u32>,
    mut frame_at: impl FnMut(&mut Camera<P>, f64) -> Frame,
) -> (f64, f64) {
    let mut worst = (0.0_f64, 0.0_f64);
    for index in frames {
        let time_s = f64::from(index) * PERIOD_S;
        let frame = frame_at(camera, time_s);
        let tracked = tracker.step(&frame, &camera.model, &Hints::default());
        assert_eq!(tracked.state, TrackingState::Tracking, "{index}: {:?}", tracked.trouble);
        let pose = tracked.pose.unwrap();
        let off = error(&pose.camera_from_map, &(camera.map_from_camera)(time_s));
        worst = (worst.0.max(off.0), worst.1.max(off.1));
    }
    worst
}
