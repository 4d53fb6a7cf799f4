//! The parameters of point extraction, their defaults, and where these come from.

use geometry::ParameterError;
use geometry::parameter::{self, Declaration, Kind, Parameter};

geometry::parameters! {
    /// The parameters of [`crate::feature::points::PointExtractor`].
    #[derive(Clone, PartialEq, Debug)]
    pub struct PointConfig {
        /// The most corners that are extracted from an image.
        // Mur-Artal et al. 2015, section IV.A: 1000 corners for images of 512 x 384 to 752 x 480 pixels, 8 levels of 1.2. More
        // than the bound are of no use to an odometry, and matching takes the square of their time.
        max_corners: usize = 1000, whole(1, 100_000);
        /// The levels of the image pyramid, the image itself included.
        // With a factor of 1.2 the sixteenth level is 15 times smaller.
        levels: usize = 8, whole(1, 16);
        /// How much smaller each level of the pyramid is than the one before.
        // Nearer to 1 two levels show the same; bilinear interpolation leaves out no pixel up to a factor of 2.
        scale_factor: f64 = 1.2, between(1.01, 2.0);
        /// How much brighter or darker, in gray levels, nine pixels of the ring around a corner must be than its centre.
        // The two thresholds that ORB-SLAM2 (Mur-Artal and Tardos 2017) is configured with for TUM RGB-D: 20 as in ORB, 7
        // where nothing is found.
        threshold: u8 = 20, at_least(1.0);
        /// The same threshold in cells of the image where no corner reaches the first one; at most the first one.
        low_threshold: u8 = 7, at_least(1.0);
        /// The side of such a cell, in pixels of the level.
        // A patch that a corner is described by is 31 pixels wide: about one corner a patch. Below the range a cell has hardly
        // a corner; above, the image is one cell.
        cell_px: usize = 32, whole(8, 1024);
        /// This share of a level's corners is chosen so that they cover it evenly, which constrains a pose in all directions;
        /// the others are the strongest, which are found again most often.
        // Neither is best alone: ORB-SLAM spreads all, ORB none.
        even_share: f64 = 0.5, share;
    }
    check = Self::check_thresholds;
}

/// The levels that corners are found on.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Pyramid {
    /// How many there are, the image's own included.
    pub levels: usize,
    /// How much smaller each is than the one before.
    pub scale_factor: f64,
}

impl Default for Pyramid {
    fn default() -> Self {
        PointConfig::default().pyramid()
    }
}

/// It has no parameters of its own: they are those of [`PointConfig`].
impl Parameter for Pyramid {
    const KIND: Kind = Kind::Group { members: &[], is_flat: true };

    fn check(&self, _: &'static Declaration) -> Result<(), ParameterError> {
        Ok(())
    }
}

impl PointConfig {
    /// The levels that corners are found on.
    #[must_use]
    pub fn pyramid(&self) -> Pyramid {
        Pyramid { levels: self.levels, scale_factor: self.scale_factor }
    }

    fn check_thresholds(&self) -> Result<(), ParameterError> {
        let (low, threshold) = (f64::from(self.low_threshold), f64::from(self.threshold));
        parameter::check("low_threshold", ("at most threshold", threshold), low, low <= threshold)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_are_valid_and_each_bad_parameter_is_named() {
        type Spoil = fn(&mut PointConfig);
        assert_eq!(PointConfig::default().validate(), Ok(()));
        let cases: [(&str, Spoil); 9] = [
            ("max_corners", |c| c.max_corners = 0),
            ("levels", |c| c.levels = 17),
            ("scale_factor", |c| c.scale_factor = f64::NAN),
            ("scale_factor", |c| c.scale_factor = 1.0),
            ("threshold", |c| c.threshold = 0),
            ("low_threshold", |c| c.low_threshold = 21),
            ("low_threshold", |c| c.low_threshold = 0),
            ("cell_px", |c| c.cell_px = 0),
            ("even_share", |c| c.even_share = 1.1),
        ];
        for (name, spoil) in cases {
            let mut config = PointConfig::default();
            spoil(&mut config);
            let message = config.validate().unwrap_err().to_string();
            assert!(message.contains(&format!("parameter {name} ")), "{message}");
        }
    }
}
