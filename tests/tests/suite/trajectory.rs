//! `stillmap eval trajectory` as a user runs it: files, bags, refusals, and beside evo.

mod bags;
mod evo;
mod files;

use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::program::succeed;

/// A file of `tests/data/trajectory`.
fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("data/trajectory").join(name)
}

/// The score of an estimate as JSON.
fn score(estimate: &Path, reference: &Path, more: &[&str]) -> Value {
    let mut arguments = vec!["eval", "trajectory", estimate.to_str().unwrap()];
    arguments.extend(["--ref", reference.to_str().unwrap(), "--json"]);
    arguments.extend(more);
    serde_json::from_str(&succeed(arguments)).unwrap()
}
