//! Bags with one fault each.

use std::path::{Path, PathBuf};

use bag_player::{BagWriter, Loss, LossKind, OfferedQos, Selection};
use detection::shell::DetectionParameters;
use geometry::{CameraModel, Distortion, Stamp};
use msgs::RosMessage;
use msgs::convert;
use msgs::geometry_msgs::PoseStamped;
use msgs::sensor_msgs::{CameraInfo, Image, LaserScan};
use msgs::tf2_msgs::TFMessage;

use super::*;
use crate::calibrate::joint_bag;
use crate::run::parameters::ParameterArgs;

/// A bag of two seconds: images at 30 Hz, scans at 10 Hz, poses at 20 Hz.
struct Recording {
    scans: Vec<(Stamp, LaserScan)>,
    images: Vec<(Stamp, Image)>,
    infos: Vec<(Stamp, CameraInfo)>,
    poses: Vec<(Stamp, PoseStamped)>,
    fixed: Vec<(Stamp, TFMessage)>,
}

const WIDTH_PX: u32 = 4;
const HEIGHT_PX: u32 = 2;

/// The pixels of a wall where the scan is.
fn wall(pixels: usize) -> Vec<u8> {
    2000_u16.to_le_bytes().repeat(pixels)
}

fn stamps(rate_hz: u32) -> impl Iterator<Item = Stamp> {
    let start = Stamp::from_secs_nanos(100, 0);
    (0..=2 * rate_hz).map(move |index| start.plus_seconds(f64::from(index) / f64::from(rate_hz)))
}

impl Recording {
    fn healthy() -> Self {
        let camera = CameraModel {
            width_px: WIDTH_PX as usize,
            height_px: HEIGHT_PX as usize,
            fx_px: 2.0,
            fy_px: 2.0,
            cx_px: 1.5,
            cy_px: 0.5,
            distortion: Distortion::None,
        };
        let scan = |stamp| {
            convert::message_from_scan(&geometry::Scan {
                stamp,
                frame_id: "laser".to_owned(),
                angle_min_rad: -0.5,
                angle_increment_rad: 0.1,
                time_increment_s: 0.0,
                scan_time_s: 0.1,
                range_min_m: 0.1,
                range_max_m: 8.0,
                ranges_m: (0..10).map(|beam| 2.0 / (0.1 * beam as f32 - 0.5).cos()).collect(),
            })
        };
        let pose = |stamp| {
            convert::message_from_pose(&geometry::StampedPose {
                stamp,
                frame_id: "map".to_owned(),
                map_from_rig: nalgebra::Isometry3::identity(),
            })
        };
        let info = |stamp| convert::message_from_camera(&camera, stamp, "camera");
        let image = |stamp| Image {
            header: info(stamp).header,
            height: HEIGHT_PX,
            width: WIDTH_PX,
            encoding: "16UC1".to_owned(),
            is_bigendian: 0,
            step: WIDTH_PX * 2,
            data: wall((WIDTH_PX * HEIGHT_PX) as usize),
        };
        Self {
            scans: stamps(10).map(|stamp| (stamp, scan(stamp))).collect(),
            images: stamps(30).map(|stamp| (stamp, image(stamp))).collect(),
            infos: stamps(30).map(|stamp| (stamp, info(stamp))).collect(),
            poses: stamps(20).map(|stamp| (stamp, pose(stamp))).collect(),
            fixed: Vec::new(),
        }
    }

    fn write(&self, folder: &Path) -> PathBuf {
        let path = folder.join("bag.mcap");
        let mut writer = BagWriter::create(&path).unwrap();
        put(&mut writer, "/scan", &self.scans);
        put(&mut writer, "/depth/image", &self.images);
        put(&mut writer, "/depth/camera_info", &self.infos);
        put(&mut writer, "/pose", &self.poses);
        if !self.fixed.is_empty() {
            let fixed = writer.channel::<TFMessage>("/tf_static", OfferedQos::latched()).unwrap();
            self.fixed.iter().for_each(|(at, message)| writer.write(fixed, *at, message).unwrap());
        }
        writer.finish().unwrap();
        path
    }

