mod folder;

use std::path::Path;

use nalgebra::Vector3;

use super::score::{at, scored};
use super::*;

fn drive(scale: f64) -> Vec<(Stamp, Isometry3<f64>)> {
    let at = |index: u32| {
        let stamp = Stamp::from_nanos(1_000_000_000).plus_seconds(0.1 * f64::from(index));
        (stamp, Isometry3::translation(scale * f64::from(index), 0.0, 0.0))
    };
    (0..1001).map(at).collect()
}

/// Regression: all users shared one temporary folder, which the first one owned, and which was not removed.
#[test]
fn the_tiles_of_the_timed_map_leave_nothing_and_what_fails_names_the_folder_to_change() {
    let temporary = tempfile::tempdir().unwrap();
    let entries = || std::fs::read_dir(temporary.path()).unwrap().count();
    let stages = StageTimes::below(temporary.path()).unwrap();
    assert_eq!(entries(), 1);
    drop(stages);
    assert_eq!(entries(), 0);
    let error = StageTimes::below(Path::new("/proc/none")).err().unwrap().to_string();
    assert!(error.contains("TMPDIR") && !error.contains("--out"), "{error}");
}

#[test]
fn a_drive_that_is_a_hundredth_too_long_has_the_figures_of_it() {
    let candidate = Candidate {
        name: "gicp-intensity".to_owned(),
        poses: drive(1.01),
        troubles: 2,
        times_ms: vec![3.0, 1.0, 5.0],
    };
    let figures = scored(&candidate, &drive(1.0)).unwrap();
    // A segment ends at the first pose after its length.
    assert!((figures.translation_percent.unwrap() - 1.0).abs() < 0.01, "{figures:?}");
    assert!((figures.end_error_percent.unwrap() - 1.0).abs() < 1e-6);
    assert!((figures.precision_percent.unwrap() - 99.0).abs() < 1e-6);
    let rms_m = 10.0 / 3.0_f64.sqrt();
    assert!(
        (figures.rms_2d_m.unwrap() - rms_m).abs() < 0.01 && figures.rms_2d_m == figures.rms_3d_m
    );
    assert!(figures.ate_rmse_m < rms_m);
    assert_eq!((figures.milliseconds_median, figures.milliseconds_mean), (Some(3.0), Some(3.0)));
    let lines = published::beside(&[figures], &StageMs::default()).unwrap();
    let of_kitti = lines.iter().find(|line| line.contains("GICP, intensity filter")).unwrap();
    assert!(of_kitti.contains("35426.0 -> 3.0") && of_kitti.contains("1.756 -> 5.7"), "{of_kitti}");
}

#[test]
fn the_truth_between_two_poses_is_between_them() {
    let truth = drive(1.0);
    let between = at(&truth, truth[4].0.plus_seconds(0.05)).unwrap();
    assert!((between.translation.vector - Vector3::new(4.5, 0.0, 0.0)).norm() < 1e-6);
    assert_eq!(at(&truth, truth[0].0.plus_seconds(-1.0)), None);
    assert_eq!(at(&truth, truth[1000].0.plus_seconds(1.0)), None);
}

#[test]
fn without_the_data_set_it_says_how_to_get_it() {
    use clap::Parser;
    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        args: KittiArgs,
    }
    let line = Line::parse_from(["kitti", "/nowhere/sequences/07"]);
    let failure = run(&line.args).unwrap_err().to_string();
    assert!(failure.contains("eval_odometry.php"), "{failure}");
}
