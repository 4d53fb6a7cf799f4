//! The codemap names tests for what it says: they exist, and each form of an argument stands in one of its tests.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

fn root(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(path)
}

/// The Rust files below a folder, as one text for each test: from its `fn` to the end of its body.
fn tests_below(folder: &Path, found: &mut BTreeMap<String, String>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            tests_below(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            let text = std::fs::read_to_string(&path).unwrap();
            for part in text.split("#[test]\n").chain(text.split("#[tokio::test")).skip(1) {
                let Some((_, from_name)) = part.split_once("fn ") else { continue };
                let name = from_name.split('(').next().unwrap().to_owned();
                let body = from_name.split("\n}\n").next().unwrap();
                let body = body.split("\n    }\n\n").next().unwrap();
                found.entry(name).or_insert_with(|| body.to_owned());
            }
        }
    }
}

fn tests_of(folder: &str) -> BTreeMap<String, String> {
    let mut found = BTreeMap::new();
    tests_below(&root(folder), &mut found);
    found
}

/// The rows of the tables of a section, by their cells.
fn rows(section: &str) -> Vec<Vec<String>> {
    let page = std::fs::read_to_string(root("nodes/README.md")).unwrap();
    let start = format!("\n## {section}\n");
    let text = page.split(&start).nth(1).unwrap_or_else(|| panic!("no section {section}"));
    let text = text.split("\n## ").next().unwrap();
    let lines = text.lines().filter(|line| line.starts_with("| ") && line.contains('`'));
    lines.map(|line| line.trim_matches('|').split(" | ").map(str::to_owned).collect()).collect()
}

/// What stands in backticks.
fn quoted(cell: &str) -> Vec<&str> {
    cell.split('`').skip(1).step_by(2).collect()
}

/// How an argument stands in a test: its option, and of a remapping or an assignment what marks its form.
fn marks(form: &str) -> Vec<String> {
    form.split_whitespace()
        .flat_map(|word| word.trim_end_matches(',').split(":="))
        .map(|word| {
            word.trim_matches(|one: char| one.is_ascii_uppercase() || one == '/' || one == ':')
        })
        .filter(|word| !word.is_empty())
        .map(str::to_owned)
        .collect()
}

#[test]
fn each_form_of_an_argument_has_a_test_with_that_form() {
    let tests = tests_of("nodes/node-shell/src");
    let rows = rows("Arguments");
    assert!(rows.len() >= 12, "{rows:?}");
    for row in rows {
        let [forms, _, named] = &row[..] else { panic!("{row:?}") };
        let bodies: Vec<&String> = quoted(named)
            .into_iter()
            .map(|name| tests.get(name).unwrap_or_else(|| panic!("there is no test {name}")))
            .collect();
        assert!(!bodies.is_empty(), "{forms} has no test");
        for form in quoted(forms) {
            for mark in marks(form) {
                let stands = bodies.iter().any(|body| body.contains(&mark));
                assert!(stands, "{form}: {mark} stands in none of {named}");
            }
        }
    }
}

#[test]
fn each_service_has_a_test_by_a_foreign_peer() {
    let tests = tests_of("tests/tests/suite/foreign");
    let rows = rows("Services that every node has");
    assert!(rows.len() >= 6, "{rows:?}");
    for row in rows {
        let [services, named] = &row[..] else { panic!("{row:?}") };
        let names = quoted(named);
        assert!(!names.is_empty(), "{services} has no test");
        for name in names {
            assert!(tests.contains_key(name), "there is no test {name}");
        }
    }
}

/// `cargo test -p CRATE FILTER` of the invariants finds a test.
#[test]
fn each_invariant_has_tests() {
    for row in rows("Invariants") {
        for command in quoted(&row[1]).into_iter().filter(|one| one.starts_with("cargo test")) {
            let words: Vec<&str> = command.split_whitespace().collect();
            let (package, filters) = (words[3], &words[4..]);
            for filter in filters.iter().filter(|one| **one != "--") {
                let part = filter.trim_end_matches("::").replace("::", "/");
                let folders = match package {
                    "stillmap-tests" => vec![root("tests/tests/suite")],
                    package => {
                        vec![root(package).join("src"), root("nodes").join(package).join("src")]
                    }
                };
                let is_there = folders.iter().any(|folder| {
                    let path = folder.join(&part);
                    path.is_dir() || path.with_extension("rs").is_file()
                });
                assert!(is_there, "{command}: there is no module {part}");
            }
        }
    }
}