    fn findings(&self) -> Vec<Finding> {
        let folder = tempfile::tempdir().unwrap();
        findings_of(&self.write(folder.path()))
    }
}

fn put<M: RosMessage>(writer: &mut BagWriter, topic: &str, messages: &[(Stamp, M)]) {
    if messages.is_empty() {
        return;
    }
    let channel = writer.channel::<M>(topic, OfferedQos::reliable(10)).unwrap();
    for (stamp, message) in messages {
        writer.write(channel, *stamp, message).unwrap();
    }
}

fn defaults() -> PipelineParameters {
    PipelineParameters::load(&ParameterArgs::default()).unwrap()
}

fn findings_of(path: &Path) -> Vec<Finding> {
    let buffer =
        ReceiveBuffer { granted_bytes: 1 << 20, asked_bytes: 1 << 20, largest_safe_bytes: 1 << 20 };
    let bag = Bag::open(path).unwrap();
    let parameters = defaults();
    // The mount is given, so that it is no finding that these bags do not show it.
    findings(&bag, &TopicArgs::default(), (parameters, true), Some(&buffer)).unwrap()
}

/// Regression: a bag without tf, which does not show where the scanner is, had no finding about it.
#[test]
fn a_mount_that_nothing_says_is_found_with_the_command_that_determines_it() {
    let folder = tempfile::tempdir().unwrap();
    let bag = Bag::open(&Recording::healthy().write(folder.path())).unwrap();
    let faults = |files: Vec<PathBuf>| -> Vec<Finding> {
        let args = ParameterArgs { files, ..ParameterArgs::default() };
        let parameters = PipelineParameters::load(&args).unwrap();
        let findings = findings(&bag, &TopicArgs::default(), (parameters, false), None).unwrap();
        findings.into_iter().filter(|one| one.severity != Severity::Ok).collect()
    };
    let parts = ["neither tf (camera to laser) nor a parameter file", "stillmap calibrate BAG"];
    only_fault(&faults(Vec::new()), Severity::Warn, &parts);
    let file = folder.path().join("mount.yaml");
    let mount = "/**: {ros__parameters: {rig_from_lidar: [0.0, 0.0, -0.1, 0.0, 0.0, 0.0]}}\n";
    std::fs::write(&file, mount).unwrap();
    assert_eq!(faults(vec![file]), []);
}

/// The one finding that is not ok.
#[track_caller]
fn only_fault(findings: &[Finding], severity: Severity, parts: &[&str]) {
    let faults: Vec<_> = findings.iter().filter(|one| one.severity != Severity::Ok).collect();
    assert_eq!(faults.len(), 1, "{faults:?}");
    assert_eq!(faults[0].severity, severity, "{faults:?}");
    let line = faults[0].line(false);
    for part in parts {
        assert!(line.contains(part), "'{part}' is not in: {line}");
    }
}

#[test]
fn all_findings_of_a_healthy_bag_are_ok() {
    let findings = Recording::healthy().findings();
    assert!(findings.iter().all(|one| one.severity == Severity::Ok), "{findings:?}");
    let reports = |part: &str| findings.iter().any(|one| one.what.contains(part));
    assert!(reports("reads /scan, /depth/image with /depth/camera_info, /pose"));
    assert!(reports("/scan: 21 messages at 10.0 Hz"));
    assert!(reports("21 of 21 scans"));
    assert!(reports("61 of 61 images"));
}

#[test]
fn a_bag_without_a_scanner_is_run_nevertheless() {
    let findings = Recording { scans: Vec::new(), ..Recording::healthy() }.findings();
    assert!(findings.iter().all(|one| one.severity == Severity::Ok), "{findings:?}");
    let says = |part: &str| findings.iter().any(|one| one.what.contains(part));
    assert!(says("reads scans that it cuts out of the depth images"), "{findings:?}");
}

