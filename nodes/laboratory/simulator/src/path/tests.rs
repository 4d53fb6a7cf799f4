use super::*;

#[test]
fn a_straight_path_keeps_its_speed_and_rests_at_its_ends() {
    let path = Path::straight(2.0, [1.0, 3.0], [1.0, -1.0], 0.5);
    assert_eq!(path.end_s(), 10.0);
    assert_eq!(path.position_at(0.0), Point3::new(1.0, 3.0, 0.0));
    assert!((path.position_at(4.0) - Point3::new(1.0, 2.0, 0.0)).norm() < 1e-12);
    assert_eq!(path.position_at(99.0), Point3::new(1.0, -1.0, 0.0));
    assert!((path.distance_at(4.0) - 1.0).abs() < 1e-12);
    assert!((path.distance_at(99.0) - 4.0).abs() < 1e-12);
    // It faces its direction of travel: -y.
    let forward = path.pose_at(3.0) * nalgebra::Vector3::x();
    assert!((forward + nalgebra::Vector3::y()).norm() < 1e-12);
    assert!(!path.is_still());
}

#[test]
fn a_still_path_and_one_without_speed_stay() {
    let pose = [1.0, 2.0, 3.0, 0.5, 0.0, 0.0];
    assert!(Path::still(pose).is_still());
    assert_eq!(Path::still(pose).pose_at(-5.0), Path::still(pose).pose_at(5.0));
    assert!(Path::straight(1.0, [0.0, 0.0], [1.0, 0.0], 0.0).is_still());
}

#[test]
fn headings_turn_the_short_way() {
    let waypoint = |time_s, yaw| Waypoint { time_s, pose: [0.0, 0.0, 0.0, yaw, 0.0, 0.0] };
    let path = Path { waypoints: vec![waypoint(0.0, 3.0), waypoint(1.0, -3.0)] };
    let heading = path.pose_at(0.5) * nalgebra::Vector3::x();
    assert!((heading + nalgebra::Vector3::x()).norm() < 1e-9);
}

#[test]
fn a_pause_shifts_what_comes_after_it_and_nothing_before() {
    let path = Path::straight(1.0, [0.0, 0.0], [4.0, 0.0], 0.5);
    let pausing = path.pausing(4.0, 10.0);
    assert_eq!(pausing.end_s(), path.end_s() + 10.0);
    for time_s in [0.0, 1.0, 2.5, 4.0] {
        assert_eq!(pausing.position_at(time_s), path.position_at(time_s));
        assert!(
            (pausing.position_at(4.0 + 10.0 + time_s) - path.position_at(4.0 + time_s)).norm()
                < 1e-9
        );
    }
    for time_s in [4.0, 9.0, 13.99] {
        assert!((pausing.position_at(time_s) - path.position_at(4.0)).norm() < 1e-9);
    }
    // At a waypoint none is doubled; a rest before, after or of no length is none.
    let at_start = path.pausing(1.0, 2.0);
    assert!(at_start.waypoints.windows(2).all(|pair| pair[0].time_s < pair[1].time_s));
    for (at_s, pause_s) in [(0.5, 3.0), (9.0, 3.0), (2.0, 0.0), (2.0, f64::NAN), (f64::NAN, 1.0)] {
        assert_eq!(path.pausing(at_s, pause_s), path);
    }
    // The heading follows the path, it is not the mean of two numbers.
    let waypoint = |time_s, yaw| Waypoint { time_s, pose: [time_s, 0.0, 0.0, yaw, 0.0, 0.0] };
    let turning = Path { waypoints: vec![waypoint(0.0, 3.0), waypoint(1.0, -3.0)] };
    let heading = turning.pausing(0.5, 1.0).pose_at(1.0) * nalgebra::Vector3::x();
    assert!((heading + nalgebra::Vector3::x()).norm() < 1e-6);
}
