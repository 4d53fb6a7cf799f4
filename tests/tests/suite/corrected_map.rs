//! The trajectory of the platform is corrected while its map is another process's.

use std::time::{Duration, Instant};

use geometry::{Cloud, MapPath, Method, PathVertex, PipelineConfig, SegmentedCycle, Stamp};
use msgs::convert;
use msgs::nav_msgs::Path;
use msgs::sensor_msgs::PointCloud2;
use msgs::stillmap_msgs::{SegmentedCloud, StageReport};
use nalgebra::{Isometry3, Point3};
use node_shell::{Node, PublishError, Publisher, Qos, RosArguments, Subscription};
use tokio::time::timeout;

use crate::program::Running;

/// Longer than anything here takes on a busy machine; reached only by a fault.
const PATIENCE: Duration = Duration::from_secs(60);

/// Without an answer for so long the next cloud is sent. A late answer does no harm.
const SEND_AGAIN: Duration = Duration::from_secs(1);

/// A peer of the node that makes the map.
struct Peer {
    clouds: Publisher<SegmentedCloud>,
    paths: Publisher<Path>,
    reports: Subscription<StageReport>,
    maps: Subscription<PointCloud2>,
    second: f64,
}

impl Peer {
    fn on(node: &Node) -> Self {
        Self {
            clouds: node.publisher("segmented_cloud", &Qos::reliable(5)).unwrap(),
            paths: node.publisher("map_path", &Qos::latched()).unwrap(),
            reports: node.subscription("reconstruction/report", &Qos::reliable(50)).unwrap(),
            maps: node.subscription("static_map", &Qos::latched()).unwrap(),
            second: 0.0,
        }
    }

    async fn meet(&self) {
        self.clouds.wait_for_subscribers(1).await;
        self.paths.wait_for_subscribers(1).await;
        self.reports.wait_for_publishers(1).await;
        self.maps.wait_for_publishers(1).await;
    }

    /// Sends clouds of one point, each a second later, until the report of one holds what is asked for. A cloud that is refused
    /// ends the test: so are those after it. What one side sends before the other side knows of it too is lost, so that a cloud
    /// without a report is followed by another.
    async fn see_until(&mut self, point_m: [f32; 3], enough: impl Fn(&StageReport) -> bool) {
        let begun = Instant::now();
        loop {
            self.second += 1.0;
            let stamp = Stamp::default().plus_seconds(self.second);
            self.clouds.publish(cloud(stamp, point_m)).unwrap();
            assert!(begun.elapsed() < PATIENCE, "none of {} clouds has it", self.second);
            let Ok(received) = timeout(SEND_AGAIN, self.reports.next()).await else { continue };
            let report = received.message;
            assert!(report.processed, "refused after {} s: {}", self.second, report.drop_reason);
            if enough(&report) {
                return;
            }
        }
    }

    /// From now on the way has been `x_m` farther on at its begin. A latched message is not taken before the one before it has been
    /// acknowledged.
    async fn correct(&self, x_m: f64) {
        let stamp = Stamp::default().plus_seconds(0.5);
        let vertex = PathVertex { stamp, map_from_rig: Isometry3::translation(x_m, 0.0, 0.0) };
        let since = Stamp::default().plus_seconds(self.second + 0.5);
        let path = MapPath::new(since, "map", vec![vertex]).unwrap();
        let taken = async {
            while let Err(error) = self.paths.publish(convert::message_from_map_path(&path)) {
                assert!(matches!(error, PublishError::NotAcknowledged { .. }), "{error}");
                tokio::time::sleep(Duration::from_millis(10)).await;
            }
        };
        timeout(PATIENCE, taken).await.unwrap();
    }

    /// Waits for a map of these points.
    async fn hear_map(&self, points_m: &[[f32; 3]]) {
        let heard = async {
            loop {
                let message = self.maps.next().await.message;
                let mut points = convert::cloud_from_message(&message).unwrap().points_m;
                points.sort_by(|one, other| one.x.total_cmp(&other.x));
                if points
                    .iter()
                    .map(|point| [point.x, point.y, point.z])
                    .eq(points_m.iter().copied())
                {
                    return;
                }
            }
        };
        timeout(PATIENCE, heard).await.unwrap();
    }
}

fn cloud(stamp: Stamp, point_m: [f32; 3]) -> SegmentedCloud {
    let cloud = |frame_id: &str, points_m: Vec<Point3<f32>>| Cloud {
        stamp,
        frame_id: frame_id.to_owned(),
        points_m,
    };
    convert::message_from_segmented_cycle(&SegmentedCycle {
        depth: None,
        scan_rays: std::sync::Arc::default(),
        retracted_m: Vec::new(),
        index: 0,
        static_cloud: cloud("map", vec![Point3::from(point_m)]),
        dynamic_cloud: cloud("rig", Vec::new()),
        map_from_rig: Isometry3::identity(),
        setup: PipelineConfig::new(Method::RecHv, 0.08).setup(),
    })
}

fn has_corrections(report: &StageReport) -> bool {
    report.count_names.iter().any(|name| name == "map_corrections")
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_map_in_another_process_follows_the_way() {
    let namespace = format!("__ns:=/corrected_map_{}", std::process::id());
    // The map of means moves point by point.
    let arguments = ["--ros-args", "-r", &namespace, "-p", "method:=rec_hv"];
    let node = Node::start("peer", &RosArguments::parse(arguments).unwrap()).unwrap();
    let mut peer = Peer::on(&node);
    let reconstruction = Running::start(["node", "reconstruction"].into_iter().chain(arguments));
    timeout(PATIENCE, peer.meet()).await.unwrap();

    peer.correct(0.0).await;
    // In the middle of a voxel, that its mean is it to the bit however often it is seen.
    let before = [0.5, 0.5, 0.5];
    peer.see_until(before, |report| !has_corrections(report)).await;
    peer.hear_map(&[before]).await;
    // Where all was that was seen by then is two metres on; what is seen later stays.
    peer.correct(2.0).await;
    let after = [4.5, 0.5, 0.5];
    peer.see_until(after, has_corrections).await;
    peer.hear_map(&[[2.5, 0.5, 0.5], after]).await;

    assert!(reconstruction.interrupt());
    drop(peer);
    node.close().await;
}
