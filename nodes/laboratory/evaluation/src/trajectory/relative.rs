//! Relative pose error: how far the estimate drifts over a given stretch (Sturm et al. 2012, section IV.A). Of
//! two pairs of poses i and j the error is `(Q_i^-1 Q_j)^-1 (P_i^-1 P_j)`, with Q of the reference and P of the
//! estimate.

mod pairs;
#[cfg(test)]
mod tests;

use nalgebra::Isometry3;
use serde::{Deserialize, Serialize};

use self::pairs::stretches;
use super::absolute::MatchedPose;
use super::statistics::Statistics;

/// The length of a stretch.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct Delta {
    /// The number of units; whole and at least 1 for frames.
    pub value: f64,
    /// The unit.
    pub unit: DeltaUnit,
}

/// The unit of the length of a stretch.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DeltaUnit {
    /// Pairs of poses.
    Frames,
    /// Time.
    Seconds,
    /// Metres of path.
    Metres,
    /// Degrees of rotation.
    Degrees,
}

/// The stretches that are evaluated.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Pairs {
    /// Each begins where the one before ends.
    Consecutive,
    /// One begins at every pose; for degrees, all that begin at every pose.
    #[default]
    All,
}

/// The trajectory whose path and rotation define the length of a stretch.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PairsFrom {
    /// The reference: a tracker that does not move while the body moves has errors.
    #[default]
    Reference,
    /// The aligned estimate, which is evo's default.
    Estimate,
}

/// The parameters of relative errors.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RelativeConfig {
    /// The lengths of the stretches, each with a score of its own.
    pub deltas: Vec<Delta>,
    /// The stretches that are evaluated.
    pub pairs: Pairs,
    /// The trajectory whose path and rotation define the length of a stretch.
    pub pairs_from: PairsFrom,
    /// A stretch of all pairs, or of seconds, may be off by this share of its length.
    pub tolerance: f64,
}

impl Default for RelativeConfig {
    fn default() -> Self {
        Self {
            // Sturm et al. propose drift per second for odometry; drift per metre does not depend on speed.
            deltas: vec![
                Delta { value: 1.0, unit: DeltaUnit::Seconds },
                Delta { value: 1.0, unit: DeltaUnit::Metres },
            ],
            pairs: Pairs::default(),
            pairs_from: PairsFrom::default(),
            // evo's.
            tolerance: 0.1,
        }
    }
}

/// The relative errors over stretches of one length.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct RelativeScore {
    /// Their length.
    pub delta: Delta,
    /// Which were evaluated.
    pub pairs: Pairs,
    /// Their number.
    pub count: usize,
    /// Errors of the translation; absent when there is no stretch of that length.
    pub translation_m: Option<Statistics>,
    /// Errors of the rotation, by its angle.
    pub rotation_deg: Option<Statistics>,
}

/// There are too many stretches for the memory.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct TooManyStretches {
    pub(super) delta: Delta,
    pub(super) most: usize,
}

/// The error of the estimate between two pairs of poses.
pub(super) fn relative_error(from: &MatchedPose, to: &MatchedPose) -> Isometry3<f64> {
    let of_reference = from.reference.inv_mul(&to.reference);
    let of_estimate = from.estimate.inv_mul(&to.estimate);
    of_reference.inv_mul(&of_estimate)
}

/// The score of each length.
pub(super) fn scores(
    poses: &[MatchedPose],
    config: &RelativeConfig,
) -> Result<Vec<RelativeScore>, TooManyStretches> {
    config.deltas.iter().map(|delta| score(poses, *delta, config)).collect()
}

fn score(
    poses: &[MatchedPose],
    delta: Delta,
    config: &RelativeConfig,
) -> Result<RelativeScore, TooManyStretches> {
    let stretches = stretches(poses, delta, config)?;
    let errors: Vec<Isometry3<f64>> =
        stretches.iter().map(|&(from, to)| relative_error(&poses[from], &poses[to])).collect();
    let of = |error: fn(&Isometry3<f64>) -> f64| {
        Statistics::of(&errors.iter().map(error).collect::<Vec<f64>>())
    };
    Ok(RelativeScore {
        delta,
        pairs: config.pairs,
        count: errors.len(),
        translation_m: of(|error| error.translation.vector.norm()),
        rotation_deg: of(|error| error.rotation.angle().to_degrees()),
    })
}

impl DeltaUnit {
    /// The unit's name in the plural.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Frames => "frames",
            Self::Seconds => "seconds",
            Self::Metres => "metres",
            Self::Degrees => "degrees",
        }
    }
}

impl std::fmt::Display for Delta {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let unit = match self.unit {
            DeltaUnit::Frames if self.value == 1.0 => "frame",
            DeltaUnit::Frames => "frames",
            DeltaUnit::Seconds => "s",
            DeltaUnit::Metres => "m",
            DeltaUnit::Degrees => "deg",
        };
        write!(formatter, "{} {unit}", self.value)
    }
}
