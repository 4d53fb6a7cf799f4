//! The parameters of the calibration, their defaults, and where these come from.

use geometry::{ParameterError, parameter};
use nalgebra::Vector6;

/// The parameters of [`crate::calibrate()`].
///
/// Every default is in [`CalibrationConfig::default`] and nowhere else. The noises only weigh one return
/// against another: how large they really are is estimated from what is left over.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct CalibrationConfig {
    /// Standard deviation of a range: this much, in quadrature with ...
    pub range_noise_m: f64,
    /// ... this share of the range.
    pub range_noise_ratio: f64,
    /// Standard deviation of a depth: this much and ...
    pub depth_noise_m: f64,
    /// ... this times the depth squared, in 1/m.
    pub depth_noise_per_m: f64,
    /// A plane is fitted to the pixels within this angle around the return, along rows and columns.
    pub patch_half_angle_rad: f64,
    /// Surfaces that either sensor sees at a larger angle from their normal are left out.
    pub max_incidence_rad: f64,
    /// Returns farther from the surface are of something else.
    pub max_offset_m: f64,
    /// Surfaces whose depth is larger are left out.
    pub max_depth_m: f64,
    /// The range must rise by this much from a beam to the next to make an edge.
    pub min_edge_jump_m: f64,
    /// The same edge is looked for in the image within this angle.
    pub edge_search_rad: f64,
    /// Normals of surfaces are known no better than this, whatever the fit says: walls are not quite plane, nor is
    /// the image of one.
    pub normal_noise_rad: f64,
    /// A direction is estimated only when the bag determines it to this standard deviation (a shift) ...
    pub max_std_dev_m: f64,
    /// ... or to this one (a turn).
    pub max_std_dev_rad: f64,
    /// How well the pose that the calibration starts from is known: a shift ...
    pub prior_std_dev_m: f64,
    /// ... and a rotation. Directions that the bag does not determine keep these.
    pub prior_std_dev_rad: f64,
    /// Fewer returns on surfaces are not enough.
    pub min_returns: usize,
    /// The returns are projected onto the image this often.
    pub max_iterations: usize,
}

impl Default for CalibrationConfig {
    fn default() -> Self {
        Self {
            // The RPLIDAR A1's data sheet: errors below 1 % of the range, half of which is taken as the deviation;
            // near by its steps and the surface's roughness.
            range_noise_m: 0.01,
            range_noise_ratio: 0.005,
            // Khoshelham and Elberink (2012) for the first Kinect; millimetres near by, as time of flight has.
            depth_noise_m: 0.003,
            depth_noise_per_m: 1.43e-3,
            // A little more than the 1 degree that a return of the RPLIDAR A1 covers; 9 cm to each side at 4 m.
            patch_half_angle_rad: 0.022,
            // 75 degrees: beyond, little light comes back, and a beam's width becomes depth.
            max_incidence_rad: 75.0 * std::f64::consts::PI / 180.0,
            // 5 degrees of yaw at 3.5 m: mountings by eye are better.
            max_offset_m: 0.3,
            // Three deviations of the depth before the 6 m at which drivers of the first Kinect cut it off: nearer to
            // the cut the farther half of the noise is missing.
            max_depth_m: 5.5,
            // Seven deviations of the range at 4 m.
            min_edge_jump_m: 0.15,
            // 4 degrees: again a mounting by eye.
            edge_search_rad: 0.07,
            // 2 degrees: 3 mm over a patch of 9 cm, as plaster and curtains have it.
            normal_noise_rad: 2.0 * std::f64::consts::PI / 180.0,
            // Twice as well as a ruler and an eye.
            max_std_dev_m: 0.01,
            max_std_dev_rad: 1.0 * std::f64::consts::PI / 180.0,
            // A ruler held to housings whose insides are not seen, and a level by eye.
            prior_std_dev_m: 0.02,
            prior_std_dev_rad: 2.0 * std::f64::consts::PI / 180.0,
            // Two scans of the 57 beams that a Kinect shares with the scanner.
            min_returns: 100,
            max_iterations: 40,
        }
    }
}

