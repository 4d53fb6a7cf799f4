//! The odometry: the processing of each scan.

mod matching;

use geometry::{ParameterError, Scan, Stamp};
use nalgebra::{Isometry2, Matrix3};

use crate::ScanOdometryConfig;
use crate::local_line::local_lines;
use crate::local_map::{LocalMap, Moment};
use crate::scan_pose::{DegenerateDirection, MatchOutcome, MatchQuality, Refusal, ScanPose};
use crate::scan_returns::ScanReturns;
use crate::twist::Twist;
use crate::uncertainty::{Anchor, parted};
use crate::velocity::Velocity;
use matching::{Match, Prediction};

/// A velocity that moves no return by this much within half a turn needs no deskewing.
const SKEW_M: f64 = 0.001;

/// Follows a 2D scanner by its scans.
///
/// Memory is bounded by `max_lines` and `reach_m`. The same scans give the same poses, bit for bit.
#[derive(Clone, Debug)]
pub struct ScanOdometry {
    config: ScanOdometryConfig,
    map: LocalMap,
    track: Option<Track>,
}

/// The state after a scan.
#[derive(Clone, Debug)]
struct Track {
    /// The middle of its turn.
    stamp: Stamp,
    odom_from_middle: Isometry2<f64>,
    velocity: Velocity,
    /// Of the pose against the map, in the scanner's frame.
    covariance: Matrix3<f64>,
    anchor: Anchor,
    /// For how long nothing has matched.
    unmatched_s: f64,
    /// How many scans came before, and how far the platform has gone.
    now: Moment,
    /// The first scan, until the second shows how the scanner moved in it.
    first: Option<ScanReturns>,
}

impl ScanOdometry {
    /// An odometry that has seen nothing.
    ///
    /// # Errors
    /// When a parameter is out of its range.
    pub fn new(config: ScanOdometryConfig) -> Result<Self, ParameterError> {
        config.validate()?;
        let map = LocalMap::new(&config);
        Ok(Self { config, map, track: None })
    }

    /// Forgets everything: the next scan is the first one.
    pub fn forget(&mut self) {
        self.map.clear();
        self.track = None;
    }

    /// Adds the next scan. Never fails: directions that a scan does not determine are predicted, and listed in the quality.
    ///
    /// A stamp that does not grow is refused; one that jumps back by more than `max_held_s` means that the clock has
    /// jumped, and the platform is taken to be near where it was.
    pub fn step(&mut self, scan: &Scan) -> ScanPose {
        let turn = ScanReturns::new(scan, &self.config);
        let Some(mut track) = self.track.take() else { return self.start(turn) };
        let since_s = turn.middle.seconds_since(track.stamp);
        if since_s <= 0.0 && since_s >= -self.config.max_held_s {
            let refusal = Refusal::NotLater { by_s: -since_s };
            let pose = self.refused(&turn, &track, Matrix3::zeros(), MatchOutcome::Held(refusal));
            self.track = Some(track);
            return pose;
        }
        let passed_s = if since_s > 0.0 { since_s } else { self.config.max_held_s };
        if passed_s > self.config.max_held_s || since_s < 0.0 {
            track.velocity = Velocity::unknown(&self.config);
        }
        let prediction = Prediction::new(&track, passed_s, &self.config);
        track.stamp = turn.middle;
        track.now.scan += 1;
        let pose = match self.matched(&turn, &prediction) {
            Ok(matched) => self.follow(&mut track, &turn, &prediction, matched),
            Err(refusal) => self.hold(&mut track, &turn, &prediction, refusal),
        };
        self.track = Some(track);
        pose
    }

    /// The first scan is the origin, once it shows enough.
    fn start(&mut self, turn: ScanReturns) -> ScanPose {
        let origin = Isometry2::identity();
        let mut track = Track {
            stamp: turn.middle,
            odom_from_middle: origin,
            velocity: Velocity::unknown(&self.config),
            covariance: Matrix3::zeros(),
            anchor: Anchor::new(0, origin, Matrix3::zeros()),
            unmatched_s: 0.0,
            now: Moment::default(),
            first: None,
        };
        if let Some(refusal) = self.few_returns(&turn) {
            return self.refused(&turn, &track, Matrix3::zeros(), MatchOutcome::Held(refusal));
        }
        self.begin_map(&turn, &track);
        let pose = self.refused(&turn, &track, Matrix3::zeros(), MatchOutcome::Started);
        track.first = Some(turn);
        self.track = Some(track);
        pose
    }

    /// A new map of one scan.
    fn begin_map(&mut self, turn: &ScanReturns, track: &Track) {
        self.map.clear();
        let lines = local_lines(turn, &turn.deskewed(&track.velocity.twist()));
        let matched = vec![None; lines.len()];
        self.map.take_in(&matched, &lines, &track.odom_from_middle, track.now);
    }

