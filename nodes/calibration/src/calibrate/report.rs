//! The result of a calibration.

use std::collections::BTreeMap;

use estimation::Observability;
use geometry::pose_vector;
use nalgebra::{Isometry3, Matrix6};
use serde::Serialize;

use super::starts::Agreement;
use super::{Problem, RigMounts, Settled};
use crate::constraint::Kind;
use crate::fit::Fit;
use crate::observability::{Coordinate, Direction, SHARE_OF_ONE, share};
use crate::repeated::{InCycle, Key};

/// A surface is upright when its normal is level within this: 10 degrees.
const UPRIGHT_RAD: f64 = 0.175;

/// The estimate of a coordinate of the correction.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct CoordinateEstimate {
    /// The coordinate.
    pub coordinate: Coordinate,
    /// The correction, in metres or radians.
    pub correction: f64,
    /// Its standard deviation, likewise; of what is held, that of the pose that the calibration started from.
    pub std_dev: f64,
    /// The share of the coordinate that was estimated: 1 all of it, 0 when it was held, in between when only a
    /// combination with others is known.
    pub estimated_share: f64,
}

impl CoordinateEstimate {
    /// Whether the coordinate was estimated.
    #[must_use]
    pub fn is_estimated(&self) -> bool {
        self.estimated_share >= SHARE_OF_ONE
    }

    /// Whether the coordinate was held where it was.
    #[must_use]
    pub fn is_held(&self) -> bool {
        self.estimated_share <= 1.0 - SHARE_OF_ONE
    }
}

/// The scanner's pose on the rig.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Calibration {
    /// The pose: `[x_m, y_m, z_m, yaw_rad, pitch_rad, roll_rad]`, the form of the parameter of this name.
    pub rig_from_lidar: [f64; 6],
    /// The correction by coordinate: x, y, z, roll, pitch, yaw, along and about the axes of the rig.
    pub coordinates: [CoordinateEstimate; 6],
    /// The covariance of the correction in this order, in m^2, m rad and rad^2.
    pub covariance: [[f64; 6]; 6],
    /// The six directions that are determined independently of each other, best known first.
    pub directions: [Direction; 6],
    /// The coordinates that are not observable, and why, in words.
    pub not_observable: Vec<String>,
    /// Cycles with a return that counts.
    pub cycles: usize,
    /// Returns on planes that count.
    pub plane_returns: usize,
    /// Edges that count.
    pub edges: usize,
    /// Returns on surfaces that have no weight: of something else.
    pub outliers: usize,
    /// Returns that were left out beforehand: of what passes through.
    pub moving_returns: usize,
    /// Root mean square of the distances of what counts, with the pose that the calibration started from ...
    pub rms_before_m: f64,
    /// ... and with the one that it found.
    pub rms_after_m: f64,
    /// The errors' standard deviation over what is expected of the sensors.
    pub noise_factor: f64,
    /// Returns where the camera sees a surface within three of their standard deviations ...
    pub agreeing_returns: usize,
    /// ... and returns where it sees one elsewhere: of what only one sensor sees, or with a wrong mount.
    pub contradicting_returns: usize,
    /// Returns where the pixels scatter too much for a surface, by what the camera's noise is elsewhere.
    pub noisy_returns: usize,
    /// How often the returns were put onto the images.
    pub iterations: usize,
}

impl Calibration {
    /// The scanner's pose as a transform.
    #[must_use]
    pub fn pose(&self) -> Isometry3<f64> {
        geometry::pose_from_vector(&self.rig_from_lidar)
    }

    /// The estimate of a coordinate.
    #[must_use]
    pub fn of(&self, coordinate: Coordinate) -> &CoordinateEstimate {
        &self.coordinates[coordinate as usize]
    }
}

