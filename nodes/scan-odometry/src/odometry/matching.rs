//! A scan is registered to the map, from the prediction or, where that finds no match, from the result of a search.

use std::f64::consts::FRAC_PI_4;

use nalgebra::{Isometry2, Matrix3};

use super::{SKEW_M, ScanOdometry, Track};
use crate::ScanOdometryConfig;
use crate::local_line::{LocalLine, local_lines};
use crate::registration::{Prior, Registration, View, register};
use crate::scan_pose::Refusal;
use crate::scan_returns::ScanReturns;
use crate::search::{SearchWindow, search};
use crate::twist::{Twist, increment};
use crate::uncertainty::carried;
use crate::velocity::Velocity;

/// With more of the returns on the map than this the prediction was good: 40 % may be of people.
const GOOD_SHARE: f64 = 0.6;
/// A return that is on the map counts this much (as a natural logarithm of likelihood): the outermost one that Tukey's
/// weight knows is 3.66 away, but neighbours err together.
const EVIDENCE_A_RETURN: f64 = 0.5;
/// Degrees of freedom of Student's distribution for the errors of the predicted motion: the fewest with a variance.
const STUDENT_FREEDOM: f64 = 3.0;
/// By this much another pose must be more likely than the one found from the prediction: a thousand to one.
const CLEARLY_MORE: f64 = 6.9;
/// A search goes no farther than this to each side ...
const WIDEST_SEARCH_M: f64 = 0.5;
/// ... and turns no farther.
const WIDEST_SEARCH_RAD: f64 = FRAC_PI_4;
/// The correction that a match may make beside a motion: the noise of the pose before, and of the stamps.
const STEP_SLACK_M: f64 = 0.3;
const STEP_SLACK_RAD: f64 = 0.3;

/// Where the scanner should be, by the pose and the velocity of the scan before.
#[derive(Clone, Copy, Debug)]
pub(super) struct Prediction {
    pub(super) previous: Isometry2<f64>,
    /// Against the map.
    pub(super) prior: Prior,
    /// Of the pose of the scan before against the map, in the scanner's present frame.
    pub(super) covariance_before: Matrix3<f64>,
    /// Of the motion since the scan before, in the scanner's frame.
    pub(super) motion_covariance: Matrix3<f64>,
    /// The covariance that it adds to that of the pose.
    pub(super) drift_covariance: Matrix3<f64>,
    pub(super) velocity: Velocity,
    pub(super) passed_s: f64,
}

impl Prediction {
    pub(super) fn new(track: &Track, passed_s: f64, config: &ScanOdometryConfig) -> Self {
        let velocity = track.velocity.after(passed_s, config);
        let step = velocity.twist().after(passed_s);
        let mut odom_from_middle = track.odom_from_middle * step;
        odom_from_middle.rotation.renormalize();
        let motion_covariance = velocity.motion_covariance(passed_s, config);
        let covariance_before = carried(&track.covariance, &step);
        let drift_covariance = motion_covariance + velocity.added_covariance(passed_s);
        let covariance = covariance_before + drift_covariance;
        let prior = Prior { odom_from_middle, covariance };
        let previous = track.odom_from_middle;
        Self {
            previous,
            prior,
            covariance_before,
            motion_covariance,
            drift_covariance,
            velocity,
            passed_s,
        }
    }

    /// The step to a pose.
    pub(super) fn step_to(&self, odom_from_middle: &Isometry2<f64>) -> Isometry2<f64> {
        self.previous.inv_mul(odom_from_middle)
    }
}

/// A scan on the map.
pub(super) struct Match {
    pub(super) registration: Registration,
    /// The scan's own lines, deskewed.
    pub(super) lines: Vec<Option<LocalLine>>,
}

type Registered = (Registration, Vec<Option<LocalLine>>);

impl ScanOdometry {
    /// Registers a scan to the map.
    pub(super) fn matched(
        &self,
        turn: &ScanReturns,
        prediction: &Prediction,
    ) -> Result<Match, Refusal> {
        if let Some(refusal) = self.few_returns(turn) {
            return Err(refusal);
        }
        let mut twist = prediction.velocity.twist();
        let mut matched =
            self.registered(turn, prediction, &twist, &prediction.prior.odom_from_middle);
        if matched.as_ref().is_none_or(|(found, _)| found.matched_share < GOOD_SHARE) {
            let evidence = |registered: &Registered| self.evidence(&registered.0, turn, prediction);
            let least =
                matched.as_ref().map_or(0.0, |registered| evidence(registered) + CLEARLY_MORE);
            let start = self.searched(turn, prediction);
            let other = start.and_then(|start| self.registered(turn, prediction, &twist, &start));
            matched = other.filter(|registered| evidence(registered) > least).or(matched);
        }
        let (mut registration, mut lines) = matched.ok_or(self.few_matched(0.0))?;
        // The turn is skewed by a velocity that is known only now: once more with that.
        let found = self.twist(&registration, prediction);
        if found.parts_m(&twist, turn.half_s, turn.lever_m()) > SKEW_M {
            twist = found;
            let start = registration.odom_from_middle;
            if let Some(again) = self.registered(turn, prediction, &twist, &start) {
                (registration, lines) = again;
            }
        }
        self.check(&registration, prediction)?;
        Ok(Match { registration, lines })
    }

