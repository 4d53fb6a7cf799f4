//! A sequence of a simulated desk in the benchmark's format.

use std::fmt::Write as _;
use std::fs;

use clap::Parser;
use geometry::Stamp;
use image::{ImageBuffer, Luma, Rgb};
use simulator::{OdometryRun, Sample, Scenario};

use super::*;
use crate::simulate::{self, SimulateArgs};
use robot::import::tum::UNITS_PER_METRE;
use robot::rig_from_camera;

#[derive(Parser)]
struct Line {
    #[command(flatten)]
    args: TumArgs,
}

fn args(words: &[&str]) -> TumArgs {
    Line::parse_from([&["tum"], words].concat()).args
}

fn seconds(stamp: Stamp) -> String {
    let (seconds, nanos) = stamp.secs_nanos();
    format!("{seconds}.{nanos:09}")
}

/// Writes a second of a camera that moves around a desk; returns its intrinsics.
fn write_desk(folder: &Path) -> String {
    for name in ["rgb", "depth"] {
        fs::create_dir_all(folder.join(name)).unwrap();
    }
    let scenario = Scenario::odometry(OdometryRun::Desk, 1).with_depth_size(320, 240);
    let mut lists = [(); 3].map(|()| "# stamps\n".to_owned());
    let mut intrinsics = String::new();
    for sample in scenario.with_duration_s(1.0).samples().unwrap() {
        match sample {
            Sample::ColourCameraInfo { camera, .. } => {
                let [fx, fy] = [camera.fx_px, camera.fy_px];
                intrinsics = format!("{fx},{fy},{},{}", camera.cx_px, camera.cy_px);
            }
            Sample::Colour(image) => {
                let name = format!("rgb/{}.png", seconds(image.stamp));
                let (width, height) = (image.width_px as u32, image.height_px as u32);
                let picture = ImageBuffer::<Rgb<u8>, _>::from_raw(width, height, image.rgb);
                picture.unwrap().save(folder.join(&name)).unwrap();
                writeln!(lists[0], "{} {name}", seconds(image.stamp)).unwrap();
            }
            Sample::Depth { image, .. } => {
                let name = format!("depth/{}.png", seconds(image.stamp));
                let (width, height) = (image.width_px(), image.height_px());
                let picture = ImageBuffer::from_fn(width as u32, height as u32, |x, y| {
                    let depth_m = image.depth_m(x as usize, y as usize).unwrap_or(0.0);
                    Luma([(f64::from(depth_m) * UNITS_PER_METRE).round() as u16])
                });
                picture.save(folder.join(&name)).unwrap();
                writeln!(lists[1], "{} {name}", seconds(image.stamp)).unwrap();
            }
            Sample::TruePose(pose) => {
                let camera = pose.map_from_rig * rig_from_camera();
                let (place, turn) = (camera.translation, camera.rotation.coords);
                let stamp = seconds(pose.stamp);
                writeln!(
                    lists[2],
                    "{stamp} {} {} {} {} {} {} {}",
                    place.x, place.y, place.z, turn.x, turn.y, turn.z, turn.w
                )
                .unwrap();
            }
            _ => {}
        }
    }
    for (name, list) in ["rgb.txt", "depth.txt", "groundtruth.txt"].iter().zip(lists) {
        fs::write(folder.join(name), list).unwrap();
    }
    intrinsics
}

#[test]
fn a_sequence_is_followed_in_each_way_and_stands_in_the_tables() {
    let parent = tempfile::tempdir().unwrap();
    let folder = parent.path().join("rgbd_dataset_freiburg3_structure_texture_near");
    let intrinsics = write_desk(&folder);
    let path = folder.to_str().unwrap();
    let args = args(&[path, "--runs", "2", "--intrinsics", &intrinsics, "--first", "12"]);
    let published = PUBLISHED.get().unwrap();
    let followed = followed(&folder, &args, published).unwrap();
    assert_eq!((followed.pairs, followed.alone), (12, 0));
    let modes: Vec<Mode> = followed.scores.iter().map(|score| score.mode).collect();
    assert_eq!(modes, [Mode::Odometry, Mode::Inline, Mode::Background]);
    for score in &followed.scores {
        assert_eq!(score.runs.len(), 2);
        for run in &score.runs {
            assert_eq!(run.poses, 12, "{run:?}");
            assert!(run.rmse_m < 0.01 && run.rmse_m > 1e-6, "{run:?}");
            assert!(run.min_m <= run.median_m && run.median_m <= run.max_m);
            assert!(run.median_tracking_s > 0.0 && run.p99_tracking_s >= run.median_tracking_s);
            assert_eq!(run.keyframes > 0, score.mode != Mode::Odometry, "{run:?}");
        }
        let mean_m = 0.5 * (score.runs[0].rmse_m + score.runs[1].rmse_m);
        assert!((score.mean[0] - mean_m).abs() < 1e-12);
    }
    let lines = tables::of_sequence(&followed).join("\n");
    assert!(lines.contains("Table 9: freiburg3_structure_texture_near: 12 pairs"), "{lines}");
    assert!(lines.contains("the thesis    0.026747"), "{lines}");
    let ours_cm = format!("{:>12.3}", 100.0 * followed.scores[1].mean[0]);
    let all = tables::of_all(&[followed], published);
    let row = all.iter().find(|line| line.contains("1.545")).unwrap();
    assert!(row.contains("2.675") && row.contains(&ours_cm), "{row}");
    let json =
        Line::parse_from(["tum", path, "--runs", "1", "--json", "--intrinsics", &intrinsics]);
    let shorter = TumArgs { first: Some(5), modes: vec![Mode::Inline], ..json.args };
    assert_eq!(run(&shorter).unwrap(), Outcome::Complete);
    // The same seed gives the same poses.
    let twice =
        [(); 2].map(|()| super::followed(&folder, &shorter, published).unwrap().scores[0].mean[0]);
    assert_eq!(twice[0], twice[1]);
}

