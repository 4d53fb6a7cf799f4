//! The files of `config/` say what the program says: their values are its defaults, none is missing,
//! and the presets fit the nodes.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use compression::CompressionParameters;
use detection::shell::DetectionParameters;
use geometry::PipelineConfig;
use lidar_odometry::shell::LidarOdometryParameters;
use msgs::rcl_interfaces::{ListParametersResponse, ListParametersResult, ParameterType};
use node_shell::MessageTooLarge;
use node_shell::parameters::{self, Assignment, NodeParameters};
use pose::shell::PoseParameters;
use reconstruction::shell::ReconstructionParameters;
use segmentation::shell::SegmentationParameters;
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;

const NODES: [&str; 3] = ["detection", "segmentation", "reconstruction"];

fn config(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../config").join(path)
}

/// The section that stands for a node of this name in any namespace.
fn section_of(node: &str) -> String {
    format!("/**/{node}")
}

/// The names of the sections in a parameter file, and of the parameters in each.
fn sections(file: &Path) -> Vec<(String, BTreeSet<String>)> {
    let text = std::fs::read_to_string(file).unwrap();
    let document: Value = serde_saphyr::from_str(&text).unwrap();
    let names =
        |section: &Value| section["ros__parameters"].as_object().unwrap().keys().cloned().collect();
    document
        .as_object()
        .unwrap()
        .iter()
        .map(|(node, section)| (node.clone(), names(section)))
        .collect()
}

/// The parameters that a node gets out of a file, alone and in a namespace alike.
fn load<P>(node: &str, file: &Path) -> P
where
    P: geometry::parameter::Parameters + Serialize + DeserializeOwned + Default,
{
    let load = |full_name: String| {
        parameters::load::<P>(&full_name, &[file], &[] as &[Assignment])
            .unwrap_or_else(|error| panic!("{full_name}: {error}"))
    };
    let alone = load(format!("/{node}"));
    let in_namespace = load(format!("/robot/{node}"));
    assert_eq!(values(&alone), values(&in_namespace), "{node} in {}", file.display());
    alone
}

fn values<P: Serialize>(parameters: &P) -> Value {
    serde_json::to_value(parameters).unwrap()
}

/// The names of what the nodes of the pipeline share.
fn shared_names() -> BTreeSet<String> {
    values(&PipelineConfig::default()).as_object().unwrap().keys().cloned().collect()
}

fn holds_every_default<P>(node: &str)
where
    P: geometry::parameter::Parameters + Serialize + DeserializeOwned + Default,
{
    let file = config(&format!("{node}.yaml"));
    let known: BTreeSet<String> =
        parameters::describe::<P>().unwrap().into_iter().map(|(name, _)| name).collect();
    // What it shares with the other nodes of the pipeline has a file of its own.
    let shared = if NODES.contains(&node) { shared_names() } else { BTreeSet::new() };
    assert!(shared.is_subset(&known), "{node} knows {known:?}");
    let known = known.difference(&shared).cloned().collect();
    assert_eq!(sections(&file), [(section_of(node), known)], "{}", file.display());

    let (loaded, defaults) = (values(&load::<P>(node, &file)), values(&P::default()));
    for (name, default) in defaults.as_object().unwrap() {
        assert_eq!(&loaded[name], default, "{name} in {}", file.display());
    }
}

#[test]
fn what_the_pipeline_shares_has_one_file_with_every_default() {
    let file = config("pipeline.yaml");
    assert_eq!(sections(&file), [("/**".to_owned(), shared_names())]);
    let pipeline = PipelineConfig::default();
    assert_eq!(load::<DetectionParameters>("detection", &file).config.pipeline, pipeline);
    assert_eq!(load::<SegmentationParameters>("segmentation", &file).config.pipeline, pipeline);
    assert_eq!(load::<ReconstructionParameters>("reconstruction", &file).config.pipeline, pipeline);
    // The pose node reads of it what has the same name.
    assert_eq!(load::<PoseParameters>("pose", &file), PoseParameters::default());
}

#[test]
fn each_node_has_a_file_with_every_parameter_at_its_default() {
    holds_every_default::<DetectionParameters>("detection");
    holds_every_default::<SegmentationParameters>("segmentation");
    holds_every_default::<ReconstructionParameters>("reconstruction");
    holds_every_default::<CompressionParameters>("compression");
    holds_every_default::<LidarOdometryParameters>("lidar_odometry");
}

