//! Readings one by one; whole bags and graphs are in the suite tests.

use msgs::geometry_msgs::{Transform, TransformStamped};
use msgs::sensor_msgs::PointField;
use msgs::tf2_msgs::TFMessage;
use proptest::prelude::*;

use super::clocks::Clock;
use super::*;
use crate::doctor::finding::Severity;

const SUBJECT: Subject<'_> = Subject { topic: "/topic", is_read: true, period_s: Some(0.1) };

fn findings_of<M: Observed>(messages: &[M]) -> Vec<Finding> {
    let mut content = Content::of_type(M::TYPE_NAME);
    for message in messages {
        content.take(message);
    }
    content.findings(&SUBJECT)
}

#[track_caller]
fn only(findings: &[Finding], check: Check, severity: Severity) {
    let found: Vec<_> = findings.iter().map(|one| (one.check, one.severity)).collect();
    assert_eq!(found, [(check, severity)], "{findings:?}");
}

fn header() -> Header {
    Header { frame_id: "sensor".to_owned(), ..Header::default() }
}

fn scan(ranges: Vec<f32>) -> LaserScan {
    LaserScan {
        header: header(),
        angle_increment: 0.01,
        range_max: 8.0,
        ranges,
        ..LaserScan::default()
    }
}

#[test]
fn few_returns_in_a_large_hall_are_no_error() {
    let mut ranges = vec![f32::INFINITY; 100];
    ranges[..3].fill(5.0);
    assert!(findings_of(&[scan(ranges.clone())]).is_empty());
    ranges[1..3].fill(0.0);
    only(&findings_of(&[scan(ranges)]), Check::Returns, Severity::Warn);
    // Far returns, as a limit in metres beside ranges in centimetres has.
    only(&findings_of(&[scan(vec![150.0; 100])]), Check::Returns, Severity::Error);
}

#[test]
fn acceleration_in_the_wrong_unit_is_found() {
    let reading = |acceleration: f64, covariance: f64| {
        let mut imu = Imu { header: header(), ..Imu::default() };
        imu.linear_acceleration.z = acceleration;
        imu.linear_acceleration_covariance[0] = covariance;
        vec![imu; 20]
    };
    assert!(findings_of(&reading(9.8, 0.0)).is_empty());
    only(&findings_of(&reading(1.0, 0.0)), Check::Units, Severity::Error);
    only(&findings_of(&reading(0.05, 0.0)), Check::Units, Severity::Error);
    // By its covariance it has no accelerometer.
    assert!(findings_of(&reading(0.0, -1.0)).is_empty());
}

#[test]
fn invalid_calibrations_are_found() {
    let info = |k: [f64; 9]| CameraInfo {
        header: header(),
        width: 640,
        height: 480,
        k,
        ..CameraInfo::default()
    };
    let k = [525.0, 0.0, 319.5, 0.0, 525.0, 239.5, 0.0, 0.0, 1.0];
    assert!(findings_of(&[info(k), info(k)]).is_empty());
    for (place, value) in [(0, f64::NAN), (0, -1.0), (0, 5.0), (4, 1e6), (2, 700.0), (5, -3.0)] {
        let mut k = k;
        k[place] = value;
        only(&findings_of(&[info(k)]), Check::Calibration, Severity::Error);
    }
    // Regression: nothing was said of K of another resolution, by which the map is of a few points.
    for other in [0.5, 2.0] {
        let k = k.map(|one| if one == 1.0 { one } else { other * (one + 0.5) - 0.5 });
        only(&findings_of(&[info(k)]), Check::Calibration, Severity::Warn);
    }
    // Of an image without its upper third it is right.
    let mut cropped = info(k);
    cropped.height -= 160;
    cropped.k[5] -= 160.0;
    assert!(findings_of(&[cropped]).is_empty());
    let mut other = k;
    other[0] += 1.0;
    only(&findings_of(&[info(k), info(other)]), Check::Calibration, Severity::Warn);
}