#[test]
fn a_bag_without_poses_names_what_is_missing() {
    let bag = Recording { poses: Vec::new(), ..Recording::healthy() };
    let parts = ["the bag has no pose", "geometry_msgs/msg/PoseStamped", "--pose"];
    only_fault(&bag.findings(), Severity::Error, &parts);
}

/// Regression: with poses by tf nothing was said of poses, offsets and mounts, as if all were well.
#[test]
fn what_is_not_checked_without_a_topic_of_poses_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let bag = Bag::open(&Recording::healthy().write(folder.path())).unwrap();
    let mut topics = TopicArgs::default();
    topics.pose = Some("tf".to_owned());
    let findings = findings(&bag, &topics, (defaults(), true), None).unwrap();
    let said = |check: Check| {
        let of_check = findings.iter().filter(|one| one.check == check);
        of_check.map(|one| one.what.clone()).collect::<Vec<_>>().join("; ")
    };
    assert!(said(Check::Poses).contains("not checked"), "{findings:?}");
    assert!(said(Check::Extrinsics).contains("not checked"), "{findings:?}");
    assert!(said(Check::Offsets).contains("21 of 21 scans"), "{findings:?}");
}

/// Regression: nothing was said of fixed transforms that were recorded last: who plays the bag drops what comes before.
#[test]
fn fixed_transforms_that_come_late_are_found() {
    let fixed_after = |seconds: f64, tool_after_s: f64| {
        let at = |seconds: f64| Stamp::from_secs_nanos(100, 0).plus_seconds(seconds);
        let on_robot = |child: &str| {
            let mut transform = msgs::geometry_msgs::TransformStamped::default();
            transform.header.frame_id = "base_link".to_owned();
            transform.child_frame_id = child.to_owned();
            transform.transform.rotation.w = 1.0;
            transform
        };
        let sensors = TFMessage { transforms: vec![on_robot("laser"), on_robot("camera")] };
        let tool = TFMessage { transforms: vec![on_robot("tool")] };
        let fixed = vec![(at(seconds), sensors), (at(tool_after_s), tool)];
        Recording { fixed, ..Recording::healthy() }.findings()
    };
    let early = fixed_after(1.0, 2.5);
    assert!(early.iter().all(|one| one.severity == Severity::Ok), "{early:?}");
    let late = fixed_after(2.1, 2.1);
    only_fault(&late, Severity::Warn, &["/tf_static: ", "2.1 s after", "ros2 bag play"]);
}

#[test]
fn a_gap_of_the_scanner_is_found() {
    let mut bag = Recording::healthy();
    bag.scans.drain(8..14);
    only_fault(&bag.findings(), Severity::Warn, &["/scan: 1 gaps", "0.700 s"]);
}

#[test]
fn clocks_that_differ_are_found() {
    let mut bag = Recording::healthy();
    for (_, scan) in &mut bag.scans {
        scan.header.stamp.sec += 60;
    }
    let findings = bag.findings();
    let of =
        |check| findings.iter().filter(move |one| one.check == check).cloned().collect::<Vec<_>>();
    let parts = ["0 of 21 scans", "-59.000 s after", "chrony"];
    only_fault(&of(Check::Offsets), Severity::Error, &parts);
    only_fault(
        &of(Check::Clocks),
        Severity::Error,
        &["/scan: its stamps are 60.000 s ahead", "PTP"],
    );
}

/// Regression: with clocks seconds apart the scan lay beside the surfaces, an error of its own, though it is that of the clocks.
#[test]
fn a_mount_is_not_judged_where_clocks_differ() {
    let mut bag = Recording::healthy();
    for (_, image) in &mut bag.images {
        image.header.stamp.sec -= 4;
    }
    let findings = bag.findings();
    let of_mount = findings.iter().filter(|one| one.check == Check::Extrinsics);
    let said: Vec<&str> = of_mount.map(|one| one.what.as_str()).collect();
    assert!(said.len() == 1 && said[0].ends_with("takes clocks that agree"), "{said:?}");
}

