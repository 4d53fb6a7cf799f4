//! What a user may give that is no good: each gets a message that names the thing and the fix, and an
//! exit code other than 0.

use std::path::Path;
use std::process::Output;

use geometry::Stamp;
use msgs::sensor_msgs::{Image, PointCloud2};

use crate::bags::{bag_of, pose, scan, small_room, ten_stamps, wall};
use crate::program::{stillmap, stillmap_with_domain, summary};

fn run(bag: &Path, out: &Path) -> Output {
    stillmap(["run", bag.to_str().unwrap(), "--out", out.to_str().unwrap()])
}

/// Runs a bag, which must fail with all of `wanted` on stderr, in a few lines.
fn refused(bag: &Path, wanted: &[&str]) {
    let out = tempfile::tempdir().unwrap();
    let output = run(bag, out.path());
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{stderr}");
    for wanted in wanted {
        assert!(stderr.contains(wanted), "'{wanted}' is not in: {stderr}");
    }
    assert!(stderr.lines().count() <= 6, "{stderr}");
    assert!(!stderr.contains("panicked"), "{stderr}");
}

#[test]
fn a_file_that_is_no_bag() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("notes.txt");
    std::fs::write(&file, "dear diary, today the robot fell down the stairs again").unwrap();
    refused(&file, &["notes.txt", "MCAP"]);
}

#[test]
fn a_file_that_is_not_there() {
    refused(Path::new("/nowhere/room.mcap"), &["/nowhere/room.mcap"]);
}

#[test]
fn an_empty_file() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("empty.mcap");
    std::fs::write(&file, "").unwrap();
    refused(&file, &["empty.mcap"]);
}

#[test]
fn a_bag_without_messages() {
    let folder = tempfile::tempdir().unwrap();
    let bag = bag_of(folder.path(), "bare.mcap", |_| {});
    refused(&bag, &["no topic of type sensor_msgs/msg/LaserScan", "stillmap info"]);
}

#[test]
fn a_bag_without_one_of_the_topics() {
    let folder = tempfile::tempdir().unwrap();
    let without_pose = bag_of(folder.path(), "pose.mcap", |topics| {
        topics.messages("/scan", ten_stamps().map(|stamp| (stamp, scan(stamp, 3.0))));
        topics.messages("/points", ten_stamps().map(|stamp| (stamp, wall(stamp, 100))));
    });
    refused(&without_pose, &["the bag has no pose", "geometry_msgs/msg/PoseStamped", "--pose"]);

    let without_cloud = bag_of(folder.path(), "cloud.mcap", |topics| {
        topics.messages("/scan", ten_stamps().map(|stamp| (stamp, scan(stamp, 3.0))));
        topics.messages("/pose", ten_stamps().map(|stamp| (stamp, pose(stamp))));
    });
    refused(&without_cloud, &["sensor_msgs/msg/Image", "--depth"]);
}

#[test]
fn a_bag_of_a_lidar_alone_names_the_commands_that_take_it() {
    let folder = tempfile::tempdir().unwrap();
    let bag = bag_of(folder.path(), "drive.mcap", |topics| {
        topics.messages("/velodyne_points", ten_stamps().map(|stamp| (stamp, wall(stamp, 100))));
    });
    refused(&bag, &["no 2D laser scan", "`stillmap run BAG --pose lidar`"]);
    let file = folder.path().join("poses.txt");
    let output = stillmap(["odometry", bag.to_str().unwrap(), "-o", file.to_str().unwrap()]);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{stderr}");
    assert!(stderr.contains("`stillmap odometry BAG --of lidar -o FILE`"), "{stderr}");
}

#[test]
fn a_filter_that_fails_leaves_no_temporary_file() {
    let folder = tempfile::tempdir().unwrap();
    // An hour apart, so that no scan becomes a cycle.
    let later = || ten_stamps().map(|stamp| stamp.plus_seconds(3600.0));
    let bag = bag_of(folder.path(), "apart.mcap", |topics| {
        topics.messages("/scan", ten_stamps().map(|stamp| (stamp, scan(stamp, 3.0))));
        topics.messages("/points", later().map(|stamp| (stamp, wall(stamp, 100))));
        topics.messages("/pose", later().map(|stamp| (stamp, pose(stamp))));
    });
    let filtered = folder.path().join("filtered.mcap");
    let output = stillmap(["filter", bag.to_str().unwrap(), "-o", filtered.to_str().unwrap()]);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{stderr}");
    assert!(stderr.contains("`stillmap doctor BAG`"), "{stderr}");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "{stderr}");
}

