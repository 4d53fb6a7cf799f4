use proptest::prelude::*;

use super::*;
use crate::doctor::finding::Severity;

fn stamps(seconds: impl IntoIterator<Item = f64>) -> Vec<Stamp> {
    let zero = Stamp::from_secs_nanos(100, 0);
    seconds.into_iter().map(|one| zero.plus_seconds(one)).collect()
}

fn every(period_s: f64, count: u32) -> Vec<Stamp> {
    stamps((0..count).map(|index| f64::from(index) * period_s))
}

fn facts(type_name: &str, stamps: Vec<Stamp>) -> TopicFacts {
    let messages = stamps.len() as u64;
    TopicFacts { stamps, messages, ..TopicFacts::new(type_name, true) }
}

#[track_caller]
fn assert_finding(finding: &Finding, severity: Severity, parts: &[&str]) {
    assert_eq!(finding.severity, severity, "{finding:?}");
    let line = finding.line(false);
    for part in parts {
        assert!(line.contains(part), "'{part}' is not in: {line}");
    }
    assert!(severity == Severity::Ok || finding.fix.is_some());
}

const SCAN: &str = "sensor_msgs/msg/LaserScan";

#[test]
fn a_steady_topic_is_ok_with_its_rate() {
    let findings = topic("/scan", &facts(SCAN, every(0.1, 50)));
    assert_eq!(findings.len(), 1);
    assert_finding(
        &findings[0],
        Severity::Ok,
        &["/scan: 50 messages at 10.0 Hz, at most 0.100 s apart"],
    );
}

#[test]
fn a_gap_is_reported_with_its_position_and_length() {
    let mut all = every(0.1, 50);
    all.drain(20..35);
    let findings = topic("/scan", &facts(SCAN, all));
    let parts = ["1 gaps", "1.600 s is 1.9 s after the first", "--max-cache-size"];
    assert_finding(&findings[0], Severity::Warn, &parts);
}

#[test]
fn poses_may_be_as_far_apart_as_they_are_interpolated() {
    let mut all = every(0.1, 20);
    all.drain(10..15);
    let pose = topic("/pose", &facts(PoseStamped::TYPE_NAME, all.clone()));
    assert_finding(&pose[0], Severity::Ok, &[]);
    assert_finding(&topic("/scan", &facts(SCAN, all))[0], Severity::Warn, &[]);
    let rare = topic("/info", &facts(CameraInfo::TYPE_NAME, stamps([0.0, 1.0, 9.0])));
    assert_finding(&rare[0], Severity::Ok, &[]);
}

#[test]
fn stamps_that_decrease_or_stay_constant_are_found() {
    let mut back = every(0.1, 20);
    back.swap(3, 4);
    let findings = topic("/scan", &facts(SCAN, back));
    assert_finding(
        &findings[0],
        Severity::Warn,
        &["1 of 20 messages are stamped before", "chronyc"],
    );
    for (nanos, part) in
        [(0, "5 of 5 messages have the stamp 0"), (9, "all 5 messages have the stamp 0.000 s")]
    {
        let constant = topic("/scan", &facts(SCAN, vec![Stamp::from_nanos(nanos); 5]));
        assert_eq!(constant.len(), 1);
        assert_finding(&constant[0], Severity::Error, &[part]);
    }
}

#[test]
fn unusable_messages_are_an_error_when_they_are_all() {
    let mut some = facts(SCAN, every(0.1, 10));
    some.unusable = 2;
    some.messages = 12;
    some.first_reason = Some("encoding rgb8".to_owned());
    let findings = topic("/scan", &some);
    assert_finding(
        &findings[0],
        Severity::Warn,
        &["2 of 12 messages cannot be used", "encoding rgb8"],
    );
    let all = TopicFacts { unusable: 5, messages: 5, stamps: Vec::new(), ..some };
    let findings = topic("/scan", &all);
    assert_eq!(findings.len(), 1);
    assert_finding(&findings[0], Severity::Error, &["5 of 5"]);
    assert!(topic("/scan", &facts(SCAN, Vec::new())).is_empty());
}

#[test]
fn scans_with_images_beside_them_are_ok() {
    let finding = offsets(&every(0.1, 50), &every(1.0 / 30.0, 150), 0.05).unwrap();
    assert_finding(&finding, Severity::Ok, &["50 of 50 scans"]);
    assert_eq!(offsets(&[], &every(0.1, 5), 0.05), None);
    assert_eq!(offsets(&every(0.1, 5), &[], 0.05), None);
}

#[test]
fn clocks_that_differ_are_reported_with_the_difference() {
    let scans = every(0.1, 50);
    let later = scans.iter().map(|stamp| stamp.plus_seconds(60.0)).collect::<Vec<_>>();
    let finding = offsets(&scans, &later, 0.05).unwrap();
    assert_finding(&finding, Severity::Error, &["0 of 50 scans", "chrony", "max_cloud_offset_s"]);
    let sparse = offsets(&scans, &every(0.3, 17), 0.05).unwrap();
    assert_finding(&sparse, Severity::Warn, &["17 of 50", "full rates"]);
}

#[test]
fn poses_must_cover_the_images() {
    let view = every(0.1, 50);
    // Poses between the images, never at the time of one.
    let poses = |period_s, count| -> Vec<_> {
        every(period_s, count).iter().map(|stamp| stamp.plus_seconds(-0.01)).collect()
    };
    assert_finding(&coverage(&view, &poses(0.05, 100), 0.7).unwrap(), Severity::Ok, &["50 of 50"]);
    let half = coverage(&view, &poses(0.05, 50), 0.7).unwrap();
    assert_finding(&half, Severity::Warn, &["25 of 50", "from -0.0 s to +2.4 s"]);
    assert_finding(&coverage(&view, &poses(1.0, 6), 0.7).unwrap(), Severity::Error, &["0 of 50"]);
    assert_finding(&coverage(&view, &view, 0.05).unwrap(), Severity::Ok, &["50 of 50"]);
    let elsewhere: Vec<_> = view.iter().map(|stamp| stamp.plus_seconds(-60.0)).collect();
    assert_finding(
        &coverage(&view, &elsewhere, 0.7).unwrap(),
        Severity::Error,
        &["0 of 50", "-60.0 s"],
    );
    assert_eq!(coverage(&view, &[], 0.7), None);
}

proptest! {
    #[test]
    fn the_nearest_stamp_is_nearer_than_all_others(
        mut nanos in proptest::collection::vec(-1000i64..1000, 1..20), wanted in -1000i64..1000
    ) {
        nanos.sort_unstable();
        let sorted: Vec<_> = nanos.iter().copied().map(Stamp::from_nanos).collect();
        let found = nearest(&sorted, Stamp::from_nanos(wanted)).unwrap().as_nanos();
        let distance = (found - wanted).abs();
        prop_assert!(nanos.iter().all(|one| distance <= (one - wanted).abs()));
    }
}
