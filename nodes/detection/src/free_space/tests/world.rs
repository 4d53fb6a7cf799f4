//! A detector in a simulated world, cycle by cycle.

use geometry::{Cloud, DynamicZone, Scan};
use nalgebra::{Isometry3, Point3};

use super::super::testing::{Dice, Scanner, Wall, stamp_of};
use crate::{CycleInput, Detected, DetectionConfig, Detector, View};

pub(super) struct World {
    pub(super) detector: Detector,
    pub(super) scanner: Scanner,
    pub(super) dice: Dice,
    pub(super) cycle: u32,
}

impl World {
    pub(super) fn new(seed: u64) -> Self {
        Self::with(DetectionConfig::default(), seed)
    }

    pub(super) fn with(config: DetectionConfig, seed: u64) -> Self {
        Self {
            detector: Detector::new(config).unwrap(),
            scanner: Scanner::A1,
            dice: Dice::new(seed),
            cycle: 0,
        }
    }

    /// One cycle from the true pose `map_from_rig`, measured as `measured`.
    pub(super) fn step(
        &mut self,
        walls: &[Wall],
        map_from_rig: &Isometry3<f64>,
        measured: &Isometry3<f64>,
    ) -> Detected {
        let scan = self.scanner.scan(walls, map_from_rig, self.cycle, &mut self.dice);
        self.step_with(&scan, measured)
    }

    /// One cycle of a scan from the measured pose.
    pub(super) fn step_with(&mut self, scan: &Scan, measured: &Isometry3<f64>) -> Detected {
        let stamp = stamp_of(self.cycle);
        let cloud = Cloud { stamp, frame_id: "camera".to_owned(), points_m: vec![] };
        self.cycle += 1;
        let input = CycleInput {
            scan,
            view: View::PointsInCamera(&cloud),
            map_from_rig: measured,
            map_frame_id: "map",
        };
        self.detector.step(&input, |_| ()).unwrap()
    }

    /// One cycle at the origin.
    pub(super) fn step_static(&mut self, walls: &[Wall]) -> Vec<DynamicZone> {
        let pose = Isometry3::identity();
        self.step(walls, &pose, &pose).cycle.zones
    }

    /// Cycles at the origin that fill the evidence.
    pub(super) fn look(&mut self, walls: &[Wall], cycles: u32) {
        for _ in 0..cycles {
            assert_eq!(self.step_static(walls), [], "in the empty scene, cycle {}", self.cycle);
        }
    }
}

/// The bearing and the distance of a point from the rig at `map_from_rig`.
pub(super) fn seen_from(map_from_rig: &Isometry3<f64>, [x, y]: [f64; 2]) -> (f64, f64) {
    let point = map_from_rig.inverse() * Point3::new(x, y, 0.0);
    (point.y.atan2(point.x), point.x.hypot(point.y))
}
