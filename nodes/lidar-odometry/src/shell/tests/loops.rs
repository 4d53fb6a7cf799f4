//! The node, back where it was.

use std::f64::consts::TAU;
use std::sync::{Arc, Mutex};

use msgs::tf2_msgs::TFMessage;

use super::super::loops::Loops;
use super::*;
use crate::loop_closing::{LoopCloser, LoopClosingConfig};
use crate::shell::BackgroundSearch;

/// Along the street and back again, this many metres in each direction.
const FAR_M: f64 = 30.0;
const SCANS: u32 = 60;

/// To and fro, gently.
fn to_and_fro_m(index: u32) -> f64 {
    0.5 * FAR_M * (1.0 - (TAU * f64::from(index) / f64::from(SCANS)).cos())
}

#[test]
fn a_loop_moves_the_odometry_in_the_map_and_not_the_odometry() {
    let parameters = LidarOdometryParameters {
        loop_closing: true,
        loop_closing_in_background: false,
        ..Default::default()
    };
    let mut scene = Scene::new(&parameters);
    let transforms = scene.peer.subscription::<TFMessage>("/tf", &Qos::reliable(10)).unwrap();
    let paths = scene.peer.subscription::<Path>("map_path", &Qos::latched()).unwrap();
    let (mut closed, mut last_m, mut tied) = (0, 0.0, 0);
    for index in 0..=SCANS {
        let cloud = scene.cloud_at(index, to_and_fro_m(index));
        let outcome = scene.take(cloud);
        let x_m = outcome.x_m();
        assert!((x_m - to_and_fro_m(index)).abs() < 0.2, "{index}: {x_m}");
        assert!((x_m - last_m).abs() < 2.0, "{index}: from {last_m} to {x_m}");
        last_m = x_m;
        let report = &outcome.reports[0];
        let mut counts = report.count_names.iter().zip(&report.counts);
        closed = counts.find(|(name, _)| *name == "closed_loops").map_or(0, |(_, count)| *count);
        while let Some(received) = transforms.try_next() {
            for transform in &received.message.transforms {
                if transform.header.frame_id == "map" {
                    assert_eq!(transform.child_frame_id, "odom");
                    tied += 1;
                    let shift = &transform.transform.translation;
                    assert!(shift.x.hypot(shift.y).hypot(shift.z) < 0.3, "{shift:?}");
                }
            }
        }
    }
    assert_eq!(tied, SCANS + 1);
    assert!(closed > 0);
    let path = paths.try_next().unwrap();
    assert_eq!(path.message.header.frame_id, "map");
    assert!(path.message.poses.len() > 20);
}

#[test]
fn scans_are_answered_while_a_loop_is_looked_for() {
    let parameters = LidarOdometryParameters { loop_closing: true, ..Default::default() };
    let mut scene = Scene::new(&parameters);
    let hold = Arc::new(Mutex::new(()));
    let of_thread = Arc::clone(&hold);
    let closer =
        LoopCloser::new(LoopClosingConfig::default(), Arc::new(estimation::Serial)).unwrap();
    let pause = move || drop(of_thread.lock().unwrap());
    let search = Box::new(BackgroundSearch::with_pause(closer, pause).unwrap());
    let loops = Loops::with(&scene.peer, &parameters, search).unwrap();
    scene.stage.have_loops_looked_for(loops);
    let closed = |scene: &Scene| scene.stage.loops().unwrap().closed;
    // There and back, and on: all is answered by then, and the search has not got beyond its first place.
    let held = hold.lock().unwrap();
    for index in 0..=SCANS {
        let cloud = scene.cloud_at(index, to_and_fro_m(index));
        let outcome = scene.take(cloud);
        assert!((outcome.x_m() - to_and_fro_m(index)).abs() < 0.2, "{index}");
        assert_eq!(closed(&scene), 0);
    }
    drop(held);
    // Once there is time, the next scans have the correction of the loop.
    let until = Instant::now() + Duration::from_secs(60);
    let mut index = SCANS;
    while closed(&scene) == 0 {
        assert!(Instant::now() < until, "the loop was not found");
        index += 1;
        let cloud = scene.cloud_at(index, to_and_fro_m(index));
        assert_eq!(scene.take(cloud).odometry.len(), 1);
    }
}

#[test]
fn without_the_parameter_there_is_no_map() {
    let mut scene = Scene::new(&LidarOdometryParameters::default());
    let transforms = scene.peer.subscription::<TFMessage>("/tf", &Qos::reliable(10)).unwrap();
    scene.is_right(0, 0);
    let received = transforms.try_next().unwrap();
    assert_eq!(received.message.transforms[0].header.frame_id, "odom");
    assert!(transforms.try_next().is_none());
}
