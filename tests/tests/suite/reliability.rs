//! `docs/reliability.md`: each promise has a command, and what the command names exists; the lints that it promises are on.

use std::path::{Path, PathBuf};

fn root(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(path)
}

/// The folder of a package; its modules are below `src`, those of the suite below `tests/tests/suite`.
fn modules_of(package: &str) -> PathBuf {
    let within = |folder: PathBuf| folder.join("src");
    match package {
        "stillmap-tests" => root("tests/tests/suite"),
        "stillmap-fuzz" => within(root("tests/fuzz")),
        package => [root(package), root("nodes").join(package)]
            .map(within)
            .into_iter()
            .find(|src| src.is_dir())
            .unwrap(),
    }
}

/// Whether a filter names a module, or a test in it.
fn is_there(package: &str, filter: &str) -> bool {
    let is_module = |path: &Path| path.is_dir() || path.with_extension("rs").is_file();
    let path = modules_of(package).join(filter.replace("::", "/"));
    if is_module(&path) {
        return true;
    }
    let (Some(module), Some(name)) = (path.parent(), path.file_name()) else { return false };
    let text = std::fs::read_to_string(module.with_extension("rs")).unwrap_or_default();
    text.contains(&format!("fn {}(", name.to_string_lossy()))
}

#[test]
fn each_promise_and_each_bound_has_a_command_that_finds_tests() {
    let page = std::fs::read_to_string(root("docs/reliability.md")).unwrap();
    let mut missing = Vec::new();
    let mut rows = 0;
    for row in page.lines().filter(|line| line.starts_with("| ") && !line.ends_with("shown by |")) {
        rows += 1;
        let shown_by = row.trim_matches(['|', ' ']).rsplit(" | ").next().unwrap();
        let commands: Vec<&str> = shown_by.split('`').skip(1).step_by(2).collect();
        if commands.is_empty() {
            missing.push(format!("no command: {row}"));
        }
        for command in commands {
            let words: Vec<&str> = command.split_whitespace().collect();
            let ["cargo", "test", "-p", package, filters @ ..] = words.as_slice() else {
                missing.push(format!("not a test: {command}"));
                continue;
            };
            let filters = filters.iter().filter(|filter| **filter != "--");
            missing.extend(
                filters
                    .filter(|filter| !is_there(package, filter))
                    .map(|filter| format!("{command}: {filter}")),
            );
        }
    }
    assert!(rows >= 40, "{rows} rows");
    assert!(missing.is_empty(), "{}", missing.join("\n"));
}

/// The modules that decode outside bytes; what is below them is theirs.
const DECODERS: [&str; 13] = [
    "msgs/src/cdr.rs",
    "msgs/src/convert.rs",
    "nodes/bag-player/src/lib.rs",
    "nodes/calibration/src/camera_file.rs",
    "nodes/laboratory/evaluation/src/trajectory/parse.rs",
    "nodes/lidar-odometry/src/capture.rs",
    "nodes/lidar-odometry/src/packets.rs",
    "nodes/lidar-odometry/src/recorded.rs",
    "nodes/node-shell/src/endpoints.rs",
    "nodes/node-shell/src/settings.rs",
    "nodes/node-shell/src/wire.rs",
    "nodes/pose/src/map/parts.rs",
    "nodes/pose/src/saved_map.rs",
];

#[test]
fn what_decodes_outside_bytes_denies_what_can_fail() {
    for module in DECODERS {
        let text = std::fs::read_to_string(root(module)).unwrap();
        assert!(text.contains("deny(clippy::indexing_slicing)"), "{module}");
    }
    let manifest = std::fs::read_to_string(root("Cargo.toml")).unwrap();
    for lint in ["unwrap_used", "expect_used", "panic"] {
        assert!(manifest.contains(&format!("{lint} = \"warn\"")), "{lint}");
    }
    assert!(manifest.contains("[profile.release]\noverflow-checks = true"));
}
