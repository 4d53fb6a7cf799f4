//! Follows a sequence of scans and prints a pose of KITTI's format a line (12 numbers), and to stderr how long it took:
//!
//! ```text
//! cargo run --release -p lidar-odometry --example follow_scans -- SCAN.bin ... [threads=2] [method=map|scan]
//! ```
//!
//! Scans are files of KITTI: x, y, z and intensity as 32-bit floats, measured at once (its scans are deskewed).
// An example prints, and may stop where it stands.
#![allow(clippy::print_stdout, clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::num::NonZeroUsize;
use std::sync::Arc;
use std::time::Instant;

use estimation::{Executor, ScopedThreads};
use geometry::Stamp;
use lidar_odometry::odometry::{Guess, LidarOdometry, LidarOdometryConfig, LidarScan, ScanToScan};
use lidar_odometry::registration::{PreparationConfig, RegistrationConfig};
use nalgebra::{Isometry3, Point3};

/// KITTI's scanner turns ten times a second.
const PERIOD_S: f64 = 0.1;

fn main() {
    let (options, paths): (Vec<String>, Vec<String>) =
        std::env::args().skip(1).partition(|argument| argument.contains('='));
    let option =
        |name: &str| options.iter().find_map(|option| option.strip_prefix(name)?.strip_prefix('='));
    let threads = option("threads").map_or(1, |value| value.parse().unwrap());
    let threads = NonZeroUsize::new(threads).expect("at least one thread");
    let executor: Arc<dyn Executor> = Arc::new(ScopedThreads::new(threads));
    let mut config = LidarOdometryConfig::default();
    if let Some(edge_m) = option("voxel_edge_m") {
        config.preparation.voxel_edge_m = edge_m.parse().unwrap();
    }
    if let Some(edge_m) = option("map_voxel_edge_m") {
        config.map_voxel_edge_m = edge_m.parse().unwrap();
    }
    let mut onto_map = LidarOdometry::new(config, Arc::clone(&executor)).unwrap();
    let mut onto_scan = ScanToScan::new(
        PreparationConfig::default(),
        RegistrationConfig::default(),
        Guess::PreviousMotion,
        executor,
    );
    let mut times_ms = Vec::new();
    for (number, path) in paths.iter().enumerate() {
        let points_m = points(path);
        let start = Instant::now();
        let pose: Isometry3<f64> = if option("method") == Some("scan") {
            onto_scan.step(&points_m).unwrap().0
        } else {
            let stamp = Stamp::default().plus_seconds(number as f64 * PERIOD_S);
            let pose =
                onto_map.step(&LidarScan { stamp, points_m: &points_m, times_s: None }).unwrap();
            eprintln!("{:?}", pose.quality);
            pose.odom_from_lidar
        };
        times_ms.push(1e3 * start.elapsed().as_secs_f64());
        let matrix = pose.to_homogeneous();
        let numbers: Vec<String> = (0..12).map(|at| matrix[(at / 4, at % 4)].to_string()).collect();
        println!("{}", numbers.join(" "));
    }
    times_ms.sort_by(f64::total_cmp);
    eprintln!(
        "median {:.1} ms, most {:.1} ms",
        times_ms[times_ms.len() / 2],
        times_ms[times_ms.len() - 1]
    );
}

fn points(path: &str) -> Vec<Point3<f32>> {
    let bytes = std::fs::read(path).unwrap_or_else(|error| panic!("{path}: {error}"));
    let floats: Vec<f32> =
        bytes.chunks_exact(4).map(|four| f32::from_le_bytes(four.try_into().unwrap())).collect();
    floats.chunks_exact(4).map(|point| Point3::new(point[0], point[1], point[2])).collect()
}
