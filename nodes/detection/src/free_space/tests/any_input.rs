use std::f64::consts::FRAC_PI_4;

use geometry::{Cloud, Scan, Stamp, pose_from_vector};
use proptest::prelude::*;

use crate::{CycleInput, DetectionConfig, Detector, View};

fn range_m() -> impl Strategy<Value = f32> {
    prop_oneof![
        // In millimetres: the sampler of floats may trip over its own rounding.
        4 => (100_u16..9_000).prop_map(|range_mm| f32::from(range_mm) * 1e-3),
        1 => prop::sample::select(vec![
            f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 0.0, -1.0, f32::MAX, f32::MIN_POSITIVE,
        ]),
    ]
}

proptest! {
    /// For any input: no panic, the same result twice, and valid zones.
    #[test]
    fn no_input_panics_and_the_same_gives_the_same(
        scans in prop::collection::vec(prop::collection::vec(range_m(), 0..90), 1..8),
        increment in prop_oneof![Just(0.02f32), Just(-0.07), Just(f32::MIN_POSITIVE), Just(1e9), Just(f32::NAN)],
        time_increment_s in prop_oneof![Just(0.0f32), Just(4e-4), Just(f32::NAN), Just(1e30)],
        range_max_m in prop_oneof![Just(8.0f32), Just(f32::INFINITY), Just(f32::NAN)],
        pose in prop::array::uniform6(-3.0f64..3.0),
        step in prop::array::uniform6(-0.3f64..0.3),
        period_ns in prop_oneof![Just(100_000_000i64), Just(0), Just(-5), Just(i64::MAX / 4)],
    ) {
        let run = || {
            let config = DetectionConfig::default();
            let mut detector = Detector::new(config).unwrap();
            let mut all = vec![];
            for (ranges_m, cycle) in scans.iter().zip(0_i32..) {
                let stamp = Stamp::from_nanos(period_ns.saturating_mul(i64::from(cycle)));
                let scan = Scan {
                    stamp,
                    angle_min_rad: -0.9,
                    angle_increment_rad: increment,
                    time_increment_s,
                    range_max_m,
                    ranges_m: ranges_m.clone(),
                    ..Scan::default()
                };
                let vector: Vec<f64> =
                    pose.iter().zip(&step).map(|(at, by)| at + f64::from(cycle) * by).collect();
                let map_from_rig = pose_from_vector(&vector.try_into().unwrap());
                let cloud = Cloud { stamp, ..Cloud::default() };
                let input = CycleInput {
                    scan: &scan,
                    view: View::PointsInCamera(&cloud),
                    map_from_rig: &map_from_rig,
                    map_frame_id: "map",
                };
                match detector.step(&input, |_| ()) {
                    Ok(detected) => all.push(detected),
                    Err(error) => assert!(scan.validate().is_err(), "{error}"),
                }
            }
            all
        };
        let detected = run();
        prop_assert_eq!(&detected, &run());
        for zone in detected.iter().flat_map(|detected| &detected.cycle.zones) {
            let span = zone.returns.unwrap();
            prop_assert!(0.0 < span.nearest_m && span.nearest_m <= span.farthest_m);
            prop_assert!(-FRAC_PI_4 <= zone.azimuth_min_rad);
            prop_assert!(zone.azimuth_min_rad <= zone.azimuth_max_rad);
            prop_assert!(zone.azimuth_max_rad <= FRAC_PI_4);
        }
    }
}