/// Regression: the first K was judged by the smallest of all sizes: after a restart in a smaller mode it was wrong, though each message is right,
/// and a wrong one after the restart was not judged.
#[test]
fn each_calibration_is_judged_by_its_own_size() {
    let info = |factor: f64, (width, height): (u32, u32)| CameraInfo {
        header: header(),
        width,
        height,
        k: [525.0, 0.0, 319.5, 0.0, 525.0, 239.5, 0.0, 0.0, 1.0]
            .map(|one| if one == 1.0 { one } else { factor * (one + 0.5) - 0.5 }),
        ..CameraInfo::default()
    };
    let (large, small) = (info(1.0, (640, 480)), info(0.5, (320, 240)));
    let is_of_mode = |one: &Finding| one.what.contains("the calibration changes");
    for modes in [[large.clone(), small.clone()], [small, large.clone()]] {
        let findings = findings_of(&modes);
        assert!(findings.iter().all(is_of_mode), "{findings:?}");
    }
    let findings = findings_of(&[large.clone(), info(1.0, (320, 240)), large]);
    let of_size = findings.iter().filter(|one| one.what.contains("320 x 240 pixels"));
    assert_eq!(of_size.count(), 1, "{findings:?}");
}

/// Regression: the first message of a simulation, whose clock begins at 0, made a bag one with errors.
#[test]
fn a_clock_that_begins_at_zero_is_no_error() {
    let said = |stamps_s: &[f64]| {
        let stamps: Vec<Stamp> =
            stamps_s.iter().map(|seconds| Stamp::from_nanos(0).plus_seconds(*seconds)).collect();
        stamps::findings("/scan", true, &stamps)
    };
    assert!(said(&[0.0, 0.1, 0.2]).is_empty());
    for unset in [&[0.0, 1.7e9, 1.7e9 + 0.1][..], &[0.0, 0.0, 0.1], &[0.1, 0.0, 0.2], &[0.0]] {
        only(&said(unset), Check::Stamps, Severity::Error);
    }
}

#[test]
fn stamps_may_be_somewhat_late_but_not_early() {
    let skewed = |offset_s: f64| {
        let clock = |topic, offset_s| Clock { topic, is_read: true, offset_s };
        clocks::findings(&[clock("/a", 0.0), clock("/b", -0.01), clock("/c", offset_s)], "x")
    };
    assert!(skewed(-0.4).is_empty());
    assert!(skewed(0.2).is_empty());
    only(&skewed(0.4), Check::Clocks, Severity::Warn);
    only(&skewed(-0.6), Check::Clocks, Severity::Warn);
    only(&skewed(2.0), Check::Clocks, Severity::Error);
    assert!(clocks::findings(&[], "x").is_empty());
}

fn transforms(edges: &[(&str, &str)]) -> TransformFacts {
    let one = |(parent, child): &(&str, &str)| TransformStamped {
        header: Header { frame_id: (*parent).to_owned(), ..Header::default() },
        child_frame_id: (*child).to_owned(),
        transform: Transform {
            rotation: msgs::geometry_msgs::Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 1.0 },
            ..Transform::default()
        },
    };
    let mut facts = TransformFacts::default();
    facts.take(&TFMessage { transforms: edges.iter().map(one).collect() }, true);
    facts
}

#[test]
fn each_loop_is_reported_once() {
    let facts = transforms(&[("b", "a"), ("a", "b"), ("b", "c"), ("d", "d")]);
    let loops: Vec<String> = facts.findings(&[]).into_iter().map(|one| one.what).collect();
    assert_eq!(loops.len(), 2, "{loops:?}");
    assert!(loops[0].contains("a -> b -> a is a loop"), "{loops:?}");
    assert!(loops[1].contains("d -> d is a loop"), "{loops:?}");
}

