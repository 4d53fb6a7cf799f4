//! What ends where free space was seen is moving: detection on a platform that may move itself, of any
//! number of objects, with gaps in the scan and objects that stop.
//!
//! The ranges alone (Rec-HV 3.2) cannot tell the object that comes from the background that it uncovers:
//! both change the range of a beam. The space can: a place that rays have passed in several cycles was
//! free, and a return that ends there is something that came. What was behind an object was never passed,
//! so that it is background when it is uncovered. An object that stops stands where free space was seen,
//! as long as the evidence is remembered.
//!
//! | module | what |
//! |---|---|
//! | `motion` | the platform's twist, the noise of its poses, jumps |
//! | `turn` | the beams of one scan in the map's plane, with the errors of their places |
//! | `warp` | the deviation of the ranges with earlier scans seen from the present place (eq. 2, 3) |
//! | `clearance` | how far each beam shows free space for sure |
//! | `free_space` | the evidence, a rolling grid; the verdict on each return |
//! | `travel` | narrow things that stand apart and go from place to place |
//! | `journey` | where a thing has been, and whether it came some way |
//! | `proof` | what a thing must show where the platform moves |
//! | `runs` | which runs of moving beams are objects |
//! | `zones` | their zones; zones of objects lost from sight |

mod clearance;
mod free_space;
mod journey;
mod motion;
mod proof;
mod runs;
mod travel;
mod turn;
mod warp;
mod zones;

use std::ops::Range;

use geometry::{DynamicZone, Scan, Stamp, ZoneSource};
use nalgebra::Isometry3;

use crate::aperture::Beam;
use crate::config::DetectionConfig;
use crate::zone_finder::Unmeasured;
use free_space::{FreeSpace, Met, Verdict};
use motion::PlatformMotion;
use proof::{CLUTTER_M, Proof, Proofs};
use runs::moving_runs;
use travel::Travellers;
use turn::{Return, Turn, TurnInput};
use warp::{WarpWindow, has_arrived};
use zones::{FOUND_AGAIN_M, MovingBeams, Sight, ZoneKeeper};

/// A scan with fewer returns in the aperture says nothing, as in Rec-HV, which needs two for a line.
const LEAST_RETURNS: usize = 2;

/// A new return beside a moving object is background, come into sight by chance, once in four times.
const STATIC_RATE_BESIDE_AN_OBJECT: f64 = 0.25;

/// A return of a thing that travels is background, matched by mistake, at most once in ten times. Two of them are no
/// object by that alone: in floating point their product is a hair above the bound of module `runs`. With a bound that
/// lets them pass, recordings of people show more zones, and no more of the people's legs in them.
const STATIC_RATE_OF_A_TRAVELLER: f64 = 0.1;

/// What the method looks at in one cycle.
#[derive(Clone, Copy, Debug)]
pub struct MotionInput<'a> {
    /// The scan.
    pub scan: &'a Scan,
    /// All its beams, by azimuth: those behind the rig see free space too.
    pub beams: &'a [Beam],
    /// The pose of the rig.
    pub map_from_rig: &'a Isometry3<f64>,
    /// The frame of the pose.
    pub map_frame_id: &'a str,
    /// When the rig was there: the stamp of the cycle's cloud.
    pub pose_stamp: Stamp,
}

/// The deviations of a cycle, and what [`MotionFinder::find`] needs beside them.
#[derive(Clone, Debug)]
pub struct Deviations {
    turn: Turn,
    std_dev_m: Option<Vec<Option<f32>>>,
    now_ms: u32,
    platform_moves: bool,
}

/// What the method finds in one cycle.
#[derive(Clone, PartialEq, Debug)]
pub struct MotionSearch {
    /// The zones by azimuth, measured or held.
    pub zones: Vec<DynamicZone>,
    /// Why none was measured, if none was.
    pub unmeasured: Option<Unmeasured>,
    /// The largest deviation in the aperture, where there are deviations.
    pub max_std_dev_m: Option<f32>,
    /// Beams of the aperture whose deviation exceeds `min_std_dev_m`.
    pub high_variability_beams: usize,
    /// Beams of the aperture in measured zones that end where free space was seen.
    pub moving_beams: usize,
    /// Beams of the aperture without a return.
    pub unknown_beams: usize,
}