/// Regression: of a camera whose stamps are 0.3 s behind after a restart the gap alone was told.
#[test]
fn a_clock_that_is_another_one_after_a_gap_is_found() {
    let after_gap = |behind_s: f64| {
        let mut bag = Recording::healthy();
        bag.images.drain(20..35);
        for (at, image) in bag.images.iter_mut().skip(20) {
            image.header.stamp = convert::time_from_stamp(at.plus_seconds(-behind_s));
        }
        let findings = bag.findings().into_iter();
        findings.filter(|one| one.check == Check::Clocks).collect::<Vec<_>>()
    };
    assert_eq!(after_gap(0.0), []);
    let parts = ["/depth/image: after the gap", "0.300 s behind those before it"];
    only_fault(&after_gap(0.3), Severity::Warn, &parts);
}

#[test]
fn an_odometry_that_ends_early_is_found() {
    let mut bag = Recording::healthy();
    bag.poses.truncate(20);
    only_fault(&bag.findings(), Severity::Warn, &["of 61 images", "poses reach from +0.0 s"]);
}

#[test]
fn images_that_are_no_depth_are_found() {
    let mut bag = Recording::healthy();
    for (_, image) in &mut bag.images {
        image.encoding = "rgb8".to_owned();
    }
    only_fault(&bag.findings(), Severity::Error, &["/depth/image: 61 of 61", "rgb8", "16UC1"]);
}

#[test]
fn images_that_do_not_cross_dds_here_are_found() {
    let mut bag = Recording::healthy();
    for (_, image) in &mut bag.images {
        (image.width, image.height, image.step) = (640, 900, 1280);
        image.data = wall(640 * 900);
    }
    for (_, info) in &mut bag.infos {
        (info.width, info.height) = (640, 900);
        info.k = [600.0, 0.0, 319.5, 0.0, 600.0, 449.5, 0.0, 0.0, 1.0];
    }
    let parts = ["/depth/image: messages of 1152 kB", "1048 kB", "--compress-depth /depth/image"];
    only_fault(&bag.findings(), Severity::Warn, &parts);
}

#[test]
fn a_bag_that_was_cut_is_damaged() {
    let folder = tempfile::tempdir().unwrap();
    let path = Recording::healthy().write(folder.path());
    let bytes = std::fs::read(&path).unwrap();
    std::fs::write(&path, &bytes[..bytes.len() / 4]).unwrap();
    let findings = findings_of(&path);
    let is_damage = |one: &&Finding| one.check == Check::Damage && one.severity == Severity::Error;
    let Some(damage) = findings.iter().find(is_damage) else { panic!("{findings:?}") };
    assert!(damage.line(false).contains("stillmap import bag BAG"), "{damage:?}");
}

/// Regression: a topic of a bag of ROS 1 that has another layout in ROS 2, as markers have, was damage, with the advice to record the bag again.
#[test]
fn a_topic_that_nothing_reads_may_be_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let bag = Bag::open(&Recording::healthy().write(folder.path())).unwrap();
    let parameters = DetectionParameters::default();
    let mut facts = BagFacts::read(&bag, &TopicArgs::default(), &parameters).unwrap();
    let severity = |facts: &BagFacts| -> Vec<Severity> {
        rules::losses(facts).iter().map(|one| one.severity).collect()
    };
    let left_out = |topic: &str| Loss {
        file: "room.bag".into(),
        offset_bytes: 0,
        size_bytes: 0,
        messages: Some(7),
        kind: LossKind::LeftOut { topic: topic.to_owned(), reason: "another layout".to_owned() },
    };
    facts.losses = vec![left_out("/markers (visualization_msgs/Marker)")];
    assert_eq!(severity(&facts), [Severity::Ok]);
    facts.losses.push(left_out("/scan (sensor_msgs/LaserScan)"));
    assert_eq!(severity(&facts), [Severity::Error, Severity::Ok]);
}

