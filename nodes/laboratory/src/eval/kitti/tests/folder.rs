//! A folder with the layout of KITTI, of a simulated drive.

use std::path::{Path, PathBuf};

use clap::Parser;
use nalgebra::{Point3, UnitQuaternion, Vector3};
use simulator::{Sample, Scenario, VelodyneModel, VelodyneTurn};

use super::*;

/// A drive of some metres from a standstill.
const SECONDS: f64 = 2.0;
const SCANS: usize = 20;

#[derive(Parser)]
struct Line {
    #[command(flatten)]
    args: KittiArgs,
}

/// The pose of KITTI's camera in the scanner's frame: z forward, x right, y down, with a small offset.
fn camera_from_velodyne() -> Isometry3<f64> {
    let axes = nalgebra::Matrix3::new(0.0, -1.0, 0.0, 0.0, 0.0, -1.0, 1.0, 0.0, 0.0);
    let turn = UnitQuaternion::from_matrix(&axes);
    let tilt = UnitQuaternion::from_scaled_axis(Vector3::new(0.01, -0.02, 0.005));
    Isometry3::from_parts(Vector3::new(-0.01, -0.06, -0.29).into(), tilt * turn)
}

fn twelve(pose: &Isometry3<f64>) -> String {
    let matrix = pose.to_homogeneous();
    let numbers = (0..12).map(|at| format!("{:e}", matrix[(at / 4, at % 4)]));
    numbers.collect::<Vec<_>>().join(" ")
}

/// The revolution in KITTI's form: deskewed to its middle, in rows from the highest laser down.
fn bytes_of(
    turn: &VelodyneTurn,
    pose_at: &dyn Fn(f64) -> Isometry3<f64>,
    middle_s: f64,
) -> Vec<u8> {
    let scanner_from_map = pose_at(middle_s).inverse();
    let columns = turn.columns;
    let mut bytes = Vec::new();
    // The rows of the message are rings, the lowest first.
    for row in turn.points.chunks(columns).rev() {
        // KITTI's rows begin at the front and go counterclockwise.
        let mut row: Vec<_> = row.iter().filter(|point| point.is_measured()).collect();
        let azimuth = |point: &&simulator::VelodynePoint| {
            f64::from(point.position_m[1].atan2(point.position_m[0]))
                .rem_euclid(std::f64::consts::TAU)
        };
        row.sort_by(|a, b| azimuth(a).total_cmp(&azimuth(b)));
        for point in row {
            let since_s = middle_s - 0.05 + f64::from(point.time_s);
            let position_m = Point3::from(point.position_m).cast::<f64>();
            let position_m = scanner_from_map * pose_at(since_s) * position_m;
            for value in [position_m.x, position_m.y, position_m.z] {
                bytes.extend((value as f32).to_le_bytes());
            }
            bytes.extend((point.intensity / 255.0).to_le_bytes());
        }
    }
    bytes
}

/// Writes sequences/07 and poses/07.txt, and returns the folder of the sequence.
fn kitti_folder(folder: &Path) -> PathBuf {
    let scenario = Scenario::road(VelodyneModel::Vlp16, 1).with_duration_s(SECONDS);
    let sequence = folder.join("sequences/07");
    std::fs::create_dir_all(sequence.join("velodyne")).unwrap();
    std::fs::create_dir_all(folder.join("poses")).unwrap();
    let start = scenario.start;
    let pose_at = |since_s: f64| scenario.rig.path.pose_at(since_s);
    let camera_from_velodyne = camera_from_velodyne();
    let (mut times, mut poses, mut first) = (String::new(), String::new(), None);
    let turns = scenario.samples().unwrap().filter_map(|sample| match sample {
        Sample::Velodyne(turn) => Some(turn),
        _ => None,
    });
    for (number, turn) in turns.enumerate() {
        let middle_s = turn.stamp.seconds_since(start) + 0.05;
        let bytes = bytes_of(&turn, &pose_at, middle_s);
        std::fs::write(sequence.join(format!("velodyne/{number:06}.bin")), bytes).unwrap();
        let pose = pose_at(middle_s);
        let from_first = first.get_or_insert(pose).inv_mul(&pose);
        let camera = camera_from_velodyne * from_first * camera_from_velodyne.inverse();
        times += &format!("{middle_s:e}\n");
        poses += &(twelve(&camera) + "\n");
    }
    std::fs::write(sequence.join("times.txt"), times).unwrap();
    std::fs::write(folder.join("poses/07.txt"), poses).unwrap();
    let calib =
        format!("P0: {}\nTr: {}\n", twelve(&Isometry3::identity()), twelve(&camera_from_velodyne));
    std::fs::write(sequence.join("calib.txt"), calib).unwrap();
    sequence
}