/// Finds what moves by the free space it stands in.
///
/// Memory: [`crate::StillmapConfig::evidence_bytes`] and the turns of the window.
#[derive(Clone, Debug)]
pub struct MotionFinder {
    rig_from_lidar: Isometry3<f64>,
    config: DetectionConfig,
    motion: PlatformMotion,
    window: WarpWindow,
    free_space: FreeSpace,
    travellers: Travellers,
    proofs: Proofs,
    keeper: ZoneKeeper,
    /// The stamp that the evidence's time counts from, and the last time.
    epoch: Option<(Stamp, u32)>,
}

impl MotionFinder {
    /// A finder that has seen nothing yet; `config` has been validated.
    #[must_use]
    pub fn new(config: &DetectionConfig) -> Self {
        Self {
            rig_from_lidar: geometry::pose_from_vector(&config.rig_from_lidar),
            motion: PlatformMotion::new(&config.stillmap),
            window: WarpWindow::new(config.window_scans),
            free_space: FreeSpace::new(&config.stillmap),
            travellers: Travellers::default(),
            proofs: Proofs::default(),
            keeper: ZoneKeeper::new(config),
            epoch: None,
            config: config.clone(),
        }
    }

    /// Forgets the evidence, the scans and the zones.
    pub fn clear(&mut self) {
        self.motion.clear();
        self.clear_what_was_seen();
    }

    /// Forgets the scans of the window alone: another geometry of the scan changes nothing in the world.
    pub fn clear_window(&mut self) {
        self.window.clear();
        self.travellers.clear();
    }

    fn clear_what_was_seen(&mut self) {
        self.window.clear();
        self.free_space.clear();
        self.travellers.clear();
        self.proofs.clear();
        self.keeper.clear();
        self.epoch = None;
    }

    /// Lays the scan out and takes the deviations of its beams over the window. A pose that jumps starts
    /// everything anew.
    pub fn take_in(&mut self, input: &MotionInput<'_>) -> Deviations {
        let motion = self.motion.advance(input.pose_stamp, input.map_from_rig, input.map_frame_id);
        if motion.jumped {
            self.clear_what_was_seen();
        }
        let turn_input = TurnInput {
            scan: input.scan,
            beams: input.beams,
            rig_from_lidar: &self.rig_from_lidar,
            map_from_rig: input.map_from_rig,
            pose_stamp: input.pose_stamp,
            motion: &motion,
        };
        let turn = Turn::new(&turn_input, &self.config.stillmap);
        let now_ms = self.now_ms(input.scan.stamp);
        if turn.beams.iter().any(|beam| beam.met.is_some()) {
            self.window.push(turn.clone());
        }
        Deviations {
            std_dev_m: self.window.std_dev_m(),
            turn,
            now_ms,
            platform_moves: motion.moves,
        }
    }

    /// The zones of the cycle, and the evidence that it adds.
    pub fn find(&mut self, deviations: &Deviations, within: &Range<usize>) -> MotionSearch {
        let Deviations { turn, std_dev_m, now_ms, platform_moves } = deviations;
        if let Some(beam) = turn.beams.first() {
            self.free_space.center_on(&beam.origin_m);
        }
        let mut verdicts: Vec<Option<Verdict>> = turn
            .beams
            .iter()
            .map(|beam| beam.met.as_ref().map(|met| self.verdict(met, *now_ms)))
            .collect();
        let travel = self.travellers.follow(turn, &verdicts, *now_ms);
        for beams in &travel.travelling {
            for verdict in verdicts[beams.clone()].iter_mut().flatten() {
                if matches!(verdict, Verdict::Unseen | Verdict::Unsure) {
                    *verdict = Verdict::Moving { static_rate: STATIC_RATE_OF_A_TRAVELLER };
                }
            }
        }

        // Runs are looked for all round: what moves behind the rig is no background either.
        let smallest_m = self.config.stillmap.smallest_object_m;
        let runs = [0..within.start, within.clone(), within.end..turn.beams.len()]
            .map(|part| moving_runs(turn, &verdicts, part, smallest_m));
        let runs: Vec<Range<usize>> = runs.into_iter().flatten().map(|run| run.beams).collect();
        let runs = self.proven(turn, runs, *now_ms, *platform_moves);
        let mut met = vec![Met::Background; turn.beams.len()];
        // Who walks away would find his own returns of a scan ago for background: poses are not exact.
        let going = travel.travelling.into_iter().chain(travel.under_way);
        going.for_each(|beams| met[beams].fill(Met::Undecided));
        for run in &runs {
            let what = if run.has_travelled { Met::Object } else { Met::Undecided };
            met[run.beams.clone()].fill(what);
        }
        self.free_space.take_in(turn, &met, *now_ms);

        let is_in_aperture =
            |run: &MovingBeams| within.start <= run.beams.start && run.beams.end <= within.end;
        let measured: Vec<MovingBeams> = runs.into_iter().filter(is_in_aperture).collect();
        let none = Vec::new();
        let std_dev_m = std_dev_m.as_ref().unwrap_or(&none);
        let unknown = vec![None; turn.beams.len()];
        let known_m: &[Option<f32>] =
            if std_dev_m.len() == turn.beams.len() { std_dev_m } else { &unknown };
        let sight = Sight { turn, verdicts: &verdicts, within, platform_moves: *platform_moves };
        let zones = self.keeper.zones(&sight, &measured, known_m);
        self.search(&verdicts, zones, &measured, known_m, within)
    }

