//! One drive whose poses are stamped poses, an odometry, poses with covariance, or transforms alone.

use std::path::{Path, PathBuf};

use bag_player::Bag;
use geometry::{RigConfig, Stamp, StampedPose, pose_from_vector, pose_vector};
use msgs::convert;
use msgs::geometry_msgs::{PoseStamped, PoseWithCovarianceStamped, TransformStamped};
use msgs::nav_msgs::Odometry;
use msgs::sensor_msgs::{CameraInfo, Image};
use msgs::std_msgs::Header;
use msgs::tf2_msgs::TFMessage;
use nalgebra::{Isometry3, Point3, Vector3};

use crate::bags::{Topics, bag_of, messages_of};
use crate::program::{stillmap, succeed, summary};
use crate::transforms::{copy_sensors, on_robot};

/// The rig in the frame of the robot: the camera is in front of the robot's middle, at the height of a table, and looks a
/// little to the left and down.
fn base_from_rig() -> Isometry3<f64> {
    pose_from_vector(&[0.2, 0.05, 0.8, 0.1, 0.15, 0.0])
}

/// Where the odometry was started.
fn map_from_odom() -> Isometry3<f64> {
    Isometry3::new(Vector3::new(1.5, -0.7, 0.0), Vector3::z() * 0.6)
}

/// A drive through a room that a person crosses.
fn drive(folder: &Path) -> PathBuf {
    let bag = folder.join("drive.mcap");
    let scene = ["simulate", "--scene", "B", "--object", "person", "--path", "A", "--platform"];
    let size = ["drive", "--depth-size", "160", "120", "--seconds", "6", "-o"];
    succeed(scene.into_iter().chain(size).chain([bag.to_str().unwrap()]));
    bag
}

/// What the sensors of the drive read, and the mounts as the description of the robot has them.
fn with_description(
    folder: &Path,
    drive: &Path,
    name: &str,
    fill: impl FnOnce(&mut Topics),
) -> PathBuf {
    with_laser_at(folder, drive, name, RigConfig::default().mounts().rig_from_lidar, fill)
}

/// The same with another mount of the scanner in the description.
fn with_laser_at(
    folder: &Path,
    drive: &Path,
    name: &str,
    rig_from_lidar: Isometry3<f64>,
    fill: impl FnOnce(&mut Topics),
) -> PathBuf {
    let from = Bag::open(drive).unwrap();
    let start = from.info().unwrap().start.unwrap().plus_seconds(-0.5);
    let rig_from_camera = RigConfig::default().mounts().rig_from_camera;
    let on_base = |child: &str, rig_from_child: Isometry3<f64>| {
        on_robot(start, child, pose_vector(&(base_from_rig() * rig_from_child)))
    };
    let transforms = vec![
        on_base("camera_depth_optical_frame", rig_from_camera),
        on_base("laser", rig_from_lidar),
        TransformStamped {
            child_frame_id: "base_footprint".to_owned(),
            ..on_robot(start, "", [0.0, 0.0, -0.1, 0.0, 0.0, 0.0])
        },
    ];
    bag_of(folder, name, |topics| {
        topics.messages("/tf_static", [(start, TFMessage { transforms })]);
        copy_sensors(&from, topics);
        fill(topics);
    })
}

/// The robot's poses in the map, each with its time.
fn robot_poses(drive: &Path) -> Vec<(Stamp, StampedPose)> {
    let rig_from_base = base_from_rig().inverse();
    let poses = messages_of::<PoseStamped>(drive, "/pose").into_iter();
    let of_robot = |(time, message): (Stamp, PoseStamped)| {
        let pose = convert::pose_from_message(&message).unwrap();
        (time, StampedPose { map_from_rig: pose.map_from_rig * rig_from_base, ..pose })
    };
    poses.map(of_robot).collect()
}

/// Transforms of the map to the odometry ten times a second, and of the odometry to the robot at each pose.
fn by_localiser(poses: &[(Stamp, StampedPose)]) -> Vec<(Stamp, TFMessage)> {
    let odom_from_map = map_from_odom().inverse();
    let first = poses[0].1.stamp;
    let mut messages = Vec::new();
    for (time, pose) in poses {
        let odom_from_base = odom_from_map * pose.map_from_rig;
        messages.push((*time, transform(pose.stamp, "odom", "base_link", &odom_from_base)));
    }
    for tenth in 0..80 {
        let stamp = first.plus_seconds(f64::from(tenth) * 0.1);
        messages.push((stamp, transform(stamp, "map", "odom", &map_from_odom())));
    }
    messages.sort_by_key(|(time, _)| *time);
    messages
}

fn transform(stamp: Stamp, parent: &str, child: &str, pose: &Isometry3<f64>) -> TFMessage {
    let header = Header { stamp: convert::time_from_stamp(stamp), frame_id: parent.to_owned() };
    let transform = convert::transform_from_isometry(pose);
    let child_frame_id = child.to_owned();
    TFMessage { transforms: vec![TransformStamped { header, child_frame_id, transform }] }
}

