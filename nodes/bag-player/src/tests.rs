//! Tests of reading and writing together. Their recorded files are in `tests/data`.

use std::path::{Path, PathBuf};

use crate::{Bag, BagError, BagMessage, Loss, Selection};

mod conformance;
mod damage;
mod order;
mod rosbag2;
mod round_trip;
mod samples;
mod sqlite;
mod sqlite_damage;

/// A file or folder of the committed recordings.
fn committed(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)
}

/// A folder of recordings that are not part of the repository; says so where it is not there.
fn recorded(name: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data").join(name);
    if path.exists() {
        Some(path)
    } else {
        eprintln!("skipped: {} is not there", path.display());
        None
    }
}

/// Every file below `folder` with this extension, in order.
fn files_below(folder: &Path, extension: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(files_below(&path, extension));
        } else if path.extension().is_some_and(|other| other == extension) {
            found.push(path);
        }
    }
    found.sort();
    found
}

/// All that a bag gives, and what it lost.
fn read_all(bag: &Bag, selection: &Selection) -> Result<(Vec<BagMessage>, Vec<Loss>), BagError> {
    let mut messages = bag.messages(selection)?;
    let read: Vec<BagMessage> = messages.by_ref().collect::<Result<_, _>>()?;
    Ok((read, messages.losses().to_vec()))
}

/// All messages in whatever encoding.
fn every_encoding() -> Selection {
    Selection { all_encodings: true, ..Selection::default() }
}
