//! The parameters of the solvers, their defaults, and where these come from.

use geometry::{ParameterError, parameter};
use nalgebra::Vector6;
use serde::{Deserialize, Serialize};

/// How much an observation counts while outliers may still be among them. Each takes the size of an error at which it
/// begins to doubt from [`RefineConfig::inlier_probability`].
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RobustKernel {
    /// Beyond the limit the weight falls with the error (Huber 1964). Has one minimum.
    Huber,
    /// The weight falls with the square of the error (Barron 2019, "A general and adaptive robust loss function"). Outliers
    /// pull less and less; there may be more minima.
    Cauchy,
    /// All count alike.
    None,
}

/// What the standard deviations of the observations mean.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum NoiseScale {
    /// They are right.
    Given,
    /// They are right but for one factor, which is estimated from what is left over.
    Estimated,
}

/// What the first round of [`crate::solve::refine_pose`] begins with.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FirstRound {
    /// All observations, under the robust kernel: for a guess that may be off by many pixels.
    Everything,
    /// Those that the guess explains: for a guess that was chosen by what it explains. Others that are nearly as good, and
    /// that more observations may be for, do not draw it away.
    FitsGuess,
}

/// The parameters of [`crate::solve::refine_pose`].
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RefineConfig {
    /// So many of the right observations are to pass for inliers.
    pub inlier_probability: f64,
    /// The robust kernel.
    pub kernel: RobustKernel,
    /// It is used in so many rounds; in later ones all inliers count alike.
    pub kernel_rounds: usize,
    /// After each round it is decided anew what is an outlier.
    pub rounds: usize,
    /// Steps in a round, at most.
    pub iterations_per_round: usize,
    /// What the first round begins with.
    pub first_round: FirstRound,
    /// An observation whose place in the image fits but not its depth is used without the depth. Otherwise it is an
    /// outlier: what moves along its ray looks so, too.
    pub keep_without_depth: bool,
    /// What the standard deviations mean.
    pub noise: NoiseScale,
    /// A direction is estimated only when the observations tell it to this standard deviation (a shift) ...
    pub max_std_dev_m: f64,
    /// ... or to this one (a turn). Otherwise the pose stays where the guess was.
    pub max_std_dev_rad: f64,
    /// How well a guess is taken to be known that comes without a covariance: a shift ...
    pub unknown_std_dev_m: f64,
    /// ... and a turn. What the observations do not tell keeps these.
    pub unknown_std_dev_rad: f64,
}

impl Default for RefineConfig {
    fn default() -> Self {
        Self {
            // The quantiles 5.991 and 7.815 of ORB-SLAM2 (Mur-Artal and Tardos 2017).
            inlier_probability: 0.95,
            // ORB-SLAM2 takes Huber's. Of 300 points and 100 lines seen with the noise of a Kinect from a guess that is 30
            // pixels off, four fifths may be anywhere in the image with this one; with Huber's half of them.
            kernel: RobustKernel::Cauchy,
            // ORB-SLAM2 again: four times ten iterations, the kernel in the first two.
            kernel_rounds: 2,
            rounds: 4,
            iterations_per_round: 10,
            first_round: FirstRound::Everything,
            // Corners are found where things end, and there the depths of a Kinect belong to either side.
            keep_without_depth: true,
            noise: NoiseScale::Given,
            // At 30 Hz a prediction by constant velocity is as good on a platform that is driven gently: 2 cm are what an
            // acceleration of 18 m/s^2 makes of a frame's time; the turn shows as much at 2 m.
            max_std_dev_m: 0.02,
            max_std_dev_rad: 0.01,
            // A step, and a quarter of a turn: a guess that nobody vouches for.
            unknown_std_dev_m: 1.0,
            unknown_std_dev_rad: 0.5,
        }
    }
}

/// The parameters of [`crate::solve::pnp_ransac`].
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RansacConfig {
    /// Decides the random choices.
    pub seed: u64,
    /// Samples, at most.
    pub max_iterations: usize,
    /// The search ends when a sample without outliers has been drawn with this probability, by the inliers so far.
    pub confidence: f64,
    /// The search ends when this share of the observations fits.
    pub enough_inlier_ratio: f64,
    /// A pose that explains fewer is none.
    pub min_inliers: usize,
    /// Samples are taken from the points with depths when at least this share has them; from all points otherwise.
    pub min_depth_share: f64,
}

impl Default for RansacConfig {
    fn default() -> Self {
        Self {
            seed: 1,
            // ORB-SLAM2's relocalisation draws 300; 30 % of inliers at the confidence below need 254.
            max_iterations: 500,
            confidence: 0.999,
            // Samples of what is left cannot show much more.
            enough_inlier_ratio: 0.9,
            // ORB-SLAM2's relocalisation asks its solver for 10.
            min_inliers: 10,
            // Below, the depths would decide which half of the image counts.
            min_depth_share: 0.5,
        }
    }
}