/// The points of the map of a run.
fn map_of(bag: &Path, transport: &str, given: &[&str]) -> Vec<Point3<f32>> {
    let out = bag.with_extension(transport);
    let fixed =
        ["run", bag.to_str().unwrap(), "--transport", transport, "--out", out.to_str().unwrap()];
    succeed(fixed.into_iter().chain(given.iter().copied()));
    let cycles = summary(&out)["cycles"]["total"].as_u64().unwrap();
    assert!(cycles >= 35, "{cycles}");
    geometry::ply::decode(&std::fs::read(out.join("map.ply")).unwrap()).unwrap()
}

/// The share of points that have one of the others within 5 cm: more than the error of interpolated poses, less than the voxel in
/// which points are sought.
fn share_near(points: &[Point3<f32>], others: &[Point3<f32>]) -> f64 {
    const NEAR_M: f32 = 0.05;
    let key = |point: &Point3<f32>| [0, 1, 2].map(|axis| (point[axis] / NEAR_M).floor() as i32);
    let mut cells = std::collections::HashMap::<[i32; 3], Vec<Point3<f32>>>::new();
    for point in others {
        cells.entry(key(point)).or_default().push(*point);
    }
    let has_near = |point: &&Point3<f32>| {
        let [x, y, z] = key(point);
        (-1..=1).any(|i| {
            (-1..=1).any(|j| {
                (-1..=1).any(|k| {
                    let cell = cells.get(&[x + i, y + j, z + k]);
                    cell.is_some_and(|cell| {
                        cell.iter().any(|other| (other - **point).norm() <= NEAR_M)
                    })
                })
            })
        })
    };
    points.iter().filter(has_near).count() as f64 / points.len() as f64
}

#[track_caller]
fn assert_same_map(what: &str, found: &[Point3<f32>], expected: &[Point3<f32>]) {
    let (there, back) = (share_near(found, expected), share_near(expected, found));
    assert!(
        there > 0.98 && back > 0.98,
        "{what}: {there} of {}, {back} of {}",
        found.len(),
        expected.len()
    );
}

/// The poses of a robot with a SLAM and a description needed a node that relayed them, and the mounts as parameters.
#[test]
fn an_odometry_a_localisation_and_tf_give_the_map_of_stamped_poses() {
    let folder = tempfile::tempdir().unwrap();
    let drive = drive(folder.path());
    let poses = robot_poses(&drive);
    let expected = map_of(&drive, "local", &[]);
    assert!(expected.len() > 1000, "{}", expected.len());
    let of_robot = folder.path().join("robot.yaml");
    let text =
        "/**:\n  ros__parameters:\n    rig_frame_id: base_link\n    extrinsics: tf_from_rig\n";
    std::fs::write(&of_robot, text).unwrap();
    let of_robot = ["--params-file", of_robot.to_str().unwrap()];

    // An odometry of the robot's footprint, which tf carries over to the robot.
    let base_from_footprint = Isometry3::translation(0.0, 0.0, -0.1);
    let odometry = with_description(folder.path(), &drive, "odometry.mcap", |topics| {
        let messages = poses.iter().map(|(time, pose)| {
            let map_from_rig = pose.map_from_rig * base_from_footprint;
            let message = convert::message_from_pose(&StampedPose { map_from_rig, ..pose.clone() });
            let mut odometry = Odometry { header: message.header, ..Odometry::default() };
            odometry.child_frame_id = "base_footprint".to_owned();
            odometry.pose.pose = message.pose;
            (*time, odometry)
        });
        topics.messages("/odom", messages);
    });
    assert_same_map("odometry", &map_of(&odometry, "local", &of_robot), &expected);

    let localised = with_description(folder.path(), &drive, "localised.mcap", |topics| {
        let messages = poses.iter().map(|(time, pose)| {
            let message = convert::message_from_pose(pose);
            let mut with_covariance =
                PoseWithCovarianceStamped { header: message.header, ..Default::default() };
            with_covariance.pose.pose = message.pose;
            (*time, with_covariance)
        });
        topics.messages("/amcl_pose", messages);
    });
    assert_same_map("localisation", &map_of(&localised, "local", &of_robot), &expected);

    // map to odom ten times a second, odom to the robot at each pose; nothing is said of frames and mounts.
    let tf = || by_localiser(&poses);
    let by_tf = with_description(folder.path(), &drive, "by_tf.mcap", |topics| {
        topics.messages("/tf", tf());
    });
    for transport in ["local", "dds"] {
        assert_same_map(transport, &map_of(&by_tf, transport, &[]), &expected);
    }

    // Regression: of a bag with an odometry beside, as most robots' are, the mounts were those of the parameters, though tf has them.
    let with_odometry = with_description(folder.path(), &drive, "with_odometry.mcap", |topics| {
        topics.messages("/tf", tf());
        let messages = poses.iter().map(|(time, pose)| {
            let map_from_rig = map_from_odom().inverse() * pose.map_from_rig;
            let message = convert::message_from_pose(&StampedPose { map_from_rig, ..pose.clone() });
            let mut odometry = Odometry { header: message.header, ..Odometry::default() };
            (odometry.child_frame_id, odometry.pose.pose) = ("base_link".to_owned(), message.pose);
            (*time, odometry)
        });
        topics.messages("/odom", messages);
    });
    assert_same_map("with odometry", &map_of(&with_odometry, "local", &[]), &expected);

    // Regression: scans that are cut out of depth images were in a frame that tf does not have, and none became a cycle.
    let without_scanner = bag_of(folder.path(), "without_scanner.mcap", |topics| {
        let [image, info] = ["/camera/depth/image_raw", "/camera/depth/camera_info"];
        for topic in ["/tf_static", "/tf"] {
            topics.messages(topic, messages_of::<TFMessage>(&by_tf, topic));
        }
        topics.messages(info, messages_of::<CameraInfo>(&by_tf, info));
        topics.messages(image, messages_of::<Image>(&by_tf, image).into_iter().take(60));
    });
    assert!(!map_of(&without_scanner, "local", &[]).is_empty());
}

