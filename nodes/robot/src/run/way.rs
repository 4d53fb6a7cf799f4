//! The way that the rig went, as the poses' source has it by now: a SLAM that closes a loop has told earlier cycles other
//! poses than it would tell today. A map that has followed it is held against clouds that have followed it, too.

use geometry::{DetectedCycle, LateCorrections, MapPath};

/// What is known of the way.
#[derive(Debug, Default)]
pub(super) struct Way {
    path: Option<MapPath>,
    late: LateCorrections,
}

impl Way {
    /// The way has been corrected, or has gone on: the cycles go along.
    pub(super) fn take<'a>(
        &mut self,
        path: MapPath,
        cycles: impl Iterator<Item = &'a mut DetectedCycle>,
    ) {
        let correction = self.path.as_ref().and_then(|before| path.correction_since(before));
        let since = path.since();
        let frame_id = path.frame_id().to_owned();
        self.path = Some(path);
        let Some(correction) = correction.filter(|correction| !correction.is_none()) else {
            return;
        };
        for cycle in cycles {
            let stamp = cycle.reduced_cloud.stamp;
            if stamp < since && cycle.map_frame_id == frame_id {
                cycle.map_from_rig = correction.at(stamp) * cycle.map_from_rig;
            }
        }
        self.late.corrected(since, &correction);
    }

    /// A cycle that was told before the latest corrections and comes after them.
    pub(super) fn bring_over(&mut self, cycle: &mut DetectedCycle) {
        if self.path.as_ref().is_none_or(|path| path.frame_id() != cycle.map_frame_id) {
            return;
        }
        if let Some(missed) = self.late.missed_at(cycle.reduced_cloud.stamp) {
            cycle.map_from_rig = missed * cycle.map_from_rig;
        }
    }
}

#[cfg(test)]
mod tests {
    use geometry::{Cloud, PathVertex, Stamp};
    use nalgebra::Isometry3;

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

    fn cycle(seconds: f64, x_m: f64, map_frame_id: &str) -> DetectedCycle {
        let cloud = Cloud { stamp: at(seconds), frame_id: "rig".to_owned(), points_m: Vec::new() };
        DetectedCycle {
            depth: None,
            index: 0,
            scan_stamp: at(seconds),
            reduced_cloud: cloud,
            voxel_points: Vec::new(),
            points_before_reduction: 0,
            map_from_rig: along(x_m),
            map_frame_id: map_frame_id.to_owned(),
            setup: geometry::CycleSetup::default(),
            zones: Vec::new(),
        }
    }

    #[test]
    fn what_was_told_before_a_correction_goes_along_and_what_is_told_after_it_stays() {
        let mut way = Way::default();
        let mut cycles =
            [cycle(0.0, 0.0, "map"), cycle(0.5, 0.5, "map"), cycle(1.0, 1.0, "map")].to_vec();
        way.take(path(1.0, &[(0.0, 0.0), (1.0, 1.0)]), cycles.iter_mut());
        // Told in the map to come, and heard before its path.
        cycles.push(cycle(2.0, 1.8, "map"));
        cycles.push(cycle(0.5, 0.5, "odom"));
        way.take(path(2.0, &[(0.0, 0.0), (1.0, 0.8), (2.0, 1.8)]), cycles.iter_mut());
        let stand_at: Vec<f64> = cycles.iter().map(|c| c.map_from_rig.translation.x).collect();
        for (got, expected) in stand_at.iter().zip([0.0, 0.4, 0.8, 1.8, 0.5]) {
            assert!((got - expected).abs() < 1e-12, "{stand_at:?}");
        }
        // Cycles that were on their way.
        for (told, x_m, expected) in [(1.5, 1.5, 1.3), (2.0, 1.8, 1.8)] {
            let mut late = cycle(told, x_m, "map");
            way.bring_over(&mut late);
            assert!((late.map_from_rig.translation.x - expected).abs() < 1e-12, "{told}");
        }
    }
}
