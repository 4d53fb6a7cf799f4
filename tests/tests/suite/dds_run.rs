//! A bag through three nodes and a player, each a process of its own, over DDS.

use crate::bags::small_room;
use crate::local_run::files_of;
use crate::program::{succeed, summary};

#[test]
fn the_run_over_dds_gives_the_local_map_point_for_point() {
    let folder = tempfile::tempdir().unwrap();
    let bag = small_room(folder.path());
    let run = |transport: &str| {
        let out = folder.path().join(transport);
        succeed([
            "run",
            bag.to_str().unwrap(),
            "--transport",
            transport,
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
