//! Trajectories as text files.

use std::path::Path;

use super::{data, score};
use crate::program::{stillmap, succeed};

/// Runs the program, which must fail with all of `wanted` on stderr, in a few lines.
fn refused(arguments: &[&str], wanted: &[&str]) {
    let output = stillmap([&["eval", "trajectory"], arguments].concat());
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{stderr}");
    for wanted in wanted {
        assert!(stderr.contains(wanted), "'{wanted}' is not in: {stderr}");
    }
    assert!(stderr.lines().count() <= 3, "{stderr}");
}

fn path(path: &Path) -> &str {
    path.to_str().unwrap()
}

#[test]
fn the_table_the_page_and_the_json_say_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("score");
    let (estimate, truth) = (data("estimate.tum"), data("truth.tum"));
    let arguments =
        [path(&estimate), "--ref", path(&truth), "--out", path(&out), "--align", "sim3"];
    let table = succeed([&["eval", "trajectory"], &arguments[..]].concat());
    let json: serde_json::Value =
        serde_json::from_slice(&std::fs::read(out.join("score.json")).unwrap()).unwrap();
    let rmse_m = json["absolute"]["translation_m"]["rmse"].as_f64().unwrap();
    assert!(table.contains(&format!("{rmse_m:.6}")), "{table}");
    let page = std::fs::read_to_string(out.join("score.html")).unwrap();
    assert!(page.contains(&format!("{rmse_m:.4} m (RMSE")), "{rmse_m}");
    for chart in
        ["Reference and estimate", "Error along the path", "Error of the position over time"]
    {
        assert!(page.contains(chart), "{chart}");
    }
    // The camera turns and hardly moves, so the noise has its say in the scale.
    let scale = json["alignment"]["scale"].as_f64().unwrap();
    assert!((0.8..1.2).contains(&scale) && (scale - 1.0).abs() > 1e-6, "{scale}");
    assert!(json["coverage"]["share"].as_f64().unwrap() > 0.98, "{}", json["coverage"]);
    assert_eq!(json["association"]["matched"], 95);
    assert_eq!(
        (&json["estimate_format"], &json["reference_format"]),
        (&"TUM".into(), &"TUM".into())
    );
}

#[test]
fn euroc_and_tum_of_one_truth_give_one_score() {
    let estimate = data("estimate.tum");
    let (tum, euroc) = (
        score(&estimate, &data("truth.tum"), &[]),
        score(&estimate, &data("truth.euroc.csv"), &[]),
    );
    assert_eq!(tum["absolute"], euroc["absolute"]);
    assert_eq!(euroc["reference_format"], "EuRoC");
}

#[test]
fn a_drive_has_the_drift_of_the_kitti_measure() {
    let json = score(&data("estimate.kitti"), &data("truth.kitti"), &["--align", "none"]);
    let percent = json["segments"]["translation_percent"].as_f64().unwrap();
    // It was made 0.8 % too long, and turns a little.
    assert!((0.8..3.0).contains(&percent), "{percent}");
    assert_eq!(json["segments"]["by_length"].as_array().unwrap().len(), 4);
    let scaled = score(&data("estimate.kitti"), &data("truth.kitti"), &["--segments", "scaled"]);
    assert_eq!(scaled["segments"]["by_length"].as_array().unwrap().len(), 8);
}

#[test]
fn a_tracker_that_gave_up_is_not_praised() {
    let folder = tempfile::tempdir().unwrap();
    let part = folder.path().join("part.tum");
    let whole = std::fs::read_to_string(data("estimate.tum")).unwrap();
    let lines: Vec<&str> = whole.lines().take(30).collect();
    std::fs::write(&part, lines.join("\r\n")).unwrap();
    let table = succeed(["eval", "trajectory", path(&part), "--ref", path(&data("truth.tum"))]);
    assert!(table.contains("coverage     30."), "{table}");
    assert!(table.contains("say nothing of the parts that are not covered"), "{table}");
}

#[test]
fn what_cannot_be_scored_is_named_with_its_line_and_the_mend() {
    let folder = tempfile::tempdir().unwrap();
    let written = |name: &str, text: &[u8]| {
        let file = folder.path().join(name);
        std::fs::write(&file, text).unwrap();
        file
    };
    let truth = data("truth.tum");
    let good = "1305031229.51 0 0 0 0 0 0 1\n";
    let broken =
        written("broken.txt", format!("# c\n{good}{good}1305031230 0 0 here\n").as_bytes());
    refused(
        &[path(&broken), "--ref", path(&truth)],
        &["broken.txt: line 4: 4 columns", "TUM has 8"],
    );
    let empty = written("empty.txt", b"# nothing\n");
    refused(&[path(&empty), "--ref", path(&truth)], &["empty.txt: it contains no poses"]);
    let binary = written("binary.txt", b"\x00\xff\x00");
    refused(&[path(&truth), "--ref", path(&binary)], &["binary.txt: line 1: not UTF-8 text"]);
    refused(&["/nowhere/a.txt", "--ref", path(&truth)], &["cannot read /nowhere/a.txt"]);
    let elsewhere =
        written("elsewhere.txt", b"1 0 0 0 0 0 0 1\n2 1 0 0 0 0 0 1\n3 1 1 0 0 0 0 1\n");
    refused(&[path(&elsewhere), "--ref", path(&truth)], &["only 0 of 3 poses", "--max-difference"]);
    let lost = written("lost.txt", b"1305031229.51 nan nan nan nan nan nan nan\n");
    refused(&[path(&lost), "--ref", path(&truth)], &["the estimate has no pose"]);
    refused(&[path(&data("truth.kitti")), "--ref", path(&truth)], &["has stamps", "--times"]);
    refused(
        &[path(&truth), "--ref", path(&truth), "--est-topic", "/x"],
        &["is not a bag", "--est-topic"],
    );
    refused(&[path(&truth), "--ref", path(&truth), "--rpe", "0m"], &["delta must be"]);
}
