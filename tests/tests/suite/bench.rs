//! What the bench finds of the transport, and its two ends for themselves. Nothing here is about times:
//! machines differ.

use serde_json::Value;

use crate::network::end::RELIABLE;
use crate::program::{Running, succeed};

/// A look with few small messages, for some seconds.
fn look(seconds: &str, more: &[&str]) -> Value {
    let mut line = vec!["bench", "transport", "--payload", "0.1", "--rate", "30"];
    line.extend(["--seconds", seconds, "--runs", "1", "--no-cyclone", "--json"]);
    line.extend(more);
    serde_json::from_str(&succeed(line)).unwrap()
}

#[test]
fn every_mode_delivers_and_reports() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("figures.json");
    let mut more = vec!["--mode", "all-networks", "localhost", "composed"];
    more.extend(["--reliability", "both", "-o", file.to_str().unwrap()]);
    let delivers = |report: &Value| {
        report["cases"].as_array().unwrap().iter().all(|row| row["delivered"] != 0.0)
    };
    // On a busy machine the subscriber may find the publisher when that has ended: then for longer.
    let mut report = look("1", &more);
    for seconds in ["10", "60"] {
        if delivers(&report) {
            break;
        }
        std::fs::remove_file(&file).unwrap();
        report = look(seconds, &more);
    }
    let written: Value = serde_json::from_slice(&std::fs::read(file).unwrap()).unwrap();
    assert_eq!(report, written);
    assert!(report["machine"]["cores"].as_u64().unwrap() > 0);
    let rows = report["cases"].as_array().unwrap();
    assert_eq!(rows.len(), 6);
    for row in rows {
        assert_eq!(row["payload_bytes"], 100_000);
        let run = &row["runs"][0];
        assert!(run["published"].as_u64().unwrap() > 0, "{row}");
        assert!(row["delivered"].as_f64().unwrap() > 0.0, "{row}");
        assert!(row["latency_median_ms"].as_f64().unwrap() > 0.0, "{row}");
        assert_eq!(row["buffer_bytes"].is_null(), row["mode"] == "composed", "{row}");
    }
}

#[test]
fn a_reader_that_crashes_is_counted_and_the_other_one_goes_on() {
    let mut line =
        vec!["bench", "transport", "--scenario", "reader-crash", "no-reader", "--seconds"];
    line.extend(["3", "--payload", "0.1", "--reliability", "reliable", "--json"]);
    let report: Value = serde_json::from_str(&succeed(line)).unwrap();
    let [crash, nobody] = report["scenarios"].as_array().unwrap().as_slice() else {
        panic!("{report}")
    };
    assert!(crash["crashes"].as_u64().unwrap() >= 2, "{crash}");
    assert!(crash["subscribe"]["received"].as_u64().unwrap() > 0, "{crash}");
    assert!(nobody["publish"]["published"].as_u64().unwrap() > 0, "{nobody}");
    assert_eq!(nobody["publish"]["subscribers_peak"], 0, "{nobody}");
    assert!(nobody["subscribe"].is_null(), "{nobody}");
}

#[test]
fn the_ends_meet_on_their_own_and_count_what_they_exchange() {
    let namespace = format!("__ns:=/bench_test_{}", std::process::id());
    let ros = ["--ros-args", "-r", namespace.as_str(), "--log-level", "error"];
    let mut sending = vec!["bench", "publish", "--topic", "image", "--bytes", "5000", "--hz", "50"];
    sending.push("--wait");
    let mut receiving = vec!["bench", "subscribe", "--topic", "image", "--count", "20"];
    for end in [&mut sending, &mut receiving] {
        end.extend(RELIABLE.split(' ').chain(ros));
    }
    let publisher = Running::start(sending);
    let report: Value = serde_json::from_str(&succeed(receiving)).unwrap();
    drop(publisher);
    assert_eq!(report["received"], 20, "{report}");
    assert_eq!(report["lost"], 0, "{report}");
    assert_eq!(report["out_of_order"], 0, "{report}");
    assert_eq!(report["publishers_peak"], 1, "{report}");
}

#[test]
fn a_soak_tells_what_the_suite_holds_while_it_maps() {
    let soak = |minutes: &str| -> Value {
        let line = ["bench", "soak", "--minutes", minutes, "--map-edge", "0.1", "--json"];
        serde_json::from_str(&succeed(line)).unwrap()
    };
    // On a busy machine the first cycle may come late: then for longer.
    let found = ["0.1", "0.5", "2"].into_iter().map(soak).find(|report| {
        report["minutes"].as_array().unwrap().iter().any(|minute| minute["voxels"] != 0)
    });
    let report = found.expect("no cycle in two minutes");
    assert!(report["drift"].is_null(), "{report}");
    let row = &report["minutes"][0];
    assert!(row["cycles"].as_u64().unwrap() > 0, "{row}");
    assert!(row["rss_bytes"].as_u64().unwrap() > 10_000_000, "{row}");
    assert!(row["descriptors"].as_u64().unwrap() > 50, "{row}");
    assert!(row["threads"].as_u64().unwrap() > 3, "{row}");
}
