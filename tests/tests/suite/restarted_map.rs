//! The service is stopped, started and killed: its map grows on.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::time::Duration;

use free_domain::FreeDomain;
use geometry::{VoxelGrid, VoxelKey, ply};
use msgs::convert;
use msgs::sensor_msgs::PointCloud2;
use msgs::stillmap_msgs::StageReport;
use nalgebra::Point3;
use node_shell::{Node, Qos, RosArguments, Transport};
use rustix::process::Signal;
use tokio::time::timeout;

use crate::bags::small_room;
use crate::program::Running;

/// Longer than anything here takes on a busy machine; reached only by a fault.
const PATIENCE: Duration = Duration::from_secs(60);
/// What has not come yet is looked for again after so long.
const LOOK_AGAIN: Duration = Duration::from_millis(50);
/// So many cycles make a map.
const CYCLES: usize = 20;

/// The service as it is shipped, in a folder of its own on a domain of its own.
struct Service {
    folder: tempfile::TempDir,
    domain: FreeDomain,
}

impl Service {
    fn new() -> Self {
        Self { folder: tempfile::tempdir().unwrap(), domain: FreeDomain::new() }
    }

    fn start(&self) -> Running {
        let unit = Path::new(env!("CARGO_MANIFEST_DIR")).join("../config/systemd/stillmap.service");
        let unit = std::fs::read_to_string(unit).unwrap();
        let command = unit.lines().find_map(|line| line.strip_prefix("ExecStart=")).unwrap();
        let words = command.split(' ').skip(1);
        // A map that is saved more often, so that the test need not wait for half a minute.
        let often = ["-p", "reconstruction:map_save_period_s:=0.3"];
        Running::start_in(self.folder.path(), self.domain.number(), words.chain(often))
    }

    fn node(&self, name: &str) -> Node {
        let arguments = RosArguments::parse(["x"]).unwrap();
        Node::start_on(Transport::on_domain(self.domain.number()).unwrap(), name, &arguments)
            .unwrap()
    }

    /// The robot drives until so many cycles have become a part of the map.
    async fn drive(&self, bag: &Path) {
        let node = self.node("ear");
        let reports =
            node.subscription::<StageReport>("reconstruction/report", &Qos::reliable(200)).unwrap();
        timeout(PATIENCE, reports.wait_for_publishers(1)).await.unwrap();
        let player = Running::start_on(
            self.domain.number(),
            ["play", bag.to_str().unwrap(), "--wait-for=/scan,/pose,/camera/depth/image_raw"],
        );
        let mut cycles = 0;
        while cycles < CYCLES {
            let report = timeout(PATIENCE, reports.next()).await.unwrap().message;
            cycles += usize::from(report.processed);
        }
        drop(player);
        drop(reports);
        node.close().await;
    }

    /// The map that a newcomer is shown.
    async fn shown(&self) -> Vec<Point3<f32>> {
        let node = self.node("viewer");
        let maps = node.subscription::<PointCloud2>("static_map", &Qos::latched()).unwrap();
        let map = timeout(PATIENCE, maps.next()).await.unwrap().message;
        drop(maps);
        node.close().await;
        convert::cloud_from_message(&map).unwrap().points_m
    }

    fn map(&self) -> PathBuf {
        self.folder.path().join("map.ply")
    }

    fn bytes(&self) -> Vec<u8> {
        std::fs::read(self.map()).unwrap()
    }

    /// What is beside the map.
    fn others(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.folder.path()).unwrap();
        let names = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap());
        names.filter(|name| name != "map.ply").collect()
    }
}

fn points(bytes: &[u8]) -> Vec<Point3<f32>> {
    ply::decode(bytes).unwrap()
}

/// A map of surfaces is made anew of its points: nine of ten are within 2 cm of one that is shown, and the other way round.
fn assert_is_shown(shown: &[Point3<f32>], saved: &[Point3<f32>]) {
    let near = |of: &[Point3<f32>], to: &[Point3<f32>]| {
        let grid = VoxelGrid::new(0.02).unwrap();
        let mut cells = BTreeMap::<VoxelKey, Vec<Point3<f32>>>::new();
        to.iter().for_each(|point| cells.entry(grid.key(point)).or_default().push(*point));
        let is_near = |point: &&Point3<f32>| {
            let around = grid.key(point).with_neighbours().filter_map(|key| cells.get(&key));
            around.flatten().any(|other| (other - **point).norm() <= 0.02)
        };
        of.iter().filter(is_near).count() as f64 / of.len() as f64
    };
    let shares = [near(saved, shown), near(shown, saved)];
    println!("{} points shown, {} saved: within 2 cm are {shares:.3?}", shown.len(), saved.len());
    assert!(shares.iter().all(|share| *share > 0.9), "{shares:.3?}");
}

fn voxels(points_m: &[Point3<f32>]) -> BTreeSet<VoxelKey> {
    let grid = VoxelGrid::new(0.08).unwrap();
    points_m.iter().map(|point| grid.key(point)).collect()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_service_as_shipped_goes_on_with_its_map_after_each_end() {
    let bags = tempfile::tempdir().unwrap();
    let bag = small_room(bags.path());
    let service = Service::new();

    let running = service.start();
    service.drive(&bag).await;
    assert!(running.end(Signal::TERM).success());
    let first = service.bytes();
    let count = points(&first).len();
    assert!(count > 100, "{count}");
    assert_eq!(service.others(), Vec::<String>::new());

    // No sensor is connected: the map is there, and stays.
    let running = service.start();
    assert_is_shown(&service.shown().await, &points(&first));
    assert!(running.end(Signal::TERM).success());
    assert!(service.bytes() == first);
    assert_eq!(service.others(), Vec::<String>::new());

    // It is killed once it has saved what it has added.
    let running = service.start();
    service.drive(&bag).await;
    let saved = async {
        while service.bytes() == first {
            tokio::time::sleep(LOOK_AGAIN).await;
        }
    };
    timeout(PATIENCE, saved).await.expect("the map is saved while the service runs");
    running.kill();
    let killed = service.bytes();
    let (before, after) = (voxels(&points(&first)), voxels(&points(&killed)));
    let lost = before.difference(&after).count();
    println!("{} voxels, then {}: {lost} of the former were cleared", before.len(), after.len());
    assert!(lost * 20 < before.len(), "{lost} of {}", before.len());
    assert!(std::fs::read(service.folder.path().join("map.version-1.ply")).unwrap() == first);

    let running = service.start();
    assert_is_shown(&service.shown().await, &points(&killed));
    assert!(running.end(Signal::TERM).success());
    assert!(service.bytes() == killed);
}