    /// The runs that count as moving: all of them from a still platform.
    fn proven(
        &mut self,
        turn: &Turn,
        runs: Vec<Range<usize>>,
        now_ms: u32,
        platform_moves: bool,
    ) -> Vec<MovingBeams> {
        // On a still platform nobody asks.
        let is_in_clutter = |beams: &Range<usize>| {
            platform_moves
                && turn.beams[beams.clone()]
                    .iter()
                    .filter_map(|beam| beam.met)
                    .any(|met| self.free_space.has_ends_near(&met.in_map_m, CLUTTER_M, now_ms))
        };
        let proofs = self.proofs.of(turn, &runs, is_in_clutter, now_ms);
        let counts = |(beams, proof): (Range<usize>, Proof)| match proof {
            _ if !platform_moves => Some(MovingBeams { beams, has_travelled: true }),
            Proof::Travelled => Some(MovingBeams { beams, has_travelled: true }),
            Proof::InEmptySpace => Some(MovingBeams { beams, has_travelled: false }),
            Proof::None => None,
        };
        runs.into_iter().zip(proofs).filter_map(counts).collect()
    }

    /// What the evidence says of a return; where there is none, what the objects of the cycle before say.
    ///
    /// Before black or far things no ray ever comes back, and no free space is seen. An object that goes on
    /// into such a place is known to be near: a return that was not there a cycle ago, no farther from it
    /// than it can have gone, is most likely its own, and so is one where its front was. What it uncovers
    /// was hidden behind it, and has not arrived.
    fn verdict(&self, met: &Return, now_ms: u32) -> Verdict {
        let verdict = self.free_space.judge(met, now_ms);
        let follows_an_object = || {
            let distance_m = self.keeper.distance_m(&met.in_map_m);
            let has_arrived =
                || self.window.previous().is_some_and(|earlier| has_arrived(earlier, met));
            distance_m <= met.error_m || (distance_m <= FOUND_AGAIN_M && has_arrived())
        };
        if verdict == Verdict::Unseen && follows_an_object() {
            return Verdict::Moving { static_rate: STATIC_RATE_BESIDE_AN_OBJECT };
        }
        verdict
    }

    fn search(
        &self,
        verdicts: &[Option<Verdict>],
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
        let is_moving = |beam: &usize| matches!(verdicts[*beam], Some(Verdict::Moving { .. }));
        let moving_beams =
            measured.iter().flat_map(|run| run.beams.clone()).filter(is_moving).count();
        let unknown_beams =
            verdicts[within.clone()].iter().filter(|verdict| verdict.is_none()).count();
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
        }
    }

    /// The evidence's time: milliseconds from its first scan, from 1 on, and later with every cycle.
    fn now_ms(&mut self, stamp: Stamp) -> u32 {
        let Some((first, last_ms)) = self.epoch else {
            self.epoch = Some((stamp, 1));
            return 1;
        };
        // The cast saturates: after 49 days the clock of the evidence stands, and starts anew.
        let now_ms = (stamp.seconds_since(first) * 1e3) as u32;
        if now_ms >= u32::MAX - 1 {
            self.clear_what_was_seen();
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
