//! The configuration of the score of a trajectory.

use geometry::{ParameterError, parameter};
use serde::{Deserialize, Serialize};

use crate::trajectory::alignment::Alignment;
use crate::trajectory::association::AssociationConfig;
use crate::trajectory::relative::{DeltaUnit, RelativeConfig};
use crate::trajectory::segments::{SegmentConfig, SegmentLengths};

/// The configuration of the score of a trajectory.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TrajectoryScoreConfig {
    /// The association of the poses.
    pub association: AssociationConfig,
    /// The alignment of the estimate.
    pub alignment: Alignment,
    /// The relative errors.
    pub relative: RelativeConfig,
    /// The drift over segments.
    pub segments: SegmentConfig,
    /// The longest time between pairs in which the reference counts as covered.
    pub max_gap_s: f64,
}

impl Default for TrajectoryScoreConfig {
    fn default() -> Self {
        Self {
            association: AssociationConfig::default(),
            alignment: Alignment::default(),
            relative: RelativeConfig::default(),
            segments: SegmentConfig::default(),
            // Keyframes come several times a second; after a second without any the robot does not know its pose.
            max_gap_s: 1.0,
        }
    }
}

impl TrajectoryScoreConfig {
    /// Checks that all numbers are valid.
    ///
    /// # Errors
    /// The first that is not.
    pub fn validate(&self) -> Result<(), ParameterError> {
        parameter::not_negative("max_difference_s", self.association.max_difference_s)?;
        parameter::not_negative("max_gap_s", self.max_gap_s)?;
        parameter::not_negative("tolerance", self.relative.tolerance)?;
        parameter::not_negative("offset_s", self.association.offset_s.abs())?;
        for delta in &self.relative.deltas {
            let value = delta.value;
            if delta.unit == DeltaUnit::Frames && value.fract() != 0.0 {
                parameter::check("delta", "a whole number above 0", value, false)?;
            }
            parameter::positive("delta", value)?;
        }
        if let SegmentLengths::Metres(lengths_m) = &self.segments.lengths {
            for length_m in lengths_m {
                parameter::positive("segment length", *length_m)?;
            }
        }
        parameter::at_least("step_poses", self.segments.step_poses, 1)
    }
}
