//! Texts: parameter files, arguments, scenarios, calibrations, names.

use std::net::IpAddr;

use calibration::camera_file::camera_from_yaml;
use compression::CompressionParameters;
use detection::shell::DetectionParameters;
use lidar_odometry::packets::Calibration;
use lidar_odometry::shell::LidarOdometryParameters;
use live_view::Access;
use node_shell::names::NodeIdentity;
use node_shell::parameters::{self, Assignment};
use node_shell::{RosArguments, StaticPeer};
use pose::shell::PoseParameters;
use reconstruction::shell::ReconstructionParameters;
use segmentation::shell::SegmentationParameters;
use simulator::Scenario;

use super::bags::on_disk;
use super::{OF_FILES, text_of};
use crate::{MemoryBound, Target};

/// The reader of YAML keeps its events and their places, and aliases up to its budget.
const YAML: MemoryBound = MemoryBound { base_bytes: 16 << 20, per_byte: 4096 };

const YAML_WORDS: &[&[u8]] = &[
    b"&a ",
    b"*a",
    b"<<: *a",
    b"- ",
    b"  ",
    b": ",
    b"[",
    b"]",
    b"{",
    b"}",
    b"|\n",
    b"!!float ",
    b"\n---\n",
    b"? ",
    b"\"",
    b"[[[[[[[[",
    b"{a: {a: {a: ",
];

const fn target(
    name: &'static str,
    body: fn(&[u8]),
    seeds: fn() -> Vec<Vec<u8>>,
    words: &'static [&'static [u8]],
) -> Target {
    Target { name, body, seeds, words, memory: YAML, gate_cases: OF_FILES }
}

pub(super) const TARGETS: &[Target] = &[
    target("parameter_file", parameter_file, parameter_files, YAML_WORDS),
    Target {
        gate_cases: 2000,
        ..target(
            "ros_args",
            ros_args,
            || {
                vec![
                    b"--ros-args\0-r\0scan:=/laser/scan\0-p\0window_scans:=4\0-r\0__ns:=/robot\0-r\0__node:=a\0--log-level\0debug"
                        .to_vec(),
                    b"--ros-args\0-p\0detection:voxel_edge_m:=0.05\0--remap\0rostopic://a:=b\0--\0file.mcap".to_vec(),
                ]
            },
            &[
                b"\0",
                b":=",
                b"-r",
                b"-p",
                b"__ns",
                b"__node",
                b"~/",
                b"{",
                b"}",
                b"/",
                b"--params-file",
                b"rosservice://",
                b"--log-level",
            ],
        )
    },
    target("scenario", scenario, scenarios, YAML_WORDS),
    target("camera_file", |bytes| drop(camera_from_yaml(text_of(bytes))), camera_files, YAML_WORDS),
    target(
        "laser_calibration",
        |bytes| drop(Calibration::from_yaml(text_of(bytes))),
        laser_calibrations,
        YAML_WORDS,
    ),
    Target {
        gate_cases: 2000,
        ..target(
            "names",
            names,
            || {
                vec![
                    b"robot\0detection\0~/map\0/tf\x00127.0.0.1:7411\0http://localhost:8642"
                        .to_vec(),
                ]
            },
            &[b"\0", b"/", b"~", b"{node}", b"{ns}", b"__", b"localhost:", b"[::1]:", b"https://"],
        )
    },
];

fn parameter_file(bytes: &[u8]) {
    on_disk("parameters.yaml", bytes, |path| {
        let none: [Assignment; 0] = [];
        let files = [path];
        let _ = parameters::is_for("/detection", path);
        let _ = parameters::load::<DetectionParameters>("/detection", &files, &none);
        let _ = parameters::load::<SegmentationParameters>("/segmentation", &files, &none);
        let _ =
            parameters::load::<ReconstructionParameters>("/robot/reconstruction", &files, &none);
        let _ = parameters::load::<PoseParameters>("/pose", &files, &none);
        let _ = parameters::load::<LidarOdometryParameters>("/lidar_odometry", &files, &none);
        let _ = parameters::load::<CompressionParameters>("/compression", &files, &none);
    });
}

fn parameter_files() -> Vec<Vec<u8>> {
    let texts = [
        "/**:\n  ros__parameters:\n    use_sim_time: true\n    voxel_edge_m: 0.05\n",
        "detection:\n  ros__parameters:\n    window_scans: 4\n    rig: {camera: {x_m: 0.1}}\n",
        "/robot/*:\n  ros__parameters:\n    map_file: \"map.ply\"\n    tiles: [1.0, 2.0]\n",
    ];
    texts.iter().map(|text| text.as_bytes().to_vec()).collect()
}

/// Arguments with a zero between them.
fn ros_args(bytes: &[u8]) {
    let arguments = text_of(bytes).split('\0');
    let Ok(parsed) = RosArguments::parse(arguments) else { return };
    if let Ok(node) = parsed.identity("detection") {
        let _ = node.full_name();
    }
    for value in text_of(bytes).split('\0').filter_map(|argument| argument.split_once(":=")) {
        let one = [Assignment { name: value.0.to_owned(), value: value.1.to_owned() }];
        let files: [&str; 0] = [];
        let _ = parameters::load::<DetectionParameters>("/detection", &files, &one);
    }
}

fn scenario(bytes: &[u8]) {
    let _ = Scenario::from_yaml(text_of(bytes));
}

fn scenarios() -> Vec<Vec<u8>> {
    vec![include_bytes!("../../../../nodes/laboratory/simulator/scenes/example.yaml").to_vec()]
}

fn camera_files() -> Vec<Vec<u8>> {
    vec![include_bytes!("../../../../nodes/calibration/cameras/rec_hv_annex_2.yaml").to_vec()]
}

fn laser_calibrations() -> Vec<Vec<u8>> {
    let laser = |id: usize| {
        format!(
            "- {{dist_correction: 0.0, dist_correction_x: 0.0, dist_correction_y: 0.0, focal_distance: 0.0, focal_slope: \
             0.0, horiz_offset_correction: 0.0, laser_id: {id}, rot_correction: 0.0, vert_correction: -0.26, \
             vert_offset_correction: 0.01}}\n"
        )
    };
    let lasers: String = (0..2).map(laser).collect();
    vec![format!("lasers:\n{lasers}num_lasers: 2\ndistance_resolution: 0.002\n").into_bytes()]
}

/// Names, addresses and headers with a zero between them.
fn names(bytes: &[u8]) {
    let texts: Vec<&str> = text_of(bytes).split('\0').collect();
    let text = |index: usize| texts.get(index).copied().unwrap_or_default();
    if let Ok(node) = NodeIdentity::new(text(0), text(1)) {
        for name in &texts {
            let _ = node.expand(name);
            let _ = node.resolve(&[], name);
        }
        let _ = node.logger_name();
    }
    let loopback = Access::on(IpAddr::from([127, 0, 0, 1]), [0; 16]);
    let open = Access::on(IpAddr::from([10, 0, 0, 1]), [7; 16]);
    for pair in texts.windows(2) {
        let _ = StaticPeer::parse(pair[0]);
        let _ = msgs::schema_of(pair[0]);
        let _ = loopback.check_data(Some(pair[0]), Some(pair[1]), None);
        assert!(open.check_page(Some(pair[0]), Some(pair[1])).is_err(), "the token was guessed");
    }
}