#[test]
fn a_connected_tree_is_ok_and_a_sensor_outside_of_it_is_reported() {
    let facts = transforms(&[("base", "laser"), ("base", "camera")]);
    only(
        &facts.findings(&[("/scan", "/laser"), ("/depth", "camera")]),
        Check::Transforms,
        Severity::Ok,
    );
    only(&facts.findings(&[("/scan", "lidar")]), Check::Frames, Severity::Warn);
    let apart = transforms(&[("base", "laser"), ("mast", "camera")]);
    only(
        &apart.findings(&[("/scan", "laser"), ("/depth", "camera")]),
        Check::Transforms,
        Severity::Warn,
    );
}

#[test]
fn a_chain_of_any_length_ends() {
    let names: Vec<String> = (0..5000).map(|number| format!("f{number}")).collect();
    let edges: Vec<(&str, &str)> =
        names.windows(2).map(|pair| (pair[0].as_str(), pair[1].as_str())).collect();
    assert!(!transforms(&edges).findings(&[("/scan", "f40")]).is_empty());
}

/// A cloud of a scanner that turns, with times of these values from the first to the last point.
fn turn(times: (f64, f64)) -> PointCloud2 {
    const POINTS: u32 = 100;
    let field = |(name, offset): (&str, u32)| PointField {
        name: name.to_owned(),
        offset,
        datatype: PointField::FLOAT64,
        count: 1,
    };
    let mut data = Vec::new();
    for index in 0..POINTS {
        let share = f64::from(index) / f64::from(POINTS - 1);
        let bearing = share * std::f64::consts::TAU;
        let time = times.0 + share * (times.1 - times.0);
        for value in [5.0 * bearing.cos(), 5.0 * bearing.sin(), 0.5, 1.0, time] {
            data.extend(value.to_le_bytes());
        }
    }
    let fields = [("x", 0), ("y", 8), ("z", 16), ("line", 24), ("timestamp", 32)];
    PointCloud2 {
        header: header(),
        height: 1,
        width: POINTS,
        fields: fields.into_iter().map(field).collect(),
        point_step: 40,
        row_step: 40 * POINTS,
        data,
        ..PointCloud2::default()
    }
}

/// Regression: times of Livox' driver, nanoseconds in floating point, were called wrong, though the node reads them.
#[test]
fn times_that_the_node_understands_are_no_finding() {
    for unit in [1.0, 1e3, 1e6, 1e9] {
        let first = 1.7e9 * unit;
        assert_eq!(findings_of(&[turn((first, first + 0.0999 * unit))]), [], "{unit}");
    }
    only(&findings_of(&[turn((0.0, 1e-4))]), Check::Units, Severity::Error);
    only(&findings_of(&[turn((7.0, 7.0))]), Check::PointTimes, Severity::Warn);
}

proptest! {
    #[test]
    fn no_cloud_causes_a_panic(
        data in prop::collection::vec(any::<u8>(), 0..200),
        fields in prop::collection::vec(("x|y|z|t|time|ring", 0_u32..40, 0_u8..10), 0..6),
        point_step in 0_u32..40,
        is_bigendian: bool,
    ) {
        let field = |(name, offset, datatype)| PointField { name, offset, datatype, count: 1 };
        let cloud = PointCloud2 {
            header: header(),
            fields: fields.into_iter().map(field).collect(),
            point_step,
            is_bigendian,
            data,
            ..PointCloud2::default()
        };
        findings_of(&[cloud.clone(), cloud]);
    }

    #[test]
    fn no_scan_causes_a_panic(
        ranges in prop::collection::vec(any::<f32>(), 0..20),
        [angle_min, angle_increment, time_increment, range_min, range_max] in any::<[f32; 5]>(),
    ) {
        let scan = LaserScan {
            angle_min, angle_increment, time_increment, range_min, range_max, ranges, ..LaserScan::default()
        };
        findings_of(&[scan.clone(), scan]);
    }
}
