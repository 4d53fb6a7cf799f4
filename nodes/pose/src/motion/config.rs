//! The parameters of the predictions, their defaults, and where these come from.

use geometry::{ParameterError, parameter};
use serde::{Deserialize, Serialize};

/// The parameters of the predictions.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MotionConfig {
    /// Standard deviation of the camera's acceleration along each axis.
    pub acceleration_m_per_s2: f64,
    /// Standard deviation of its angular acceleration about each axis.
    pub acceleration_rad_per_s2: f64,
    /// Over longer gaps nothing is predicted.
    pub max_gap_s: f64,
    /// The noise density of the gyroscope: the standard deviation of the turn after a second.
    pub gyro_noise_rad_per_sqrt_s: f64,
    /// Standard deviation of what the gyroscope reads when it stands still.
    pub gyro_bias_rad_per_s: f64,
    /// Standard deviation of what wheels say, as a share of the way: along it ...
    pub wheel_noise_along: f64,
    /// ... and across, where only slip leads.
    pub wheel_noise_across: f64,
    /// The same for a turn about the upright axis, as a share of the turn ...
    pub wheel_noise_turn: f64,
    /// ... and for each metre of way.
    pub wheel_noise_rad_per_m: f64,
    /// What the platform's floor lets it heave in a step: standard deviation up and down ...
    pub heave_m: f64,
    /// ... and of roll and pitch.
    pub tilt_rad: f64,
}

impl Default for MotionConfig {
    fn default() -> Self {
        Self {
            // A hand-held camera: walking people's heads and hands accelerate by 1 to 3 m/s^2 (Rec-HV's platform by less).
            acceleration_m_per_s2: 3.0,
            // A hand turns by 1 rad/s within a fifth of a second.
            acceleration_rad_per_s2: 5.0,
            // Fifteen frames of a Kinect: after that a walker has changed his mind.
            max_gap_s: 0.5,
            // MPU-6050's data sheet: 0.005 degrees a second per root of a hertz; ten times that for what shakes on a platform.
            gyro_noise_rad_per_sqrt_s: 1e-3,
            // The same data sheet states 20 degrees a second before any calibration; a second of rest leaves less than half
            // a degree.
            gyro_bias_rad_per_s: 0.01,
            // What is common for encoders on indoor floors (Borenstein and Feng 1996 measured errors of 1 to 3 % for carpets
            // and tiles).
            wheel_noise_along: 0.03,
            wheel_noise_across: 0.03,
            wheel_noise_turn: 0.05,
            wheel_noise_rad_per_m: 0.05,
            // Joints of tiles, and the play of a mast.
            heave_m: 0.002,
            tilt_rad: 0.005,
        }
    }
}

impl MotionConfig {
    /// Checks every parameter.
    ///
    /// # Errors
    /// The first parameter out of its range, with its name, its value and what is accepted.
    pub fn validate(&self) -> Result<(), ParameterError> {
        parameter::positive("acceleration_m_per_s2", self.acceleration_m_per_s2)?;
        parameter::positive("acceleration_rad_per_s2", self.acceleration_rad_per_s2)?;
        parameter::positive("max_gap_s", self.max_gap_s)?;
        parameter::positive("gyro_noise_rad_per_sqrt_s", self.gyro_noise_rad_per_sqrt_s)?;
        parameter::positive("gyro_bias_rad_per_s", self.gyro_bias_rad_per_s)?;
        parameter::positive("wheel_noise_along", self.wheel_noise_along)?;
        parameter::positive("wheel_noise_across", self.wheel_noise_across)?;
        parameter::positive("wheel_noise_turn", self.wheel_noise_turn)?;
        parameter::positive("wheel_noise_rad_per_m", self.wheel_noise_rad_per_m)?;
        parameter::positive("heave_m", self.heave_m)?;
        parameter::positive("tilt_rad", self.tilt_rad)
    }
}
