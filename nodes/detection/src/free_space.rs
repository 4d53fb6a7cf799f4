//! Detection of moving objects by observed free space: on a platform that may move itself, of any number of objects,
//! with gaps in the scan and objects that stop.
//!
//! The ranges alone (Rec-HV 3.2) cannot distinguish an approaching object from the background that it uncovers:
//! both change the range of a beam. Observed free space can: a place that rays have passed in several cycles was
//! free, and a return there is newly occupied. The space behind an object was never passed,
//! so a return there is background when it is uncovered. An object that stops is in observed free space as long as the
//! evidence is kept. An object outside of observed free space is tracked over the scans: an isolated, narrow segment that
//! has travelled is moving.
//!
//! | module | what |
//! |---|---|
//! | `platform_motion` | the twist of the platform, the noise of its poses, jumps |
//! | `deskewed_scan` | the beams of one scan in the map's plane, with the errors of their positions |
//! | `scan_window` | the deviation of the ranges, with earlier scans as seen from the present position (eq. 2, 3) |
//! | `clearance` | the distance up to which each beam certainly shows free space |
//! | `evidence` | the evidence, a rolling grid; the class of each return |
//! | `moving_runs` | which runs of beams in free space are objects |
//! | `tracker` | association with the objects of earlier scans, and whether they have travelled |
//! | `zones` | the zones of objects, visible or not |
//! | `beams_beside` | the beams of objects that are in no run: in held zones, feet, edges |
//! | `search` | the result of one cycle |

mod beams_beside;
mod clearance;
mod deskewed_scan;
mod evidence;
mod moving_runs;
mod platform_motion;
mod scan_window;
mod search;
mod tracker;
mod zones;

use std::ops::Range;
use std::sync::Arc;

use geometry::{MovingBeam, Scan, Stamp};
use nalgebra::Isometry3;

use crate::aperture::Beam;
use crate::config::DetectionConfig;
use beams_beside::add_beams_beside;
use deskewed_scan::{DeskewInput, DeskewedScan, Return};
use evidence::{EvidenceGrid, ReturnClass, ReturnLabel};
use moving_runs::moving_runs;
use platform_motion::PlatformMotion;
pub use platform_motion::PoseJump;
use scan_window::{ScanWindow, is_newly_occupied};
pub use search::MotionSearch;
use search::rays;
use tracker::{MAX_SPEED_M_PER_S, MEMORY_MS, MotionEvidence, Tracker, motion_evidence};
use zones::{CycleView, MovingBeams, ZoneMaker};

/// The probability that a newly visible return beside a moving object is background.
const RATE_BESIDE_AN_OBJECT: f64 = 0.25;

/// The probability that a return of a travelling object is background that was associated wrongly. Two such returns alone
/// are not an object: in floating point their product is slightly above the bound of module `moving_runs`. With a
/// bound that accepts them, recordings of people have more zones, and no more of the people's legs in them.
const RATE_OF_TRAVELLING_OBJECT: f64 = 0.1;

/// Background so near to an object may be a part of it that was missed before: the width of a chair.
const CLUTTER_M: f64 = 0.5;

/// The input of one cycle.
#[derive(Clone, Copy, Debug)]
pub struct MotionInput<'a> {
    /// The scan.
    pub scan: &'a Scan,
    /// All its beams, by azimuth: those behind the rig see free space too.
    pub beams: &'a [Beam],
    /// Where the scanner is on the rig: a joint may move it from cycle to cycle.
    pub rig_from_lidar: &'a Isometry3<f64>,
    /// The pose of the rig.
    pub map_from_rig: &'a Isometry3<f64>,
    /// The frame of the pose.
    pub map_frame_id: &'a str,
    /// The stamp of the pose, which is that of the cycle's cloud.
    pub pose_stamp: Stamp,
}

/// The deviations of a cycle, and what [`MotionFinder::find`] needs beside them.
#[derive(Clone, Debug)]
pub struct Deviations {
    /// Shared with the window of scans.
    scan: Arc<DeskewedScan>,
    std_dev_m: Option<Vec<Option<f32>>>,
    now_ms: u32,
    platform_moves: bool,
    pose_jump: Option<PoseJump>,
}

/// Finds moving objects by returns in observed free space.
///
/// Memory: [`crate::FreeSpaceConfig::evidence_bytes`] and the scans of the window.
#[derive(Clone, Debug)]
pub struct MotionFinder {
    config: DetectionConfig,
    motion: PlatformMotion,
    window: ScanWindow,
    evidence: EvidenceGrid,
    tracker: Tracker,
    zone_maker: ZoneMaker,
    /// The stamp that the evidence's time counts from, and the last time.
    epoch: Option<(Stamp, u32)>,
}