#[test]
fn a_folder_laid_out_as_kitti_has_all_tables() {
    let folder = tempfile::tempdir().unwrap();
    let sequence = kitti_folder(folder.path());
    let given = folder.path().join("poses/07.txt");
    // Regression: of a given trajectory a copy was written, in the place of a file that was there.
    let out = folder.path().join("out");
    let before = out.join("07.txt.txt");
    std::fs::create_dir(&out).unwrap();
    std::fs::write(&before, "of another day").unwrap();
    let words = ["kitti".into(), sequence, "--estimate".into(), given, "--out".into(), out.clone()];
    let line = Line::parse_from(words.map(PathBuf::into_os_string));
    let evaluation = evaluated(&line.args).unwrap();
    assert_eq!(std::fs::read_to_string(before).unwrap(), "of another day");
    assert!(out.join("ours.txt").exists());
    assert_eq!((evaluation.scans, evaluation.true_poses), (SCANS, SCANS));
    assert!((3.0..20.0).contains(&evaluation.way_m), "{}", evaluation.way_m);
    let of = |name: &str| evaluation.figures.iter().find(|one| one.name == name).unwrap();
    // The ground truth is that of the scanner, whatever the camera's axes are.
    let ours = of("ours");
    assert_eq!((ours.poses, ours.troubles), (SCANS, 0));
    assert!(ours.rms_3d_m.unwrap() < 0.05 && ours.ate_rmse_m < 0.05, "{ours:?}");
    assert_eq!(of("07.txt").poses, SCANS);
    // Every number of rays is a separate run.
    let rays = ["22", "18", "14", "10", "6"].map(|rays| of(&format!("gicp-rays-{rays}")));
    for (one, other) in rays.iter().zip(&rays[1..]) {
        assert_ne!(one.rms_3d_m, other.rms_3d_m, "{} {}", one.name, other.name);
    }
    let lines = table::lines(&evaluation).unwrap();
    for number in 1..=6 {
        let title = format!("Table 4.{number}");
        assert_eq!(lines.iter().filter(|line| line.starts_with(&title)).count(), 1, "{lines:#?}");
    }
    // Every row has our figure, except for stages that are not measured and figures that the thesis does not give.
    let without = lines.iter().filter(|line| line.contains("-> -")).collect::<Vec<_>>();
    assert!(without.len() == 1 && without[0].contains("view"), "{without:#?}");
}

/// Regression: all variants were run over the whole drive before it was said that there is nothing to score them against.
#[test]
fn a_drive_without_true_poses_is_refused_before_a_scan_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let velodyne = folder.path().join("velodyne");
    std::fs::create_dir_all(&velodyne).unwrap();
    // It could not be read.
    std::fs::write(velodyne.join("000000.bin"), [0; 3]).unwrap();
    let line = Line::parse_from(["kitti".into(), folder.path().as_os_str().to_owned()]);
    let error = evaluated(&line.args).unwrap_err().to_string();
    assert!(error.contains("no ground-truth poses") && error.contains("NN.txt"), "{error}");
}
