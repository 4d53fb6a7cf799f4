//! The scans of a scenario in the forward aperture, for experiments without a camera.

use std::collections::BTreeMap;

use detection::DetectionConfig;
use detection::aperture::{Aperture, Beam};
use detection::gap_fill::{RangeLimits, fill_gaps};
use geometry::{Stamp, pose_from_vector};
use simulator::{Sample, Scenario};

use robot::Failure;

/// The part of a scan that the method uses: the thesis' vectors theta and r, and the object of each beam.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct ForwardScan {
    pub(crate) stamp: Stamp,
    /// The beams of the forward 90 degrees, by azimuth.
    pub(crate) beams: Vec<Beam>,
    /// The object of each of them; 0 for the static scene.
    pub(crate) labels: Vec<u16>,
    limits: RangeLimits,
}

impl ForwardScan {
    /// The number of beams without a return.
    pub(crate) fn gaps(&self) -> usize {
        self.beams.iter().filter(|beam| beam.range_m.is_none()).count()
    }

    /// The number of beams on moving objects.
    pub(crate) fn beams_on_objects(&self) -> usize {
        self.labels.iter().filter(|label| **label != 0).count()
    }

    /// The ranges without gaps (Rec-HV 3.3.2.1); `None` with fewer than two returns.
    pub(crate) fn filled_m(&self) -> Option<Vec<f32>> {
        fill_gaps(&self.beams, self.limits).ok().map(|filled| filled.ranges_m)
    }

    /// The azimuth of a beam, left of forward.
    pub(crate) fn azimuths_deg(&self) -> impl Iterator<Item = f64> + '_ {
        self.beams.iter().map(|beam| beam.azimuth_rad.to_degrees())
    }
}

/// All scans of a scenario, the same as in the pipeline: the scanner's noise does not depend on the camera, of which as
/// little as possible is simulated.
pub(crate) fn forward_scans(scenario: &Scenario) -> Result<Vec<ForwardScan>, Failure> {
    /// Few and small images, since they are not used.
    const IMAGE_SIZE_PX: (usize, usize) = (8, 6);
    const IMAGE_RATE_HZ: f64 = 0.01;
    let mut scenario = scenario.clone().with_depth_size(IMAGE_SIZE_PX.0, IMAGE_SIZE_PX.1);
    scenario.rig.depth_camera.rate_hz = IMAGE_RATE_HZ;
    let failed = |error: &dyn std::error::Error| {
        Failure::new(error.to_string()).within(format_args!("scenario {}", scenario.name))
    };
    let aperture_rad = DetectionConfig::default().aperture_rad;
    let rig_from_lidar = pose_from_vector(&scenario.rig.lidar.rig_from_lidar);
    let mut aperture: Option<Aperture> = None;
    let mut scans = Vec::new();
    for sample in scenario.samples().map_err(|error| failed(&error))? {
        let Sample::Scan { scan, labels } = sample else { continue };
        let aperture = match &aperture {
            Some(aperture) => aperture,
            None => &*aperture.insert(
                Aperture::new(&scan, &rig_from_lidar, aperture_rad)
                    .map_err(|error| failed(&error))?,
            ),
        };
        let beams = aperture.crop(&scan);
        let label = |beam: &Beam| labels.get(beam.index).copied().unwrap_or_default();
        scans.push(ForwardScan {
            stamp: scan.stamp,
            labels: beams.iter().map(label).collect(),
            beams,
            limits: RangeLimits { min_m: scan.range_min_m, max_m: scan.range_max_m },
        });
    }
    Ok(scans)
}

/// A scenario with the length of this many scans.
pub(crate) fn for_scans(scenario: Scenario, scans: usize) -> Scenario {
    /// The last revolution must be complete, and the motor's speed varies.
    const SPARE_TURNS: f64 = 0.5;
    let duration_s = (scans as f64 + SPARE_TURNS) / scenario.rig.lidar.turn_rate_hz;
    scenario.with_duration_s(duration_s)
}

/// For each scan, the number of beams of the aperture on each object.
pub(crate) fn beams_on_objects(
    scenario: &Scenario,
) -> Result<BTreeMap<Stamp, BTreeMap<u16, usize>>, Failure> {
    let scans = forward_scans(scenario)?;
    Ok(scans
        .into_iter()
        .map(|scan| {
            let mut beams: BTreeMap<u16, usize> = BTreeMap::new();
            for label in scan.labels.into_iter().filter(|label| *label != 0) {
                *beams.entry(label).or_default() += 1;
            }
            (scan.stamp, beams)
        })
        .collect())
}

#[cfg(test)]
mod tests {
    use simulator::{CrossingObject, PathName, SceneName};

    use super::*;

    #[test]
    fn a_scenario_for_scans_has_as_many_of_ninety_beams() {
        let scans = forward_scans(&for_scans(Scenario::empty(SceneName::A, 1), 12)).unwrap();
        assert_eq!(scans.len(), 12);
        assert!(scans.iter().all(|scan| scan.beams.len() == 90 && scan.beams_on_objects() == 0));
        assert!(scans.iter().all(|scan| scan.filled_m().is_some_and(|ranges| ranges.len() == 90)));
    }

    #[test]
    fn scans_are_those_that_the_pipeline_sees() {
        let scenario = Scenario::crossing(SceneName::B, CrossingObject::Robot, PathName::A, 2)
            .with_depth_size(40, 30);
        let alone = forward_scans(&scenario).unwrap();
        let beside: Vec<_> = scenario
            .samples()
            .unwrap()
            .filter_map(|sample| match sample {
                Sample::Scan { scan, .. } => Some(scan),
                _ => None,
            })
            .collect();
        assert_eq!(alone.len(), beside.len());
        for (alone, beside) in alone.iter().zip(&beside) {
            assert_eq!(alone.stamp, beside.stamp);
            for beam in &alone.beams {
                assert_eq!(beam.range_m, beside.measured_range_m(beam.index));
            }
        }
        let beams = beams_on_objects(&scenario).unwrap();
        assert!(beams.values().any(|of_scan| of_scan.values().sum::<usize>() > 5));
    }
}
