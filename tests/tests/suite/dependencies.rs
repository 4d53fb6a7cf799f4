//! What is linked: licences and sources, by the rules of `deny.toml`. `cargo deny check` reads the same file, and knows of
//! advisories and further rules.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::process::Command;

use serde_json::Value;
use spdx::{Expression, LicenseReq, ParseMode};

/// Where every package that is not of this workspace must come from.
const REGISTRY: &str = "registry+https://github.com/rust-lang/crates.io-index";

fn repository() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// The packages that are linked on Linux.
fn packages() -> Vec<Value> {
    let line = ["metadata", "--format-version", "1", "--locked"];
    let output = Command::new(env!("CARGO"))
        .args(line)
        .args(["--filter-platform", "x86_64-unknown-linux-gnu"])
        .current_dir(repository())
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let metadata: Value = serde_json::from_slice(&output.stdout).unwrap();
    let linked: BTreeSet<&str> = metadata["resolve"]["nodes"]
        .as_array()
        .unwrap()
        .iter()
        .map(|node| node["id"].as_str().unwrap())
        .collect();
    let all = metadata["packages"].as_array().unwrap();
    all.iter().filter(|package| linked.contains(package["id"].as_str().unwrap())).cloned().collect()
}

/// The licences that `deny.toml` allows.
fn allowed() -> Vec<LicenseReq> {
    let text = std::fs::read_to_string(repository().join("deny.toml")).unwrap();
    let rules: toml::Table = text.parse().unwrap();
    let names = rules["licenses"]["allow"].as_array().unwrap();
    names
        .iter()
        .flat_map(|name| {
            let expression = Expression::parse(name.as_str().unwrap()).unwrap();
            expression.requirements().map(|found| found.req.clone()).collect::<Vec<_>>()
        })
        .collect()
}

/// Whether a package may be linked, by its licence as `Cargo.toml` states it.
fn is_allowed(licence: &str, allowed: &[LicenseReq]) -> bool {
    Expression::parse_mode(licence, ParseMode::LAX)
        .is_ok_and(|expression| expression.evaluate(|needed| allowed.contains(needed)))
}

#[test]
fn what_is_linked_has_a_permissive_licence_and_comes_from_the_registry() {
    let (packages, allowed) = (packages(), allowed());
    assert!(packages.len() > 100, "{} packages", packages.len());
    for package in &packages {
        let (name, licence) = (&package["name"], package["license"].as_str().unwrap_or("none"));
        assert!(is_allowed(licence, &allowed), "{name} has the licence {licence}");
        let source = package["source"].as_str();
        assert!(source.is_none_or(|source| source == REGISTRY), "{name} is from {source:?}");
    }
}

#[test]
fn a_licence_that_binds_what_it_is_linked_with_is_refused() {
    let allowed = allowed();
    for licence in ["GPL-3.0-only", "MIT AND LGPL-2.1-or-later", "none", "AGPL-3.0"] {
        assert!(!is_allowed(licence, &allowed), "{licence}");
    }
    for licence in
        ["MIT", "MIT/Apache-2.0", "GPL-2.0 OR MIT", "(MIT OR Apache-2.0) AND Unicode-3.0"]
    {
        assert!(is_allowed(licence, &allowed), "{licence}");
    }
}