impl CalibrationConfig {
    /// Checks every parameter.
    ///
    /// # Errors
    /// The first parameter out of its range, with its name, its value and what is accepted.
    pub fn validate(&self) -> Result<(), ParameterError> {
        parameter::positive("range_noise_m", self.range_noise_m)?;
        parameter::positive("depth_noise_m", self.depth_noise_m)?;
        parameter::positive("patch_half_angle_rad", self.patch_half_angle_rad)?;
        parameter::positive("max_offset_m", self.max_offset_m)?;
        parameter::positive("max_depth_m", self.max_depth_m)?;
        parameter::positive("min_edge_jump_m", self.min_edge_jump_m)?;
        parameter::positive("edge_search_rad", self.edge_search_rad)?;
        parameter::positive("max_std_dev_m", self.max_std_dev_m)?;
        parameter::positive("max_std_dev_rad", self.max_std_dev_rad)?;
        parameter::positive("prior_std_dev_m", self.prior_std_dev_m)?;
        parameter::positive("prior_std_dev_rad", self.prior_std_dev_rad)?;
        parameter::at_least("min_returns", self.min_returns, 1)?;
        parameter::at_least("max_iterations", self.max_iterations, 1)?;
        parameter::below_one("range_noise_ratio", self.range_noise_ratio)?;
        parameter::below_one("depth_noise_per_m", self.depth_noise_per_m)?;
        parameter::below_one("normal_noise_rad", self.normal_noise_rad)?;
        let incidence = self.max_incidence_rad;
        let holds = incidence > 0.0 && incidence < std::f64::consts::FRAC_PI_2;
        parameter::check("max_incidence_rad", "between 0 and pi/2", incidence, holds)
    }

    /// Standard deviation of a range.
    pub(crate) fn range_std_dev_m(&self, range_m: f64) -> f64 {
        self.range_noise_m.hypot(self.range_noise_ratio * range_m)
    }

    /// Standard deviation of a depth.
    pub(crate) fn depth_std_dev_m(&self, depth_m: f64) -> f64 {
        self.depth_noise_m + self.depth_noise_per_m * depth_m * depth_m
    }

    /// The required accuracy of a direction, one number a coordinate of a correction.
    pub(crate) fn wanted_std_devs(&self) -> Vector6<f64> {
        let (shift, turn) = (self.max_std_dev_m, self.max_std_dev_rad);
        Vector6::new(shift, shift, shift, turn, turn, turn)
    }

    /// The accuracy known beforehand, likewise.
    pub(crate) fn prior_std_devs(&self) -> Vector6<f64> {
        let (shift, turn) = (self.prior_std_dev_m, self.prior_std_dev_rad);
        Vector6::new(shift, shift, shift, turn, turn, turn)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_are_valid_and_bad_values_are_named() {
        type Spoil = fn(&mut CalibrationConfig);
        assert_eq!(CalibrationConfig::default().validate(), Ok(()));
        let cases: [(&str, Spoil); 6] = [
            ("range_noise_m", |c| c.range_noise_m = 0.0),
            ("max_offset_m", |c| c.max_offset_m = f64::NAN),
            ("min_returns", |c| c.min_returns = 0),
            ("normal_noise_rad", |c| c.normal_noise_rad = -0.1),
            ("max_incidence_rad", |c| c.max_incidence_rad = 1.6),
            ("prior_std_dev_rad", |c| c.prior_std_dev_rad = f64::INFINITY),
        ];
        for (name, spoil) in cases {
            let mut config = CalibrationConfig::default();
            spoil(&mut config);
            let message = config.validate().unwrap_err().to_string();
            assert!(message.starts_with(&format!("parameter {name} must be")), "{message}");
        }
    }
}