#[test]
fn a_topic_of_the_wrong_type() {
    let folder = tempfile::tempdir().unwrap();
    let bag = bag_of(folder.path(), "types.mcap", |topics| {
        topics.messages("/scan", ten_stamps().map(|stamp| (stamp, scan(stamp, 3.0))));
        topics.messages("/points", ten_stamps().map(|stamp| (stamp, wall(stamp, 100))));
        topics.messages("/pose", ten_stamps().map(|stamp| (stamp, pose(stamp))));
    });
    let out = folder.path().join("out");
    let arguments =
        ["run", bag.to_str().unwrap(), "--scan", "/pose", "--out", out.to_str().unwrap()];
    let output = stillmap(arguments);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1));
    let wanted = "topic /pose carries geometry_msgs/msg/PoseStamped, not sensor_msgs/msg/LaserScan";
    assert!(stderr.contains(wanted), "{stderr}");
    assert!(stderr.contains("--scan: /scan"), "{stderr}");
}

#[test]
fn an_image_that_is_no_depth_image() {
    let folder = tempfile::tempdir().unwrap();
    let bag = bag_of(folder.path(), "colour.mcap", |topics| {
        topics.messages("/scan", ten_stamps().map(|stamp| (stamp, scan(stamp, 3.0))));
        topics.messages("/pose", ten_stamps().map(|stamp| (stamp, pose(stamp))));
        let colour = |stamp| Image {
            header: pose(stamp).header,
            height: 1,
            width: 2,
            encoding: "rgb8".to_owned(),
            is_bigendian: 0,
            step: 6,
            data: vec![0; 6],
        };
        topics.messages("/image", ten_stamps().map(|stamp| (stamp, colour(stamp))));
        topics.messages(
            "/camera_info",
            ten_stamps().map(|stamp| {
                let camera = geometry::CameraModel {
                    width_px: 2,
                    height_px: 1,
                    fx_px: 1.0,
                    fy_px: 1.0,
                    cx_px: 0.5,
                    cy_px: 0.0,
                    distortion: geometry::Distortion::None,
                };
                (stamp, msgs::convert::message_from_camera(&camera, stamp, "camera"))
            }),
        );
    });
    refused(&bag, &["no scan became a cycle", "rgb8", "16UC1"]);
}

#[test]
fn clouds_without_a_point() {
    let folder = tempfile::tempdir().unwrap();
    let bag = bag_of(folder.path(), "void.mcap", |topics| {
        topics.messages("/scan", ten_stamps().map(|stamp| (stamp, scan(stamp, 3.0))));
        topics.messages("/points", ten_stamps().map(|stamp| (stamp, wall(stamp, 0))));
        topics.messages("/pose", ten_stamps().map(|stamp| (stamp, pose(stamp))));
    });
    refused(&bag, &["/points", "no point"]);
    // Regression: files of a map of no points were left.
    let out = folder.path().join("out");
    run(&bag, &out);
    let has = |name: &str| out.join(name).exists();
    assert_eq!(["map.ply", "map.pcd", "summary.json"].map(has), [false, false, true]);
    // Regression: `filter` said nothing of it, and ended with 0.
    assert_filter_says(&bag, &["clouds on /points have no point", "the map has no point"]);
}

#[test]
fn scans_without_a_return_still_map_what_the_camera_sees() {
    let folder = tempfile::tempdir().unwrap();
    let bag = bag_of(folder.path(), "blind.mcap", |topics| {
        topics.messages("/scan", ten_stamps().map(|stamp| (stamp, scan(stamp, f32::INFINITY))));
        topics.messages("/points", ten_stamps().map(|stamp| (stamp, wall(stamp, 100))));
        topics.messages("/pose", ten_stamps().map(|stamp| (stamp, pose(stamp))));
    });
    let out = folder.path().join("out");
    let output = run(&bag, &out);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(3), "{stderr}");
    assert!(stderr.contains("/scan"), "{stderr}");
    assert!(stderr.contains("too few returns"), "{stderr}");
    let summary = summary(&out);
    assert_eq!(summary["cycles"]["total"], 10);
    assert_eq!(summary["cycles"]["detections"], 0);
    assert!(summary["map"]["points"].as_u64().unwrap() > 5);
    // Regression: `filter` said nothing of it, and ended with 0.
    assert_filter_says(&bag, &["10 of 10 scans on /scan have too few returns"]);
}

/// `filter` ends with 3, and says all of `wanted`.
fn assert_filter_says(bag: &Path, wanted: &[&str]) {
    let filtered = bag.with_extension("static.mcap");
    let output = stillmap(["filter", bag.to_str().unwrap(), "-o", filtered.to_str().unwrap()]);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(3), "{stderr}");
    for wanted in wanted {
        assert!(stderr.contains(wanted), "'{wanted}' is not in: {stderr}");
    }
}

