//! A bag through the cores in one process.

use std::collections::BTreeMap;
use std::path::Path;

use geometry::{CameraModel, DepthImage, DepthPixels, Distortion};
use msgs::convert;

use crate::bags::{bag_of, pose, scan, small_room, ten_stamps, with_organised_clouds};
use crate::program::{succeed, summary};

/// Every file below a folder, by its path there.
pub(crate) fn files_of(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut files = BTreeMap::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(next) = folders.pop() {
        for entry in std::fs::read_dir(next).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else {
                let name = path.strip_prefix(folder).unwrap().to_str().unwrap().to_owned();
                files.insert(name, std::fs::read(&path).unwrap());
            }
        }
    }
    files
}

#[test]
fn two_runs_of_a_bag_write_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let bag = small_room(folder.path());
    let run = |name: &str| {
        let out = folder.path().join(name);
        succeed([
            "run",
            bag.to_str().unwrap(),
            "--transport",
            "local",
            "--no-timing",
            "--out",
            out.to_str().unwrap(),
        ]);
        files_of(&out)
    };
    let (first, second) = (run("first"), run("second"));
    for name in ["map.ply", "map.pcd", "summary.json", "report.html"] {
        assert!(first.contains_key(name), "{name} is missing");
    }
    assert!(first.keys().any(|name| name.starts_with("dynamic/cycle_")));
    assert!(first.keys().eq(second.keys()));
    for (name, bytes) in &first {
        assert!(bytes == &second[name], "{name} differs");
    }
}

#[test]
fn the_times_are_all_that_differs_between_two_runs() {
    let folder = tempfile::tempdir().unwrap();
    let bag = small_room(folder.path());
    let run = |name: &str| {
        let out = folder.path().join(name);
        succeed(["run", bag.to_str().unwrap(), "--out", out.to_str().unwrap()]);
        let mut summary = summary(&out);
        let timing = summary.as_object_mut().unwrap().remove("timing").unwrap();
        let mut files = files_of(&out);
        files.remove("summary.json");
        (files, summary, timing)
    };
    let (first_files, first_summary, timing) = run("first");
    let (second_files, second_summary, _) = run("second");
    assert_eq!(first_summary, second_summary);
    assert!(first_files == second_files);
    assert!(timing["cycle"]["median_ms"].as_f64().unwrap() > 0.0, "{timing}");
    assert!(timing["steps"].as_array().unwrap().len() >= 8, "{timing}");
}

#[test]
fn the_person_is_cut_out_and_the_room_stays() {
    let folder = tempfile::tempdir().unwrap();
    let bag = small_room(folder.path());
    let out = folder.path().join("out");
    succeed(["run", bag.to_str().unwrap(), "--out", out.to_str().unwrap()]);
    let summary = summary(&out);
    assert_eq!(summary["drops"], serde_json::json!([]));
    let truth = &summary["truth"];
    let person = &truth["objects"][0];
    assert_eq!(person["name"], "person");
    let in_view = person["cycles_in_view"].as_u64().unwrap();
    assert!(in_view >= 10, "{in_view}");
    assert!(person["cycles_found"].as_u64().unwrap() * 5 >= in_view * 4, "{person}");
    assert!(person["points"]["share"].as_f64().unwrap() > 0.7, "{person}");
    // All of it was measured.
    assert!(truth["map"]["static_kept_share_of_unfiltered"].as_f64().unwrap() > 0.99, "{truth}");
}

/// Clouds have the pixels of the image that they were computed from: what moves is masked in them, too.
#[test]
fn a_map_of_surfaces_from_organised_clouds_is_that_of_the_depth_images_and_free_of_the_person() {
    let folder = tempfile::tempdir().unwrap();
    let bag_of_images = small_room(folder.path());
    let bag_of_clouds = with_organised_clouds(folder.path(), &bag_of_images);
    let run = |bag: &Path, name: &str| {
        let out = folder.path().join(name);
        let (bag, to) = (bag.to_str().unwrap(), out.to_str().unwrap());
        succeed(["run", bag, "--map-edge", "0.03", "--out", to]);
        out
    };
    let (of_images, of_clouds) = (run(&bag_of_images, "images"), run(&bag_of_clouds, "clouds"));
    // The labels of the truth are of the images.
    let truth = &summary(&of_images)["truth"]["map"];
    assert!(truth["object_only_without_removal"].as_u64().unwrap() > 100, "{truth}");
    assert_eq!(truth["object_only_left"], 0, "{truth}");
    let summary = summary(&of_clouds);
    assert_eq!(summary["drops"], serde_json::json!([]));
    let distance = |reference: &Path, edge: &str, tolerance: &str| {
        let (map, reference) = (of_clouds.join("map.ply"), reference.to_str().unwrap());
        let map = map.to_str().unwrap();
        let edges = ["--edge", edge, "--tolerance", tolerance];
        let score =
            succeed([&["eval", "map", map, "--ref", reference, "--json"], &edges[..]].concat());
        serde_json::from_str::<serde_json::Value>(&score).unwrap()["distance"].clone()
    };
    let same = distance(&of_images.join("map.ply"), "0.03", "0.01");
    assert!(same["precision"].as_f64().unwrap() > 0.999, "{same}");
    assert!(same["recall"].as_f64().unwrap() > 0.999, "{same}");
    // 0.951 was measured; the map of the reduced clouds, with voxels of 8 cm, has 0.80.
    let surface = distance(&bag_of_images, "0.05", "0.05");
    assert!(surface["f_score"].as_f64().unwrap() > 0.94, "{surface}");
}

/// Many drivers send the calibration behind the image. The images before the first one were once dropped.
#[test]
fn a_calibration_that_comes_late_loses_no_cycle() {
    let folder = tempfile::tempdir().unwrap();
    let camera = CameraModel {
        width_px: 8,
        height_px: 6,
        fx_px: 6.0,
        fy_px: 6.0,
        cx_px: 3.5,
        cy_px: 2.5,
        distortion: Distortion::None,
    };
    let image = |stamp| {
        let pixels = DepthPixels::Millimetres(vec![2000; 8 * 6]);
        DepthImage::new(stamp, "camera".to_owned(), (8, 6), pixels).unwrap()
    };
    let bag = bag_of(folder.path(), "late.mcap", |topics| {
        topics.messages("/scan", ten_stamps().map(|stamp| (stamp, scan(stamp, 3.0))));
        topics.messages("/pose", ten_stamps().map(|stamp| (stamp, pose(stamp))));
        let images = ten_stamps().map(|stamp| (stamp, convert::message_from_depth(&image(stamp))));
        topics.messages("/depth/image_raw", images);
        // The first calibration is logged behind the third image.
        let infos = ten_stamps().skip(2).map(|stamp| {
            let message = convert::message_from_camera(&camera, stamp, "camera");
            (stamp.plus_seconds(0.001), message)
        });
        topics.messages("/depth/camera_info", infos);
    });
    let out = folder.path().join("out");
    succeed(["run", bag.to_str().unwrap(), "--out", out.to_str().unwrap()]);
    let summary = summary(&out);
    assert_eq!(summary["cycles"]["total"], 10, "{}", summary["drops"]);
}
