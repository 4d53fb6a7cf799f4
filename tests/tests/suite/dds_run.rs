//! A bag through three nodes and a player, each a process of its own, over DDS.

use geometry::ply;

use crate::bags::small_room;
use crate::local_run::files_of;
use crate::program::{succeed, summary};

/// The depth images and their masks cross three processes.
#[test]
fn a_map_of_depth_images_is_the_same_over_dds_and_free_of_the_person() {
    let folder = tempfile::tempdir().unwrap();
    let bag = small_room(folder.path());
    let run = |transport: &str| {
        let out = folder.path().join(transport);
        let (bag, out_name) = (bag.to_str().unwrap(), out.to_str().unwrap());
        succeed(["run", bag, "--transport", transport, "--map-edge", "0.03", "--out", out_name]);
        out
    };
    let (local, dds) = (run("local"), run("dds"));
    let summaries = [summary(&local), summary(&dds)];
    assert_eq!(summaries[1]["drops"], serde_json::json!([]), "nothing may be lost on the way");
    for key in ["cycles", "points", "map", "truth"] {
        assert_eq!(summaries[0][key], summaries[1][key], "{key}");
    }
    // With its normals, which the published cloud does not have.
    let maps = [&local, &dds].map(|out| files_of(out)["map.ply"].clone());
    assert!(maps[0] == maps[1], "the two maps differ");
    assert!(!ply::decode_with_normals(&maps[1]).unwrap().normals.is_empty());
    let map = &summaries[0]["truth"]["map"];
    assert_eq!(map["object_only_left"], 0, "{map}");
    // 0.986 and 0.951 were measured.
    assert!(map["static_kept_share_of_unfiltered"].as_f64().unwrap() > 0.97, "{map}");
    assert!(map["surface"]["f_score"].as_f64().unwrap() > 0.94, "{map}");
}

/// The published method has one edge, and an edge has a range: that is said at the start.
#[test]
fn an_edge_of_the_map_that_cannot_be_is_refused_with_the_reason() {
    let folder = tempfile::tempdir().unwrap();
    let bag = small_room(folder.path());
    for (arguments, parts) in [
        (vec!["--map-edge", "0.02", "--method", "rec_hv"], ["--map-edge", "free_space"]),
        (vec!["--map-edge", "0.0001"], ["map_edge_m", "0.001"]),
        (vec!["--map-edge", "nan"], ["map_edge_m", "NaN"]),
    ] {
        let out = folder.path().join("out");
        let run = ["run", bag.to_str().unwrap(), "--out", out.to_str().unwrap()];
        let output = crate::program::stillmap(run.into_iter().chain(arguments.clone()));
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(!output.status.success(), "{arguments:?}");
        assert!(parts.iter().all(|part| said.contains(part)), "{arguments:?}: {said}");
    }
}

#[test]
fn the_run_over_dds_gives_the_local_map_point_for_point() {
    let folder = tempfile::tempdir().unwrap();
    let bag = small_room(folder.path());
    // As ROS users write it: for a node that a run over DDS puts into a namespace. It was once ignored there.
    let parameters = folder.path().join("parameters.yaml");
    let text = "detection:\n  ros__parameters:\n    run_bound: outer_end\n    window_scans: 4\n";
    std::fs::write(&parameters, text).unwrap();
    let run = |transport: &str| {
        let out = folder.path().join(transport);
        succeed([
            "run",
            bag.to_str().unwrap(),
            "--transport",
            transport,
            "--params-file",
            parameters.to_str().unwrap(),
            "--out",
            out.to_str().unwrap(),
        ]);
        out
    };
    let (local, dds) = (run("local"), run("dds"));
    let summaries = [summary(&local), summary(&dds)];
    assert_eq!(summaries[1]["drops"], serde_json::json!([]), "nothing may be lost on the way");
    for key in ["cycles", "points", "zone_shares", "map", "truth", "duration_s"] {
        assert_eq!(summaries[0][key], summaries[1][key], "{key}");
    }
    let (mut local, mut dds) = (files_of(&local), files_of(&dds));
    let effective = String::from_utf8(local["parameters.yaml"].clone()).unwrap();
    assert!(effective.contains("\"window_scans\": 4"), "{effective}");
    for name in ["summary.json", "report.html"] {
        // These two name the transport.
        local.remove(name);
        dds.remove(name);
    }
    assert!(local.keys().eq(dds.keys()));
    for (name, bytes) in &local {
        assert!(*bytes == dds[name], "{name} differs");
    }
}
