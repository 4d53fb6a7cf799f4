use geometry::pose_from_vector;

use super::super::platform_motion::PlatformMotion;
use super::super::testing::{StaticPlatform, deskewed, empty_scan, static_scan};
use super::*;
use crate::aperture::Aperture;

/// A turn of a platform that turns at 0.5 rad/s and goes at 0.5 m/s, of a scan with a time increment.
fn turn_in_motion(order: BeamOrder, time_increment_s: f32) -> DeskewedScan {
    turn_after_pose(order, time_increment_s, 0.0)
}

/// The same with the scan's stamp this long after that of the pose.
fn turn_after_pose(order: BeamOrder, time_increment_s: f32, after_pose_s: f64) -> DeskewedScan {
    let config = FreeSpaceConfig { beam_order: order, ..FreeSpaceConfig::default() };
    let mut follower = PlatformMotion::new(&config);
    let pose_at = |time_s: f64| pose_from_vector(&[0.5 * time_s, 0.0, 0.0, 0.5 * time_s, 0.0, 0.0]);
    let mut motion = None;
    for cycle in 0..3 {
        let time_s = f64::from(cycle) * 0.1;
        let stamp = Stamp::default().plus_seconds(time_s);
        motion = Some(follower.advance(stamp, &pose_at(time_s), "map"));
    }
    let pose_stamp = Stamp::default().plus_seconds(0.2);
    let stamp = pose_stamp.plus_seconds(after_pose_s);
    let scan = Scan { stamp, ranges_m: vec![2.0; 360], time_increment_s, ..empty_scan() };
    let beams =
        Aperture::new(&scan, &Isometry3::identity(), std::f64::consts::TAU).unwrap().crop(&scan);
    let input = DeskewInput {
        scan: &scan,
        beams: &beams,
        rig_from_lidar: &Isometry3::identity(),
        map_from_rig: &pose_at(0.2),
        pose_stamp,
        motion: &motion.unwrap(),
    };
    DeskewedScan::new(&input, &config)
}

#[test]
fn beams_are_moved_to_the_time_of_the_pose_by_their_order() {
    let increment_s = 0.1 / 360.0;
    let bearing_rad = |turn: &DeskewedScan, beam: usize| {
        let hit = turn.beams[beam].hit.unwrap();
        hit.in_rig_m.y.atan2(hit.in_rig_m.x) - turn.beams[beam].azimuth_rad
    };
    let unmoved = turn_in_motion(BeamOrder::FirstToLast, 0.0);
    let expected = static_scan(&StaticPlatform::default(), &[2.0; 360]);
    assert_eq!(unmoved.beams[180].hit.unwrap().in_rig_m, expected.beams[180].hit.unwrap().in_rig_m);
    // The middle is measured half a turn later, by then the rig has turned by 0.025 rad and gone 2.5 cm.
    for order in [BeamOrder::Unknown, BeamOrder::FirstToLast, BeamOrder::LastToFirst] {
        let turn = turn_in_motion(order, increment_s);
        assert!((bearing_rad(&turn, 180) - 0.025).abs() < 2e-3, "{order:?}");
        assert!((turn.beams[180].hit.unwrap().in_rig_m.x - 2.025).abs() < 2e-3);
    }
    // Straight to the right the motion forward turns the bearing too: by 2.5 cm in 2 m.
    let early = |order| bearing_rad(&turn_in_motion(order, increment_s), 90);
    assert!((early(BeamOrder::FirstToLast) - early(BeamOrder::LastToFirst) + 0.0375).abs() < 2e-3);
    // An unknown order increases the error at the turn's ends, and not in its middle.
    let (unknown, known) = (
        turn_in_motion(BeamOrder::Unknown, increment_s),
        turn_in_motion(BeamOrder::FirstToLast, increment_s),
    );
    let lost_rad =
        |beam: usize| unknown.beams[beam].bearing_error_rad - known.beams[beam].bearing_error_rad;
    assert!((lost_rad(0) - 0.025).abs() < 1e-3);
    assert!(lost_rad(180).abs() < 1e-3);
}

/// Regression: a scan without a time increment, as simulators and many drivers send it, was taken to be of the pose's stamp, which
/// is that of the image.
#[test]
fn a_scan_without_a_time_increment_is_moved_from_its_own_stamp() {
    for (after_pose_s, turned_rad) in [(0.0, 0.0), (0.05, 0.025), (-0.1, -0.05)] {
        let turn = turn_after_pose(BeamOrder::Unknown, 0.0, after_pose_s);
        let ahead = turn.beams[180].hit.unwrap();
        let bearing_rad = ahead.in_rig_m.y.atan2(ahead.in_rig_m.x) - turn.beams[180].azimuth_rad;
        assert!((bearing_rad - turned_rad).abs() < 2e-3, "{after_pose_s}: {bearing_rad}");
        let ahead_m = 2.0 * f64::cos(turned_rad) + 0.5 * after_pose_s;
        assert!((ahead.in_rig_m.x - ahead_m).abs() < 2e-3, "{after_pose_s}: {ahead:?}");
    }
    // Stamps that are farther apart are wrong.
    let turn = turn_after_pose(BeamOrder::Unknown, 0.0, 3.0);
    assert!((turn.beams[180].hit.unwrap().in_rig_m.x - 2.0).abs() < 1e-9);
}

#[test]
fn a_static_platform_moves_no_beam() {
    let platform = StaticPlatform::default();
    let plain = static_scan(&platform, &[2.0; 360]);
    let mut follower = PlatformMotion::new(&FreeSpaceConfig::default());
    for cycle in 0..3 {
        let stamp = Stamp::default().plus_seconds(f64::from(cycle) * 0.1);
        let motion = follower.advance(stamp, &platform.map_from_rig, "map");
        assert_eq!(deskewed(&platform.map_from_rig, &[2.0; 360], &motion), plain);
    }
}

#[test]
fn neighbours_cross_the_seam_of_a_full_turn_only() {
    let full = static_scan(&StaticPlatform::default(), &[2.0; 360]);
    assert_eq!((full.neighbour(0, -1), full.next(359)), (Some(359), Some(0)));
    let part = static_scan(&StaticPlatform::default(), &[2.0; 90]);
    assert_eq!((part.neighbour(0, -1), part.next(89), part.next(3)), (None, None, Some(4)));
}
