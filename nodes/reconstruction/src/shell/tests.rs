mod behind;
mod distance;
mod files;
mod grid;
mod mesh;
mod path;
mod subscribers;

use std::time::Duration;

use free_domain::FreeDomain;
use geometry::{Cloud, Method, PipelineConfig, SegmentedCycle, Stamp};
use msgs::convert;
use msgs::sensor_msgs::PointCloud2;
use msgs::stillmap_msgs::{SegmentedCloud, StageReport};
use nalgebra::{Isometry3, Point3};
use node_shell::{Host, Publisher, Qos, RosArguments, Subscription, Transport};
use tokio::time::Instant;

use super::schedule::Subscribers;
use super::*;

/// A test that waits longer has failed, even on a busy machine.
/// After how long a message that may have come before a connection is sent again; twice as long each time, or a slow machine would never
/// catch up.
const AGAIN: Duration = Duration::from_millis(200);
const PATIENCE: Duration = Duration::from_secs(120);

/// The nodes of one test, separated from all others by domain and namespace.
struct Place {
    transport: Transport,
    arguments: RosArguments,
}

impl Place {
    fn new(test: &str) -> Self {
        let transport = Transport::on_domain(FreeDomain::of_this_process().number()).unwrap();
        let namespace = format!("__ns:=/reconstruction_test_{test}");
        let arguments = RosArguments::parse(["--ros-args", "-r", &namespace]).unwrap();
        Self { transport, arguments }
    }

    /// A host, which represents one process.
    fn host(&self) -> Host {
        Host::on(self.transport.clone()).unwrap()
    }

    fn node(&self, host: &Host, name: &str) -> Node {
        host.node(name, &self.arguments).unwrap()
    }
}

/// Lets the node serve until its host's shutdown is triggered.
fn serving(
    node: Node,
    parameters: ReconstructionParameters,
) -> tokio::task::JoinHandle<Result<(), NodeFailure>> {
    tokio::spawn(async move {
        let result = serve(&node, parameters).await;
        node.close().await;
        result
    })
}

async fn soon<T>(what: &str, wait: impl Future<Output = T>) -> T {
    match tokio::time::timeout(PATIENCE, wait).await {
        Ok(value) => value,
        Err(_) => panic!("timed out: {what}"),
    }
}

/// The pipeline parameters of the tests: points are not cleared, although some are in front of others.
fn pipeline() -> PipelineConfig {
    PipelineConfig::new(Method::RecHv, 1.0)
}

fn cloud(stamp_ns: i64, frame_id: &str, points_m: &[[f32; 3]]) -> SegmentedCloud {
    let cloud = |frame_id: &str, points_m: &[[f32; 3]]| Cloud {
        stamp: Stamp::from_nanos(stamp_ns),
        frame_id: frame_id.to_owned(),
        points_m: points_m.iter().copied().map(Point3::from).collect(),
    };
    convert::message_from_segmented_cycle(&SegmentedCycle {
        index: 0,
        static_cloud: cloud(frame_id, points_m),
        dynamic_cloud: cloud("rig", &[]),
        map_from_rig: Isometry3::identity(),
        depth: None,
        scan_rays: std::sync::Arc::default(),
        retracted_m: Vec::new(),
        setup: pipeline().setup(),
    })
}