impl Problem<'_> {
    /// The result of the last fit.
    pub(super) fn report(
        &self,
        Settled { constraints, fit, iterations }: &Settled,
        agreement: Agreement,
    ) -> Calibration {
        let mounts = self.mounts.corrected(&fit.total);
        let covariance = self.covariance(constraints, fit);
        let coordinates = Coordinate::ALL.map(|coordinate| {
            let index = coordinate as usize;
            CoordinateEstimate {
                coordinate,
                // No negative zero.
                correction: fit.total[index] + 0.0,
                std_dev: covariance[(index, index)].max(0.0).sqrt(),
                estimated_share: share(&fit.observability, coordinate),
            }
        });
        let used: Vec<&InCycle> = constraints
            .iter()
            .zip(&fit.weights)
            .filter(|(_, weight)| **weight > 0.0)
            .map(|(one, _)| one)
            .collect();
        let of_kind = |kind: Kind| used.iter().filter(|one| one.constraint.kind == kind).count();
        let mut cycles: Vec<usize> = used.iter().map(|one| one.cycle).collect();
        cycles.sort_unstable();
        cycles.dedup();
        Calibration {
            rig_from_lidar: pose_vector(&mounts.rig_from_lidar),
            coordinates,
            covariance: std::array::from_fn(|row| {
                std::array::from_fn(|column| covariance[(row, column)])
            }),
            directions: fit.observability.directions.map(Direction::from),
            not_observable: not_observable(&fit.observability, &used, &mounts),
            cycles: cycles.len(),
            plane_returns: of_kind(Kind::Plane),
            edges: of_kind(Kind::Edge),
            outliers: constraints.len() - used.len(),
            moving_returns: self
                .is_static
                .iter()
                .flatten()
                .filter(|is_static| !**is_static)
                .count(),
            rms_before_m: self.rms_before_m(&used),
            rms_after_m: rms(used.iter().map(|one| distance_m(one, &mounts))),
            noise_factor: fit.variance_factor.sqrt(),
            agreeing_returns: agreement.agree,
            contradicting_returns: agreement.contradict,
            noisy_returns: agreement.noisy,
            iterations: *iterations,
        }
    }

    /// The covariance of the estimate; of what was held, that of what it was held at; and what the one does to the
    /// other.
    fn covariance(&self, constraints: &[InCycle], fit: &Fit) -> Matrix6<f64> {
        let wanted = self.config.wanted_std_devs();
        let prior = self.config.prior_std_devs().component_div(&wanted);
        let here = self.mounts.corrected(&fit.total);
        let observations = self.observations(constraints, &here);
        let mut covariance = fit.covariance;
        for direction in fit.observability.directions.iter().filter(|one| !one.estimated) {
            let weights = &direction.in_units;
            let deviation = wanted.component_mul(weights) * prior.component_mul(weights).norm();
            covariance += deviation * deviation.transpose();
            // A scanner with an unknown tilt sees a wall a little farther away, in whichever direction it is
            // tilted: so both signs are computed, with the distances as they are, not linearised.
            for side in [-1.0, 1.0] {
                let there = self.mounts.corrected(&(fit.total + side * deviation));
                let changes = constraints.iter().zip(&observations).map(|(one, observation)| {
                    (*observation, distance_m(one, &there) - observation.linearised.distance_m)
                });
                let change = fit.response(changes);
                covariance += 0.5 * change * change.transpose();
            }
        }
        covariance
    }

    /// The distances of the same returns before any correction. A return may have hit another surface then, or
    /// none; those that had hit none are left out.
    fn rms_before_m(&self, used: &[&InCycle]) -> f64 {
        let before: BTreeMap<Key, f64> = self
            .constraints(&self.mounts, None)
            .iter()
            .map(|one| (one.key(), distance_m(one, &self.mounts)))
            .collect();
        rms(used.iter().filter_map(|one| before.get(&one.key()).copied()))
    }
}

fn distance_m(one: &InCycle, mounts: &RigMounts) -> f64 {
    one.constraint.linearised(mounts).distance_m
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) =
        values.fold((0.0, 0_usize), |(sum, count), value| (sum + value * value, count + 1));
    if count == 0 { 0.0 } else { (sum / count as f64).sqrt() }
}

/// The coordinates that are not observable, in words: a sentence for each reason.
fn not_observable(
    observability: &Observability<6>,
    used: &[&InCycle],
    mounts: &RigMounts,
) -> Vec<String> {
    let share_of = |coordinate: Coordinate| share(observability, coordinate);
    let held: Vec<Coordinate> = Coordinate::ALL
        .into_iter()
        .filter(|coordinate| share_of(*coordinate) <= 1.0 - SHARE_OF_ONE)
        .collect();
    let upright =
        used.iter().all(|one| one.constraint.linearised(mounts).normal.z.abs() < UPRIGHT_RAD.sin());
    let by_height = |coordinate: &Coordinate| {
        matches!(coordinate, Coordinate::Z | Coordinate::Roll | Coordinate::Pitch)
    };
    let (of_height, others): (Vec<Coordinate>, Vec<Coordinate>) =
        held.into_iter().partition(by_height);
    let mut sentences = Vec::new();
    let why_height = if upright {
        "the scan hit only vertical surfaces"
    } else {
        "the scan hit too few surfaces that are not vertical"
    };
    sentences.extend(sentence(&of_height, why_height));
    for coordinate in others {
        let why = match coordinate {
            Coordinate::X => "the scan hit nothing that faces the camera",
            Coordinate::Y => "the scan hit no surface that faces sideways, and no edge",
            _ => "the scan hit too little to determine its heading",
        };
        sentences.extend(sentence(&[coordinate], why));
    }
    for direction in observability.directions.iter().filter(|direction| !direction.estimated) {
        let mixed: Vec<(f64, Coordinate)> = direction
            .in_units
            .iter()
            .copied()
            .zip(Coordinate::ALL)
            .filter(|(_, coordinate)| {
                let share = share_of(*coordinate);
                share > 1.0 - SHARE_OF_ONE && share < SHARE_OF_ONE
            })
            .filter(|(weight, _)| weight.powi(2) > 1.0 - SHARE_OF_ONE)
            .collect();
        if let [_, _, ..] = mixed.as_slice() {
            let parts: Vec<String> = mixed
                .iter()
                .map(|(weight, coordinate)| format!("{weight:+.2} {coordinate}"))
                .collect();
            sentences.push(format!(
                "{} is not observable from this bag: the scan hit surfaces of one direction",
                parts.join(" ")
            ));
        }
    }
    sentences
}

fn sentence(coordinates: &[Coordinate], why: &str) -> Option<String> {
    let names: Vec<&str> = coordinates.iter().map(|coordinate| coordinate.name()).collect();
    let (last, before) = names.split_last()?;
    let subject = match before {
        [] => format!("{last} is"),
        _ => format!("{} and {last} are", before.join(", ")),
    };
    Some(format!("{subject} not observable from this bag: {why}"))
}
