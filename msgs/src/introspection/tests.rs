use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use serde::Serialize;

use super::compare::{Values, differences};
use super::fill::filled;
use crate::definition::Definition;
use crate::registry::for_each_message;
use crate::{RosMessage, RosService, lifecycle_msgs, rcl_interfaces, std_srvs, stillmap_msgs};

fn package_of<M: RosMessage>() -> &'static str {
    M::TYPE_NAME.split('/').next().unwrap()
}

fn assert_struct_is_its_text<M: RosMessage + Default>() {
    let (package, text) = (package_of::<M>(), M::DEFINITION);
    let mut found = differences(&M::default(), package, text, Values::Default);
    for seed in 0..4 {
        found.extend(differences(&filled::<M>(seed), package, text, Values::Any));
    }
    assert!(found.is_empty(), "{}: {found:#?}", M::TYPE_NAME);
}

#[test]
fn every_struct_is_its_text() {
    macro_rules! check {
        ($($message:ty,)*) => { $(assert_struct_is_its_text::<$message>();)* };
    }
    for_each_message!(check);
}

fn assert_constants_are_their_text<M: RosMessage>() {
    let definition = Definition::parse(M::DEFINITION).unwrap();
    let wanted: Vec<(&str, i64)> = definition
        .constants
        .iter()
        .map(|(_, name, value)| (*name, value.parse().unwrap()))
        .collect();
    assert_eq!(M::CONSTANTS, wanted, "{}", M::TYPE_NAME);
}

#[test]
fn every_constant_is_its_text() {
    macro_rules! check {
        ($($message:ty,)*) => { $(assert_constants_are_their_text::<$message>();)* };
    }
    for_each_message!(check);
}

fn names_of_files(folder: &str, ending: &str) -> BTreeSet<String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
    let mut names = BTreeSet::new();
    for package in fs::read_dir(root).unwrap() {
        let package = package.unwrap();
        for file in fs::read_dir(package.path()).unwrap() {
            let (file, package) = (file.unwrap().file_name(), package.file_name());
            let (file, package) = (file.to_str().unwrap(), package.to_str().unwrap());
            let name = file.strip_suffix(ending).expect("only definitions stand here");
            names.insert(format!("{package}/{folder}/{name}"));
        }
    }
    names
}

#[test]
fn every_definition_file_has_its_struct() {
    macro_rules! names {
        ($($message:ty,)*) => { BTreeSet::from([$(<$message>::TYPE_NAME.to_owned()),*]) };
    }
    let mut messages: BTreeSet<String> = for_each_message!(names);
    messages.retain(|name| name.contains("/msg/"));
    assert_eq!(messages, names_of_files("msg", ".msg"));

    let services = [
        std_srvs::Trigger::TYPE_NAME,
        std_srvs::Empty::TYPE_NAME,
        std_srvs::SetBool::TYPE_NAME,
        lifecycle_msgs::ChangeState::TYPE_NAME,
        lifecycle_msgs::GetState::TYPE_NAME,
        lifecycle_msgs::GetAvailableStates::TYPE_NAME,
        lifecycle_msgs::GetAvailableTransitions::TYPE_NAME,
        rcl_interfaces::DescribeParameters::TYPE_NAME,
        rcl_interfaces::GetParameters::TYPE_NAME,
        rcl_interfaces::GetParameterTypes::TYPE_NAME,
        rcl_interfaces::ListParameters::TYPE_NAME,
        rcl_interfaces::SetParameters::TYPE_NAME,
        rcl_interfaces::SetParametersAtomically::TYPE_NAME,
        stillmap_msgs::GetDistances::TYPE_NAME,
        stillmap_msgs::GetDistanceField::TYPE_NAME,
    ];
    assert_eq!(BTreeSet::from(services.map(str::to_owned)), names_of_files("srv", ".srv"));
}

#[test]
fn a_service_splits_at_its_line() {
    assert_eq!(std_srvs::TriggerRequest::DEFINITION, "");
    assert!(std_srvs::SetBoolRequest::DEFINITION.ends_with("bool data\n"));
    assert!(std_srvs::SetBoolResponse::DEFINITION.ends_with(
        "bool success\n\n# More in words, above all when it was not done.\nstring message\n"
    ));
    assert!(!std_srvs::SetBoolResponse::DEFINITION.contains("---"));
}

/// The comparison must see every kind of drift.
#[test]
fn drift_is_seen() {
    #[derive(Serialize, Default)]
    struct Sample {
        count: u32,
        name: String,
        #[serde(with = "serde_bytes")]
        data: Vec<u8>,
        corners: [f64; 4],
        w: f64,
        color: crate::std_msgs::ColorRGBA,
    }
    const TEXT: &str = "uint32 count\nstring<=9 name\nuint8[] data\nfloat64[4] corners\n\
                        float64 w 0\nstd_msgs/ColorRGBA color\n";
    let sample = Sample::default();
    let found = |text: &str| differences(&sample, "sample_msgs", text, Values::Default).len();
    assert_eq!(found(TEXT), 0);
    for (old, new) in [
        ("uint32 count", "int32 count"),
        ("uint32 count", "uint64 count"),
        ("uint32 count", "uint32 counts"),
        ("uint32 count", "uint32 count 1"),
        ("uint32 count\nstring<=9 name\n", "string<=9 name\nuint32 count\n"),
        ("string<=9 name\n", ""),
        ("string<=9 name", "string[] name"),
        ("uint8[] data", "uint8[4] data"),
        ("uint8[] data", "float32[] data"),
        ("float64[4] corners", "float64[] corners"),
        ("float64[4] corners", "float64[5] corners"),
        ("float64[4] corners", "float32[4] corners"),
        ("float64 w 0", "float64 w 1"),
        ("std_msgs/ColorRGBA", "std_msgs/Header"),
        ("std_msgs/ColorRGBA", "geometry_msgs/Quaternion"),
        ("std_msgs/ColorRGBA color", "std_msgs/ColorRGBA color\nbool more"),
    ] {
        let changed = TEXT.replace(old, new);
        assert_ne!(changed, TEXT, "{old} is in the text");
        assert_ne!(found(&changed), 0, "{old} -> {new}");
    }

    /// Bytes that would be written element by element.
    #[derive(Serialize)]
    struct Slow {
        data: Vec<u8>,
    }
    let slow = Slow { data: vec![1] };
    assert_ne!(differences(&slow, "sample_msgs", "uint8[] data\n", Values::Any).len(), 0);
}