    fn registered(
        &self,
        turn: &ScanReturns,
        prediction: &Prediction,
        twist: &Twist,
        start: &Isometry2<f64>,
    ) -> Option<Registered> {
        let sightings = turn.deskewed(twist);
        let lines = local_lines(turn, &sightings);
        let view = View { turn, sightings: &sightings, lines: &lines };
        let registration = register(&self.map, &view, &prediction.prior, start, &self.config)?;
        Some((registration, lines))
    }

    /// How much speaks for a pose: the returns on the map, less what speaks against such a motion. The errors of motions
    /// are taken to be of Student's distribution, since a platform that is knocked does not keep to any velocity.
    fn evidence(
        &self,
        registration: &Registration,
        turn: &ScanReturns,
        prediction: &Prediction,
    ) -> f64 {
        let Prior { odom_from_middle, covariance } = &prediction.prior;
        let off = increment(&odom_from_middle.inv_mul(&registration.odom_from_middle));
        let distance = covariance.try_inverse().map_or(0.0, |inverse| off.dot(&(inverse * off)));
        let against = 0.5 * (STUDENT_FREEDOM + 3.0) * (distance / STUDENT_FREEDOM).ln_1p();
        EVIDENCE_A_RETURN * registration.matched_share * turn.returns.len() as f64 - against
    }

    fn searched(&self, turn: &ScanReturns, prediction: &Prediction) -> Option<Isometry2<f64>> {
        let Prediction { passed_s, .. } = *prediction;
        let window = SearchWindow {
            position_m: (STEP_SLACK_M + self.config.max_speed_m_per_s * passed_s)
                .min(WIDEST_SEARCH_M),
            turn_rad: (STEP_SLACK_RAD + self.config.max_turn_rad_per_s * passed_s)
                .min(WIDEST_SEARCH_RAD),
        };
        let sightings = turn.deskewed(&prediction.velocity.twist());
        search(&self.map, &sightings, &prediction.prior.odom_from_middle, &window)
    }

    /// The velocity in the turn, when the scan lies there.
    fn twist(&self, registration: &Registration, prediction: &Prediction) -> Twist {
        self.velocity_by(registration, prediction).twist()
    }

    /// The velocity with what a scan says of it; of scans too far apart, none.
    pub(super) fn velocity_by(
        &self,
        registration: &Registration,
        prediction: &Prediction,
    ) -> Velocity {
        if prediction.passed_s > self.config.max_held_s {
            return Velocity::unknown(&self.config);
        }
        let step = prediction.step_to(&registration.odom_from_middle);
        let covariance = registration.covariance + prediction.covariance_before;
        let Prediction { velocity, passed_s, .. } = prediction;
        velocity.measured(&step, &covariance, *passed_s, &registration.observability, &self.config)
    }

    fn check(&self, registration: &Registration, prediction: &Prediction) -> Result<(), Refusal> {
        if registration.matched_share < self.config.min_matched_share {
            return Err(self.few_matched(registration.matched_share));
        }
        if registration.observability.estimated() == 0 {
            return Err(Refusal::Unconstrained);
        }
        let passed_s = prediction.passed_s;
        let step = prediction.step_to(&registration.odom_from_middle);
        let (step_m, turn_rad) = (step.translation.vector.norm(), step.rotation.angle().abs());
        let is_near = step_m <= STEP_SLACK_M + self.config.max_speed_m_per_s * passed_s
            && turn_rad <= STEP_SLACK_RAD + self.config.max_turn_rad_per_s * passed_s;
        if is_near {
            return Ok(());
        }
        Err(Refusal::TooFar { step_m, turn_deg: turn_rad.to_degrees(), passed_s })
    }

    fn few_matched(&self, share: f64) -> Refusal {
        Refusal::FewMatched { share, needed: self.config.min_matched_share }
    }
}
