//! The map, worked on in the caller's thread: every answer is there at once.

use std::sync::Arc;

use geometry::ParameterError;

use super::{Done, Kept, Mapping, Request};
use crate::map::{Map, MapError, NewKeyframe};
use crate::mapping::{Mapper, MappingConfig, MappingStep};

/// A map that is worked on at each request.
#[derive(Clone, Debug)]
pub struct InlineMapping {
    mapper: Mapper,
    map: Arc<Map>,
    answers: Vec<Done>,
}

impl InlineMapping {
    /// A map of nothing.
    ///
    /// # Errors
    /// When a parameter has a value that means nothing.
    pub fn new(config: MappingConfig) -> Result<Self, ParameterError> {
        Ok(Self::of(Mapper::new(config)?))
    }

    /// A map that is there already.
    #[must_use]
    pub fn of(mapper: Mapper) -> Self {
        let map = Arc::new(mapper.map().clone());
        Self { mapper, map, answers: Vec::new() }
    }

    /// The mapper.
    #[must_use]
    pub fn mapper(&self) -> &Mapper {
        &self.mapper
    }
}

impl Mapping for InlineMapping {
    fn map(&self) -> Arc<Map> {
        Arc::clone(&self.map)
    }

    fn is_idle(&self) -> bool {
        true
    }

    fn ask(&mut self, request: Request) {
        let done = answered(&mut self.mapper, request, &|| false);
        self.map = Arc::new(self.mapper.map().clone());
        self.answers.push(done);
    }

    fn answers(&mut self) -> Vec<Done> {
        std::mem::take(&mut self.answers)
    }
}

/// Processes a request.
pub(crate) fn answered(
    mapper: &mut Mapper,
    request: Request,
    is_aborted: &dyn Fn() -> bool,
) -> Done {
    match request {
        Request::Keep(kept) => Done::Kept(keep(mapper, &kept, is_aborted)),
        Request::Find { frame, camera } => {
            let found = mapper.find(&frame, &camera);
            let camera_from_map = found.map(|(_, located)| located.pose.camera_from_map);
            Done::Found { frame, camera, camera_from_map }
        }
    }
}

fn keep(
    mapper: &mut Mapper,
    kept: &Kept,
    is_aborted: &dyn Fn() -> bool,
) -> Result<MappingStep, MapError> {
    for (point, times) in &kept.predicted.points {
        mapper.map_mut().count_predicted(*point, *times);
    }
    for (line, times) in &kept.predicted.lines {
        mapper.map_mut().count_predicted(*line, *times);
    }
    let new = NewKeyframe {
        camera: kept.camera,
        camera_from_map: kept.camera_from_map,
        frame: Arc::clone(&kept.frame),
        points: &kept.points,
        lines: &kept.lines,
        by_odometry: kept.by_odometry,
    };
    mapper.step(new, is_aborted)
}
