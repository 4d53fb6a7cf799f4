//! The inputs and outputs of the node beside images and poses.

use geometry::pose_from_vector;
use msgs::geometry_msgs::{PoseStamped, Vector3 as Vector3Message};
use msgs::nav_msgs::Path;
use msgs::sensor_msgs::Imu;
use msgs::stillmap_msgs::{Track, Tracks};
use msgs::tf2_msgs::TFMessage;

use super::*;

/// Everything that has come.
fn heard<M: msgs::RosMessage + Clone>(topic: &Subscription<M>) -> Vec<M> {
    std::iter::from_fn(|| topic.try_next().map(|received| (*received.message).clone())).collect()
}

#[test]
fn path_and_transforms_are_those_of_the_odometry() {
    let mut scene = Scene::new();
    let paths: Subscription<Path> = scene.peer.subscription("path", &Qos::reliable(10)).unwrap();
    let transforms: Subscription<TFMessage> =
        scene.peer.subscription("/tf", &Qos::reliable(100)).unwrap();
    let poses: Vec<_> = (0..65).flat_map(|index| scene.see(index).odometry).collect();
    let transforms = heard(&transforms);
    assert_eq!((poses.len(), transforms.len()), (65, 65));
    for (odometry, transform) in poses.iter().zip(&transforms) {
        let transform = &transform.transforms[0];
        assert_eq!(
            (&transform.header, &transform.child_frame_id),
            (&odometry.header, &odometry.child_frame_id)
        );
        let (by_topic, by_tf) = (&odometry.pose.pose.position, &transform.transform.translation);
        assert_eq!((by_topic.x, by_topic.y, by_topic.z), (by_tf.x, by_tf.y, by_tf.z));
    }
    // At once, and then once a second.
    let paths = heard(&paths);
    let lengths: Vec<usize> = paths.iter().map(|path| path.poses.len()).collect();
    assert_eq!(lengths, [1, 31, 61]);
    let last: &PoseStamped = &paths[2].poses[60];
    assert_eq!((&last.header, &last.pose), (&poses[60].header, &poses[60].pose.pose));
}

#[test]
fn a_smoothed_pose_is_the_mean_of_the_last_ones() {
    let mut scene = Scene::with(PoseParameters { smoothing_poses: 4, ..PoseParameters::default() });
    for index in 0..12 {
        let y_m = scene.see(index).y_m();
        let first = index.saturating_sub(3);
        let mean_m = (first..=index).map(right_m).sum::<f64>() / f64::from(index - first + 1);
        assert!((y_m + mean_m).abs() < 0.002, "{index}: {y_m} for {mean_m}");
    }
}

/// A depth camera of its own beside the colour camera, with another view; the wall is as far for both.
#[test]
fn raw_depth_is_registered() {
    let color_from_depth = [0.03, 0.01, 0.0, 0.0, 0.0, 0.0];
    let parameters =
        PoseParameters { depth: DepthSource::Raw, color_from_depth, ..PoseParameters::default() };
    let mut scene = Scene::with(parameters);
    let infos = scene.peer.publisher("depth/camera_info", &Qos::sensor(1)).unwrap();
    let own = CameraModel { fx_px: 180.0, fy_px: 180.0, ..camera(240) };
    let (color, depth) = (scene.color(0, 0.0), scene.depth(0));
    let outcome = scene.take(color, depth);
    assert!(outcome.reason().contains("no calibration on /depth/camera_info"), "{outcome:?}");
    infos.publish(convert::message_from_camera(&own, stamp(0), "depth")).unwrap();
    for index in 1..12 {
        let color = scene.color(index, right_m(index));
        let size_px = (own.width_px, own.height_px);
        let pixels = DepthPixels::Metres(vec![WALL_M; size_px.0 * size_px.1]);
        let depth = DepthImage::new(stamp(index), "depth".to_owned(), size_px, pixels).unwrap();
        let y_m = scene.take(color, convert::message_from_depth(&depth)).y_m();
        assert!((y_m + right_m(index) - right_m(1)).abs() < 0.01, "{index}: {y_m}");
    }
}

/// A box over the right half of the wall, whatever its depth.
fn right_half(index: u32, frame_id: &str) -> Tracks {
    let stamp = convert::time_from_stamp(stamp(index));
    let mut track = Track { id: 1, ..Track::default() };
    (track.position.x, track.position.y) = (f64::from(WALL_M), -1.0);
    track.extent = Vector3Message { x: 1.0, y: 2.0, z: 4.0 };
    let header = msgs::std_msgs::Header { stamp, frame_id: frame_id.to_owned() };
    Tracks { header, cycle: index, tracks: vec![track] }
}