impl MotionFinder {
    /// A finder without evidence; `config` has been validated.
    #[must_use]
    pub fn new(config: &DetectionConfig) -> Self {
        Self {
            motion: PlatformMotion::new(&config.free_space),
            window: ScanWindow::new(config.window_scans),
            evidence: EvidenceGrid::new(&config.free_space, config.pipeline.max_stop_s),
            tracker: Tracker::default(),
            zone_maker: ZoneMaker::new(config),
            epoch: None,
            config: config.clone(),
        }
    }

    /// Bounds the zones by another aperture than the configuration's.
    pub fn set_aperture(&mut self, aperture_rad: f64) {
        self.zone_maker.set_aperture(aperture_rad);
    }

    /// Forgets the evidence, the scans and the zones.
    pub fn clear(&mut self) {
        self.motion.clear();
        self.clear_scene();
    }

    /// Forgets only the scans of the window: the evidence does not depend on the geometry of the scan.
    pub fn clear_window(&mut self) {
        self.window.clear();
    }

    fn clear_scene(&mut self) {
        self.window.clear();
        self.evidence.clear();
        self.tracker.clear();
        self.epoch = None;
    }

    /// Deskews the scan and computes the deviations of its beams over the window. A pose that jumps resets the finder.
    pub fn take_in(&mut self, input: &MotionInput<'_>) -> Deviations {
        self.motion.mount(input.rig_from_lidar);
        let motion = self.motion.advance(input.pose_stamp, input.map_from_rig, input.map_frame_id);
        if motion.jumped {
            self.clear_scene();
        }
        let turn_input = DeskewInput {
            scan: input.scan,
            beams: input.beams,
            rig_from_lidar: input.rig_from_lidar,
            map_from_rig: input.map_from_rig,
            pose_stamp: input.pose_stamp,
            motion: &motion,
        };
        let scan = Arc::new(DeskewedScan::new(&turn_input, &self.config.free_space));
        let now_ms = self.now_ms(input.scan.stamp);
        if scan.beams.iter().any(|beam| beam.hit.is_some()) {
            self.window.push(Arc::clone(&scan));
        }
        Deviations {
            std_dev_m: self.window.std_dev_m(),
            scan,
            now_ms,
            platform_moves: motion.moves,
            pose_jump: motion.jump,
        }
    }

    /// The zones of the cycle, and the evidence that it adds.
    pub fn find(&mut self, deviations: &Deviations, within: &Range<usize>) -> MotionSearch {
        let Deviations { scan, std_dev_m, now_ms, platform_moves, pose_jump } = deviations;
        if let Some(beam) = scan.beams.first() {
            self.evidence.center_on(&beam.origin_m);
        }
        let mut classes: Vec<Option<ReturnClass>> = scan
            .beams
            .iter()
            .map(|beam| beam.hit.as_ref().map(|hit| self.classify(hit, *now_ms)))
            .collect();
        // Runs are searched in the whole scan: moving objects behind the rig are not background either.
        let mut runs = self.runs(scan, &classes, within);
        self.tracker.update(scan, &classes, &runs, *now_ms, *platform_moves);
        let mut has_changed = false;
        for (beam, hit) in self.tracker.travelling().flat_map(|beams| scan.returns_of_object(beams))
        {
            let is_object = match classes[beam] {
                Some(ReturnClass::Unknown | ReturnClass::Ambiguous) => true,
                // The object itself, before it had travelled.
                Some(ReturnClass::Background) => {
                    self.evidence.is_new_background(hit, MEMORY_MS, *now_ms)
                }
                Some(ReturnClass::InFreeSpace { .. }) | None => false,
            };
            if is_object {
                let background_rate = RATE_OF_TRAVELLING_OBJECT;
                classes[beam] = Some(ReturnClass::InFreeSpace { background_rate });
                has_changed = true;
            }
        }
        if has_changed {
            runs = self.runs(scan, &classes, within);
        }
        let runs = self.moving(scan, runs, *now_ms, *platform_moves);
        let mut labels = vec![ReturnLabel::Background; scan.beams.len()];
        // Otherwise earlier returns of a person who walks away would count as background, since poses are not exact.
        self.tracker.under_way().for_each(|beams| labels[beams].fill(ReturnLabel::Undecided));
        for run in &runs {
            let label =
                if run.has_travelled { ReturnLabel::Moving } else { ReturnLabel::Undecided };
            labels[run.beams.clone()].fill(label);
        }
        self.evidence.integrate(scan, &labels, *now_ms);

        let mut beams: Vec<usize> = runs
            .iter()
            .flat_map(|run| scan.returns_of_object(run.beams.clone()))
            .map(|(beam, _)| beam)
            .collect();
        let is_in_aperture =
            |run: &MovingBeams| within.start <= run.beams.start && run.beams.end <= within.end;
        let measured: Vec<MovingBeams> = runs.into_iter().filter(is_in_aperture).collect();
        let none = Vec::new();
        let std_dev_m = std_dev_m.as_ref().unwrap_or(&none);
        let unknown = vec![None; scan.beams.len()];
        let known_m: &[Option<f32>] =
            if std_dev_m.len() == scan.beams.len() { std_dev_m } else { &unknown };
        let view = CycleView { scan, classes: &classes, within, platform_moves: *platform_moves };
        let objects = self.tracker.objects_mut();
        let zones = self.zone_maker.zones(&view, &measured, objects, known_m);
        add_beams_beside(&mut beams, scan, &classes, &zones);
        let hits = self.hits(scan, beams, *now_ms);
        let found = self.search(&classes, zones, &measured, known_m, within);
        let rays = rays(scan, &labels, &hits);
        MotionSearch { hits, rays, pose_jump: *pose_jump, ..found }
    }

