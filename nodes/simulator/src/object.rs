//! What moves: its shape, and its way.

use nalgebra::Isometry3;
use serde::{Deserialize, Serialize};

use crate::solid::Solid;
use crate::{Body, Path, Walker};

/// Something that moves through the room.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MovingObject {
    /// Its label, 1 or more: 0 is what never moves.
    pub id: u16,
    /// What it is called.
    pub name: String,
    /// What it looks like.
    pub figure: Figure,
    /// Where it goes: the pose of its frame in the room.
    pub path: Path,
}

/// The shape of a moving object, in its own frame.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Figure {
    /// Parts that keep their places.
    Rigid(Vec<Body>),
    /// A person whose limbs swing as far as the path takes them.
    Walker(Walker),
}

impl MovingObject {
    pub(crate) fn solids(&self, time_s: f64) -> Vec<Solid> {
        let room_from_object = self.room_from_object(time_s);
        let parts = |bodies: &[Body]| {
            bodies.iter().map(|body| body.solid(self.id, &room_from_object)).collect()
        };
        match &self.figure {
            Figure::Rigid(bodies) => parts(bodies),
            Figure::Walker(walker) => walker.solids(self.id, &room_from_object, &self.path, time_s),
        }
    }

    pub(crate) fn room_from_object(&self, time_s: f64) -> Isometry3<f64> {
        self.path.pose_at(time_s)
    }
}
