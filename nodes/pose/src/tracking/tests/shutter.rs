//! A camera that reads its rows one after the other.

use super::*;
use crate::tracking::FollowConfig;

fn run(readout_s: f64, follow: FollowConfig) -> (f64, f64, f64) {
    let config = TrackerConfig { follow, ..TrackerConfig::default() };
    let mut tracker = Tracker::new(config).unwrap();
    let room = Thing::room(4000, 300, 40);
    let mut camera = Camera::new(looking_about, Spoil { readout_s, ..Spoil::default() }, 40);
    let (off_m, _) = worst_error(&mut tracker, &mut camera, 0..300, |camera, time_s| {
        camera.frame(time_s, &[(&room, Isometry3::identity())])
    });
    (tracker.readout().seconds, tracker.readout().std_dev_s(), off_m)
}

#[test]
fn the_time_that_a_camera_takes_to_read_an_image_is_found() {
    for readout_s in [0.0, 0.015, 0.03] {
        let (found_s, _, off_m) = run(readout_s, FollowConfig::default());
        assert!((found_s - readout_s).abs() < 0.003, "{found_s} of {readout_s}");
        // Landmarks that were mapped before the time was known are corrected as far as their shift was common.
        assert!(off_m < 0.06, "{readout_s} {off_m}");
    }
}

#[test]
fn a_time_that_is_known_makes_the_pose_better() {
    let known = FollowConfig { readout_s: 0.03, estimate_readout: false, ..Default::default() };
    let ignored = FollowConfig { estimate_readout: false, ..FollowConfig::default() };
    let ((_, _, known_m), (_, _, ignored_m)) = (run(0.03, known), run(0.03, ignored));
    assert!(known_m < 0.5 * ignored_m, "{known_m} {ignored_m}");
}