/// The parameters of a section, those of groups with the groups' names before them.
fn leaves(group: &Value, prefix: &str) -> BTreeSet<String> {
    let leaf = |(name, value): (&String, &Value)| {
        let name = format!("{prefix}{name}");
        if value.is_object() { leaves(value, &format!("{name}.")) } else { [name].into() }
    };
    group.as_object().unwrap().iter().flat_map(leaf).collect()
}

#[test]
fn the_pose_nodes_file_has_every_parameter_at_its_default() {
    let file = config("pose.yaml");
    let document: Value = serde_saphyr::from_str(&std::fs::read_to_string(&file).unwrap()).unwrap();
    let described = parameters::describe::<PoseParameters>().unwrap();
    let known: BTreeSet<String> = described.into_iter().map(|(name, _)| name).collect();
    assert_eq!(leaves(&document[section_of("pose")]["ros__parameters"], ""), known);
    let loaded: PoseParameters = load("pose", &file);
    assert_eq!(loaded, PoseParameters::default());
    loaded.validate().unwrap();
}

/// What a node says of its parameters to others: each has a description, its range is no narrower than what the node
/// accepts, and no wider at its ends, and none that names a file may be set while the node runs.
fn descriptors_say_what_holds<P: NodeParameters>() {
    let accepts = |name: &str, value: &str| {
        let assignment = Assignment { name: name.to_owned(), value: value.to_owned() };
        parameters::load::<P>("/n", &[] as &[PathBuf], &[assignment])
            .is_ok_and(|loaded| loaded.validate_node().is_ok())
    };
    let accepts_whole = |name: &str, number: i64| accepts(name, &number.to_string());
    let accepts_real = |name: &str, number: f64| accepts(name, &format!("{number:e}"));
    for one in &node_shell::descriptors::<P>().unwrap() {
        let name = one.name.as_str();
        assert!(!one.description.is_empty(), "{name} has no description");
        assert!(
            one.read_only || !names_a_place(name),
            "{name} may be set by anybody on the network"
        );
        // What other parameters bound as well may refuse the ends.
        let is_bound = BOUND_BY_OTHERS.contains(&name);
        match (one.r#type, one.integer_range.first(), one.floating_point_range.first()) {
            (ParameterType::PARAMETER_INTEGER, Some(range), None) => {
                let (least, most) = (range.from_value, range.to_value);
                assert!(!accepts_whole(name, least - 1), "{name} may be below {least}");
                assert!(is_bound || accepts_whole(name, least), "{name} may not be {least}");
                if let Some(more) = most.checked_add(1) {
                    assert!(!accepts_whole(name, more), "{name} may be above {most}");
                    assert!(is_bound || accepts_whole(name, most), "{name} may not be {most}");
                }
            }
            (ParameterType::PARAMETER_DOUBLE, None, Some(range)) => {
                let (least, most) = (range.from_value, range.to_value);
                for outside in [least.next_down(), most.next_up(), f64::MIN, f64::MAX] {
                    let is_outside = !(least..=most).contains(&outside);
                    let is_refused = !outside.is_finite() || !accepts_real(name, outside);
                    assert!(!is_outside || is_refused, "{name} may be {outside}");
                }
                if !is_bound {
                    assert!(accepts_real(name, least), "{name} may not be {least}");
                    assert!(accepts_real(name, most), "{name} may not be {most}");
                }
            }
            (ParameterType::PARAMETER_DOUBLE, None, None)
                if one.additional_constraints.is_empty() =>
            {
                for number in ["-1000000000", "0", "1000000000"] {
                    assert!(accepts(name, number), "{name} has no range, and may not be {number}");
                }
            }
            (_, None, None) => {}
            (kind, ..) => panic!("{name} of the type {kind} has a range"),
        }
    }
}

/// Whether a parameter names a file or a folder.
fn names_a_place(name: &str) -> bool {
    ["_file", "_folder", "_on_exit"].iter().any(|end| name.ends_with(end))
}

/// A response that every client of a service gets: one datagram of Ethernet's, less what is in it besides.
const LARGEST_RESPONSE_BYTES: usize = 1372;

