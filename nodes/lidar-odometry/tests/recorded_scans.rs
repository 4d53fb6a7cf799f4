//! Recorded scans of an HDL-64E, where they are there (`../shared/data` beside the repository).
// A test may stop where it stands, and says what it measured.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

use std::path::{Path, PathBuf};
use std::sync::Arc;

use estimation::Serial;
use geometry::Stamp;
use lidar_odometry::odometry::{LidarOdometry, LidarOdometryConfig, LidarScan, Outcome};
use lidar_odometry::registration::{
    PreparationConfig, PreparedCloud, RegistrationConfig, register,
};
use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};

fn recording(name: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data").join(name);
    if !path.exists() {
        println!("skipped: {name} is not there");
        return None;
    }
    Some(path)
}

/// x, y, z and intensity as 32-bit floats.
fn points(path: &Path) -> Vec<Point3<f32>> {
    let bytes = std::fs::read(path).unwrap();
    let floats: Vec<f32> =
        bytes.chunks_exact(4).map(|four| f32::from_le_bytes(four.try_into().unwrap())).collect();
    floats.chunks_exact(4).map(|point| Point3::new(point[0], point[1], point[2])).collect()
}

fn prepared(points_m: &[Point3<f32>]) -> PreparedCloud {
    PreparedCloud::new(points_m, &PreparationConfig::default(), &Serial).unwrap()
}

fn registered(
    source: &[Point3<f32>],
    target: &[Point3<f32>],
    guess: &Isometry3<f64>,
) -> Isometry3<f64> {
    let config = RegistrationConfig::default();
    let found = register(&prepared(source), &prepared(target), guess, &config, &Serial).unwrap();
    assert!(found.converged && found.observability.estimated() == 6 && found.overlap > 0.9);
    found.target_from_source
}

/// The twelve numbers of each line, after what it is called.
fn matrices(path: &Path) -> Vec<Isometry3<f64>> {
    let text = std::fs::read_to_string(path).unwrap();
    text.lines()
        .map(|line| {
            let numbers: Vec<f64> =
                line.split_whitespace().filter_map(|word| word.parse().ok()).collect();
            let n = &numbers[numbers.len() - 12..];
            let rotation = Matrix3::new(n[0], n[1], n[2], n[4], n[5], n[6], n[8], n[9], n[10]);
            // Six digits are no rotation yet.
            let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix(&rotation));
            Isometry3::from_parts(Translation3::new(n[3], n[7], n[11]), rotation)
        })
        .collect()
}

#[test]
fn kittis_pair_lies_where_its_truth_says() {
    let Some(folder) = recording("kitti-odometry") else { return };
    let [target, source] = ["000094", "000095"]
        .map(|name| points(&folder.join(format!("sequences/00/velodyne/{name}.bin"))));
    let poses = matrices(&folder.join("poses/00.txt"));
    let camera_from_lidar = matrices(&folder.join("sequences/00/calib_Tr_only.txt"))[0];
    let lidar = |frame: usize| poses[frame] * camera_from_lidar;
    let truth = lidar(94).inv_mul(&lidar(95));
    let between = truth.inv_mul(&registered(&source, &target, &Isometry3::identity()));
    let (metres, degrees) =
        (between.translation.vector.norm(), between.rotation.angle().to_degrees());
    println!("{metres:.4} m, {degrees:.4} degrees");
    assert!(metres < 0.01 && degrees < 0.05, "{metres} m, {degrees} degrees");
}

#[test]
fn twelve_scans_end_where_the_last_lies_to_the_first() {
    let Some(folder) = recording("kitti360-50") else { return };
    let scans: Vec<Vec<Point3<f32>>> = (3000..3012)
        .map(|number| points(&folder.join(format!("velodyne/{number:010}.bin"))))
        .collect();
    let mut odometry =
        LidarOdometry::new(LidarOdometryConfig::default(), Arc::new(Serial)).unwrap();
    let mut end = Isometry3::identity();
    for (number, points_m) in scans.iter().enumerate() {
        let stamp = Stamp::default().plus_seconds(0.1 * number as f64);
        let pose = odometry.step(&LidarScan { stamp, points_m, times_s: None }).unwrap();
        assert_eq!(pose.quality.outcome == Outcome::Matched, number > 0);
        end = pose.odom_from_lidar;
    }
    // The last onto the first: no drift is in that.
    let direct = registered(&scans[11], &scans[0], &end);
    let off_m = (end.translation.vector - direct.translation.vector).norm();
    println!("off {off_m:.4} m of {:.2} m", direct.translation.vector.norm());
    assert!(off_m < 0.005 * direct.translation.vector.norm(), "{off_m} m");
    // The result of KISS-ICP 1.3.0 on the same scans.
    let kiss_icp = Vector3::new(11.207, -0.298, 0.081);
    let apart_m = (end.translation.vector - kiss_icp).norm();
    println!("{apart_m:.4} m from KISS-ICP");
    assert!(apart_m < 0.01 * kiss_icp.norm(), "{apart_m} m");
}