/// The parameters of [`crate::solve::split_rigid_sets`].
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RigidSetsConfig {
    /// No more sets are looked for.
    pub max_sets: usize,
    /// The background holds at least this share of the usable points.
    pub min_background_share: f64,
    /// How surely the larger of two sets is the background: the odds grow with this power of the ratio of their sizes.
    pub size_power: f64,
    /// So many predictions are right. Those that are not say nothing: farther off than so many right ones are, no distance
    /// from the prediction is worse than another.
    pub prediction_probability: f64,
    /// How each set is found. Its `min_inliers` is the smallest set.
    pub ransac: RansacConfig,
}

impl Default for RigidSetsConfig {
    fn default() -> Self {
        Self {
            // A room and three who walk in it.
            max_sets: 4,
            // Two people close to the camera leave so much of a Kinect's view.
            min_background_share: 0.15,
            // Of sets as 60 to 40 the larger is the background five times out of six: what the prediction says by more than
            // two standard deviations weighs more.
            size_power: 4.0,
            prediction_probability: 0.999,
            ransac: RansacConfig::default(),
        }
    }
}

/// Neither 0 nor 1: their quantiles say nothing.
fn between_0_and_1(name: &'static str, value: f64) -> Result<(), ParameterError> {
    parameter::check(name, "above 0 and below 1", value, value > 0.0 && value < 1.0)
}

impl RefineConfig {
    /// Checks every parameter.
    ///
    /// # Errors
    /// The first parameter out of its range, with its name, its value and what is accepted.
    pub fn validate(&self) -> Result<(), ParameterError> {
        between_0_and_1("inlier_probability", self.inlier_probability)?;
        parameter::positive("rounds", self.rounds as f64)?;
        parameter::positive("iterations_per_round", self.iterations_per_round as f64)?;
        parameter::positive("max_std_dev_m", self.max_std_dev_m)?;
        parameter::positive("max_std_dev_rad", self.max_std_dev_rad)?;
        parameter::positive("unknown_std_dev_m", self.unknown_std_dev_m)?;
        parameter::positive("unknown_std_dev_rad", self.unknown_std_dev_rad)
    }

    /// What a direction must be known to, one number a coordinate of a perturbation.
    pub(crate) fn limits(&self) -> Vector6<f64> {
        let (shift, turn) = (self.max_std_dev_m, self.max_std_dev_rad);
        Vector6::new(shift, shift, shift, turn, turn, turn)
    }

    /// What is known of a guess that comes without a covariance, likewise.
    pub(crate) fn unknown_std_devs(&self) -> Vector6<f64> {
        let (shift, turn) = (self.unknown_std_dev_m, self.unknown_std_dev_rad);
        Vector6::new(shift, shift, shift, turn, turn, turn)
    }
}

impl RansacConfig {
    /// Checks every parameter.
    ///
    /// # Errors
    /// The first parameter out of its range, with its name, its value and what is accepted.
    pub fn validate(&self) -> Result<(), ParameterError> {
        parameter::positive("max_iterations", self.max_iterations as f64)?;
        between_0_and_1("confidence", self.confidence)?;
        parameter::between("enough_inlier_ratio", self.enough_inlier_ratio, 0.0, 1.0)?;
        parameter::between("min_depth_share", self.min_depth_share, 0.0, 1.0)?;
        // Three points always fit some pose.
        parameter::at_least("min_inliers", self.min_inliers, 4)
    }
}

impl RigidSetsConfig {
    /// Checks every parameter.
    ///
    /// # Errors
    /// The first parameter out of its range, with its name, its value and what is accepted.
    pub fn validate(&self) -> Result<(), ParameterError> {
        parameter::positive("max_sets", self.max_sets as f64)?;
        parameter::between("min_background_share", self.min_background_share, 0.0, 1.0)?;
        parameter::positive("size_power", self.size_power)?;
        between_0_and_1("prediction_probability", self.prediction_probability)?;
        self.ransac.validate()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_are_valid_and_bad_values_are_named() {
        type Spoil = fn(&mut RigidSetsConfig);
        assert_eq!(RigidSetsConfig::default().validate(), Ok(()));
        let cases: [(&str, Spoil); 5] = [
            ("max_sets", |c| c.max_sets = 0),
            ("min_background_share", |c| c.min_background_share = f64::NAN),
            ("prediction_probability", |c| c.prediction_probability = 1.0),
            ("min_inliers", |c| c.ransac.min_inliers = 3),
            ("confidence", |c| c.ransac.confidence = 1.0),
        ];
        for (name, spoil) in cases {
            let mut config = RigidSetsConfig::default();
            spoil(&mut config);
            let message = config.validate().unwrap_err().to_string();
            assert!(message.starts_with(&format!("parameter {name} ")), "{message}");
        }
        type SpoilRefine = fn(&mut RefineConfig);
        assert_eq!(RefineConfig::default().validate(), Ok(()));
        let cases: [(&str, SpoilRefine); 3] = [
            ("inlier_probability", |c| c.inlier_probability = 0.0),
            ("max_std_dev_rad", |c| c.max_std_dev_rad = f64::INFINITY),
            ("rounds", |c| c.rounds = 0),
        ];
        for (name, spoil) in cases {
            let mut config = RefineConfig::default();
            spoil(&mut config);
            let message = config.validate().unwrap_err().to_string();
            assert!(message.starts_with(&format!("parameter {name} ")), "{message}");
        }
    }
}