#[derive(Parser)]
struct SimulateLine {
    #[command(flatten)]
    args: SimulateArgs,
}

#[test]
fn a_bag_is_a_sequence_and_a_simulated_counterpart_stands_in_its_table() {
    let folder = tempfile::tempdir().unwrap();
    let bag = folder.path().join("desk-xyz.mcap");
    let line = ["simulate", "desk-xyz", "--seconds", "1", "--depth-size", "320", "240", "-o"];
    let line = line.into_iter().chain([bag.to_str().unwrap()]);
    let simulated = SimulateLine::parse_from(line).args;
    let outcome = simulate::run(&simulated, &Default::default()).unwrap();
    assert_eq!(outcome, Outcome::Complete);
    let published = PUBLISHED.get().unwrap();
    let (found, failures) = found(&[folder.path().to_owned()], published);
    assert_eq!((found.len(), failures.len()), (1, 0));
    let args = args(&[bag.to_str().unwrap(), "--runs", "1", "--modes", "inline"]);
    let followed = followed(&found[0], &args, published).unwrap();
    assert_eq!((followed.name.as_str(), followed.pairs, followed.alone), ("desk-xyz", 30, 0));
    let run = &followed.scores[0].runs[0];
    assert_eq!(run.poses, 30);
    assert!(run.rmse_m < 0.01 && run.rmse_m > 1e-6, "{run:?}");
    let ours_cm = format!("{:>12.3}", 100.0 * run.rmse_m);
    let lines = tables::of_counterparts(&[followed]);
    let row = lines.iter().find(|line| line.starts_with("desk-xyz")).unwrap();
    assert!(
        row.contains("freiburg1_xyz") && row.contains("1.00") && row.contains(&ours_cm),
        "{row}"
    );
}

#[test]
fn a_sequence_that_is_not_there_is_told_with_where_to_get_it() {
    let failure = run(&args(&["/nowhere/rgbd_dataset_freiburg2_desk_with_person"])).unwrap_err();
    let failure = failure.to_string();
    let address = "rgbd/dataset/freiburg2/rgbd_dataset_freiburg2_desk_with_person.tgz";
    assert!(failure.contains("does not exist") && failure.contains(address), "{failure}");
    let empty = tempfile::tempdir().unwrap();
    let failure = run(&args(&[empty.path().to_str().unwrap()])).unwrap_err().to_string();
    assert!(failure.contains("groundtruth.txt") && failure.contains("cvg.cit.tum.de"), "{failure}");
}

#[test]
fn folders_of_sequences_are_looked_through() {
    let parent = tempfile::tempdir().unwrap();
    for name in ["b", "a", "other"] {
        fs::create_dir(parent.path().join(name)).unwrap();
    }
    for name in ["a", "b"] {
        for list in ["rgb.txt", "depth.txt", "groundtruth.txt"] {
            fs::write(parent.path().join(name).join(list), "").unwrap();
        }
    }
    let (folders, failures) =
        found(&[parent.path().to_owned(), parent.path().join("other")], PUBLISHED.get().unwrap());
    assert_eq!(folders, ["a", "b"].map(|name| parent.path().join(name)));
    assert_eq!(failures.len(), 1);
}

/// The printed means of the tables agree with each other.
#[test]
fn the_published_numbers_are_those_of_the_tables() {
    let published = PUBLISHED.get().unwrap();
    let sequences = &published.sequences;
    let tables: std::collections::BTreeSet<u8> = sequences.iter().map(|one| one.table).collect();
    assert_eq!((tables, sequences.len()), ((4..=13).collect(), 10));
    let mean = |at: usize| sequences.iter().map(|one| one.thesis[at]).sum::<f64>() / 10.0;
    for (at, printed_s) in [6, 7].into_iter().zip(published.mean_times_s) {
        assert!((mean(at) - printed_s).abs() < 1e-4, "{} {printed_s}", mean(at));
    }
    for counterpart in &published::COUNTERPARTS {
        assert!(published.of(counterpart.of).is_some(), "{counterpart:?}");
    }
    assert!(sequences.iter().all(|one| one.aim_m() <= one.thesis[0]));
    assert_eq!(published.of("freiburg3_walking_halfsphere").unwrap().aim_m(), 0.025);
}
