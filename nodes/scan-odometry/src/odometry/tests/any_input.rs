//! Whatever comes, there is a pose of finite numbers, and the memory is bounded.

use geometry::{BeamOrder, Scan, Stamp};
use proptest::prelude::*;

use super::*;
use crate::testing::{Random, Scanner, World};
use crate::{ScanOdometry, ScanOdometryConfig};

fn any_range() -> impl Strategy<Value = f32> {
    prop_oneof![
        4 => 0.0..12.0_f32,
        1 => Just(f32::NAN),
        1 => Just(f32::INFINITY),
        1 => Just(f32::NEG_INFINITY),
        1 => Just(0.0_f32),
        1 => any::<f32>(),
    ]
}

fn any_step() -> impl Strategy<Value = f32> {
    prop_oneof![4 => -0.02..0.02_f32, 1 => any::<f32>(), 1 => Just(0.0_f32)]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn any_scans_give_finite_poses(
        scans in proptest::collection::vec(
            (proptest::collection::vec(any_range(), 0..300), any_step(), any::<i64>(), any_step()),
            1..8,
        ),
        room_first in any::<bool>(),
    ) {
        let scanner = Scanner::full_turn(360);
        let config = ScanOdometryConfig { beam_order: BeamOrder::FirstToLast, max_lines: 200, ..ScanOdometryConfig::default() };
        let mut odometry = ScanOdometry::new(config).unwrap();
        if room_first {
            odometry.step(&scanner.scan(&World::furnished(), &standing, 0, &mut Random::new(1)));
        }
        for (ranges_m, step, stamp, time) in scans {
            let scan = Scan {
                stamp: Stamp::from_nanos(stamp),
                angle_min_rad: step * 100.0,
                angle_increment_rad: step,
                time_increment_s: time,
                range_max_m: 100.0,
                ranges_m,
                ..Scan::default()
            };
            let pose = odometry.step(&scan);
            let numbers = [pose.odom_from_lidar.translation.x, pose.odom_from_lidar.translation.y, pose.odom_from_lidar.rotation.angle()];
            let finite = numbers.iter().chain(pose.covariance.iter()).chain(pose.step_covariance.iter()).all(|number| number.is_finite());
            prop_assert!(finite, "{:?}", pose);
            prop_assert!(pose.quality.map_lines <= 200);
        }
    }
}
