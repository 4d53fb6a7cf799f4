//! A node that is slower than the scanner.

use super::*;

/// Regression: up to fifty cycles waited, and a node that was to end processed all of them first.
#[tokio::test]
async fn a_live_node_takes_the_newest_two_waiting_cycles_and_counts_the_others() {
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
