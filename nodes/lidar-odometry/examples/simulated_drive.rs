//! Runs several odometry methods on a simulated drive with traffic at once, and prints the drift of each:
//!
//! ```text
//! cargo run --release -p lidar-odometry --example simulated_drive -- [model=hdl64e] [seconds=40] [traffic=5] [threads=2]
//!     [road=short|long] [seed=1] [methods=map,scan,...] [poses=FOLDER] [loops=inline|background]
//! ```
//!
//! Methods: `map` is the odometry; `scan` the thesis' GICP from scan to scan with the guess of the previous motion, `standing` without
//! it; `intensity` with the filter of the road's intensity, `rays` without the lowest rays, `ground` without the ground, all three from
//! scan to scan; `map_ground`, `map_intensity` the odometry with these. The folder gets poses of KITTI's format, of the truth and of
//! each method. With `loops` each method is printed a second time, with its loops closed; the times of scans then include the search for
//! loops. The drift is the mean over stretches of 100, 200 ... 800 m that begin every tenth scan (Geiger et al. 2012, section
//! 3.2, and the benchmark's page); `long` is a round of 2 km. With `real_time=true` scans come as the scanner turns.
// An example prints, and may stop where it stands.
#![allow(clippy::print_stdout, clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::num::NonZeroUsize;
use std::sync::Arc;
use std::time::Instant;

use estimation::{Executor, ScopedThreads, Serial};
use geometry::{LidarCloud, Stamp};
use lidar_odometry::loop_closing::{
    InlineSearch, LoopCloser, LoopClosingConfig, LoopOutcome, LoopSearch, Place,
};
use lidar_odometry::odometry::{
    Follower, FollowerConfig, Guess, LidarPose, MotionHint, OdometryMethod, deskewed_cloud,
};
use lidar_odometry::selection::{GroundFilter, PointChoice, RayFilter, RoadIntensityFilter};
use lidar_odometry::shell::BackgroundSearch;
use nalgebra::{Isometry3, Point3};
use simulator::{
    Body, Figure, Material, MovingObject, Path, Sample, Scenario, VelodyneModel, VelodyneTurn,
};

/// Stretches are this long ...
const STRETCHES_M: [f64; 8] = [100.0, 200.0, 300.0, 400.0, 500.0, 600.0, 700.0, 800.0];
/// ... and begin this many scans after one another.
const STRETCH_STEP: usize = 10;

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
    let executor: Arc<dyn Executor> = Arc::new(ScopedThreads::new(threads));
    let seed = number("seed", 1.0) as u64;
    let mut scenario = match option("road") {
        Some("long") => Scenario::long_road(model, seed),
        _ => Scenario::road(model, seed),
    };
    let seconds = number("seconds", scenario.duration_s);
    scenario.scene.objects = traffic(&scenario.rig.path, number("traffic", 5.0) as u16);
    let scenario = scenario.with_duration_s(seconds);
    let mut runs: Vec<Run> = option("methods")
        .unwrap_or("map")
        .split(',')
        .map(|name| Run::new(name, model, &executor, option("loops")))
        .collect();
    let turns: Box<dyn Iterator<Item = Sample>> =
        Box::new(scenario.samples().unwrap().with_executor(Arc::clone(&executor)));
    let clouds = turns.filter_map(|sample| match sample {
        Sample::Velodyne(turn) => Some(cloud_of(&turn)),
        _ => None,
    });
    // In real time all are made before, so that nothing else takes time.
    let is_real_time = option("real_time").is_some();
    let clouds: Box<dyn Iterator<Item = LidarCloud>> = if is_real_time {
        Box::new(clouds.collect::<Vec<_>>().into_iter())
    } else {
        Box::new(clouds)
    };
    let period = std::time::Duration::from_millis(100);
    let begin = Instant::now();
    for (number, cloud) in (0_u32..).zip(clouds) {
        if is_real_time {
            std::thread::sleep((number * period).saturating_sub(begin.elapsed()));
        }
        for run in &mut runs {
            run.step(&cloud, &scenario);
        }
    }
    for run in &mut runs {
        run.end();
        run.print();
        if let Some(with_loops) = run.with_loops() {
            with_loops.print();
        }
    }
    if let Some(folder) = option("poses") {
        std::fs::create_dir_all(folder).unwrap();
        let file = |name: &str| format!("{folder}/{name}.txt");
        for run in &runs {
            let (truth, estimate) = run.both_from_first();
            std::fs::write(file("truth"), kitti_lines(&truth)).unwrap();
            std::fs::write(file(&run.name), kitti_lines(&estimate)).unwrap();
        }
    }
}

/// One of the methods.
struct Run {
    name: String,
    follower: Follower,
    truth: Vec<Isometry3<f64>>,
    estimate: Vec<Isometry3<f64>>,
    times_ms: Vec<f64>,
    failures: usize,
    stamps: Vec<Stamp>,
    loops: Option<Box<dyn LoopSearch>>,
}

