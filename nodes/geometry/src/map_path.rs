//! The trajectory of the platform in the current map; how a correction of the map has moved it; and a frame in
//! which the platform does not jump when it is corrected.

mod continuous;
mod correction;
mod late;
#[cfg(test)]
mod tests;

use nalgebra::Isometry3;

use crate::{Stamp, UnusablePose, check_pose};
pub use continuous::ContinuousFrame;
pub(crate) use continuous::REACH_M;
pub use correction::{PathCorrection, PathKnot};
pub use late::LateCorrections;

/// A vertex of the trajectory: a moment, and where the platform was then.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct PathVertex {
    /// When.
    pub stamp: Stamp,
    /// Where the rig was, as the map has it.
    pub map_from_rig: Isometry3<f64>,
}

/// The trajectory of the platform in the current map: the keyframe poses that a SLAM publishes.
///
/// A vertex is known again by its stamp: the same moment in two paths is the same place of the room, wherever the map
/// has it.
#[derive(Clone, PartialEq, Debug)]
pub struct MapPath {
    since: Stamp,
    frame_id: String,
    vertices: Vec<PathVertex>,
}

/// A path is invalid.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum MapPathError {
    /// More vertices than [`MapPath::MOST_VERTICES`].
    #[error("the path has {vertices} vertices, and {} is the most", MapPath::MOST_VERTICES)]
    TooLong {
        /// How many.
        vertices: usize,
    },
    /// A vertex is no later than the one before it: it cannot be known again.
    #[error(
        "vertex {index} of the path is no later than the one before it: each needs a stamp of its own"
    )]
    Unordered {
        /// Its place in the path, from 0.
        index: usize,
    },
    /// A vertex cannot be used.
    #[error("vertex {index} of the path: {source}")]
    Pose {
        /// Its place in the path, from 0.
        index: usize,
        /// Why.
        source: UnusablePose,
    },
}

impl MapPath {
    /// More vertices than a day of keyframes: 64 MB.
    pub const MOST_VERTICES: usize = 1_000_000;

    /// A path in the frame `frame_id`. `stamp` is that of the first pose that was published in the map as the path has it;
    /// where it is missing (zero, or before the last vertex) that of the last vertex is used.
    ///
    /// # Errors
    /// When there are too many vertices, one is out of order, or one has a pose that cannot be used.
    pub fn new(
        stamp: Stamp,
        frame_id: &str,
        vertices: Vec<PathVertex>,
    ) -> Result<Self, MapPathError> {
        if vertices.len() > Self::MOST_VERTICES {
            return Err(MapPathError::TooLong { vertices: vertices.len() });
        }
        let mut last = None;
        for (index, vertex) in vertices.iter().enumerate() {
            if last.is_some_and(|last| vertex.stamp <= last) {
                return Err(MapPathError::Unordered { index });
            }
            check_pose(&vertex.map_from_rig)
                .map_err(|source| MapPathError::Pose { index, source })?;
            last = Some(vertex.stamp);
        }
        let since = last.map_or(stamp, |last| stamp.max(last));
        Ok(Self { since, frame_id: frame_id.to_owned(), vertices })
    }

    /// From this moment on poses are published in the map as the path has it; earlier ones were in the map of
    /// before.
    #[must_use]
    pub fn since(&self) -> Stamp {
        self.since
    }

    /// The frame of the map.
    #[must_use]
    pub fn frame_id(&self) -> &str {
        &self.frame_id
    }

    /// The vertices, each later than the one before.
    #[must_use]
    pub fn vertices(&self) -> &[PathVertex] {
        &self.vertices
    }

    /// The correction that moved the map from an earlier path to this one, by the vertices that both have; `None` where they have
    /// none in common, as after a new start, or are in different frames.
    #[must_use]
    pub fn correction_since(&self, earlier: &Self) -> Option<PathCorrection> {
        if self.frame_id != earlier.frame_id {
            return None;
        }
        let mut before = earlier.vertices.iter().peekable();
        let mut knots = Vec::new();
        for vertex in &self.vertices {
            while before.next_if(|known| known.stamp < vertex.stamp).is_some() {}
            if let Some(known) = before.next_if(|known| known.stamp == vertex.stamp) {
                knots.push(PathKnot::between(known, vertex));
            }
        }
        PathCorrection::new(knots)
    }

    /// The path that a map is built on after a correction since this path to `later` was made, which may leave knots where
    /// they were: see [`PathCorrection::beyond`]. It has the vertices of `later`, and has those where they were that the
    /// correction left there, so that what they are off by counts the next time.
    #[must_use]
    pub fn after(&self, made: &PathCorrection, later: &Self) -> Self {
        let mut known = self.vertices.iter().peekable();
        let vertices = later.vertices.iter().map(|vertex| {
            while known.next_if(|known| known.stamp < vertex.stamp).is_some() {}
            let before = known.next_if(|known| known.stamp == vertex.stamp);
            before.filter(|_| made.stays_at(vertex.stamp)).copied().unwrap_or(*vertex)
        });
        Self { since: later.since, frame_id: later.frame_id.clone(), vertices: vertices.collect() }
    }
}
