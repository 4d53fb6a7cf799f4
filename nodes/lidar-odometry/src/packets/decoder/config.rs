//! The settings that a packet alone does not contain.

use serde::{Deserialize, Serialize};

use crate::packets::calibration::{Calibration, CalibrationError};
use crate::packets::model::{Model, ReturnMode};

/// The settings that a packet alone does not contain.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DecoderConfig {
    /// The model, where the factory bytes do not name it (older firmware) or name it wrongly.
    pub model: Option<Model>,
    /// The return mode, likewise.
    pub return_mode: Option<ReturnMode>,
    /// The scanner's own calibration; the data sheet's where there is none.
    pub calibration: Option<Calibration>,
    /// A nearer echo is no return.
    pub range_min_m: f64,
    /// A farther echo is no return.
    pub range_max_m: f64,
    /// No scanner turns faster: a larger step of the azimuth within a packet is an error.
    pub max_turn_rate_hz: f64,
}

impl Default for DecoderConfig {
    fn default() -> Self {
        Self {
            model: None,
            return_mode: None,
            calibration: None,
            // All that the scanner sends: what is too near for the vehicle is the odometry's to say.
            range_min_m: 0.0,
            // Beyond the range of a packet (65535 steps of 4 mm).
            range_max_m: 300.0,
            // 20 turns a second are the most of every model's manual, and a quarter for the encoder's steps.
            max_turn_rate_hz: 25.0,
        }
    }
}

/// Why a configuration does not serve.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum DecoderConfigError {
    /// The calibration is not one of the model.
    #[error(transparent)]
    Calibration(#[from] CalibrationError),
    /// The limits of the range leave nothing between them.
    #[error("range_min_m {min_m} and range_max_m {max_m} leave no ranges between them")]
    Ranges {
        /// `range_min_m`.
        min_m: f64,
        /// `range_max_m`.
        max_m: f64,
    },
    /// The turn rate is invalid.
    #[error("max_turn_rate_hz is {rate_hz}, not above 0")]
    TurnRate {
        /// `max_turn_rate_hz`.
        rate_hz: f64,
    },
}

impl DecoderConfig {
    /// Checks what can be checked before the model is known.
    ///
    /// # Errors
    /// When the limits are none, or the calibration is not one of the stated model.
    pub fn validate(&self) -> Result<(), DecoderConfigError> {
        let (min_m, max_m) = (self.range_min_m, self.range_max_m);
        if !(min_m >= 0.0 && min_m < max_m && max_m.is_finite()) {
            return Err(DecoderConfigError::Ranges { min_m, max_m });
        }
        if !(self.max_turn_rate_hz > 0.0 && self.max_turn_rate_hz.is_finite()) {
            return Err(DecoderConfigError::TurnRate { rate_hz: self.max_turn_rate_hz });
        }
        match (self.model, &self.calibration) {
            (Some(model), Some(calibration)) => Ok(calibration.validate(model)?),
            _ => Ok(()),
        }
    }
}
