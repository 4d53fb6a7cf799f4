//! Which corrections a bag determines.

use std::fmt;

use estimation::Observability;
use estimation::observability::to_one_unit;
use nalgebra::{Matrix6, Vector6};
use serde::Serialize;

/// A coordinate counts as estimated when this share of it is, and as held when the rest of 1 is.
pub(crate) const SHARE_OF_ONE: f64 = 0.95;

/// A coordinate of a correction.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Coordinate {
    /// Forward.
    X,
    /// To the left.
    Y,
    /// Up.
    Z,
    /// About the axis that points forward.
    Roll,
    /// About the axis that points left.
    Pitch,
    /// About the axis that points up.
    Yaw,
}

impl Coordinate {
    /// All of them, in the order of a correction.
    pub const ALL: [Self; 6] = [Self::X, Self::Y, Self::Z, Self::Roll, Self::Pitch, Self::Yaw];

    /// Whether it is a shift; the others are turns.
    #[must_use]
    pub fn is_shift(self) -> bool {
        matches!(self, Self::X | Self::Y | Self::Z)
    }

    /// Its name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::X => "x",
            Self::Y => "y",
            Self::Z => "z",
            Self::Roll => "roll",
            Self::Pitch => "pitch",
            Self::Yaw => "yaw",
        }
    }
}

impl fmt::Display for Coordinate {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.name())
    }
}

/// A direction of corrections as a report has it, one of six that are known independently of each other.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct Direction {
    /// How much of each coordinate is in it, in units of the standard deviation that is requested; the squares
    /// add up to 1.
    pub weights: [f64; 6],
    /// The eigenvalue of the information: 1 where the bag determines the direction just as well as is required, 4
    /// where it determines it twice as well, 0 where it does not.
    pub information: f64,
    /// Whether it was estimated. The others keep what they were.
    pub estimated: bool,
}

impl From<estimation::Direction<6>> for Direction {
    fn from(direction: estimation::Direction<6>) -> Self {
        let estimation::Direction { in_units, information, estimated } = direction;
        Self { weights: in_units.into(), information, estimated }
    }
}

/// The observability of a correction by `information`, with `wanted_std_devs` for units: directions that are known to these can be
/// estimated, but for the coordinates that are `held`.
///
/// A coordinate of which hardly anything can be estimated is held as a whole: noise alone would mix a little
/// of it into what is known, and it would drift.
#[must_use]
pub fn observability(
    information: &Matrix6<f64>,
    wanted_std_devs: &Vector6<f64>,
    held: [bool; 6],
) -> Observability<6> {
    let first = Observability::of(information, wanted_std_devs, to_one_unit);
    let held = Coordinate::ALL.map(|coordinate| {
        held[coordinate as usize] || share(&first, coordinate) <= 1.0 - SHARE_OF_ONE
    });
    let unmixed = Matrix6::from_fn(|row, column| {
        if row != column && (held[row] || held[column]) { 0.0 } else { information[(row, column)] }
    });
    Observability::of(&unmixed, wanted_std_devs, |direction, information| {
        let weights = direction.iter().zip(held);
        let of_held: f64 =
            weights.filter(|(_, held)| *held).map(|(weight, _)| weight * weight).sum();
        to_one_unit(direction, information) && of_held < 1.0 - SHARE_OF_ONE
    })
}

/// The share of a coordinate that is estimated: 1 when it is known by itself, 0 when nothing is known of it,
/// between the two when it is known only together with others.
#[must_use]
pub fn share(observability: &Observability<6>, coordinate: Coordinate) -> f64 {
    observability
        .directions
        .iter()
        .filter(|direction| direction.estimated)
        .map(|direction| direction.in_units[coordinate as usize].powi(2))
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    const ONES: Vector6<f64> = Vector6::new(1.0, 1.0, 1.0, 1.0, 1.0, 1.0);

    #[test]
    fn observable_directions_are_separated_from_the_others() {
        // x and y are known only in their sum, z not at all, the turns well.
        let mut information =
            Matrix6::from_diagonal(&Vector6::new(0.0, 0.0, 0.01, 50.0, 60.0, 70.0));
        for (row, column) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            information[(row, column)] = 20.0;
        }
        let found = observability(&information, &ONES, [false; 6]);
        assert_eq!(found.estimated(), 4);
        let percent = |coordinate| (share(&found, coordinate) * 100.0).round() as i32;
        assert_eq!(Coordinate::ALL.map(percent), [50, 50, 0, 100, 100, 100]);
        // What is held is held exactly, noise or not.
        let mut noisy = information;
        for other in [3, 4, 5] {
            (noisy[(2, other)], noisy[(other, 2)]) = (2.0, 2.0);
        }
        let held = observability(&noisy, &ONES, [false; 6]);
        assert_eq!((held.estimated(), share(&held, Coordinate::Z)), (4, 0.0));
        // A held coordinate is held, known or not.
        let without_yaw =
            observability(&information, &ONES, [false, false, false, false, false, true]);
        assert_eq!((without_yaw.estimated(), share(&without_yaw, Coordinate::Yaw)), (3, 0.0));
        let correction = found.projector() * Vector6::new(1.0, 0.0, 3.0, 0.0, 0.0, 2.0);
        let expected = Vector6::new(0.5, 0.5, 0.0, 0.0, 0.0, 2.0);
        assert!((correction - expected).norm() < 1e-9, "{correction}");
    }
}
