//! What is small of every cycle, as JSON: the pose, the zones, the tracks, the counts.

use serde_json::{Value, json};

use crate::payload::{pose, rounded, zone};
use crate::{CycleRecord, RunRecord};

pub(super) fn encode(run: &RunRecord) -> Value {
    let first = run.cycles.first().map(|cycle| cycle.scan_stamp).unwrap_or_default();
    let mut views = 0;
    let cycle = |cycle: &CycleRecord| {
        let view = cycle.view.as_ref().map(|_| {
            views += 1;
            views - 1
        });
        let tracks: Vec<[f64; 4]> = cycle
            .tracks_m
            .iter()
            .map(|(id, at_m)| [f64::from(*id), rounded(at_m.x), rounded(at_m.y), rounded(at_m.z)])
            .collect();
        json!({
            "index": cycle.index,
            "t_s": rounded(cycle.scan_stamp.seconds_since(first)),
            "pose": pose(&cycle.map_from_rig),
            "zones": cycle.zones.iter().map(zone).collect::<Vec<_>>(),
            "tracks": tracks,
            "counts": {
                "before": cycle.points_in, "reduced": cycle.counts.reduced, "in_zone": cycle.counts.in_zone,
                "dynamic": cycle.counts.dynamic, "map": cycle.map_points,
            },
            "view": view,
        })
    };
    json!({ "cycles": run.cycles.iter().map(cycle).collect::<Vec<_>>() })
}
