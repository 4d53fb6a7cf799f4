//! A core has no threads of its own: it gets an executor from its caller.
// A test may stop where it stands.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::fs;
use std::path::{Path, PathBuf};

/// What makes a thread, or asks how many there may be.
const OF_THREADS: [&str; 5] =
    ["std::thread", "thread::", "ScopedThreads", "available_parallelism", "rayon"];

/// Parts of a core's crate that are none of the core: its shell, its program, its tests; and what a feature brings in that
/// the core is built without (the network of `lidar-odometry`). The executor over threads itself is here for shells.
const BESIDE: [&str; 7] = [
    "/src/shell",
    "/src/main.rs",
    "/tests",
    "/testing",
    "lidar-odometry/src/live",
    "estimation/src/executor",
    "estimation/src/lib.rs",
];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// The folders of the cores that `.ci/run` names.
fn cores() -> Vec<PathBuf> {
    let gate = fs::read_to_string(root().join(".ci/run")).unwrap();
    let list = gate.lines().find_map(|line| line.strip_prefix("cores=(")).expect("a list of cores");
    let names = list.trim_end_matches(')').split_whitespace();
    let folder = |name: &str| {
        let nodes = root().join("nodes");
        [nodes.join(name), nodes.join("laboratory").join(name)].into_iter().find(|at| at.is_dir())
    };
    names.map(|name| folder(name).unwrap_or_else(|| panic!("{name} has no folder"))).collect()
}

fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
}

/// The lines of a core that have to do with threads, each with its place.
fn threads_in(name: &str, text: &str) -> Vec<String> {
    // The tests of a file stand at its end.
    let code = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
    let lines = code.lines().enumerate().filter(|(_, line)| {
        let line = line.trim_start();
        !line.starts_with("//") && OF_THREADS.iter().any(|word| line.contains(word))
    });
    lines.map(|(number, line)| format!("{name}:{}: {}", number + 1, line.trim())).collect()
}

#[test]
fn no_core_makes_a_thread() {
    let mut found = Vec::new();
    let cores = cores();
    assert!(cores.len() > 10, "{cores:?}");
    for core in &cores {
        let mut files = Vec::new();
        sources(&core.join("src"), &mut files);
        files.sort();
        for file in files {
            let name = file.strip_prefix(root()).unwrap().display().to_string();
            if !BESIDE.iter().any(|part| name.contains(part)) {
                found.extend(threads_in(&name, &fs::read_to_string(&file).unwrap()));
            }
        }
    }
    assert!(found.is_empty(), "threads in cores:\n{}", found.join("\n"));
}

#[test]
fn a_thread_is_seen_and_those_of_tests_are_not() {
    let core = "use std::thread;\n// std::thread\nfn f() {}\n#[cfg(test)]\nmod tests {\n    thread::spawn(f);\n}\n";
    assert_eq!(threads_in("core.rs", core), ["core.rs:1: use std::thread;"]);
    assert!(threads_in("core.rs", "fn f() {}\n").is_empty());
}