impl Run {
    fn new(
        name: &str,
        model: VelodyneModel,
        executor: &Arc<dyn Executor>,
        loops: Option<&str>,
    ) -> Self {
        // The thesis leaves 14 of 32 rays.
        let lowest_left_out = match model {
            VelodyneModel::Hdl64e => 36,
            VelodyneModel::Hdl32e => 18,
            _ => 9,
        };
        let rays = PointChoice::Rays(RayFilter { lowest_left_out, every: 1 });
        let road = PointChoice::NotRoadIntensity(RoadIntensityFilter::default());
        let ground = PointChoice::NotGround(GroundFilter::default());
        let (method, guess, points) = match name {
            "map" => (OdometryMethod::LocalMap, Guess::PreviousMotion, PointChoice::All),
            "map_ground" => (OdometryMethod::LocalMap, Guess::PreviousMotion, ground),
            "map_intensity" => (OdometryMethod::LocalMap, Guess::PreviousMotion, road),
            "scan" => (OdometryMethod::ScanToScan, Guess::PreviousMotion, PointChoice::All),
            "standing" => (OdometryMethod::ScanToScan, Guess::Standing, PointChoice::All),
            "intensity" => (OdometryMethod::ScanToScan, Guess::PreviousMotion, road),
            "rays" => (OdometryMethod::ScanToScan, Guess::PreviousMotion, rays),
            "ground" => (OdometryMethod::ScanToScan, Guess::PreviousMotion, ground),
            other => panic!("there is no method {other}"),
        };
        let config = FollowerConfig { method, guess, points, ..FollowerConfig::default() };
        Self {
            name: name.to_owned(),
            follower: Follower::new(config, Arc::clone(executor)).unwrap(),
            truth: Vec::new(),
            estimate: Vec::new(),
            times_ms: Vec::new(),
            failures: 0,
            stamps: Vec::new(),
            loops: loops.map(|how| search(how, executor)),
        }
    }

    fn step(&mut self, cloud: &LidarCloud, scenario: &Scenario) {
        let start = Instant::now();
        let pose = self.follower.step(cloud, &MotionHint::default());
        if let Ok(pose) = &pose {
            self.look_for_a_loop(cloud, pose);
        }
        self.times_ms.push(1e3 * start.elapsed().as_secs_f64());
        let Ok(pose) = pose else {
            self.failures += 1;
            return;
        };
        self.failures += usize::from(pose.quality.trouble().is_some());
        let since_s = pose.stamp.seconds_since(Stamp::default());
        self.stamps.push(pose.stamp);
        self.truth.push(scenario.rig.path.pose_at(since_s - scenario_start_s(scenario)));
        self.estimate.push(pose.odom_from_lidar);
    }

    fn look_for_a_loop(&mut self, cloud: &LidarCloud, pose: &LidarPose) {
        let Some(loops) = &mut self.loops else { return };
        if loops.wants(&pose.odom_from_lidar) {
            let points_m = match (self.stamps.last(), self.estimate.last()) {
                (Some(stamp), Some(last)) => {
                    let motion = last.inv_mul(&pose.odom_from_lidar);
                    deskewed_cloud(cloud, &motion, pose.stamp.seconds_since(*stamp))
                }
                _ => cloud.points_m.clone(),
            };
            let odom_from_vehicle = pose.odom_from_lidar;
            loops.take(Place { stamp: pose.stamp, odom_from_vehicle, points_m });
        }
        for answer in loops.answers() {
            if !matches!(answer.outcome, LoopOutcome::NewPlace) {
                eprintln!("{} at scan {}: {:?}", self.name, self.truth.len(), answer.outcome);
            }
        }
    }

    /// Waits for the pending searches.
    fn end(&mut self) {
        let Some(loops) = &mut self.loops else { return };
        while !loops.is_idle() {
            std::thread::sleep(std::time::Duration::from_millis(1));
        }
        loops.answers();
    }

    /// The same drive, its loops closed.
    fn with_loops(&self) -> Option<Self> {
        let loops = self.loops.as_ref()?.known();
        let poses = self.stamps.iter().zip(&self.estimate);
        Some(Self {
            name: format!("{} + {} loops", self.name, loops.closed),
            follower: self.follower.clone(),
            truth: self.truth.clone(),
            estimate: poses.map(|(stamp, pose)| loops.map_from_vehicle(*stamp, pose)).collect(),
            times_ms: self.times_ms.clone(),
            failures: self.failures,
            stamps: Vec::new(),
            loops: None,
        })
    }

    /// Both from the first pose.
    fn both_from_first(&self) -> (Vec<Isometry3<f64>>, Vec<Isometry3<f64>>) {
        let from = |poses: &[Isometry3<f64>]| {
            let first = poses[0].inverse();
            poses.iter().map(|pose| first * pose).collect()
        };
        (from(&self.truth), from(&self.estimate))
    }

