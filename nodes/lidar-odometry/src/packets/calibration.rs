//! Where each laser looks, and what is wrong with its ranges.

mod data_sheet;
mod file;

use serde::{Deserialize, Serialize};

use super::model::Model;

pub use file::CalibrationFileError;

/// The lasers of a scanner, in the order in which a packet holds them. [`Calibration::of_data_sheet`] is that of a
/// model; a scanner's own comes with it.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Calibration {
    /// The range of one unit of a packet.
    pub range_step_m: f64,
    /// As many as the model has. Of an HDL-64E the upper bank is first.
    pub lasers: Vec<LaserCalibration>,
}

/// One laser. Angles and offsets are those of the manual of the HDL-64E.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LaserCalibration {
    /// Above the horizon.
    pub elevation_deg: f64,
    /// Left of where the head looks, seen from behind it.
    pub rotation_deg: f64,
    /// Added to every range.
    pub range_offset_m: f64,
    /// The correction near by in place of it, along the sensor's x (to the right) and y (forward): the two-point
    /// calibration of the S2 and S3. Zero means none.
    pub near_range_offset_m: [f64; 2],
    /// The beam comes from this far above the scanner's origin.
    pub height_m: f64,
    /// The beam is this far to the left of one through the origin, seen from behind.
    pub horizontal_offset_m: f64,
}

/// Why a calibration does not serve.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum CalibrationError {
    /// Not as many lasers as the model has.
    #[error("{found} lasers are calibrated, but the {model} has {expected}", expected = model.lasers())]
    Lasers {
        /// The model.
        model: Model,
        /// Lasers of the calibration.
        found: usize,
    },
    /// A value is not finite, or beyond what a laser can be.
    #[error("{name} of laser {laser} is {value}, not within -{limit} .. {limit}")]
    Value {
        /// Which laser, from 0.
        laser: usize,
        /// What is wrong.
        name: &'static str,
        /// What it is.
        value: f64,
        /// How large it may be.
        limit: f64,
    },
    /// The unit of ranges is no length.
    #[error("range_step_m is {value}, not within 0 .. 1")]
    RangeStep {
        /// What it is.
        value: f64,
    },
}

impl Calibration {
    /// Checks that this is a calibration of `model`.
    ///
    /// # Errors
    /// When there are not as many lasers as the model has, or a value is impossible for a laser.
    pub fn validate(&self, model: Model) -> Result<(), CalibrationError> {
        if self.lasers.len() != model.lasers() {
            return Err(CalibrationError::Lasers { model, found: self.lasers.len() });
        }
        if !(self.range_step_m > 0.0 && self.range_step_m <= 1.0) {
            return Err(CalibrationError::RangeStep { value: self.range_step_m });
        }
        for (laser, calibration) in self.lasers.iter().enumerate() {
            calibration.validate(laser)?;
        }
        Ok(())
    }

    /// The row of each laser: 0 is the highest. Of two at one elevation the first is the higher.
    #[must_use]
    pub fn rows(&self) -> Vec<u16> {
        let mut order: Vec<usize> = (0..self.lasers.len()).collect();
        let elevation_deg =
            |laser: &usize| self.lasers.get(*laser).map_or(0.0, |laser| laser.elevation_deg);
        order.sort_by(|a, b| elevation_deg(b).total_cmp(&elevation_deg(a)));
        let mut rows = vec![0; order.len()];
        for (row, laser) in order.into_iter().enumerate() {
            if let Some(entry) = rows.get_mut(laser) {
                *entry = row as u16;
            }
        }
        rows
    }

    /// The elevations of the rows, the highest first.
    #[must_use]
    pub fn row_elevations_deg(&self) -> Vec<f64> {
        let mut elevations_deg: Vec<f64> =
            self.lasers.iter().map(|laser| laser.elevation_deg).collect();
        elevations_deg.sort_by(|a, b| b.total_cmp(a));
        elevations_deg
    }
}

impl LaserCalibration {
    fn validate(&self, laser: usize) -> Result<(), CalibrationError> {
        /// A laser looks sideways by less than this.
        const MAX_ANGLE_DEG: f64 = 90.0;
        /// Farther than any housing is large, more than the offsets of any known calibration (1.6 m).
        const MAX_OFFSET_M: f64 = 10.0;
        let [near_x_m, near_y_m] = self.near_range_offset_m;
        let values = [
            ("elevation_deg", self.elevation_deg, MAX_ANGLE_DEG),
            ("rotation_deg", self.rotation_deg, MAX_ANGLE_DEG),
            ("range_offset_m", self.range_offset_m, MAX_OFFSET_M),
            ("near_range_offset_m", near_x_m, MAX_OFFSET_M),
            ("near_range_offset_m", near_y_m, MAX_OFFSET_M),
            ("height_m", self.height_m, MAX_OFFSET_M),
            ("horizontal_offset_m", self.horizontal_offset_m, MAX_OFFSET_M),
        ];
        let wrong = values.into_iter().find(|(_, value, limit)| !(-limit..=*limit).contains(value));
        match wrong {
            Some((name, value, limit)) => {
                Err(CalibrationError::Value { laser, name, value, limit })
            }
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests;
