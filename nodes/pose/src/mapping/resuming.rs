//! Continuing an existing map.

use geometry::ParameterError;

use super::{Mapper, MappingConfig};
use crate::map::{Map, MapConfig};
use crate::place_recognition::{Consistency, PlaceDatabase};

/// A map cannot be gone on with.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum ResumeError {
    /// A parameter has a value that means nothing.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// Its corners were found on other levels: the distance of a point would be predicted wrongly.
    #[error(
        "its corners were found on {} levels with a factor of {} between them, and here it is {} with {}",
        map.levels, map.scale_factor, ours.levels, ours.scale_factor
    )]
    OtherLevels {
        /// The map's.
        map: MapConfig,
        /// Ours.
        ours: MapConfig,
    },
}

impl Mapper {
    /// Continues a map. The appearance of its places is computed from its keyframes.
    ///
    /// # Errors
    /// When a parameter has a value that means nothing, or the map was made with other levels.
    pub fn resume(config: MappingConfig, map: Map) -> Result<Self, ResumeError> {
        config.validate()?;
        if *map.config() != config.map {
            return Err(ResumeError::OtherLevels { map: *map.config(), ours: config.map });
        }
        let mut places = PlaceDatabase::new(config.places);
        let mut keyframes: Vec<_> = map.keyframes().iter().collect();
        // As they came in: of what is equally alike the newest is the first.
        keyframes.sort_by_key(|(_, keyframe)| keyframe.number());
        for (id, keyframe) in keyframes {
            places.insert(id, keyframe.frame());
        }
        Ok(Self { config, map, places, consistency: Consistency::default() })
    }
}
