//! The files of `config/` say what the program says: their values are its defaults, none is missing,
//! and the presets fit the nodes.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use compression::CompressionParameters;
use detection::shell::DetectionParameters;
use node_shell::MessageTooLarge;
use node_shell::parameters::{self, Assignment};
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
    P: Serialize + DeserializeOwned + Default,
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

fn holds_every_default<P>(node: &str)
where
    P: Serialize + DeserializeOwned + Default,
{
    let file = config(&format!("{node}.yaml"));
    let known = parameters::describe::<P>().unwrap().into_iter().map(|(name, _)| name).collect();
    assert_eq!(sections(&file), [(section_of(node), known)], "{}", file.display());

    let (loaded, defaults) = (values(&load::<P>(node, &file)), values(&P::default()));
    for (name, default) in defaults.as_object().unwrap() {
        assert_eq!(&loaded[name], default, "{name} in {}", file.display());
    }
}

#[test]
fn each_node_has_a_file_with_every_parameter_at_its_default() {
    holds_every_default::<DetectionParameters>("detection");
    holds_every_default::<SegmentationParameters>("segmentation");
    holds_every_default::<ReconstructionParameters>("reconstruction");
    holds_every_default::<CompressionParameters>("compression");
}

#[test]
fn each_rig_preset_fits_all_three_nodes() {
    let presets: Vec<PathBuf> =
        std::fs::read_dir(config("rig")).unwrap().map(|entry| entry.unwrap().path()).collect();
    assert!(presets.contains(&config("rig/rplidar_a1_kinect_v1.yaml")), "{presets:?}");
    for preset in &presets {
        // A section of a misspelt node would be nobody's, and so pass for one without mistakes.
        let found: BTreeSet<String> = sections(preset).into_iter().map(|(node, _)| node).collect();
        assert_eq!(found, NODES.map(section_of).into(), "{}", preset.display());

        let named = |error: &dyn std::error::Error| panic!("{}: {error}", preset.display());
        let detection = load::<DetectionParameters>("detection", preset).config;
        detection.validate().unwrap_or_else(|error| named(&error));
        let segmentation = load::<SegmentationParameters>("segmentation", preset).config;
        segmentation.validate().unwrap_or_else(|error| named(&error));
        let reconstruction = load::<ReconstructionParameters>("reconstruction", preset).config;
        reconstruction.validate().unwrap_or_else(|error| named(&error));
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
