//! The result of one cycle: the zones, with the counts and the beams that they are read by.

use std::ops::Range;

use geometry::{DynamicZone, MovingBeam, ScanRay, ZoneSource};

use super::deskewed_scan::{DeskewedBeam, DeskewedScan};
use super::evidence::{ReturnClass, ReturnLabel};
use super::zones::MovingBeams;
use super::{MotionFinder, PoseJump};
use crate::zone_finder::Unmeasured;

/// A scan with fewer returns in the aperture is not used, as in Rec-HV, which needs two for a line.
const LEAST_RETURNS: usize = 2;

/// The result of one cycle.
#[derive(Clone, PartialEq, Debug)]
pub struct MotionSearch {
    /// The zones by azimuth, measured or held.
    pub zones: Vec<DynamicZone>,
    /// Why none was measured, if none was.
    pub unmeasured: Option<Unmeasured>,
    /// The largest deviation in the aperture, if there are deviations.
    pub max_std_dev_m: Option<f32>,
    /// Beams of the aperture whose deviation exceeds `min_std_dev_m`.
    pub high_variability_beams: usize,
    /// Beams of the aperture in measured zones whose return is in observed free space.
    pub moving_beams: usize,
    /// Beams of the aperture without a return.
    pub unknown_beams: usize,
    /// The step of the pose since the last cycle, if no platform makes it: what earlier cycles saw was forgotten.
    pub pose_jump: Option<PoseJump>,
    /// The beams that hit what moves, of the whole scan, by their places among [`MotionInput::beams`](super::MotionInput::beams).
    pub hits: Vec<MovingBeam>,
    /// The rays of all beams that have a return, in the rig frame of the cycle's pose.
    pub rays: Vec<ScanRay>,
}

impl MotionFinder {
    /// The zones of a cycle with its counts; without its hits and rays.
    pub(super) fn search(
        &self,
        classes: &[Option<ReturnClass>],
        zones: Vec<DynamicZone>,
        measured: &[MovingBeams],
        std_dev_m: &[Option<f32>],
        within: &Range<usize>,
    ) -> MotionSearch {
        let in_aperture = &std_dev_m[within.clone()];
        let largest = |most: Option<f32>, next_m: &f32| Some(most.unwrap_or(0.0).max(*next_m));
        let max_std_dev_m = in_aperture.iter().flatten().fold(None, largest);
        let least_m = self.config.min_std_dev_m as f32;
        let high_variability_beams =
            in_aperture.iter().flatten().filter(|deviation_m| **deviation_m > least_m).count();
        let is_moving =
            |beam: &usize| matches!(classes[*beam], Some(ReturnClass::InFreeSpace { .. }));
        let moving_beams =
            measured.iter().flat_map(|run| run.beams.clone()).filter(is_moving).count();
        let unknown_beams = classes[within.clone()].iter().filter(|class| class.is_none()).count();
        let returns = within.len() - unknown_beams;
        let is_measured = zones.iter().any(|zone| zone.source == ZoneSource::Measured);
        let unmeasured = if is_measured {
            None
        } else if returns < LEAST_RETURNS {
            Some(Unmeasured::TooFewReturns { returns })
        } else if self.window.len() < self.config.window_scans {
            let window_scans = self.config.window_scans;
            Some(Unmeasured::WindowFilling { scans: self.window.len(), window_scans })
        } else {
            Some(Unmeasured::NothingInFreeSpace { returns })
        };
        MotionSearch {
            zones,
            unmeasured,
            max_std_dev_m,
            high_variability_beams,
            moving_beams,
            unknown_beams,
            pose_jump: None,
            hits: Vec::new(),
            rays: Vec::new(),
        }
    }
}

/// The rays of all beams that have a return. What is not certainly background may move.
pub(super) fn rays(
    scan: &DeskewedScan,
    labels: &[ReturnLabel],
    hits: &[MovingBeam],
) -> Vec<ScanRay> {
    let is_hit = |place: usize| hits.binary_search_by_key(&(place as u32), |hit| hit.index).is_ok();
    let ray = |(place, beam): (usize, &DeskewedBeam)| {
        let hit = beam.hit.as_ref()?;
        let next = scan.next(place).filter(|next| *next == place + 1);
        let next = next.and_then(|next| scan.beams.get(next));
        Some(ScanRay {
            from_m: beam.origin_in_rig_m.cast(),
            to_m: hit.in_rig_m.cast(),
            is_moving: is_hit(place) || labels.get(place) != Some(&ReturnLabel::Background),
            joins_next: next.is_some_and(|next| next.hit.is_some()),
        })
    };
    scan.beams.iter().enumerate().filter_map(ray).collect()
}