#[test]
fn what_a_track_covers_is_left_out_and_drawn_so() {
    let mut scene = Scene::with(PoseParameters { track_margin_m: 0.0, ..Default::default() });
    let tracks = scene.peer.publisher("tracks", &Qos::reliable(1)).unwrap();
    let left_out = |outcome: &Outcome| {
        let report = &outcome.reports[0];
        let at = report.count_names.iter().position(|name| name == "left_out").unwrap();
        report.counts[at]
    };
    for index in 0..10 {
        let outcome = scene.see(index);
        assert_eq!(left_out(&outcome), 0);
    }
    heard(&scene.pictures);
    tracks.publish(right_half(10, "odom")).unwrap();
    for index in 10..20 {
        let outcome = scene.see(index);
        assert!(left_out(&outcome) > 50, "{outcome:?}");
        assert!((outcome.y_m() + right_m(index)).abs() < 0.01, "{index}: {}", outcome.y_m());
    }
    const PURPLE: [u8; 3] = [204, 121, 167];
    for picture in heard(&scene.pictures) {
        let pixels = picture.data.as_chunks::<3>().0.iter().enumerate();
        let columns = pixels.filter(|(_, pixel)| **pixel == PURPLE).map(|(at, _)| at % 320);
        let columns: Vec<usize> = columns.collect();
        // The middle of the image is the box' edge.
        assert!(columns.len() > 500 && columns.iter().all(|column| *column > 150));
    }
    // Half a second later its position is unknown.
    assert_eq!(left_out(&scene.see(26)), 0);
    tracks.publish(right_half(27, "map")).unwrap();
    assert_eq!(left_out(&scene.see(27)), 0);
}

/// What a gyroscope at the rig's axes reads while the rig turns to the left.
fn turning_left(from: u32, to: u32, rate_rad_per_s: f64) -> impl Iterator<Item = Imu> {
    (4 * from..=4 * to).map(move |quarter| {
        let mut imu = Imu::default();
        let at = stamp(0).plus_seconds(f64::from(quarter) * 0.25 * PERIOD_S);
        imu.header.stamp = convert::time_from_stamp(at);
        imu.angular_velocity.z = rate_rad_per_s;
        imu
    })
}

#[test]
fn a_gyroscope_gives_the_cameras_rotation() {
    let parameters = PoseParameters {
        use_imu: true,
        // Its x is the rig's y: what it reads about z is also about the rig's z.
        rig_from_imu: [0.0, 0.0, 0.0, std::f64::consts::FRAC_PI_2, 0.0, 0.0],
        ..PoseParameters::default()
    };
    let mut knowledge = hints::Knowledge::new(&parameters);
    for imu in turning_left(0, 3, 0.6) {
        knowledge.take_imu(&imu).unwrap();
    }
    let motion = &parameters.tracker.motion;
    let turn = knowledge.turn(stamp(1), stamp(2), motion).unwrap();
    // To the left is about -y of an optical frame.
    let expected = nalgebra::Vector3::new(0.0, -0.6 * PERIOD_S, 0.0);
    assert!((turn.begin_from_end.scaled_axis() - expected).norm() < 1e-6, "{turn:?}");
    assert_eq!(knowledge.turn(stamp(2), stamp(6), motion), None, "the samples end before");
}

#[test]
fn a_node_with_gyroscope_and_wheels_follows_as_one_without() {
    let parameters =
        PoseParameters { use_imu: true, use_wheels: true, ..PoseParameters::default() };
    let mut scene = Scene::with(parameters);
    let gyro = scene.peer.publisher("imu", &Qos::sensor(100)).unwrap();
    let wheels = scene.peer.publisher("wheels", &Qos::sensor(100)).unwrap();
    // In a frame of their own, which begins elsewhere and looks to the right.
    let wheels_from_odom = pose_from_vector(&[3.0, 1.0, 0.0, -1.2, 0.0, 0.0]);
    for index in 0..20 {
        for imu in turning_left(index, index + 1, 0.0) {
            gyro.publish(imu).unwrap();
        }
        let at = nalgebra::Isometry3::translation(0.0, -right_m(index), 0.0);
        let mut odometry = Odometry { header: scene.header(index), ..Odometry::default() };
        odometry.pose.pose = convert::pose_from_isometry(&(wheels_from_odom * at));
        wheels.publish(odometry).unwrap();
        scene.is_right(index);
    }
    // A jump of 30 cm between two images, as the wheels have it: nothing else could predict it.
    let jumped_m = right_m(20) + 0.3;
    let at = nalgebra::Isometry3::translation(0.0, -jumped_m, 0.0);
    let mut odometry = Odometry { header: scene.header(20), ..Odometry::default() };
    odometry.pose.pose = convert::pose_from_isometry(&(wheels_from_odom * at));
    wheels.publish(odometry).unwrap();
    let (color, depth) = (scene.color(20, jumped_m), scene.depth(20));
    let y_m = scene.take(color, depth).y_m();
    assert!((y_m + jumped_m).abs() < 0.01, "{y_m}");
}