/// Sends clouds without points until the node has reported the last of them: messages that it publishes before it
/// has discovered its subscriber are lost. Returns the cycle of the last one.
async fn wait_until_connected(
    clouds: &Publisher<SegmentedCloud>,
    reports: &Subscription<StageReport>,
) -> u32 {
    let mut wait = AGAIN;
    for stamp_ns in 0.. {
        clouds.publish(cloud(stamp_ns, "map", &[])).unwrap();
        let heard = async {
            loop {
                let report = reports.next().await.message;
                if convert::stamp_from_time(report.header.stamp) == Stamp::from_nanos(stamp_ns) {
                    return report.cycle;
                }
            }
        };
        if let Ok(cycle) = tokio::time::timeout(wait, heard).await {
            return cycle;
        }
        wait *= 2;
        assert!(wait < PATIENCE, "timed out: a report");
    }
    unreachable!()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn clouds_become_a_map_that_is_published_reported_and_saved() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.ply");
    let test = Place::new("whole");
    let (own, peer) = (test.node(&test.host(), "reconstruction"), test.node(&test.host(), "peer"));
    let shutdown = own.shutdown_signal();
    let parameters = ReconstructionParameters {
        map_publish_period_s: 0.05,
        map_file: path.to_str().unwrap().to_owned(),
        config: ReconstructionConfig { pipeline: pipeline(), ..ReconstructionConfig::default() },
        ..ReconstructionParameters::default()
    };
    let served = serving(own, parameters);
    {
        let clouds =
            peer.publisher::<SegmentedCloud>("segmented_cloud", &Qos::reliable(5)).unwrap();
        let reports =
            peer.subscription::<StageReport>("reconstruction/report", &Qos::reliable(5)).unwrap();
        soon("the node", clouds.wait_for_subscribers(1)).await;
        let first_cycle = 1 + wait_until_connected(&clouds, &reports).await;

        let first = cloud(1_000, "map", &[[0.25, 0.5, 0.5], [5.5, 0.5, 0.5]]);
        let second = cloud(2_000, "map", &[[0.75, 0.5, 0.5]]);
        // One after the other: of waiting clouds a live node takes only the newest.
        for (sent, points_in, voxels_new, cycle) in [(first, 2, 2, 0), (second, 1, 0, 1)] {
            clouds.publish(sent).unwrap();
            let report = soon("a report", reports.next()).await.message;
            assert!(report.processed);
            assert_eq!(report.cycle, first_cycle + cycle);
            let count = |name: &str| {
                let index = report.count_names.iter().position(|known| known == name).unwrap();
                report.counts[index]
            };
            assert_eq!(
                (count("points_in"), count("voxels"), count("voxels_new")),
                (points_in, 2, voxels_new)
            );
            assert_eq!((count("points_refused"), count("points_not_finite")), (0, 0));
            assert_eq!(report.step_names, ["convert", "add"]);
        }
        clouds.publish(cloud(3_000, "elsewhere", &[[0.75, 0.5, 0.5]])).unwrap();
        let report = soon("the report of the drop", reports.next()).await.message;
        assert!(!report.processed && report.drop_reason.contains("elsewhere"), "{report:?}");

        // The map had no subscriber so far. A new one gets the whole map.
        let maps = peer.subscription::<PointCloud2>("static_map", &Qos::latched()).unwrap();
        let expected = [Point3::new(0.5, 0.5, 0.5), Point3::new(5.5, 0.5, 0.5)];
        let map = soon("the map of both clouds", async {
            loop {
                let map = maps.next().await.message;
                let map = convert::cloud_from_message(&map).unwrap();
                if map.stamp == Stamp::from_nanos(2_000) {
                    return map;
                }
            }
        })
        .await;
        assert_eq!((map.frame_id.as_str(), map.points_m.as_slice()), ("map", &expected[..]));
    }
    shutdown.trigger();
    soon("the end", served).await.unwrap().unwrap();
    peer.close().await;
    let saved = std::fs::read(&path).unwrap();
    let expected = [Point3::new(0.5, 0.5, 0.5), Point3::new(5.5, 0.5, 0.5)];
    assert_eq!(saved, geometry::ply::encode(&expected));
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_map_with_an_unreadable_tile_is_not_published_and_reported() {
    let folder = tempfile::tempdir().unwrap();
    let test = Place::new("unreadable");
    let node = test.node(&test.host(), "reconstruction");
    let parameters = ReconstructionParameters {
        spill_folder: folder.path().to_str().unwrap().to_owned(),
        config: ReconstructionConfig {
            pipeline: PipelineConfig { map_edge_m: 1.0, ..PipelineConfig::default() },
            max_map_blocks: 10,
            at_max_voxels: crate::AtMaxVoxels::Spill,
            spill_tile_edge_m: 8.0,
            ..ReconstructionConfig::default()
        },
        ..ReconstructionParameters::default()
    };
    let mut stage = Stage::new(&node, &parameters).unwrap();
    let line = (0..100_u8).flat_map(|x| (0..7_u8).map(move |y| [x, y, 4].map(f32::from)));
    let line: Vec<Point3<f32>> = line.map(Point3::from).collect();
    stage.map.replace(&line, &[], "map").unwrap();
    let points = stage.map.points().len();
    let published = format!("published the map of {points} points");
    assert_eq!(stage.publish_on_request().unwrap(), published);
    let own = std::fs::read_dir(folder.path()).unwrap().next().unwrap().unwrap().path();
    let tiles = std::fs::read_dir(own).unwrap().map(|entry| entry.unwrap().path());
    let tile = tiles.filter(|path| path.extension().is_some_and(|it| it == "tile")).min().unwrap();
    let bytes = std::fs::read(&tile).unwrap();
    std::fs::remove_file(&tile).unwrap();
    // A folder in place of the file cannot be read.
    std::fs::create_dir(&tile).unwrap();
    let error = stage.publish_on_request().unwrap_err().to_string();
    let key = tile.file_stem().unwrap().to_str().unwrap().replace('_', ", ");
    assert!(error.contains("incomplete") && error.contains(&format!("({key})")), "{error}");
    let due = stage.schedule.look(Instant::now() + LOOK_AGAIN, Subscribers { map: 1, updates: 0 });
    assert!(!due.map, "not again at once");
    std::fs::remove_dir(&tile).unwrap();
    std::fs::write(&tile, bytes).unwrap();
    assert_eq!(stage.publish_on_request().unwrap(), published);
    drop(stage);
    node.close().await;
}

#[test]
fn a_period_is_positive() {
    for seconds in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let parameters = ReconstructionParameters {
            map_publish_period_s: seconds,
            ..ReconstructionParameters::default()
        };
        let error = Settings::of(&parameters).map(|_| ()).unwrap_err().to_string();
        assert!(error.contains("map_publish_period_s"), "{error}");
    }
    let settings = Settings::of(&ReconstructionParameters::default()).unwrap();
    assert_eq!(settings.periods.updates, Duration::from_millis(500));
}