    /// The hits of beams, each with the background behind it.
    fn hits(&self, scan: &DeskewedScan, mut beams: Vec<usize>, now_ms: u32) -> Vec<MovingBeam> {
        beams.sort_unstable();
        beams.dedup();
        let hit = |place: usize| {
            let beam = &scan.beams[place];
            let hit = beam.hit.as_ref()?;
            let background_m = self.evidence.background_behind_m(beam, hit, now_ms);
            Some(MovingBeam { index: place as u32, background_m })
        };
        beams.into_iter().filter_map(hit).collect()
    }

    /// The runs of beams in free space, in the aperture and outside of it.
    fn runs(
        &self,
        scan: &DeskewedScan,
        classes: &[Option<ReturnClass>],
        within: &Range<usize>,
    ) -> Vec<Range<usize>> {
        let smallest_m = self.config.free_space.smallest_object_m;
        [0..within.start, within.clone(), within.end..scan.beams.len()]
            .into_iter()
            .flat_map(|part| moving_runs(scan, classes, part, smallest_m))
            .map(|run| run.beams)
            .collect()
    }

    /// The runs that count as moving: all of them from a static platform.
    fn moving(
        &self,
        scan: &DeskewedScan,
        runs: Vec<Range<usize>>,
        now_ms: u32,
        platform_moves: bool,
    ) -> Vec<MovingBeams> {
        let moving = |beams: Range<usize>| {
            let object = self.tracker.object_of(&beams);
            let evidence = match object.and_then(|object| self.tracker.object(object)) {
                _ if !platform_moves => MotionEvidence::Travelled,
                Some(object) => motion_evidence(object, scan, &beams, || {
                    self.is_in_clutter(scan, &beams, now_ms)
                }),
                None => MotionEvidence::Insufficient,
            };
            let has_travelled = match evidence {
                MotionEvidence::Travelled => true,
                MotionEvidence::InEmptySpace => false,
                MotionEvidence::Insufficient => return None,
            };
            Some(MovingBeams { beams, object, has_travelled })
        };
        runs.into_iter().filter_map(moving).collect()
    }

    fn is_in_clutter(&self, scan: &DeskewedScan, beams: &Range<usize>, now_ms: u32) -> bool {
        scan.beams[beams.clone()]
            .iter()
            .filter_map(|beam| beam.hit)
            .any(|hit| self.evidence.has_background_near(&hit.in_map_m, CLUTTER_M, now_ms))
    }

    /// The class of a return by the evidence or, without evidence, by the objects of the cycle before.
    ///
    /// In front of black or far surfaces there are no returns, so no free space is observed. When a tracked object moves
    /// into such a place, a return that was not there a cycle ago, no farther from the object than it can have moved, is
    /// most likely on it, and so is a return where its front was. Background that the object uncovers was hidden behind it,
    /// and is not newly occupied.
    fn classify(&self, hit: &Return, now_ms: u32) -> ReturnClass {
        let class = self.evidence.classify(hit, now_ms);
        let follows_an_object = || {
            let distance_m = self.tracker.distance_to_zones_m(&hit.in_map_m);
            let reach_m = hit.error_m + MAX_SPEED_M_PER_S * self.tracker.elapsed_s(now_ms);
            let is_new =
                || self.window.previous().is_some_and(|earlier| is_newly_occupied(earlier, hit));
            distance_m <= hit.error_m || (distance_m <= reach_m && is_new())
        };
        if class == ReturnClass::Unknown && follows_an_object() {
            return ReturnClass::InFreeSpace { background_rate: RATE_BESIDE_AN_OBJECT };
        }
        class
    }

    /// The evidence's time: milliseconds from its first scan, from 1 on, and later with every cycle.
    fn now_ms(&mut self, stamp: Stamp) -> u32 {
        let Some((first, last_ms)) = self.epoch else {
            self.epoch = Some((stamp, 1));
            return 1;
        };
        // The cast saturates: after 49 days the evidence is reset and its time starts again.
        let now_ms = (stamp.seconds_since(first) * 1e3) as u32;
        if now_ms >= u32::MAX - 1 {
            self.clear_scene();
            return self.now_ms(stamp);
        }
        let now_ms = now_ms.max(last_ms.saturating_add(1));
        self.epoch = Some((first, now_ms));
        now_ms
    }
}

#[cfg(test)]
mod testing;
#[cfg(test)]
mod tests;