/// Regression: `calibrate` refused poses by tf, `doctor` compared nothing with them, and both took the mounts of the parameters where
/// `run` takes those of tf.
#[test]
fn calibrate_and_doctor_take_the_poses_and_mounts_that_a_run_takes() {
    let folder = tempfile::tempdir().unwrap();
    let drive = drive(folder.path());
    let poses = robot_poses(&drive);
    let truth = RigConfig::default().mounts().rig_from_lidar;
    let wrong = truth * Isometry3::new(Vector3::new(0.06, 0.03, 0.0), Vector3::z() * 0.04);
    let odometry = || {
        poses.iter().map(|(time, pose)| {
            let message = convert::message_from_pose(pose);
            let mut odometry = Odometry { header: message.header, ..Odometry::default() };
            (odometry.child_frame_id, odometry.pose.pose) = ("base_link".to_owned(), message.pose);
            (*time, odometry)
        })
    };
    let bag = |name: &str, rig_from_lidar: Isometry3<f64>, has_odometry: bool| {
        with_laser_at(folder.path(), &drive, name, rig_from_lidar, |topics| {
            topics.messages("/tf", by_localiser(&poses));
            if has_odometry {
                topics.messages("/odom", odometry());
            }
        })
    };
    for (name, has_odometry) in [("tf", false), ("odometry", true)] {
        let right = bag(&format!("{name}.mcap"), truth, has_odometry);
        let said = stillmap(["doctor", right.to_str().unwrap()]);
        let said = String::from_utf8(said.stdout).unwrap();
        assert!(said.contains("ok     by tf the scan lies 0.0"), "{name}: {said}");
        assert!(!said.contains("rig_from_lidar"), "{name}: {said}");

        let wrong = bag(&format!("{name}_wrong.mcap"), wrong, has_odometry);
        let said = stillmap(["doctor", wrong.to_str().unwrap()]);
        let said = String::from_utf8(said.stdout).unwrap();
        assert!(said.contains("error") && said.contains("by tf the scan lies"), "{name}: {said}");
        let file = folder.path().join(format!("{name}.yaml"));
        let arguments = ["calibrate", wrong.to_str().unwrap(), "-o", file.to_str().unwrap()];
        let calibrated = stillmap(arguments);
        assert!(file.exists(), "{name}: {}", String::from_utf8_lossy(&calibrated.stderr));
        let text = std::fs::read_to_string(&file).unwrap();
        let mount = |key: &str| {
            let line = text.lines().find_map(|line| line.trim().strip_prefix(key)).unwrap();
            let numbers = line.trim_matches(|one| " []".contains(one)).split(", ");
            let numbers: Vec<f64> = numbers.map(|number| number.parse().unwrap()).collect();
            pose_from_vector(&numbers.try_into().unwrap())
        };
        let off = (mount("rig_from_camera:").inverse() * mount("rig_from_lidar:")).inverse()
            * (RigConfig::default().mounts().rig_from_camera.inverse() * truth);
        assert!(off.translation.vector.norm() < 0.02, "{name}: {off}");
        assert!(off.rotation.angle() < 0.01, "{name}: {off}");
    }
}

#[test]
fn a_bag_without_any_pose_says_what_computes_one() {
    let folder = tempfile::tempdir().unwrap();
    let drive = drive(folder.path());
    let from = Bag::open(&drive).unwrap();
    let bag = bag_of(folder.path(), "none.mcap", |topics| {
        copy_sensors(&from, topics);
    });
    let out = folder.path().join("none");
    let ended = stillmap(["run", bag.to_str().unwrap(), "--out", out.to_str().unwrap()]);
    assert_eq!(ended.status.code(), Some(1));
    let said = String::from_utf8_lossy(&ended.stderr);
    for part in ["the bag has no pose", "nav_msgs/msg/Odometry", "/tf", "--pose visual"] {
        assert!(said.contains(part), "{said}");
    }
    let ended =
        stillmap(["run", bag.to_str().unwrap(), "--out", out.to_str().unwrap(), "--pose", "tf"]);
    assert_eq!(ended.status.code(), Some(1));
    let said = String::from_utf8_lossy(&ended.stderr);
    assert!(said.contains("neither /tf nor /tf_static"), "{said}");
}
