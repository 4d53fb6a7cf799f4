use std::time::Duration;

use free_domain::FreeDomain;
use geometry::{DynamicZone, ReturnSpan, Stamp, ZoneSource};
use msgs::stillmap_msgs::{ReducedCloud, StageReport};
use nalgebra::{Isometry3, Point3};
use node_shell::{RosArguments, Transport};

use super::*;

/// Longer than anything takes on a busy machine; a test that waits so long has failed.
const PATIENCE: Duration = Duration::from_secs(120);

/// A node on the domain of this process.
fn node(name: &str) -> Node {
    let transport = Transport::on_domain(FreeDomain::of_this_process().number()).unwrap();
    let arguments = RosArguments::parse(["--ros-args", "-r", "__ns:=/segmentation_test"]).unwrap();
    Node::start_on(transport, name, &arguments).unwrap()
}

async fn soon<T>(what: &str, wait: impl Future<Output = T>) -> T {
    match tokio::time::timeout(PATIENCE, wait).await {
        Ok(value) => value,
        Err(_) => panic!("waited in vain: {what}"),
    }
}

/// Ahead in the zone an object, behind it a wall; to the left, outside the zone, another wall.
fn cycle() -> DetectedCycle {
    let points_m = [[1.0, 0.0, 0.0], [3.0, 0.0, 0.0], [1.0, 2.0, 0.0]].map(Point3::from).to_vec();
    DetectedCycle {
        depth: None,
        scan_rays: std::sync::Arc::default(),
        index: 4,
        scan_stamp: Stamp::from_nanos(1_000),
        reduced_cloud: Cloud {
            stamp: Stamp::from_nanos(2_000),
            frame_id: "rig".to_owned(),
            points_m,
        },
        voxel_points: vec![4, 3, 2],
        points_before_reduction: 9,
        map_from_rig: Isometry3::translation(10.0, 0.0, 0.0),
        map_from_continuous: None,
        map_frame_id: "map".to_owned(),
        setup: geometry::CycleSetup::default(),
        moving_beams: Vec::new(),
        zones: vec![DynamicZone {
            azimuth_min_rad: -0.1,
            azimuth_max_rad: 0.1,
            peak_std_dev_m: 0.5,
            source: ZoneSource::Measured,
            returns: Some(ReturnSpan { nearest_m: 1.0, farthest_m: 1.0 }),
        }],
    }
}

