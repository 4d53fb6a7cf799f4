//! The pose that registers a scan to the map: point to line, by Gauss-Newton with Tukey's weights (Censi 2008; Chen and
//! Medioni 1992; Beaton and Tukey 1974).

use estimation::quantile::upper_median;
use estimation::tukey::{TukeyWeights, scale_that_reaches, weight};
use nalgebra::{Isometry2, Matrix3, Vector2, Vector3};

use crate::ScanOdometryConfig;
use crate::local_line::LocalLine;
use crate::local_map::{LocalMap, Meeting};
use crate::observability::{NormalEquations, Observability, units};
use crate::scan_returns::{DeskewedReturn, ScanReturns};
use crate::twist::{increment, motion};

/// Returns are looked for within this many cells while the pose still moves ...
const WIDE_RING: usize = 2;
const WIDE_RADIUS_M: f64 = 0.5;
/// ... and within one afterwards, when its last step was below this.
const NEAR_RING: usize = 1;
const NEAR_RADIUS_M: f64 = 0.25;
const NEAR_STEP_M: f64 = 0.02;
/// Predictions are off by this many standard deviations at most.
const OPENING_STD_DEVS: f64 = 3.0;
/// Residuals smaller than this are left to the errors themselves.
const CLOSED_M: f64 = 0.05;
/// A step below this changes nothing: a tenth of the best accuracy of a scan.
const SETTLED_STEP_M: f64 = 5e-5;
/// More rounds do not help: returns change to and fro between lines.
const MAX_ROUNDS: usize = 15;
/// After this many rounds the set of observable directions is kept.
const DECIDED_ROUNDS: usize = 5;
/// The coordinates of a pose in the plane.
const COORDINATES: usize = 3;

/// The scan that is registered to the map.
#[derive(Clone, Copy)]
pub(crate) struct View<'a> {
    pub(crate) turn: &'a ScanReturns,
    pub(crate) sightings: &'a [DeskewedReturn],
    pub(crate) lines: &'a [Option<LocalLine>],
}

/// A scan that lies on the map as well as it can.
#[derive(Clone, Debug)]
pub(crate) struct Registration {
    pub(crate) odom_from_middle: Isometry2<f64>,
    /// For each return the line that it lies on, and the inverse of its variance; `None` for outliers.
    pub(crate) matched: Vec<Option<(Meeting, f64)>>,
    /// Share of the returns that lie on the map.
    pub(crate) matched_share: f64,
    /// Of those.
    pub(crate) residual_rms_m: f64,
    /// Of `[x, y, turn]` in the frame of the middle; 0 in unobservable directions.
    pub(crate) covariance: Matrix3<f64>,
    pub(crate) observability: Observability,
}

/// A return on a line of the map, and how its distance changes with the pose.
#[derive(Clone, Copy, Debug)]
struct Pair {
    index: usize,
    meeting: Meeting,
    /// Of the return alone.
    own_variance_m2: f64,
    /// Of the residual.
    variance_m2: f64,
    /// The same, if the line is static.
    standing_variance_m2: f64,
    /// Change of the residual by `[x, y, turn]` in the frame of the middle.
    jacobian: Vector3<f64>,
    /// The same for a normal that is turned by a right angle: what the error of the normal adds to the jacobian.
    aside: Vector3<f64>,
    normal_variance_rad2: f64,
}

/// Where a scan should lie.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Prior {
    pub(crate) odom_from_middle: Isometry2<f64>,
    /// Of `[x, y, turn]` in the frame of the middle.
    pub(crate) covariance: Matrix3<f64>,
}

/// Registers a scan to the map from a pose near by. `None` when too few returns find a line.
///
/// The prior counts as a measurement beside the returns: little in a room, and where they determine little it keeps the
/// pose from following their noise.
pub(crate) fn register(
    map: &LocalMap,
    view: &View<'_>,
    prior: &Prior,
    start: &Isometry2<f64>,
    config: &ScanOdometryConfig,
) -> Option<Registration> {
    let prior_information = prior.covariance.try_inverse()?;
    let lever_m = view.turn.lever_m();
    let mut pose = *start;
    let mut observability = Observability::nothing(&units(lever_m));
    let mut reach = (WIDE_RING, WIDE_RADIUS_M);
    let mut open_m = opening_m(prior, lever_m);
    for round in 0..MAX_ROUNDS {
        let pairs = pairs(map, view, &pose, reach);
        let weighing = weigh(&pairs, config.min_returns, open_m)?;
        let mut equations = normal_equations(&pairs, &weighing, config);
        let variance = weighing.variance_factor(COORDINATES);
        if round < DECIDED_ROUNDS {
            observability = equations.observability(lever_m, variance, config);
        }
        let moved = increment(&prior.odom_from_middle.inv_mul(&pose));
        equations.add_prior(&prior_information, variance, &moved);
        let step = equations.solve(&observability, &moved)?;
        if !step.iter().all(|element| element.is_finite()) {
            return None;
        }
        pose *= motion(&step);
        pose.rotation.renormalize();
        let step_m = step.component_div(&observability.units).norm();
        reach = if step_m < NEAR_STEP_M {
            (NEAR_RING, NEAR_RADIUS_M)
        } else {
            (WIDE_RING, WIDE_RADIUS_M)
        };
        let is_open = open_m > 0.0;
        open_m = if open_m > CLOSED_M { 0.5 * open_m } else { 0.0 };
        if step_m < SETTLED_STEP_M && !is_open {
            break;
        }
    }
    let pairs = pairs(map, view, &pose, (NEAR_RING, NEAR_RADIUS_M));
    let weighing = weigh(&pairs, config.min_returns, 0.0)?;
    let mut equations = normal_equations(&pairs, &weighing, config);
    let variance = weighing.variance_factor(COORDINATES) * weighing.run_factor();
    equations.add_prior(&prior_information, variance, &Vector3::zeros());
    let covariance = variance * equations.inverse(&observability)?;
    Some(Registration {
        odom_from_middle: pose,
        matched: matched(&pairs, &weighing, view.sightings.len()),
        matched_share: matched_share(&pairs, view.sightings.len()),
        residual_rms_m: residual_rms_m(&pairs, &weighing),
        covariance,
        observability,
    })
}

