//! The trajectory of the rig, as the source of the poses has corrected it: after a loop closure of a SLAM, the poses reported
//! with earlier cycles are outdated. The map follows the correction, so the clouds that are compared with it must follow it, too.

use geometry::{DetectedCycle, LateCorrections, MapPath, Stamp};
use nalgebra::Isometry3;

/// Where the rig was in a cycle.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct CyclePlace {
    pub(super) cloud_stamp: Stamp,
    pub(super) map_from_rig: Isometry3<f64>,
    pub(super) map_frame_id: String,
}

impl CyclePlace {
    pub(super) fn of(cycle: &DetectedCycle) -> Self {
        Self {
            cloud_stamp: cycle.reduced_cloud.stamp,
            map_from_rig: cycle.map_from_rig,
            map_frame_id: cycle.map_frame_id.clone(),
        }
    }
}

/// The latest trajectory, and the corrections for cycles that arrive after them.
#[derive(Debug, Default)]
pub(super) struct Trajectory {
    path: Option<MapPath>,
    late: LateCorrections,
}

impl Trajectory {
    /// Takes a corrected or extended trajectory, and corrects the poses of the cycles.
    pub(super) fn take<'a>(
        &mut self,
        path: MapPath,
        cycles: impl Iterator<Item = &'a mut CyclePlace>,
    ) {
        let correction = self.path.as_ref().and_then(|before| path.correction_since(before));
        let since = path.since();
        let frame_id = path.frame_id().to_owned();
        self.path = Some(path);
        let Some(correction) = correction.filter(|correction| !correction.is_none()) else {
            return;
        };
        for cycle in cycles {
            let stamp = cycle.cloud_stamp;
            if stamp < since && cycle.map_frame_id == frame_id {
                cycle.map_from_rig = correction.at(stamp) * cycle.map_from_rig;
            }
        }
        self.late.corrected(since, &correction);
    }

    /// Corrects a cycle that was sent before the latest corrections and received after them.
    pub(super) fn correct_late(&mut self, cycle: &mut CyclePlace) {
        if self.path.as_ref().is_none_or(|path| path.frame_id() != cycle.map_frame_id) {
            return;
        }
        if let Some(missed) = self.late.missed_at(cycle.cloud_stamp) {
            cycle.map_from_rig = missed * cycle.map_from_rig;
        }
    }
}

#[cfg(test)]
mod tests {
    use geometry::PathVertex;

    use super::*;

    fn at(seconds: f64) -> Stamp {
        Stamp::default().plus_seconds(seconds)
    }

    fn along(x_m: f64) -> Isometry3<f64> {
        Isometry3::translation(x_m, 0.0, 0.0)
    }

    fn path(since_s: f64, vertices: &[(f64, f64)]) -> MapPath {
        let vertices = vertices
            .iter()
            .map(|(seconds, x_m)| PathVertex { stamp: at(*seconds), map_from_rig: along(*x_m) });
        MapPath::new(at(since_s), "map", vertices.collect()).unwrap()
    }

    fn cycle(seconds: f64, x_m: f64, map_frame_id: &str) -> CyclePlace {
        let map_frame_id = map_frame_id.to_owned();
        CyclePlace { cloud_stamp: at(seconds), map_from_rig: along(x_m), map_frame_id }
    }

    #[test]
    fn cycles_before_a_correction_are_corrected_and_those_after_it_are_not() {
        let mut trajectory = Trajectory::default();
        let mut cycles =
            [cycle(0.0, 0.0, "map"), cycle(0.5, 0.5, "map"), cycle(1.0, 1.0, "map")].to_vec();
        trajectory.take(path(1.0, &[(0.0, 0.0), (1.0, 1.0)]), cycles.iter_mut());
        // Sent in the corrected map, and received before its path.
        cycles.push(cycle(2.0, 1.8, "map"));
        cycles.push(cycle(0.5, 0.5, "odom"));
        trajectory.take(path(2.0, &[(0.0, 0.0), (1.0, 0.8), (2.0, 1.8)]), cycles.iter_mut());
        let positions_m: Vec<f64> = cycles.iter().map(|c| c.map_from_rig.translation.x).collect();
        for (got, expected) in positions_m.iter().zip([0.0, 0.4, 0.8, 1.8, 0.5]) {
            assert!((got - expected).abs() < 1e-12, "{positions_m:?}");
        }
        // Cycles that are received after the correction.
        for (sent_s, x_m, expected) in [(1.5, 1.5, 1.3), (2.0, 1.8, 1.8)] {
            let mut late = cycle(sent_s, x_m, "map");
            trajectory.correct_late(&mut late);
            assert!((late.map_from_rig.translation.x - expected).abs() < 1e-12, "{sent_s}");
        }
    }
}
