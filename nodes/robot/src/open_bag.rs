//! Opens a bag, or says which command takes what is there.

use std::path::Path;

use bag_player::{Bag, BagError};

use crate::failure::Failure;
use crate::import::{numbered_pictures, tum};
use crate::interrupt::Interrupt;
use crate::lidar::LidarSource;
use crate::ros_words::quoted;

/// Opens a bag.
///
/// # Errors
/// When it cannot be opened; with the command that takes a recording of another kind.
pub(crate) fn open_bag(path: &Path) -> Result<Bag, Failure> {
    Bag::open(path).map_err(|error| refused(path, &error))
}

/// Opens a bag, unless a signal comes while it is unpacked or converted.
///
/// # Errors
/// As of [`open_bag`]; an interruption where a signal has come.
pub(crate) fn open_bag_while(path: &Path, interrupt: &Interrupt) -> Result<Bag, Failure> {
    Bag::open_while(path, &|| !interrupt.has_come()).map_err(|error| match error {
        BagError::Interrupted { .. } => Failure::interruption(error.to_string()),
        error => refused(path, &error),
    })
}

/// Why a bag cannot be opened, with the command that takes a recording of another kind.
pub fn refused(path: &Path, error: &BagError) -> Failure {
    let failure = Failure::new(error.to_string());
    match taken_by(path) {
        Some(command) => failure.fix(command),
        None => failure,
    }
}

/// Refuses a recording that another command takes.
///
/// # Errors
/// With that command.
pub(crate) fn refuse_other_kinds(path: &Path) -> Result<(), Failure> {
    // A bag of ROS 1 is converted when it is opened: that is left to who reads it.
    if taken_by(path).is_some() { open_bag(path).map(drop) } else { Ok(()) }
}

/// What takes a recording of another kind.
fn taken_by(path: &Path) -> Option<String> {
    let shown = quoted(&path.display().to_string());
    let name = path.file_name().map_or_else(Default::default, |name| name.to_string_lossy());
    let bag = quoted(&format!("{}.mcap", if name.is_empty() { "recording" } else { &*name }));
    if LidarSource::is_no_bag(path) {
        let import = if path.is_dir() { "kitti" } else { "velodyne" };
        return Some(format!(
            "`stillmap run {shown} --pose lidar` maps a LiDAR's recording, `stillmap import {import} {shown} -o {bag}` makes a bag of it"
        ));
    }
    if tum::is_sequence(path) {
        return Some(format!(
            "`stillmap import tum {shown} --scan-from-depth -o {bag}` makes a bag of a TUM sequence"
        ));
    }
    numbered_pictures(path).is_ok().then(|| {
        format!(
            "`stillmap import depth {shown} --intrinsics FX,FY,CX,CY --scan-from-depth -o {bag}` makes a bag of numbered depth \
             images of a camera that stands"
        )
    })
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    /// Regression: Ctrl-C while a bag was unpacked or converted changed nothing until that was done, with exit code 1.
    #[test]
    fn a_signal_ends_the_unpacking_of_a_bag() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("bag.db3.zst");
        fs::write(&path, [0x28, 0xb5, 0x2f, 0xfd, 0, 0, 0, 0]).unwrap();
        let interrupt = Interrupt::default();
        assert!(!open_bag_while(&path, &interrupt).unwrap_err().is_interruption());
        interrupt.trigger();
        assert!(open_bag_while(&path, &interrupt).unwrap_err().is_interruption());
    }

    #[test]
    fn a_recording_of_another_kind_names_what_takes_it() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::create_dir_all(at("desk")).unwrap();
        fs::create_dir_all(at("07/velodyne")).unwrap();
        fs::create_dir_all(at("empty")).unwrap();
        fs::create_dir_all(at("the kitchen")).unwrap();
        fs::write(at("the kitchen/0001.png"), "no picture").unwrap();
        for list in ["rgb.txt", "depth.txt"] {
            fs::write(at("desk").join(list), "# none\n").unwrap();
        }
        fs::write(at("07/velodyne/000000.bin"), [0; 16]).unwrap();
        fs::write(at("drive.pcap"), [0xd4, 0xc3, 0xb2, 0xa1, 2, 0]).unwrap();
        fs::write(at("notes.txt"), "dear diary").unwrap();
        for (name, command) in [
            ("desk", Some("import tum")),
            ("the kitchen", Some("-o 'the kitchen.mcap'`")),
            ("07", Some("--pose lidar")),
            ("07", Some("`stillmap import kitti ")),
            ("drive.pcap", Some("--pose lidar")),
            ("drive.pcap", Some("-o drive.pcap.mcap`")),
            ("notes.txt", None),
            ("empty", None),
        ] {
            let said = open_bag(&at(name)).unwrap_err().to_string();
            let holds = command.is_none_or(|command| said.contains(command));
            assert!(holds && said.contains("`stillmap") == command.is_some(), "{name}: {said}");
            assert_eq!(refuse_other_kinds(&at(name)).is_err(), command.is_some(), "{name}");
        }
    }
}
