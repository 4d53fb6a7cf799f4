//! Follows a simulated drive with traffic, and says how far it drifts:
//!
//! ```text
//! cargo run --release -p lidar-odometry --example simulated_drive -- [model=hdl64e] [seconds=40] [traffic=5] [threads=2]
//!     [way=map|scan] [truth=FILE] [estimate=FILE]
//! ```
//!
//! The files hold poses of KITTI's format, for `stillmap eval trajectory`. The drift is the mean over all stretches of 100 m
//! (Geiger et al. 2012, section 3.2).
// An example prints, and may stop where it stands.
#![allow(clippy::print_stdout, clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::num::NonZeroUsize;
use std::time::Instant;

use geometry::Stamp;
use lidar_odometry::odometry::{Guess, LidarOdometry, LidarOdometryConfig, LidarScan, ScanToScan};
use lidar_odometry::registration::{PreparationConfig, RegistrationConfig};
use nalgebra::{Isometry3, Point3};
use simulator::{
    Body, Figure, Material, MovingObject, Path, Sample, Scenario, VelodyneModel, VelodyneTurn,
};

/// Stretches are so long.
const STRETCH_M: f64 = 100.0;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let option = |name: &str| {
        arguments.iter().find_map(|argument| argument.strip_prefix(name)?.strip_prefix('='))
    };
    let number = |name, default: f64| option(name).map_or(default, |value| value.parse().unwrap());
    let model = match option("model") {
        None | Some("hdl64e") => VelodyneModel::Hdl64e,
        Some("hdl32e") => VelodyneModel::Hdl32e,
        Some("vlp16") => VelodyneModel::Vlp16,
        Some(other) => panic!("there is no model {other}"),
    };
    let threads = NonZeroUsize::new(number("threads", 2.0) as usize).expect("at least one thread");
    let mut scenario = Scenario::road(model, number("seed", 1.0) as u64);
    let seconds = number("seconds", scenario.duration_s);
    scenario.scene.objects = traffic(&scenario.rig.path, number("traffic", 5.0) as u16);
    let scenario = scenario.with_duration_s(seconds);
    let mut config = LidarOdometryConfig::default();
    config.preparation.voxel_edge_m = number("voxel_edge_m", config.preparation.voxel_edge_m);
    config.preparation.neighbours =
        number("neighbours", config.preparation.neighbours as f64) as usize;
    config.map_voxel_edge_m = number("map_voxel_edge_m", config.map_voxel_edge_m);
    config.map_memory_points = number("memory", f64::from(config.map_memory_points)) as u32;
    let mut onto_map = LidarOdometry::new(config, threads).unwrap();
    let mut onto_scan = ScanToScan::new(
        PreparationConfig::default(),
        RegistrationConfig::default(),
        Guess::PreviousMotion,
        threads,
    );
    let (mut truth, mut estimate, mut times_ms) = (Vec::new(), Vec::new(), Vec::new());
    for sample in scenario.samples().unwrap().on_threads(threads) {
        let Sample::Velodyne(turn) = sample else { continue };
        let (points_m, times_s) = points_of(&turn);
        let start = Instant::now();
        let (stamp, pose) = if option("way") == Some("scan") {
            (turn.stamp, onto_scan.step(&points_m).unwrap().0)
        } else {
            let scan =
                LidarScan { stamp: turn.stamp, points_m: &points_m, times_s: Some(&times_s) };
            let pose = onto_map.step(&scan).unwrap();
            if option("verbose").is_some() {
                eprintln!("{:?}", pose.quality);
            }
            (pose.stamp, pose.odom_from_lidar)
        };
        times_ms.push(1e3 * start.elapsed().as_secs_f64());
        let since_s = stamp.seconds_since(Stamp::default());
        truth.push(scenario.rig.path.pose_at(since_s - scenario_start_s(&scenario)));
        estimate.push(pose);
    }
    let origin = truth[0].inverse();
    truth.iter_mut().for_each(|pose| *pose = origin * *pose);
    for (name, poses) in [("truth", &truth), ("estimate", &estimate)] {
        if let Some(path) = option(name) {
            std::fs::write(path, kitti_lines(poses)).unwrap();
        }
    }
    times_ms.sort_by(f64::total_cmp);
    let errors_m: Vec<f64> = truth
        .iter()
        .zip(&estimate)
        .map(|(truth, estimate)| (truth.translation.vector - estimate.translation.vector).norm())
        .collect();
    let (drift_percent, turn_deg) = drift(&truth, &estimate);
    println!(
        "{} scans; drift over {STRETCH_M} m: {drift_percent:.3} %, {turn_deg:.4} degrees; farthest off {:.3} m, at the end {:.3} m; \
         median {:.1} ms, most {:.1} ms",
        truth.len(),
        errors_m.iter().copied().fold(0.0, f64::max),
        errors_m[errors_m.len() - 1],
        times_ms[times_ms.len() / 2],
        times_ms[times_ms.len() - 1],
    );
}