/// What is said of the mount in a bag whose scanner a joint turns: the turn, and the error of tf.
fn mount_of_joint(turn_and_error_rad: [f64; 2]) -> Finding {
    let folder = tempfile::tempdir().unwrap();
    let [path, file] = joint_bag::write(folder.path(), turn_and_error_rad);
    let args = ParameterArgs { files: vec![file], ..ParameterArgs::default() };
    let parameters = PipelineParameters::load(&args).unwrap();
    let bag = Bag::open(&path).unwrap();
    let findings = findings(&bag, &TopicArgs::default(), (parameters, true), None).unwrap();
    let mut of_mount = findings.into_iter().filter(|one| one.check == Check::Extrinsics);
    let (first, second) = (of_mount.next().unwrap(), of_mount.next());
    assert_eq!(second, None, "{first:?}");
    first
}

/// Regression: the last transform of the bag was taken for the mount of all scans, so that a robot whose head turns had an
/// error, or no line.
#[test]
fn the_mount_by_a_joint_is_that_of_each_scan() {
    let right = mount_of_joint([joint_bag::TURN_RAD, 0.0]);
    assert_eq!(right.severity, Severity::Ok, "{right:?}");
    assert!(right.what.contains("by tf the scan lies 0.0"), "{right:?}");
    let wrong = mount_of_joint([joint_bag::TURN_RAD; 2]);
    assert_eq!(wrong.severity, Severity::Error, "{wrong:?}");
}

/// Regression: nothing was said of the mount where too few returns lie on surfaces, as if it had been checked.
#[test]
fn a_mount_that_the_images_do_not_show_is_said_to_be_unchecked() {
    let findings = Recording::healthy().findings();
    let is_said = |one: &Finding| {
        one.check == Check::Extrinsics
            && one.what.contains("not checked")
            && one.what.contains("30 returns on such surfaces; of 20 scans 0 are")
    };
    assert!(findings.iter().any(is_said), "{findings:?}");
}

/// Regression: nothing was said where depths and ranges differ grossly: no return is near a surface then, by which the mount is judged.
#[test]
fn depths_of_another_scale_than_the_ranges_are_found() {
    let folder = tempfile::tempdir().unwrap();
    let [path, _] = joint_bag::write(folder.path(), [0.0; 2]);
    let of_scale = |scale: f64| {
        let scaled = folder.path().join("scaled.mcap");
        with_depths(&path, &scaled, |depth_mm| (scale * f64::from(depth_mm)).round() as u16);
        let findings = findings_of(&scaled);
        findings.into_iter().filter(|one| one.severity != Severity::Ok).collect::<Vec<_>>()
    };
    assert_eq!(of_scale(1.0), []);
    let parts =
        ["its depths are 2.00 times the ranges of /scan", "beams that end in its view", "REP-118"];
    only_fault(&of_scale(2.0), Severity::Error, &parts);
    // Tenths of a millimetre are said once, by the camera alone.
    let parts = ["the median depth of its 16UC1 images", "tenths of a millimetre"];
    only_fault(&of_scale(10.0), Severity::Error, &parts);
}

/// The same bag with other depths.
fn with_depths(from: &Path, to: &Path, edit: impl Fn(u16) -> u16) {
    let mut writer = BagWriter::create(to).unwrap();
    for message in Bag::open(from).unwrap().messages(&Selection::default()).unwrap() {
        let mut message = message.unwrap();
        if let Ok(mut image) = message.decode::<Image>() {
            let (pixels, _) = image.data.as_chunks_mut::<2>();
            for pixel in pixels {
                *pixel = edit(u16::from_le_bytes(*pixel)).to_le_bytes();
            }
            message.data = msgs::cdr::encode(&image).unwrap();
        }
        let (topic, type_name) = (&message.topic, &message.type_name);
        let qos = OfferedQos::reliable(10).to_yaml();
        let channel = writer.raw_channel(topic, type_name, "", &qos).unwrap();
        let at = message.log_time;
        writer.write_raw(channel, at, at, &message.data).unwrap();
    }
    writer.finish().unwrap();
}