/// `ros2 param list` gets its answer, whatever middleware it runs on.
fn names_fit_into_a_response<P: NodeParameters>() {
    let names: Vec<String> =
        node_shell::descriptors::<P>().unwrap().into_iter().map(|one| one.name).collect();
    let result = ListParametersResult { names, prefixes: Vec::new() };
    let bytes = msgs::cdr::encode(&ListParametersResponse { result }).unwrap().len();
    assert!(bytes <= LARGEST_RESPONSE_BYTES, "{bytes}");
}

#[test]
fn the_names_of_each_nodes_parameters_fit_into_one_response() {
    names_fit_into_a_response::<DetectionParameters>();
    names_fit_into_a_response::<SegmentationParameters>();
    names_fit_into_a_response::<ReconstructionParameters>();
    names_fit_into_a_response::<CompressionParameters>();
    names_fit_into_a_response::<LidarOdometryParameters>();
}

/// Their ranges hang on one another.
const BOUND_BY_OTHERS: [&str; 15] = [
    "voxel_edge_m",
    "evidence_cell_m",
    "evidence_extent_m",
    "evidence_reach_m",
    "min_range_m",
    "max_range_m",
    "grid_min_height_m",
    "grid_max_height_m",
    "grid_free_below_m",
    "frame.points.threshold",
    "frame.points.low_threshold",
    "frame.line_depth.nearest_side_px",
    "frame.line_depth.farthest_side_px",
    "follow.narrow_radius_px",
    "follow.widest_radius_px",
];

#[test]
fn each_parameter_is_described_with_the_range_that_its_node_accepts() {
    descriptors_say_what_holds::<DetectionParameters>();
    descriptors_say_what_holds::<SegmentationParameters>();
    descriptors_say_what_holds::<ReconstructionParameters>();
    descriptors_say_what_holds::<CompressionParameters>();
    descriptors_say_what_holds::<LidarOdometryParameters>();
    descriptors_say_what_holds::<PoseParameters>();
}

#[test]
fn each_rig_preset_fits_its_nodes() {
    let presets: Vec<PathBuf> =
        std::fs::read_dir(config("rig")).unwrap().map(|entry| entry.unwrap().path()).collect();
    for known in ["rig/rplidar_a1_kinect_v1.yaml", "rig/hdl32e_car.yaml"] {
        assert!(presets.contains(&config(known)), "{presets:?}");
    }
    for preset in &presets {
        // A section of a misspelt node would be nobody's, and so pass for one without mistakes.
        let found: BTreeSet<String> = sections(preset).into_iter().map(|(node, _)| node).collect();
        if found == [section_of("lidar_odometry")].into() {
            load::<LidarOdometryParameters>("lidar_odometry", preset)
                .validate()
                .unwrap_or_else(|error| panic!("{}: {error}", preset.display()));
            continue;
        }
        let of_a_node = |node: &String| {
            ["detection", "segmentation", "reconstruction"].map(section_of).contains(node)
        };
        let (of_all, of_nodes): (Vec<&String>, Vec<&String>) =
            found.iter().partition(|node| *node == "/**");
        assert_eq!(of_all.len(), 1, "{}: {found:?}", preset.display());
        assert!(of_nodes.into_iter().all(of_a_node), "{}: {found:?}", preset.display());

        let named = |error: &dyn std::error::Error| panic!("{}: {error}", preset.display());
        let detection = load::<DetectionParameters>("detection", preset).config;
        detection.validate().unwrap_or_else(|error| named(&error));
        let segmentation = load::<SegmentationParameters>("segmentation", preset).config;
        segmentation.validate().unwrap_or_else(|error| named(&error));
        let reconstruction = load::<ReconstructionParameters>("reconstruction", preset).config;
        reconstruction.validate().unwrap_or_else(|error| named(&error));
        assert_eq!(detection.pipeline, segmentation.pipeline);
        assert_eq!(detection.pipeline, reconstruction.pipeline);
    }
}

#[test]
fn the_kernel_setting_is_the_one_that_the_nodes_ask_for() {
    let file = std::fs::read_to_string(config("sysctl/60-stillmap.conf")).unwrap();
    let settings: Vec<&str> =
        file.lines().filter(|line| !line.is_empty() && !line.starts_with('#')).collect();
    let advice =
        MessageTooLarge { topic: "/points".to_owned(), bytes: 2, largest_safe: 1 }.to_string();
    assert!(settings.len() == 1 && advice.contains(settings[0]), "{settings:?} in: {advice}");
}
