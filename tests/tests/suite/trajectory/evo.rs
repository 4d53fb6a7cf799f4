//! The same files to evo, the tool that most papers use, as a program of its own. What it answered once stands
//! in `tests/data/trajectory/evo.json` and is held to by a unit test of the crate `evaluation`; here it is asked again.

use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

use super::{data, score};
use crate::python::python_with;

/// Both compute in double precision; evo rounds stamps and matrices otherwise.
const TOLERANCE: f64 = 1e-6;
/// One case of so many is asked live: each starts a Python that takes a second or more.
const EACH: usize = 4;

/// Our statistics for a case.
fn ours(case: &Value, folder: &Path) -> Value {
    let text = |name: &str| case[name].as_str().unwrap().to_owned();
    let mut more = vec!["--align".to_owned(), text("alignment")];
    let delta = &case["delta"];
    if !delta.is_null() {
        let unit = match delta["unit"].as_str().unwrap() {
            "metres" => "m",
            "degrees" => "deg",
            "seconds" => "s",
            _ => "frames",
        };
        more.extend(["--rpe".to_owned(), format!("{}{unit}", delta["value"])]);
        more.extend(["--rpe-pairs".to_owned(), text("pairs")]);
        more.extend(["--rpe-from".to_owned(), text("pairs_from")]);
    }
    if let Some(period_s) = case["period_s"].as_f64() {
        let times = folder.join("times.txt");
        let lines = (0..1000).map(|frame| format!("{:.6}\n", f64::from(frame) * period_s));
        std::fs::write(&times, lines.collect::<String>()).unwrap();
        more.extend(["--times".to_owned(), times.to_str().unwrap().to_owned()]);
    }
    let more: Vec<&str> = more.iter().map(String::as_str).collect();
    let score = score(&data(&text("estimate")), &data(&text("reference")), &more);
    let of = match text("of").as_str() {
        "translation" => "translation_m",
        _ => "rotation_deg",
    };
    if delta.is_null() { score["absolute"][of].clone() } else { score["relative"][0][of].clone() }
}

#[test]
fn the_program_prints_what_evo_finds() {
    let Some(python) = python_with("evo") else { return };
    let folder = tempfile::tempdir().unwrap();
    let all: Vec<Value> =
        serde_json::from_slice(&std::fs::read(data("evo.json")).unwrap()).unwrap();
    let chosen: Vec<Value> = all.into_iter().step_by(EACH).collect();
    let cases: PathBuf = folder.path().join("cases.json");
    std::fs::write(&cases, serde_json::to_vec(&chosen).unwrap()).unwrap();
    let asked = Command::new(python)
        // No byte code into the source tree.
        .arg("-B")
        .arg(concat!(env!("CARGO_MANIFEST_DIR"), "/peers/evo/ask.py"))
        .arg(&cases)
        .arg(data(""))
        // evo keeps settings in the home folder.
        .env("HOME", folder.path())
        .output()
        .unwrap();
    assert!(asked.status.success(), "{}", String::from_utf8_lossy(&asked.stderr));
    let answers: Vec<Value> = serde_json::from_slice(&asked.stdout).unwrap();
    assert_eq!(answers.len(), chosen.len());
    for answer in answers {
        let ours = ours(&answer, folder.path());
        for (name, evo) in answer["statistics"].as_object().unwrap() {
            let (found, wanted) = (ours[name].as_f64().unwrap(), evo.as_f64().unwrap());
            assert!((found - wanted).abs() < TOLERANCE, "{name}: {found}, evo {wanted}: {answer}");
        }
    }
}