    fn print(&self) {
        let (truth, estimate) = self.both_from_first();
        let mut times_ms = self.times_ms.clone();
        times_ms.sort_by(f64::total_cmp);
        let off_m: Vec<nalgebra::Vector3<f64>> = truth
            .iter()
            .zip(&estimate)
            .map(|(truth, estimate)| estimate.translation.vector - truth.translation.vector)
            .collect();
        let rms_m = |of: fn(&nalgebra::Vector3<f64>) -> f64| {
            (off_m.iter().map(|off_m| of(off_m).powi(2)).sum::<f64>() / off_m.len() as f64).sqrt()
        };
        let (drift_percent, turn_deg) = drift(&truth, &estimate);
        println!(
            "{:>13}: {} scans, {} in trouble; drift {drift_percent:.3} %, {turn_deg:.3} degrees/100 m; RMS 2D {:.3} m, 3D {:.3} m; \
             end {:.3} m off, {:.3} of it up; median {:.1} ms, most {:.1} ms",
            self.name,
            truth.len(),
            self.failures,
            rms_m(|off| off.xy().norm()),
            rms_m(|off| off.norm()),
            off_m[off_m.len() - 1].norm(),
            off_m[off_m.len() - 1].z,
            times_ms[times_ms.len() / 2],
            times_ms[times_ms.len() - 1],
        );
    }
}

fn search(how: &str, executor: &Arc<dyn Executor>) -> Box<dyn LoopSearch> {
    let config = LoopClosingConfig::default();
    match how {
        "inline" => Box::new(InlineSearch::new(config, Arc::clone(executor)).unwrap()),
        "background" => {
            let closer = LoopCloser::new(config, Arc::new(Serial)).unwrap();
            Box::new(BackgroundSearch::new(closer).unwrap())
        }
        other => panic!("loops are closed inline or in the background, not {other}"),
    }
}

fn scenario_start_s(scenario: &Scenario) -> f64 {
    scenario.start.seconds_since(Stamp::default())
}

/// Cars of the oncoming traffic, and every fifth drives ahead.
fn traffic(road: &Path, cars: u16) -> Vec<MovingObject> {
    (1..=cars)
        .map(|id| {
            let ahead = id % 5 == 1;
            let mut path = road.clone();
            let end_s = road.end_s();
            for waypoint in &mut path.waypoints {
                let [x_m, y_m, _, yaw_rad, _, _] = waypoint.pose;
                if ahead {
                    // A second and a half ahead of us.
                    waypoint.time_s -= 1.5;
                    waypoint.pose = [x_m, y_m, 0.0, yaw_rad, 0.0, 0.0];
                } else {
                    // On the other lane, in the opposite direction, one after another.
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

fn cloud_of(turn: &VelodyneTurn) -> LidarCloud {
    let measured = || turn.points.iter().filter(|point| point.is_measured());
    LidarCloud {
        stamp: turn.stamp,
        frame_id: turn.frame_id.clone(),
        points_m: measured().map(|point| Point3::from(point.position_m)).collect(),
        intensities: Some(measured().map(|point| point.intensity).collect()),
        rings: Some(measured().map(|point| point.ring).collect()),
        times_s: Some(measured().map(|point| point.time_s).collect()),
    }
}

fn kitti_lines(poses: &[Isometry3<f64>]) -> String {
    let line = |pose: &Isometry3<f64>| {
        let matrix = pose.to_homogeneous();
        (0..12).map(|at| matrix[(at / 4, at % 4)].to_string()).collect::<Vec<_>>().join(" ") + "\n"
    };
    poses.iter().map(line).collect()
}

/// The mean over all stretches, in percent and in degrees over 100 m.
fn drift(truth: &[Isometry3<f64>], estimate: &[Isometry3<f64>]) -> (f64, f64) {
    let mut travelled_m = vec![0.0];
    for pair in truth.windows(2) {
        let step_m = (pair[1].translation.vector - pair[0].translation.vector).norm();
        travelled_m.push(travelled_m[travelled_m.len() - 1] + step_m);
    }
    let mut sums = (0.0, 0.0, 0.0);
    for length_m in STRETCHES_M {
        for from in (0..truth.len()).step_by(STRETCH_STEP) {
            let to = travelled_m.partition_point(|at_m| *at_m <= travelled_m[from] + length_m);
            if to == truth.len() {
                break;
            }
            let expected = truth[from].inv_mul(&truth[to]);
            let error = expected.inv_mul(&estimate[from].inv_mul(&estimate[to]));
            sums.0 += error.translation.vector.norm() / length_m;
            sums.1 += error.rotation.angle().to_degrees() / length_m;
            sums.2 += 1.0;
        }
    }
    (100.0 * sums.0 / sums.2, 100.0 * sums.1 / sums.2)
}
