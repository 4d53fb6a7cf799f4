//! The floors of this crate: a module imports from its own folder and from those below it, never from one above.

use std::path::{Path, PathBuf};

/// The folders, from the bottom up; the crate's page says what each is for.
const FLOORS: [&str; 8] =
    ["process", "settings", "wire", "graph", "endpoints", "node", "services", "program"];

/// Where the tests within a source begin: they may use the whole crate.
const TESTS_BEGIN: &str = "#[cfg(test)]\nmod tests {";

/// The imports of a source of `floor` that lead upward, or to what the crate exports, each with its line.
fn upward(floor: usize, source: &str) -> Vec<(usize, String)> {
    let code = source.split(TESTS_BEGIN).next().unwrap_or_default();
    let mut found = Vec::new();
    for (index, line) in code.lines().enumerate() {
        if line.trim_start().starts_with("//") {
            continue;
        }
        for (at, mark) in line.match_indices("crate::") {
            if line[..at].ends_with(['$', '_']) {
                continue;
            }
            let target: String = line[at + mark.len()..]
                .chars()
                .take_while(|one| one.is_ascii_alphanumeric() || *one == '_')
                .collect();
            let is_below = FLOORS[..=floor].contains(&target.as_str());
            if !is_below {
                found.push((index + 1, line.trim().to_owned()));
            }
        }
    }
    found
}

/// The sources of a folder that are no tests.
fn sources(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let is_tests = path.file_stem().is_some_and(|stem| stem == "tests");
        if path.is_dir() && !is_tests {
            found.extend(sources(&path));
        } else if path.extension().is_some_and(|extension| extension == "rs") && !is_tests {
            found.push(path);
        }
    }
    found
}

#[test]
fn no_floor_imports_a_higher_one() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut faults = Vec::new();
    for (floor, name) in FLOORS.iter().enumerate() {
        let mut files = vec![root.join(name).with_extension("rs")];
        files.extend(sources(&root.join(name)));
        assert!(files.len() > 1, "{name} is no folder with modules");
        for file in files {
            for (line, text) in upward(floor, &std::fs::read_to_string(&file).unwrap()) {
                let file = file.strip_prefix(&root).unwrap().display();
                faults.push(format!("{file}:{line}: {text}"));
            }
        }
    }
    assert!(faults.is_empty(), "these lead upward:\n{}", faults.join("\n"));
}

/// A module outside of the floors would not be checked.
#[test]
fn every_module_is_on_a_floor() {
    let lib = include_str!("lib.rs");
    let mut modules = Vec::new();
    let mut is_test = false;
    for line in lib.lines() {
        let name = line.trim_start_matches("pub ").strip_prefix("mod ");
        if let Some(name) = name.and_then(|rest| rest.strip_suffix(';'))
            && !is_test
        {
            modules.push(name);
        }
        is_test = line == "#[cfg(test)]" || line.starts_with("#[cfg(all(test,");
    }
    let mut floors = FLOORS.to_vec();
    floors.sort_unstable();
    assert_eq!(modules, floors);
}

#[test]
fn an_import_that_leads_upward_is_named_with_its_line() {
    let source = "use crate::wire::payload::Payload;\nuse crate::graph::{Graph, Role};\n// crate::node::Node\n\
                  use crate::Qos;\n#[cfg(test)]\nmod tests {\nuse crate::program::Program;\n}\n";
    let wire = upward(2, source);
    let lines: Vec<usize> = wire.iter().map(|(line, _)| *line).collect();
    assert_eq!(lines, [2, 4], "{wire:?}");
    assert_eq!(upward(3, source).len(), 1);
}
