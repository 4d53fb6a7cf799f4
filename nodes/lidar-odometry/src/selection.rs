//! Which points take part in a registration (Road LiDAR, section 4.2.1.2): the road is plane, looks the same from wherever it
//! is seen from, and the sensor's rings on it move with the vehicle. Three methods to leave it out.
//!
//! Each filter answers, point by point, whether it is kept; [`kept`] applies the answers. What is left out is left out of
//! the registration only, not of a map.

mod choice;
mod ground;
mod rays;
mod road_intensity;

pub use self::choice::{PointChoice, PointChoiceError};
pub use self::ground::GroundFilter;
pub use self::rays::RayFilter;
pub use self::road_intensity::{RoadIntensity, RoadIntensityFilter};

/// The items that are kept. Items without an answer are not.
#[must_use]
pub fn kept<T: Copy>(items: &[T], keep: &[bool]) -> Vec<T> {
    items.iter().zip(keep).filter(|(_, keep)| **keep).map(|(item, _)| *item).collect()
}
