//! Bags of the simulator, healthy ones and ones with one fault each.

use std::path::Path;
use std::sync::OnceLock;

use serde_json::Value;

use super::bag_faults;
use super::json;
use super::plant::Recording;
use crate::program::{stillmap, succeed};

/// What the simulator makes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Base {
    /// A still platform in a furnished room.
    Room,
    /// The same with tf.
    RoomWithTf,
    /// A swaying platform in another scene.
    Sway,
    /// A 3D scanner beside.
    Velodyne,
    /// An inertial unit and wheels beside.
    Inertial,
}

const BASES: [Base; 5] = [Base::Room, Base::RoomWithTf, Base::Sway, Base::Velodyne, Base::Inertial];

impl Base {
    fn arguments(self) -> &'static str {
        match self {
            Self::Room | Self::RoomWithTf => "small --seconds 2",
            Self::Sway => "--scene F --platform sway --seconds 2 --depth-size 160 120",
            Self::Velodyne => "small --velodyne vlp16 --seconds 1",
            Self::Inertial => "small --imu --wheels --seconds 2",
        }
    }

    /// Its bag, which is simulated once.
    fn recording(self) -> Recording {
        static MADE: [OnceLock<Recording>; 5] = [const { OnceLock::new() }; 5];
        let make = || {
            if self == Self::RoomWithTf {
                return Self::Room.recording().with_tf().clone();
            }
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("base.mcap");
            let arguments = self.arguments().split(' ');
            succeed(["simulate", "-o", path.to_str().unwrap()].into_iter().chain(arguments));
            let mut recording = Recording::read(&path);
            // The truth is large, and nobody's input.
            recording.messages.retain(|message| !message.topic.starts_with("/truth/"));
            recording
        };
        MADE[self as usize].get_or_init(make).clone()
    }
}

/// What the doctor says of a bag, and its exit code. The mount is given: not each of these bags shows it.
fn examine(bag: &Path) -> (Value, i32) {
    let mount = bag.with_extension("yaml");
    let given = "detection: {ros__parameters: {rig_from_lidar: [0.0, 0.0, -0.05, 0.0, 0.0, 0.0]}}";
    std::fs::write(&mount, given).unwrap();
    let (bag, mount) = (bag.to_str().unwrap(), mount.to_str().unwrap());
    let output = stillmap(["doctor", bag, "--json", "--params-file", mount]);
    (json(&output), output.status.code().unwrap())
}

/// The findings that are no OK.
fn faults(report: &Value) -> Vec<&Value> {
    let findings = report["findings"].as_array().unwrap();
    findings.iter().filter(|finding| finding["severity"] != "ok").collect()
}

#[test]
fn nothing_is_found_in_five_healthy_bags() {
    let folder = tempfile::tempdir().unwrap();
    for base in BASES {
        let bag = base.recording().write(folder.path().join(format!("{base:?}.mcap")));
        let (report, code) = examine(&bag);
        assert_eq!(faults(&report), Vec::<&Value>::new(), "{base:?}");
        assert_eq!(code, 0, "{base:?}");
    }
}

/// A fault, and how it is found.
pub(super) struct Fault {
    name: &'static str,
    base: Base,
    plant: fn(&mut Recording),
    check: &'static str,
    severity: &'static str,
    /// What the finding and its fix say, besides the topic.
    says: &'static [&'static str],
    /// Other checks that it must fail too, being what it is.
    also: &'static [&'static str],
}

pub(super) const fn fault(
    name: &'static str,
    base: Base,
    plant: fn(&mut Recording),
    [severity, check]: [&'static str; 2],
    says: &'static [&'static str],
) -> Fault {
    Fault { name, base, plant, check, severity, says, also: &[] }
}

impl Fault {
    pub(super) const fn also(mut self, also: &'static [&'static str]) -> Self {
        self.also = also;
        self
    }
}

#[test]
fn each_fault_that_is_planted_in_a_bag_is_found() {
    let folder = tempfile::tempdir().unwrap();
    let mut missed = Vec::new();
    for fault in bag_faults::faults() {
        let mut recording = fault.base.recording();
        (fault.plant)(&mut recording);
        let bag = recording.write(folder.path().join(format!("{}.mcap", fault.name)));
        let (report, code) = examine(&bag);
        let found = faults(&report);
        let is_it = |finding: &&&Value| {
            let line = format!("{} {}", finding["what"], finding["fix"]);
            finding["check"] == fault.check
                && finding["severity"] == fault.severity
                && fault.says.iter().all(|part| line.contains(part))
        };
        let others: Vec<_> = found
            .iter()
            .filter(|finding| {
                let check = finding["check"].as_str().unwrap();
                check != fault.check && !fault.also.contains(&check)
            })
            .collect();
        let has_error = found.iter().any(|finding| finding["severity"] == "error");
        let complete = found.iter().all(|finding| {
            ["what", "consequence", "fix"]
                .iter()
                .all(|key| finding[key].as_str().is_some_and(|text| !text.is_empty()))
        });
        if found.iter().find(is_it).is_none() || !others.is_empty() || !complete {
            missed.push(format!("{}: {found:#?}", fault.name));
        }
        if code != if has_error { 1 } else { 3 } {
            missed.push(format!("{}: exit code {code}", fault.name));
        }
        std::fs::remove_file(bag).unwrap();
    }
    assert!(missed.is_empty(), "{}", missed.join("\n"));
}