fn scenario_start_s(scenario: &Scenario) -> f64 {
    scenario.start.seconds_since(Stamp::default())
}

/// Cars that come the other way, and every fifth drives ahead.
fn traffic(way: &Path, cars: u16) -> Vec<MovingObject> {
    (1..=cars)
        .map(|id| {
            let ahead = id % 5 == 1;
            let mut path = way.clone();
            let end_s = way.end_s();
            for waypoint in &mut path.waypoints {
                let [x_m, y_m, _, yaw_rad, _, _] = waypoint.pose;
                if ahead {
                    // A second and a half ahead of us.
                    waypoint.time_s -= 1.5;
                    waypoint.pose = [x_m, y_m, 0.0, yaw_rad, 0.0, 0.0];
                } else {
                    // On the other lane, the other way, one after another.
                    waypoint.time_s = end_s - waypoint.time_s + 3.0 * f64::from(id) - 9.0;
                    let (sin, cos) = yaw_rad.sin_cos();
                    let there = yaw_rad + std::f64::consts::PI;
                    waypoint.pose = [x_m - 3.4 * sin, y_m + 3.4 * cos, 0.0, there, 0.0, 0.0];
                }
            }
            if !ahead {
                path.waypoints.reverse();
            }
            let paint = Material::matt(0.5);
            let body = Body::cuboid("body", [-2.1, -0.9, 0.3], [2.1, 0.9, 0.9], paint);
            let cabin = Body::cuboid("cabin", [-1.5, -0.8, 0.9], [0.8, 0.8, 1.5], paint);
            let figure = Figure::Rigid(vec![body, cabin]);
            MovingObject { id, name: format!("car {id}"), figure, path, label_span_s: None }
        })
        .collect()
}

fn points_of(turn: &VelodyneTurn) -> (Vec<Point3<f32>>, Vec<f32>) {
    let measured = turn.points.iter().filter(|point| point.is_measured());
    measured.map(|point| (Point3::from(point.position_m), point.time_s)).unzip()
}

fn kitti_lines(poses: &[Isometry3<f64>]) -> String {
    let line = |pose: &Isometry3<f64>| {
        let matrix = pose.to_homogeneous();
        (0..12).map(|at| matrix[(at / 4, at % 4)].to_string()).collect::<Vec<_>>().join(" ") + "\n"
    };
    poses.iter().map(line).collect()
}

/// The mean over all stretches, in percent and in degrees.
fn drift(truth: &[Isometry3<f64>], estimate: &[Isometry3<f64>]) -> (f64, f64) {
    let mut way_m = vec![0.0];
    for pair in truth.windows(2) {
        let step_m = (pair[1].translation.vector - pair[0].translation.vector).norm();
        way_m.push(way_m[way_m.len() - 1] + step_m);
    }
    let mut sums = (0.0, 0.0, 0.0);
    for from in 0..truth.len() {
        let to = way_m.partition_point(|at_m| *at_m <= way_m[from] + STRETCH_M);
        if to == truth.len() {
            break;
        }
        let expected = truth[from].inv_mul(&truth[to]);
        let error = expected.inv_mul(&estimate[from].inv_mul(&estimate[to]));
        sums.0 += error.translation.vector.norm();
        sums.1 += error.rotation.angle().to_degrees();
        sums.2 += 1.0;
    }
    (100.0 * sums.0 / sums.2 / STRETCH_M, sums.1 / sums.2)
}