/// Regression: a run said nothing of clouds that it could not use nor of a third of the scans that it dropped, and ended with 0; each
/// cloud was an entry of the summary, since the reason had its time.
#[test]
fn unusable_messages_and_dropped_scans_are_said_and_counted() {
    let folder = tempfile::tempdir().unwrap();
    let later = |stamp: Stamp| stamp.plus_seconds(1.0);
    let stamps = || ten_stamps().chain(ten_stamps().map(later));
    let bag = bag_of(folder.path(), "gaps.mcap", |topics| {
        topics.messages("/scan", stamps().map(|stamp| (stamp, scan(stamp, 3.0))));
        topics.messages("/points", stamps().take(12).map(|stamp| (stamp, wall(stamp, 100))));
        topics.cut_off::<PointCloud2>("/points", stamps().skip(12));
        topics.messages("/pose", stamps().map(|stamp| (stamp, pose(stamp))));
    });
    let out = folder.path().join("out");
    let output = run(&bag, &out);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(3), "{stderr}");
    assert!(stderr.contains("/points: 8 messages cannot be used"), "{stderr}");
    assert!(stderr.contains("scans were dropped, "), "{stderr}");
    let summary = summary(&out);
    let drops = summary["drops"].as_array().unwrap();
    let of_points = drops.iter().filter(|drop| drop["topic_or_stage"] == "/points");
    assert_eq!(of_points.map(|drop| &drop["count"]).collect::<Vec<_>>(), [8], "{drops:?}");
}

#[test]
fn a_bag_that_was_cut_is_mapped_as_far_as_it_goes() {
    let folder = tempfile::tempdir().unwrap();
    let whole = small_room(folder.path());
    let bytes = std::fs::read(&whole).unwrap();
    let cut = folder.path().join("cut.mcap");
    std::fs::write(&cut, &bytes[..bytes.len() * 2 / 3]).unwrap();

    let (whole_out, cut_out) = (folder.path().join("whole"), folder.path().join("part"));
    assert_eq!(run(&whole, &whole_out).status.code(), Some(0));
    let output = run(&cut, &cut_out);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(3), "{stderr}");
    assert!(stderr.contains("cut.mcap"), "{stderr}");
    let cycles = |out: &Path| summary(out)["cycles"]["total"].as_u64().unwrap();
    let (whole_cycles, cut_cycles) = (cycles(&whole_out), cycles(&cut_out));
    assert!(cut_cycles * 2 > whole_cycles, "{cut_cycles} of {whole_cycles}");
    assert!(cut_cycles < whole_cycles);
    assert!(cut_out.join("map.ply").is_file() && cut_out.join("report.html").is_file());
}

#[test]
fn a_failed_run_leaves_the_results_of_the_one_before() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    assert_eq!(run(&small_room(folder.path()), &out).status.code(), Some(0));
    let map = std::fs::read(out.join("map.ply")).unwrap();

    let bad = folder.path().join("bad.mcap");
    std::fs::write(&bad, "no bag").unwrap();
    let arguments = ["run", bad.to_str().unwrap(), "--overwrite", "--out", out.to_str().unwrap()];
    let output = stillmap(arguments);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.code() == Some(1) && stderr.contains("bad.mcap"), "{stderr}");
    assert!(map == std::fs::read(out.join("map.ply")).unwrap());
}

#[test]
fn a_run_that_cannot_start_leaves_the_removed_clouds_of_the_one_before() {
    let folder = tempfile::tempdir().unwrap();
    let (bag, out) = (small_room(folder.path()), folder.path().join("out"));
    assert_eq!(run(&bag, &out).status.code(), Some(0));
    let clouds = || std::fs::read_dir(out.join("dynamic")).unwrap().count();
    let before = clouds();
    assert!(before > 0);
    let output = stillmap_with_domain(
        "300",
        [
            "run",
            bag.to_str().unwrap(),
            "--transport",
            "dds",
            "--overwrite",
            "--out",
            out.to_str().unwrap(),
        ],
    );
    assert_eq!(output.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&output.stderr).contains("ROS_DOMAIN_ID=300"));
    assert_eq!(clouds(), before);
}

#[test]
fn a_parameter_file_for_no_node() {
    let folder = tempfile::tempdir().unwrap();
    let bag = small_room(folder.path());
    let file = folder.path().join("misspelt.yaml");
    std::fs::write(&file, "detektion:\n  ros__parameters:\n    window_scans: 4\n").unwrap();
    let out = folder.path().join("out");
    let output = stillmap([
        "run",
        bag.to_str().unwrap(),
        "--params-file",
        file.to_str().unwrap(),
        "--out",
        out.to_str().unwrap(),
    ]);
    assert_eq!(output.status.code(), Some(2));
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(stderr.contains("misspelt.yaml") && stderr.contains("none of the nodes"), "{stderr}");
}

