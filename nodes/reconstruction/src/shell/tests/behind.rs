//! A node that takes longer for a cycle than the scanner.

use super::*;

/// Once fifty cycles waited, and a node that was asked to end worked them all off.
#[tokio::test]
async fn of_the_cycles_that_wait_live_the_newest_two_are_taken_and_the_others_counted() {
    let test = Place::new("behind");
    let host = Host::in_process().with_max_waiting_cycles(2);
    let (own, peer) = (test.node(&host, "reconstruction"), test.node(&host, "peer"));
    let parameters = ReconstructionParameters {
        config: ReconstructionConfig { pipeline: pipeline(), ..ReconstructionConfig::default() },
        ..ReconstructionParameters::default()
    };
    let mut stage = Stage::new(&own, &parameters).unwrap();
    let clouds = peer.publisher("segmented_cloud", &Qos::reliable(50)).unwrap();
    let reports: Subscription<StageReport> =
        peer.subscription("reconstruction/report", &Qos::reliable(50)).unwrap();
    for stamp_ns in 0..10 {
        clouds.publish(cloud(stamp_ns, "map", &[[1.0, 0.0, 0.0]])).unwrap();
    }
    stage.take_waiting();
    let taken = std::iter::from_fn(|| reports.try_next());
    let stamps: Vec<_> =
        taken.map(|report| convert::stamp_from_time(report.message.header.stamp)).collect();
    assert_eq!(stamps, [8, 9].map(Stamp::from_nanos));
    assert_eq!(stage.cycles.lost_count(), 8);
    assert!(!own.takes_every_cycle());
    drop((stage, clouds, reports));
    own.close().await;
    peer.close().await;
}
