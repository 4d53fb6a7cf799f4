//! A bag through three nodes and a player, each a process of its own, over DDS.

use crate::bags::small_room;
use crate::local_run::files_of;
use crate::program::{succeed, summary};

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
        assert!(bytes == &dds[name], "{name} differs");
    }
}
