//! Which of the filters is taken.

use geometry::LidarCloud;

use super::{GroundFilter, RayFilter, RoadIntensityFilter};
use crate::registration::ParameterError;

/// Which points take part in a registration.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub enum PointChoice {
    /// All.
    #[default]
    All,
    /// Those of some rays.
    Rays(RayFilter),
    /// Those that are not as bright as the road.
    NotRoadIntensity(RoadIntensityFilter),
    /// Those that do not lie on the ground.
    NotGround(GroundFilter),
}

/// A cloud lacks what a choice goes by.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
pub enum PointChoiceError {
    /// It says nothing of lasers.
    #[error("points cannot be chosen by rays: the cloud has no field of a point's ring")]
    NoRings,
    /// It says nothing of brightness.
    #[error(
        "points cannot be chosen by the road's intensity: the cloud has no field of a point's intensity"
    )]
    NoIntensities,
}

impl PointChoice {
    /// Checks every parameter.
    ///
    /// # Errors
    /// The first parameter out of its range.
    pub fn validate(&self) -> Result<(), ParameterError> {
        match self {
            Self::All => Ok(()),
            Self::Rays(filter) => filter.validate(),
            Self::NotRoadIntensity(filter) => filter.validate(),
            Self::NotGround(filter) => filter.validate(),
        }
    }

    /// Whether each point of a cloud is kept; `None` where all are.
    ///
    /// # Errors
    /// When the cloud lacks the field that the choice needs.
    pub fn keeps(&self, cloud: &LidarCloud) -> Result<Option<Vec<bool>>, PointChoiceError> {
        match self {
            Self::All => Ok(None),
            Self::Rays(filter) => {
                let rings = cloud.rings.as_deref().ok_or(PointChoiceError::NoRings)?;
                Ok(Some(filter.keeps(&cloud.points_m, rings)))
            }
            Self::NotRoadIntensity(filter) => {
                let intensities =
                    cloud.intensities.as_deref().ok_or(PointChoiceError::NoIntensities)?;
                Ok(Some(filter.keeps(&cloud.points_m, intensities)))
            }
            Self::NotGround(filter) => Ok(Some(filter.keeps(&cloud.points_m))),
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::*;

    #[test]
    fn a_cloud_that_lacks_a_field_is_refused_by_name() {
        let cloud = LidarCloud { points_m: vec![Point3::new(3.0, 0.0, 0.0)], ..Default::default() };
        assert_eq!(PointChoice::All.keeps(&cloud), Ok(None));
        let rays = PointChoice::Rays(RayFilter { lowest_left_out: 2, every: 1 });
        assert_eq!(rays.keeps(&cloud), Err(PointChoiceError::NoRings));
        let road = PointChoice::NotRoadIntensity(RoadIntensityFilter::default());
        assert_eq!(road.keeps(&cloud), Err(PointChoiceError::NoIntensities));
        let ground = PointChoice::NotGround(GroundFilter::default());
        assert_eq!(ground.keeps(&cloud).map(|keep| keep.map(|keep| keep.len())), Ok(Some(1)));
        let complete = LidarCloud { rings: Some(vec![1]), intensities: Some(vec![9.0]), ..cloud };
        assert_eq!(rays.keeps(&complete), Ok(Some(vec![false])));
        assert_eq!(road.keeps(&complete), Ok(Some(vec![true])));
    }
}
