mod behind;
mod listeners;
mod path;

use std::time::Duration;

use geometry::{Cloud, SegmentedCycle, Stamp};
use msgs::convert;
use msgs::sensor_msgs::PointCloud2;
use msgs::stillmap_msgs::{SegmentedCloud, StageReport};
use nalgebra::{Isometry3, Point3};
use node_shell::{Host, Publisher, Qos, RosArguments, Subscription, Transport};
use tokio::time::Instant;

use super::map_file::MapFile;
use super::parameters::period;
use super::schedule::Subscribers;
use super::*;
use crate::StaticMap;

/// Longer than anything takes on a busy machine; a test that waits so long has failed.
const PATIENCE: Duration = Duration::from_secs(20);

/// The nodes of one test, apart from those of all others by domain and namespace.
struct Place {
    transport: Transport,
    arguments: RosArguments,
}

impl Place {
    fn new(test: &str) -> Self {
        let process = std::process::id();
        let transport = Transport::on_domain((1 + process % 100) as u16).unwrap();
        let namespace = format!("__ns:=/reconstruction_test_{process}_{test}");
        let arguments = RosArguments::parse(["--ros-args", "-r", &namespace]).unwrap();
        Self { transport, arguments }
    }

    /// The place of one process.
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
        Err(_) => panic!("waited in vain: {what}"),
    }
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
        camera_in_rig_m: Point3::origin(),
    })
}