/// While cycles waited before segmentation, reconstruction in the same process was kept waiting and lost its own.
#[tokio::test]
async fn a_peer_gets_each_cycle_while_more_of_them_wait() {
    const CYCLES: u32 = 3;
    let host = node_shell::Host::in_process();
    let arguments = RosArguments::parse(["--ros-args"]).unwrap();
    let node = |name: &str| host.node(name, &arguments).unwrap();
    let (own, peer) = (node("segmentation"), node("peer"));
    let cycles = peer.value_publisher::<DetectedCycle>("reduced_cloud", &Qos::reliable(5)).unwrap();
    let statics = peer.subscription::<PointCloud2>("static_cloud", &Qos::reliable(1)).unwrap();
    let shutdown = own.shutdown_signal();
    let heard = tokio::spawn(async move {
        let mut stamps = Vec::new();
        for _ in 0..CYCLES {
            let before = format!("a cycle after {stamps:?}");
            stamps.push(soon(&before, statics.next()).await.message.header.stamp.nanosec);
        }
        shutdown.trigger();
        stamps
    });
    let published = async {
        cycles.wait_for_subscribers(1).await;
        for index in 0..CYCLES {
            let stamp = Stamp::from_nanos(i64::from(1 + index));
            let reduced_cloud = Cloud { stamp, ..cycle().reduced_cloud };
            cycles.publish(DetectedCycle { index, reduced_cloud, ..cycle() }).unwrap();
        }
    };
    let served = async { tokio::join!(serve(&own, SegmentationParameters::default()), published) };
    soon("the end", served).await.0.unwrap();
    assert_eq!(heard.await.unwrap(), [1, 2, 3]);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_cycle_comes_out_in_two_parts_with_its_report() {
    let (own, peer) = (node("segmentation"), node("peer"));
    let shutdown = own.shutdown_signal();
    let heard = async {
        let cycles = peer.publisher::<ReducedCloud>("reduced_cloud", &Qos::reliable(5)).unwrap();
        let statics = peer.subscription::<PointCloud2>("static_cloud", &Qos::reliable(5)).unwrap();
        let dynamics =
            peer.subscription::<PointCloud2>("dynamic_cloud", &Qos::reliable(5)).unwrap();
        let reports =
            peer.subscription::<StageReport>("segmentation/report", &Qos::reliable(5)).unwrap();
        soon("the node", async {
            cycles.wait_for_subscribers(1).await;
            statics.wait_for_publishers(1).await;
            dynamics.wait_for_publishers(1).await;
            reports.wait_for_publishers(1).await;
            // What nobody listens to is not made: the node is to know of its listeners.
            let is_heard = |one: &node_shell::Match| {
                one.role == node_shell::Role::Publisher
                    && ["static_cloud", "dynamic_cloud", "segmentation/report"]
                        .iter()
                        .any(|name| one.topic.ends_with(name))
                    && one.peers > 0
            };
            while own.matches().iter().filter(|one| is_heard(one)).count() < 3 {
                tokio::time::sleep(Duration::from_millis(10)).await;
            }
        })
        .await;

        let message = convert::message_from_detected_cycle(&cycle());
        cycles.publish(message.clone()).unwrap();
        let statics = soon("the static cloud", statics.next()).await.message;
        let statics = convert::cloud_from_message(&statics).unwrap();
        assert_eq!((statics.frame_id.as_str(), statics.stamp.as_nanos()), ("map", 2_000));
        assert_eq!(statics.points_m, [[13.0, 0.0, 0.0], [11.0, 2.0, 0.0]].map(Point3::from));
        let dynamics = soon("the dynamic cloud", dynamics.next()).await.message;
        let dynamics = convert::cloud_from_message(&dynamics).unwrap();
        assert_eq!((dynamics.frame_id.as_str(), dynamics.stamp.as_nanos()), ("rig", 2_000));
        assert_eq!(dynamics.points_m, [Point3::new(1.0, 0.0, 0.0)]);
        let report = soon("the report", reports.next()).await.message;
        assert!(report.processed);
        assert_eq!((report.cycle, &report.header), (4, &message.header));
        assert_eq!(
            report.count_names,
            ["points_reduced", "points_in_zone", "points_dynamic", "points_static", "tracks"]
        );
        assert_eq!(report.counts[..4], [3, 2, 1, 2]);
        assert_eq!(
            report.step_names,
            [
                "convert",
                "evidence",
                "angular",
                "depth_clustering",
                "tracking",
                "evidence",
                "transform",
                "publish"
            ]
        );

        let mut damaged = message;
        damaged.zones[0].azimuth_max_rad = f64::NAN;
        cycles.publish(damaged).unwrap();
        let report = soon("the report of the drop", reports.next()).await.message;
        assert!(!report.processed && !report.drop_reason.is_empty(), "{report:?}");
        shutdown.trigger();
    };
    let (served, ()) = tokio::join!(serve(&own, SegmentationParameters::default()), heard);
    served.unwrap();
    own.close().await;
    peer.close().await;
}

/// A panic in one step ended the process, and with it the nodes beside it.
#[tokio::test]
async fn a_panic_in_a_step_costs_its_cycle_and_what_is_known_of_earlier_ones() {
    let host = node_shell::Host::in_process();
    let own = host.node("segmentation", &RosArguments::parse(["--ros-args"]).unwrap()).unwrap();
    let mut stage = Stage::new(&own, &SegmentationParameters::default()).unwrap();
    let arrived = Arrived::Value(Arc::new(cycle()));
    stage.take(&arrived);
    assert!(stage.segmenter.evidence_blocks() > 0);
    let (cause, reason) = stage.guarded(|_| -> Result<(), _> { panic!("half done") }).unwrap_err();
    assert_eq!(cause, Panicked::CAUSE);
    assert!(reason.ends_with("half done"), "{reason}");
    assert_eq!(stage.segmenter.evidence_blocks(), 0);
    stage.take(&arrived);
    assert!(stage.segmenter.evidence_blocks() > 0 && own.counters().drops().is_empty());
}
