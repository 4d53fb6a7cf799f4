//! What is small of every cycle, as JSON: the pose, the zones, the tracks, the counts.

use geometry::{DynamicZone, ZoneSource};
use nalgebra::Isometry3;
use serde_json::{Value, json};

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

/// A pose as x, y, z of the translation and x, y, z, w of the unit quaternion.
pub(super) fn pose(pose: &Isometry3<f64>) -> [f64; 7] {
    let (at_m, turn) = (pose.translation, pose.rotation);
    let fine = |value: f64| (value * 1e5).round() / 1e5;
    [
        rounded(at_m.x),
        rounded(at_m.y),
        rounded(at_m.z),
        fine(turn.i),
        fine(turn.j),
        fine(turn.k),
        fine(turn.w),
    ]
}

fn zone(zone: &DynamicZone) -> Value {
    let held = match zone.source {
        ZoneSource::Measured => 0,
        ZoneSource::Held { cycles } => cycles,
    };
    json!({
        "from_rad": rounded(zone.azimuth_min_rad), "to_rad": rounded(zone.azimuth_max_rad), "held": held,
        "near_m": zone.returns.map(|returns| rounded(returns.nearest_m.into())),
        "far_m": zone.returns.map(|returns| rounded(returns.farthest_m.into())),
    })
}

/// To a thousandth of a metre, second or radian: less than can be seen.
fn rounded(value: f64) -> f64 {
    (value * 1e3).round() / 1e3
}
