//! The parameters of the solvers, their defaults, and where these come from.

use nalgebra::Vector6;

geometry::choices! {
    /// The weight of an observation while there may be outliers. Each kernel takes the size of an error at which it
    /// begins to reduce the weight from [`RefineConfig::inlier_probability`].
    pub enum RobustKernel {
        /// Beyond the limit the weight falls with the error (Huber 1964). Has one minimum.
        Huber = "huber",
        /// The weight falls with the square of the error (Barron 2019, "A general and adaptive robust loss function"). Outliers
        /// pull less and less; there may be more minima.
        Cauchy = "cauchy",
        /// All count alike.
        None = "none",
    }
}

impl RobustKernel {
    /// The cost of a squared error, and its derivative, which is the weight. `limit` is the squared error at which
    /// the kernel begins to reduce the weight.
    #[inline]
    pub(crate) fn loss_and_weight(self, chi2: f64, limit: f64) -> (f64, f64) {
        let kernel = match self {
            Self::Huber => estimation::RobustKernel::Huber,
            Self::Cauchy => estimation::RobustKernel::Cauchy,
            Self::None => estimation::RobustKernel::None,
        };
        kernel.loss_and_weight(chi2, limit)
    }
}

geometry::choices! {
    /// The meaning of the observations' standard deviations.
    pub enum NoiseScale {
        /// They are right.
        Given = "given",
        /// They are right but for one factor, which is estimated from the residuals.
        Estimated = "estimated",
    }
}

geometry::choices! {
    /// What the first round of [`crate::solve::refine_pose`] begins with.
    pub enum FirstRound {
        /// All observations, under the robust kernel: for a guess that may be off by many pixels.
        Everything = "everything",
        /// Those that the guess explains: for a guess that was chosen by what it explains. Others that are nearly as good, and
        /// that more observations may be for, do not draw it away.
        FitsGuess = "fits_guess",
    }
}

geometry::parameters! {
    /// The parameters of [`crate::solve::refine_pose`].
    #[derive(Clone, Copy, PartialEq, Debug)]
    pub struct RefineConfig {
        /// The share of right observations that pass as inliers.
        // The quantiles 5.991 and 7.815 of ORB-SLAM2 (Mur-Artal and Tardos 2017).
        inlier_probability: f64 = 0.95, probability;
        /// The robust kernel.
        // ORB-SLAM2 takes Huber's. Of 300 points and 100 lines seen with the noise of a Kinect from a guess that is 30 pixels
        // off, four fifths may be anywhere in the image with this one; with Huber's half of them.
        kernel: RobustKernel = RobustKernel::Cauchy;
        /// The robust kernel is used in this many rounds; in later ones all inliers count alike.
        // ORB-SLAM2 again: four times ten iterations, the kernel in the first two.
        kernel_rounds: usize = 2;
        /// Rounds; after each of them outliers are decided anew.
        rounds: usize = 4, at_least(1.0);
        /// The most iterations in a round.
        iterations_per_round: usize = 10, at_least(1.0);
        /// What the first round begins with.
        first_round: FirstRound = FirstRound::Everything;
        /// Whether an observation whose image position fits but whose depth does not is used without the depth. Otherwise it is
        /// an outlier: something that moves along its ray looks so, too.
        // Corners are found where things end, and there the depths of a Kinect belong to either side.
        keep_without_depth: bool = true;
        /// What the standard deviations of the observations mean.
        noise: NoiseScale = NoiseScale::Given;
        /// A direction of translation is estimated only when the observations determine it to this standard deviation;
        /// otherwise it stays where the guess was.
        // At 30 Hz a prediction by constant velocity is as good on a platform that is driven gently: 2 cm are what an
        // acceleration of 18 m/s^2 makes of a frame's time; the turn shows as much at 2 m.
        max_std_dev_m: f64 = 0.02, positive;
        /// A direction of rotation is estimated only when the observations determine it to this standard deviation; otherwise
        /// it stays where the guess was.
        max_std_dev_rad: f64 = 0.01, positive;
        /// Standard deviation of the translation of a guess that comes without a covariance. Directions that the observations
        /// do not determine keep it.
        // A step, and a quarter of a turn: a guess without any evidence.
        unknown_std_dev_m: f64 = 1.0, positive;
        /// Standard deviation of the rotation of a guess that comes without a covariance. Directions that the observations do
        /// not determine keep it.
        unknown_std_dev_rad: f64 = 0.5, positive;
    }
}

geometry::parameters! {
    /// The parameters of [`crate::solve::pnp_ransac`].
    #[derive(Clone, Copy, PartialEq, Debug)]
    pub struct RansacConfig {
        /// The seed of the random samples.
        seed: u64 = 1;
        /// The most samples that are drawn.
        // ORB-SLAM2's relocalisation draws 300; 30 % of inliers at the confidence below need 254.
        max_iterations: usize = 500, at_least(1.0);
        /// The search ends when a sample without outliers has been drawn with this probability, by the inliers so far.
        confidence: f64 = 0.999, probability;
        /// The search ends when this share of the observations fits.
        // Samples of what is left cannot show much more.
        enough_inlier_ratio: f64 = 0.9, share;
        /// A pose that explains fewer observations is refused.
        // ORB-SLAM2's relocalisation asks its solver for 10. Three points always fit some pose.
        min_inliers: usize = 10, at_least(4.0);
        /// Samples are drawn from the points with depths when at least this share has them; from all points otherwise.
        // Below, the depths would decide which half of the image counts.
        min_depth_share: f64 = 0.5, share;
    }
}

geometry::parameters! {
    /// The parameters of [`crate::solve::split_rigid_sets`].
    #[derive(Clone, Copy, PartialEq, Debug)]
    pub struct RigidSetsConfig {
        /// The most sets that are searched for.
        // A room and three people who walk in it.
        max_sets: usize = 4, at_least(1.0);
        /// The background has at least this share of the usable points.
        // Two people close to the camera leave this much of a Kinect's view.
        min_background_share: f64 = 0.15, share;
        /// How surely the larger of two sets is the background: the odds grow with this power of the ratio of their sizes.
        // Of sets as 60 to 40 the larger is the background five times out of six: what the prediction says by more than two
        // standard deviations weighs more.
        size_power: f64 = 4.0, positive;
        /// The share of right predictions. Beyond the distance of this share of right ones a prediction counts as wrong, and no
        /// distance from it is worse than another.
        prediction_probability: f64 = 0.999, probability;
        /// How each set is found, and a lost camera. Its min_inliers is the size of the smallest set.
        ransac: RansacConfig;
    }
}

impl RefineConfig {
    /// The required accuracy of a direction, one number a coordinate of a perturbation.
    pub(crate) fn limits(&self) -> Vector6<f64> {
        let (shift, turn) = (self.max_std_dev_m, self.max_std_dev_rad);
        Vector6::new(shift, shift, shift, turn, turn, turn)
    }

    /// The assumed accuracy of a guess without a covariance, likewise.
    pub(crate) fn unknown_std_devs(&self) -> Vector6<f64> {
        let (shift, turn) = (self.unknown_std_dev_m, self.unknown_std_dev_rad);
        Vector6::new(shift, shift, shift, turn, turn, turn)
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
            ("ransac.min_inliers", |c| c.ransac.min_inliers = 3),
            ("ransac.confidence", |c| c.ransac.confidence = 1.0),
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