    /// The scan was matched: the map takes it in.
    fn follow(
        &mut self,
        track: &mut Track,
        turn: &ScanReturns,
        prediction: &Prediction,
        matched: Match,
    ) -> ScanPose {
        let matched = match track.first.take() {
            Some(first) => self.with_first_deskewed(track, &first, turn, prediction, matched),
            None => matched,
        };
        let Match { registration, lines } = matched;
        let observability = &registration.observability;
        let (_, not_observed) = parted(&prediction.motion_covariance, observability);
        let (_, drift) = parted(&prediction.drift_covariance, observability);
        let (observed, held) = parted(&prediction.covariance_before, observability);
        let step = prediction.step_to(&registration.odom_from_middle);
        let step_covariance = registration.covariance + observed + not_observed;
        track.velocity = self.velocity_by(&registration, prediction);
        track.covariance = registration.covariance + held + drift;
        track.odom_from_middle = registration.odom_from_middle;
        track.unmatched_s = 0.0;
        track.now.travelled_m += step.translation.vector.norm();
        let kept = registration.matched.iter().flatten().map(|(meeting, _)| {
            f64::from(u8::from(self.map.lines()[meeting.line].born <= track.anchor.scan))
        });
        let kept_share = kept.clone().sum::<f64>() / kept.count().max(1) as f64;
        track.anchor.follow(track.now.scan, kept_share, &track.odom_from_middle, &track.covariance);
        self.map.take_in(&registration.matched, &lines, &track.odom_from_middle, track.now);
        ScanPose {
            stamp: track.stamp,
            odom_from_lidar: track.odom_from_middle,
            covariance: track.anchor.covariance_of(&track.odom_from_middle, &track.covariance),
            step_covariance,
            quality: MatchQuality {
                outcome: MatchOutcome::Matched,
                returns: turn.returns.len(),
                map_lines: self.map.lines().len(),
                matched_share: registration.matched_share,
                residual_rms_m: registration.residual_rms_m,
                degenerate: DegenerateDirection::all(observability),
            },
        }
    }

    /// The second scan shows how the platform moved in the first one, which was mapped as if the platform were static: the map is
    /// made anew, and the second scan matched against that.
    fn with_first_deskewed(
        &mut self,
        track: &mut Track,
        first: &ScanReturns,
        turn: &ScanReturns,
        prediction: &Prediction,
        matched: Match,
    ) -> Match {
        let still = Twist::default();
        let velocity = self.velocity_by(&matched.registration, prediction);
        let mut matched = matched;
        if velocity.twist().parts_m(&still, first.half_s, first.lever_m()) > SKEW_M {
            let begun = Track { velocity, now: Moment::default(), ..track.clone() };
            let before = self.map.clone();
            self.begin_map(first, &begun);
            match self.matched(turn, prediction) {
                Ok(again) => matched = again,
                // What was matched is of the map of before.
                Err(_) => self.map = before,
            }
        }
        // The map is as good as the one scan that it holds.
        let of_one_scan = matched.registration.covariance;
        track.anchor = Anchor::new(0, track.odom_from_middle, of_one_scan);
        track.covariance = of_one_scan;
        matched
    }

    /// The scan was not matched: constant velocity is assumed, for a limited time.
    fn hold(
        &mut self,
        track: &mut Track,
        turn: &ScanReturns,
        prediction: &Prediction,
        refusal: Refusal,
    ) -> ScanPose {
        let step = prediction.step_to(&prediction.prior.odom_from_middle);
        track.unmatched_s += prediction.passed_s;
        track.velocity = prediction.velocity;
        track.covariance = prediction.prior.covariance;
        track.odom_from_middle = prediction.prior.odom_from_middle;
        track.now.travelled_m += step.translation.vector.norm();
        let mut outcome = MatchOutcome::Held(refusal);
        if track.unmatched_s > self.config.max_held_s {
            track.velocity = Velocity::unknown(&self.config);
            if self.few_returns(turn).is_none() {
                outcome = MatchOutcome::BegunAnew(refusal);
                let pose = track.odom_from_middle;
                let covariance = track.anchor.covariance_of(&pose, &track.covariance);
                track.anchor = Anchor::new(track.now.scan, pose, covariance);
                track.covariance = Matrix3::zeros();
                track.unmatched_s = 0.0;
                track.first = None;
                self.begin_map(turn, track);
            }
        }
        self.refused(turn, track, prediction.motion_covariance, outcome)
    }

    fn few_returns(&self, turn: &ScanReturns) -> Option<Refusal> {
        let (returns, needed) = (turn.returns.len(), self.config.min_returns);
        (returns < needed).then_some(Refusal::FewReturns { returns, needed })
    }

    /// The pose of a scan that was not matched.
    fn refused(
        &self,
        turn: &ScanReturns,
        track: &Track,
        step_covariance: Matrix3<f64>,
        outcome: MatchOutcome,
    ) -> ScanPose {
        ScanPose {
            stamp: turn.middle,
            odom_from_lidar: track.odom_from_middle,
            covariance: track.anchor.covariance_of(&track.odom_from_middle, &track.covariance),
            step_covariance,
            quality: MatchQuality {
                outcome,
                returns: turn.returns.len(),
                map_lines: self.map.lines().len(),
                matched_share: 0.0,
                residual_rms_m: 0.0,
                degenerate: Vec::new(),
            },
        }
    }
}

#[cfg(test)]
mod tests;