/// How far off a return may be at first because the prediction is: where few returns determine a direction, such as the end
/// of a corridor, they would seem outliers beside the many that determine others.
fn opening_m(prior: &Prior, lever_m: f64) -> f64 {
    let covariance = &prior.covariance;
    let turn_m2 = lever_m * lever_m * covariance.m33;
    let variance_m2 = covariance.m11.max(covariance.m22) + turn_m2;
    (OPENING_STD_DEVS * variance_m2.sqrt()).min(WIDE_RADIUS_M)
}

/// Finds for each return the line next to it.
fn pairs(
    map: &LocalMap,
    view: &View<'_>,
    pose: &Isometry2<f64>,
    (ring, radius_m): (usize, f64),
) -> Vec<Pair> {
    let pair = |index: usize, sighting: &DeskewedReturn| {
        let point_m = pose * sighting.point_m;
        let direction = pose.rotation * sighting.direction;
        let own = view.lines[index].map(|line| pose.rotation * line.normal);
        let meeting = map.nearest(&point_m, &direction, own.as_ref(), ring, radius_m)?;
        let line = &map.lines()[meeting.line];
        let own_variance_m2 = view.turn.returns[index].variance_along_m2(
            &line.normal,
            &direction,
            view.turn.step_rad,
        );
        let normal = pose.rotation.inverse_transform_vector(&line.normal);
        let left = Vector2::new(-normal.y, normal.x);
        Some(Pair {
            index,
            meeting,
            own_variance_m2,
            variance_m2: own_variance_m2 + line.variance_m2(meeting.along_m),
            standing_variance_m2: own_variance_m2 + line.standing_variance_m2(meeting.along_m),
            jacobian: change_of_distance(&normal, &sighting.point_m.coords),
            aside: change_of_distance(&left, &sighting.point_m.coords),
            normal_variance_rad2: line.normal_variance_rad2,
        })
    };
    view.sightings
        .iter()
        .enumerate()
        .filter_map(|(index, sighting)| pair(index, sighting))
        .collect()
}

/// How the distance `normal . (pose * motion([x, y, turn]) * point)` changes with x, y and turn at 0; all in the frame
/// that moves.
fn change_of_distance(normal: &Vector2<f64>, point_m: &Vector2<f64>) -> Vector3<f64> {
    // A turn moves the point to its left by its distance.
    Vector3::new(normal.x, normal.y, point_m.perp(normal))
}

/// Errors of less than `open_m` are no outliers.
fn weigh(pairs: &[Pair], least: usize, open_m: f64) -> Option<TukeyWeights> {
    if pairs.len() < least {
        return None;
    }
    let errors = pairs.iter().map(|pair| pair.meeting.residual_m / pair.variance_m2.sqrt());
    let mut variances: Vec<f64> = pairs.iter().map(|pair| pair.variance_m2).collect();
    let variance_m2 = upper_median(&mut variances)?;
    TukeyWeights::of(errors.collect(), scale_that_reaches(open_m / variance_m2.sqrt()))
}

fn normal_equations(
    pairs: &[Pair],
    weighing: &TukeyWeights,
    config: &ScanOdometryConfig,
) -> NormalEquations {
    let mut equations = NormalEquations::default();
    let surface_variance = config.surface_noise_rad * config.surface_noise_rad;
    for (pair, weight) in pairs.iter().zip(&weighing.weights) {
        if *weight == 0.0 {
            continue;
        }
        let information = weight / pair.variance_m2;
        let Pair { jacobian, aside, .. } = pair;
        equations.information += information * jacobian * jacobian.transpose();
        equations.gradient += information * pair.meeting.residual_m * jacobian;
        let variance = pair.normal_variance_rad2 + surface_variance;
        equations.noise += information * variance * aside * aside.transpose();
    }
    equations
}

fn matched(pairs: &[Pair], weighing: &TukeyWeights, returns: usize) -> Vec<Option<(Meeting, f64)>> {
    let mut matched = vec![None; returns];
    for (pair, weight) in pairs.iter().zip(&weighing.weights) {
        if *weight > 0.0 {
            matched[pair.index] = Some((pair.meeting, weight / pair.own_variance_m2));
        }
    }
    matched
}

/// The returns that lie on the map within the noise that is expected, whatever the others do: two poses are compared
/// by it.
fn matched_share(pairs: &[Pair], returns: usize) -> f64 {
    let error = |pair: &Pair| pair.meeting.residual_m / pair.standing_variance_m2.sqrt();
    let on_map: f64 = pairs.iter().map(|pair| weight(error(pair), 1.0)).sum();
    on_map / returns.max(1) as f64
}

fn residual_rms_m(pairs: &[Pair], weighing: &TukeyWeights) -> f64 {
    let inliers = || pairs.iter().zip(&weighing.weights).filter(|(_, weight)| **weight > 0.0);
    let squares: f64 = inliers().map(|(pair, _)| pair.meeting.residual_m.powi(2)).sum();
    (squares / inliers().count().max(1) as f64).sqrt()
}

#[cfg(test)]
mod tests;
