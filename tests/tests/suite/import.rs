//! Recorded data sets become bags.

use std::path::Path;

use bag_player::{Bag, Selection};
use geometry::{DepthPixels, Stamp};
use msgs::convert;
use msgs::geometry_msgs::PoseStamped;
use msgs::sensor_msgs::{Image, LaserScan};

use crate::program::{stillmap, succeed};

/// A 16-bit PNG of one value.
fn write_depth(path: &Path, value: u16) {
    write_depth_of((64, 48), path, value);
}

fn write_depth_of((width_px, height_px): (u32, u32), path: &Path, value: u16) {
    let value = image::Luma([value]);
    image::ImageBuffer::<image::Luma<u16>, _>::from_pixel(width_px, height_px, value)
        .save(path)
        .unwrap();
}

fn messages<M: msgs::RosMessage>(bag: &Path, topic: &str) -> Vec<M> {
    let selection = Selection { topics: Some(vec![topic.to_owned()]), ..Selection::default() };
    let bag = Bag::open(bag).unwrap();
    bag.messages(&selection).unwrap().map(|message| message.unwrap().decode().unwrap()).collect()
}

/// Regression: a bag of a camera alone was refused, with the name of the command that adds the scans.
#[test]
fn a_bag_without_a_scanner_is_run_with_scans_of_its_depth_images() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let shown = |name: &str| path(name).to_str().unwrap().to_owned();
    let scene = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../nodes/laboratory/simulator/scenes/sensors/no-laser.yaml"
    );
    let (bag, with_scan) = (shown("camera.mcap"), shown("with_scan.mcap"));
    let small = ["--depth-size", "80", "60", "--seconds", "2", "-o", &bag];
    succeed([&["simulate", scene][..], &small].concat());
    succeed(["import", "bag", &bag, "--scan-from-depth", "-o", &with_scan]);
    succeed(["run", &with_scan, "--out", &shown("imported")]);
    let map = |out: &str| std::fs::read(path(out).join("map.ply")).unwrap();
    for transport in ["local", "dds"] {
        let out = shown(transport);
        let how = ["run", &bag, "--transport", transport, "--rate", "2", "--out", &out];
        let output = stillmap(how);
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{stderr}");
        let note = "scans are cut out of the depth images of /camera/depth/image_raw";
        assert!(stderr.contains(note), "{stderr}");
        assert!(map(transport) == map("imported"), "{transport}");
    }
}

#[test]
fn numbered_depth_pictures_become_images_scans_and_labels() {
    let folder = tempfile::tempdir().unwrap();
    let (depth, masks) = (folder.path().join("depth"), folder.path().join("masks"));
    std::fs::create_dir_all(&depth).unwrap();
    std::fs::create_dir_all(&masks).unwrap();
    // The order is that of the numbers, not of the names.
    for (name, value) in [("9.png", 1500), ("10.png", 2500)] {
        write_depth(&depth.join(name), value);
        write_depth(&masks.join(name), if value == 2500 { 255 } else { 0 });
    }
    let bag = folder.path().join("out.mcap");
    succeed([
        "import",
        "depth",
        depth.to_str().unwrap(),
        "--masks",
        masks.to_str().unwrap(),
        "--intrinsics",
        "60,60,31.5,23.5",
        "--rate",
        "5",
        "--scan-from-depth",
        "-o",
        bag.to_str().unwrap(),
    ]);

    let images: Vec<_> = messages::<Image>(&bag, "/camera/depth/image_raw")
        .iter()
        .map(|image| convert::depth_from_message(image).unwrap())
        .collect();
    assert_eq!(images.len(), 2);
    assert_eq!(images[0].pixels(), &DepthPixels::Millimetres(vec![1500; 64 * 48]));
    assert_eq!(images[1].pixels(), &DepthPixels::Millimetres(vec![2500; 64 * 48]));
    assert!((images[1].stamp.seconds_since(images[0].stamp) - 0.2).abs() < 1e-9);

    let labels: Vec<_> = messages::<Image>(&bag, "/truth/labels")
        .iter()
        .map(|image| convert::labels_from_message(image).unwrap())
        .collect();
    assert_eq!(labels[0].object_id(3, 3), Some(0));
    assert_eq!(labels[1].object_id(3, 3), Some(1));

    let scans: Vec<_> = messages::<LaserScan>(&bag, "/scan")
        .iter()
        .map(|scan| convert::scan_from_message(scan).unwrap())
        .collect();
    let middle = scans[0].ranges_m.len() / 2;
    assert!((scans[0].ranges_m[middle] - 1.5).abs() < 0.02, "{:?}", scans[0].ranges_m);
    assert!((scans[1].ranges_m[middle] - 2.5).abs() < 0.02, "{:?}", scans[1].ranges_m);
}