/// Regression: it was without effect, in silence. It is no error: the file may be for another node of the graph.
#[test]
fn a_misspelt_parameter_for_all_nodes_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let bag = small_room(folder.path());
    let file = folder.path().join("all.yaml");
    std::fs::write(&file, "/**:\n  ros__parameters:\n    max_stop: 20.0\n").unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (bag, file, out, filtered) =
        (bag.to_str().unwrap(), path("all.yaml"), path("out"), path("static.mcap"));
    // What follows is refused, so that no node starts.
    let up = ["up", "--ros-args", "--params-file", &file, "-p", "use_sim_time:=maybe"];
    for (arguments, code) in [
        (["run", bag, "--params-file", &file, "--out", &out].as_slice(), 0),
        (&["filter", bag, "--params-file", &file, "-o", &filtered], 0),
        (&up, 2),
    ] {
        let output = stillmap(arguments);
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {stderr}");
        let wanted = "all.yaml, line 3: no node of stillmap has a parameter `max_stop`";
        assert!(stderr.contains(wanted) && stderr.contains("`max_stop_s`"), "{stderr}");
    }
}

/// Regression: the map was torn there, and only `doctor` said so.
#[test]
fn poses_that_jump() {
    let folder = tempfile::tempdir().unwrap();
    let bag = bag_of(folder.path(), "jump.mcap", |topics| {
        topics.messages("/scan", ten_stamps().map(|stamp| (stamp, scan(stamp, 3.0))));
        topics.messages("/points", ten_stamps().map(|stamp| (stamp, wall(stamp, 100))));
        let jumping = |(index, stamp)| {
            let mut pose = pose(stamp);
            pose.pose.position.x = if index < 5 { 0.0 } else { 4.0 };
            (stamp, pose)
        };
        topics.messages("/pose", ten_stamps().enumerate().map(jumping));
    });
    let output = run(&bag, &folder.path().join("out"));
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(3), "{stderr}");
    assert!(stderr.contains("/pose: the poses jump before 1 of 10 cycles"), "{stderr}");
    assert_filter_says(&bag, &["the poses jump before 1 of 10 cycles"]);
}

/// Once such a map was empty without a word.
#[test]
fn a_map_that_is_too_fine_for_its_bounds() {
    let folder = tempfile::tempdir().unwrap();
    let camera = geometry::CameraModel {
        width_px: 160,
        height_px: 120,
        fx_px: 140.0,
        fy_px: 140.0,
        cx_px: 79.5,
        cy_px: 59.5,
        distortion: geometry::Distortion::None,
    };
    let image = |stamp| {
        let pixels = geometry::DepthPixels::Millimetres(vec![3000; 160 * 120]);
        let image = geometry::DepthImage::new(stamp, "camera".to_owned(), (160, 120), pixels);
        msgs::convert::message_from_depth(&image.unwrap())
    };
    let info = |stamp| msgs::convert::message_from_camera(&camera, stamp, "camera");
    let stamps = || ten_stamps().take(3);
    let bag = bag_of(folder.path(), "near.mcap", |topics| {
        topics.messages("/scan", stamps().map(|stamp| (stamp, scan(stamp, 3.0))));
        topics.messages("/depth/image", stamps().map(|stamp| (stamp, image(stamp))));
        topics.messages("/depth/camera_info", stamps().map(|stamp| (stamp, info(stamp))));
        topics.messages("/pose", stamps().map(|stamp| (stamp, pose(stamp))));
    });
    let out = folder.path().join("out");
    let (bag, out) = (bag.to_str().unwrap(), out.to_str().unwrap());
    let output = stillmap(["run", bag, "--map-edge", "0.001", "--out", out]);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(matches!(output.status.code(), Some(1 | 3)), "{stderr}");
    for wanted in ["map_edge_m 0.001 is too fine", "30000 blocks", "--map-edge"] {
        assert!(stderr.contains(wanted), "'{wanted}' is not in: {stderr}");
    }
}

/// Once such a number was taken for an unknown option.
#[test]
fn a_negative_number_names_the_range() {
    let folder = tempfile::tempdir().unwrap();
    let bag = small_room(folder.path());
    let (bag, out) = (bag.to_str().unwrap(), folder.path().join("out"));
    for (options, wanted) in [
        (["--map-edge", "-1"].as_slice(), "map_edge_m must be 0.001 to 1, not -1"),
        (&["--transport", "dds", "--rate", "-1"], "--rate -1 is not a positive number"),
    ] {
        let line = ["run", bag, "--out", out.to_str().unwrap()];
        let output = stillmap(line.iter().chain(options));
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{options:?}: {stderr}");
        assert!(stderr.contains(wanted), "{options:?}: {stderr}");
    }
}