/// Sends clouds without points until the node has reported the last of them: what it publishes before it
/// knows of its subscriber is lost. Returns the cycle of the last one.
async fn knock(clouds: &Publisher<SegmentedCloud>, reports: &Subscription<StageReport>) -> u32 {
    for stamp_ns in 0..100 {
        clouds.publish(cloud(stamp_ns, "map", &[])).unwrap();
        let heard = async {
            loop {
                let report = reports.next().await.message;
                if convert::stamp_from_time(report.header.stamp) == Stamp::from_nanos(stamp_ns) {
                    return report.cycle;
                }
            }
        };
        if let Ok(cycle) = tokio::time::timeout(Duration::from_millis(200), heard).await {
            return cycle;
        }
    }
    panic!("waited in vain: a report");
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
        save_map_on_exit: path.to_str().unwrap().to_owned(),
        config: ReconstructionConfig { voxel_edge_m: 1.0, ..ReconstructionConfig::default() },
        ..ReconstructionParameters::default()
    };
    let served = serving(own, parameters);
    {
        let clouds =
            peer.publisher::<SegmentedCloud>("segmented_cloud", &Qos::reliable(5)).unwrap();
        let reports =
            peer.subscription::<StageReport>("reconstruction/report", &Qos::reliable(5)).unwrap();
        soon("the node", clouds.wait_for_subscribers(1)).await;
        let first_cycle = 1 + knock(&clouds, &reports).await;

        clouds.publish(cloud(1_000, "map", &[[0.25, 0.5, 0.5], [5.5, 0.5, 0.5]])).unwrap();
        clouds.publish(cloud(2_000, "map", &[[0.75, 0.5, 0.5]])).unwrap();
        clouds.publish(cloud(3_000, "elsewhere", &[[0.75, 0.5, 0.5]])).unwrap();
        for (points_in, voxels_new, cycle) in [(2, 2, 0), (1, 0, 1)] {
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
            assert!(count("map_bytes") > 0);
            assert_eq!(report.step_names, ["convert", "add"]);
        }
        let report = soon("the report of the drop", reports.next()).await.message;
        assert!(!report.processed && report.drop_reason.contains("elsewhere"), "{report:?}");

        // Nobody has subscribed to the map so far. Who comes now gets it whole.
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

#[test]
fn what_cannot_be_saved_is_found_out_at_the_start() {
    for (path, part) in
        [("map.obj", ".ply, .pcd or"), ("map", "or .bt"), ("/no/such/m.ply", "folder")]
    {
        let error = MapFile::new("map_file", path).err().unwrap().to_string();
        assert!(error.contains(part) && error.contains("map_file"), "{path}: {error}");
    }
    assert!(MapFile::new("map_file", "").unwrap().is_none());
    assert!(MapFile::new("map_file", "map.PLY").unwrap().is_some());
}

fn map_of(voxel_edge_m: f64, max_voxels: usize) -> StaticMap {
    let config =
        ReconstructionConfig { voxel_edge_m, max_voxels, ..ReconstructionConfig::default() };
    StaticMap::new(config).unwrap()
}

#[test]
fn a_map_that_was_saved_is_loaded() {
    let folder = tempfile::tempdir().unwrap();
    let points = [[-0.03_f32, 0.5, 0.02], [1.0, -2.0, 0.3], [0.07, 0.07, 9.0]].map(Point3::from);
    let mut map = map_of(0.08, 10);
    map.replace(&points, "map").unwrap();
    let keys = |map: &StaticMap| -> Vec<_> {
        map.points().iter().map(|point| map.grid().key(point)).collect()
    };
    for name in ["m.ply", "m.pcd", "m.bt"] {
        let path = folder.path().join(name);
        let file = MapFile::new("map_file", path.to_str().unwrap()).unwrap().unwrap();
        assert_eq!(file.save(&map).unwrap(), 3);
        let mut loaded = map_of(0.08, 3);
        loaded.replace(&[Point3::origin()], "map").unwrap();
        assert_eq!(file.load(&mut loaded, "odom").unwrap(), 3);
        assert_eq!((keys(&loaded), loaded.frame_id()), (keys(&map), Some("odom")));
        if name != "m.bt" {
            assert_eq!(loaded.points(), map.points());
        }
        // Too many: the path and the cause are told, and the map is as it was.
        let mut small = map_of(0.08, 2);
        small.replace(&points[..1], "map").unwrap();
        let error = file.load(&mut small, "map").unwrap_err().to_string();
        assert!(error.contains(name) && error.contains('2'), "{error}");
        assert_eq!(small.points(), points[..1]);
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 3, "nothing temporary is left");
    let path = folder.path().join("m.bt");
    let file = MapFile::new("map_file", path.to_str().unwrap()).unwrap().unwrap();
    let error = file.load(&mut map_of(0.05, 10), "map").unwrap_err().to_string();
    assert!(error.contains("0.08") && error.contains("0.05"), "{error}");
    std::fs::remove_file(&path).unwrap();
    let error = file.load(&mut map, "map").unwrap_err().to_string();
    assert!(error.contains("m.bt"), "{error}");
    assert_eq!(map.points(), {
        let mut sorted = map_of(0.08, 10);
        sorted.replace(&points, "map").unwrap();
        sorted.points()
    });
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_map_of_which_a_file_cannot_be_read_is_not_published_and_that_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let test = Place::new("unreadable");
    let node = test.node(&test.host(), "reconstruction");
    let parameters = ReconstructionParameters {
        spill_folder: folder.path().to_str().unwrap().to_owned(),
        config: ReconstructionConfig {
            voxel_edge_m: 1.0,
            max_voxels: 64,
            at_max_voxels: crate::AtMaxVoxels::Spill,
            spill_tile_edge_m: 4.0,
            ..ReconstructionConfig::default()
        },
        ..ReconstructionParameters::default()
    };
    let mut stage = Stage::new(&node, &parameters).unwrap();
    let line: Vec<[f32; 3]> = (0..100_u8).map(|x| [f32::from(x) + 0.5, 0.5, 0.5]).collect();
    stage.take(&cloud(1, "map", &line));
    assert_eq!(stage.publish_on_request().unwrap(), "published the map of 100 points");
    let own = std::fs::read_dir(folder.path()).unwrap().next().unwrap().unwrap().path();
    let tile = own.join("0_0_0.tile");
    let bytes = std::fs::read(&tile).unwrap();
    std::fs::remove_file(&tile).unwrap();
    // A folder is no file, and is there.
    std::fs::create_dir(&tile).unwrap();
    let error = stage.publish_on_request().unwrap_err().to_string();
    assert!(error.contains("not whole") && error.contains("(0, 0, 0)"), "{error}");
    assert_eq!(stage.map.len(), 100);
    let due = stage.schedule.look(Instant::now() + LOOK_AGAIN, Subscribers { map: 1, updates: 0 });
    assert!(!due.map, "not again at once");
    std::fs::remove_dir(&tile).unwrap();
    std::fs::write(&tile, bytes).unwrap();
    assert_eq!(stage.publish_on_request().unwrap(), "published the map of 100 points");
    drop(stage);
    node.close().await;
}

#[test]
fn a_period_is_positive() {
    for seconds in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let error = period("map_publish_period_s", seconds).unwrap_err().to_string();
        assert!(error.contains("map_publish_period_s"), "{error}");
    }
    assert_eq!(period("map_update_period_s", 0.5).unwrap(), Duration::from_millis(500));
}