#[test]
fn a_tum_sequence_keeps_its_stamps_and_its_poses() {
    let folder = tempfile::tempdir().unwrap();
    let sequence = folder.path().join("rgbd_dataset_freiburg3_made_up");
    std::fs::create_dir_all(sequence.join("depth")).unwrap();
    write_depth_of((640, 480), &sequence.join("depth/a.png"), 5000);
    std::fs::write(sequence.join("depth.txt"), "# depth\n100.250001 depth/a.png\n").unwrap();
    std::fs::write(
        sequence.join("groundtruth.txt"),
        "# truth\n100.2 1 2 3 -0.5 0.5 -0.5 0.5\n100.3 2 2 3 -0.5 0.5 -0.5 0.5\n",
    )
    .unwrap();
    let bag = folder.path().join("tum.mcap");
    succeed(["import", "tum", sequence.to_str().unwrap(), "-o", bag.to_str().unwrap()]);

    let images = messages::<Image>(&bag, "/camera/depth/image_raw");
    let image = convert::depth_from_message(&images[0]).unwrap();
    assert_eq!(image.stamp, Stamp::from_secs_nanos(100, 250_001_000));
    // 5000 units are a metre there.
    assert_eq!(image.depth_m(0, 0), Some(1.0));

    let poses: Vec<_> = messages::<PoseStamped>(&bag, "/pose")
        .iter()
        .map(|pose| convert::pose_from_message(pose).unwrap())
        .collect();
    // The camera looks along the world's x axis with the image upright: the rig is not turned.
    let rig = poses[0].map_from_rig;
    assert!((rig.translation.vector - nalgebra::Vector3::new(1.0, 2.0, 3.0)).norm() < 1e-9);
    assert!(rig.rotation.angle() < 1e-6, "{rig}");
    assert_eq!(poses.len(), 2);
}

/// Six images of a wall, with their poses.
fn write_sequence(folder: &Path) {
    std::fs::create_dir_all(folder.join("depth")).unwrap();
    let (mut images, mut poses) = (String::new(), String::new());
    for index in 0..6 {
        // As large as the camera's are, whose calibration is known by the folder's name.
        write_depth_of((640, 480), &folder.join(format!("depth/{index}.png")), 5000);
        images += &format!("100.{index}00 depth/{index}.png\n");
        poses += &format!("100.{index}00 1 2 3 -0.5 0.5 -0.5 0.5\n");
    }
    std::fs::write(folder.join("depth.txt"), images).unwrap();
    std::fs::write(folder.join("groundtruth.txt"), poses).unwrap();
}

#[test]
fn a_tum_sequence_is_run_as_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let shown = |name: &str| path(name).display().to_string();
    let sequence = "rgbd_dataset_freiburg3_wall";
    write_sequence(&path(sequence));
    succeed(["run", &shown(sequence), "--out", &shown("as_it_is")]);
    let bag = shown("wall.mcap");
    succeed(["import", "tum", &shown(sequence), "--scan-from-depth", "-o", &bag]);
    succeed(["run", &bag, "--out", &shown("imported")]);
    let map = |out: &str| std::fs::read(path(out).join("map.ply")).unwrap();
    assert_eq!(map("as_it_is"), map("imported"));
    let points = geometry::ply::decode_with_normals(&map("as_it_is")).unwrap().points_m;
    assert!(points.len() > 1000, "{}", points.len());

    // Whose camera is not known is imported first.
    std::fs::rename(path(sequence), path("wall")).unwrap();
    let output = stillmap(["run", &shown("wall"), "--out", &shown("unknown")]);
    assert_eq!(output.status.code(), Some(1));
    let stderr = String::from_utf8_lossy(&output.stderr);
    let command = format!("`stillmap import tum {} --intrinsics", shown("wall"));
    assert!(stderr.contains(&command), "{stderr}");
    assert!(!path("unknown").exists());
}

#[test]
fn what_cannot_be_imported_is_named_with_the_mend() {
    let folder = tempfile::tempdir().unwrap();
    let bag = folder.path().join("x.mcap");
    let (folder, bag) = (folder.path().to_str().unwrap(), bag.to_str().unwrap());
    for (arguments, wanted) in [
        (
            vec!["import", "depth", folder, "--intrinsics", "1,1,1,1", "-o", bag],
            "holds no numbered PNG files",
        ),
        (vec!["import", "tum", folder, "-o", bag], "does not name the camera"),
        (
            vec!["import", "tum", folder, "--intrinsics", "1,1,1,1", "-o", bag],
            "a TUM sequence holds depth.txt",
        ),
    ] {
        let output = stillmap(&arguments);
        assert_eq!(output.status.code(), Some(1));
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert!(stderr.contains(wanted), "{stderr}");
        assert!(!Path::new(bag).exists());
    }
}
