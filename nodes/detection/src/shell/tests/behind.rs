//! A node that is slower than the scanner.

use super::*;

/// Ten scans with their images and poses have come while the node was busy.
async fn processed_of_ten(max_waiting_cycles: usize) -> (Vec<StageReport>, Vec<String>) {
    let host = Host::in_process().with_max_waiting_cycles(max_waiting_cycles);
    let arguments = RosArguments::parse([""; 0]).unwrap();
    let (own, peer) =
        (host.node("detection", &arguments).unwrap(), host.node("robot", &arguments).unwrap());
    let mut stage = Stage::new(&own, &DetectionParameters::default()).unwrap();
    let qos = Qos::sensor(10);
    let scans = peer.publisher("scan", &qos).unwrap();
    let images = peer.publisher("depth/image", &qos).unwrap();
    let infos = peer.publisher("depth/camera_info", &qos).unwrap();
    let poses = peer.publisher("pose", &qos).unwrap();
    let reports = peer.subscription("detection/report", &Qos::reliable(50)).unwrap();
    infos.publish(camera_info(4)).unwrap();
    for count in 0..10 {
        let stamp = at(1_000 + 20 * count);
        images.publish(image(stamp)).unwrap();
        scans.publish(scan(stamp)).unwrap();
        poses.publish(pose(stamp, 0.0)).unwrap();
    }
    process(&mut stage);
    let taken: Vec<StageReport> = std::iter::from_fn(|| reports.try_next())
        .map(|report| Arc::unwrap_or_clone(report.message))
        .collect();
    let drops = own.counters().drops().into_iter().map(|(cause, count)| format!("{count} {cause}"));
    let drops = drops.collect();
    drop((stage, scans, images, infos, poses, reports));
    own.close().await;
    peer.close().await;
    (taken, drops)
}

/// Regression: all scans that had come while the node was busy were processed, up to seven seconds old.
#[tokio::test]
async fn a_live_node_processes_the_newest_two_complete_cycles_and_reports_the_others() {
    let (reports, drops) = processed_of_ten(LIVE).await;
    let (processed, dropped): (Vec<_>, Vec<_>) =
        reports.iter().partition(|report| report.processed);
    let stamps = |reports: &[&StageReport]| -> Vec<Stamp> {
        reports.iter().map(|report| convert::stamp_from_time(report.header.stamp)).collect()
    };
    assert_eq!(stamps(&processed), [at(1_160), at(1_180)]);
    assert_eq!(stamps(&dropped), [0, 1, 2, 3, 4, 5, 6, 7].map(|count| at(1_000 + 20 * count)));
    assert_eq!(drops, ["8 newer cycles wait"]);
    assert!(dropped.iter().all(|report| report.drop_reason == "newer cycles wait"));
}

#[tokio::test]
async fn of_a_recording_each_is_processed() {
    let (reports, drops) = processed_of_ten(OF_A_RECORDING).await;
    assert!(reports.len() == 10 && reports.iter().all(|report| report.processed), "{reports:?}");
    assert!(drops.is_empty(), "{drops:?}");
}
