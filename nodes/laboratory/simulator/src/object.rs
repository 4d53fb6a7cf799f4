//! Moving objects: shape and path.

use nalgebra::{Isometry3, Point3, Vector3};
use serde::{Deserialize, Serialize};

use crate::solid::{STATIC_ID, Solid};
use crate::{Body, Path, Walker};

/// An object that moves through the room.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MovingObject {
    /// The label, 1 or more: 0 is the static scene.
    pub id: u16,
    /// The name.
    pub name: String,
    /// The shape.
    pub figure: Figure,
    /// The path: the pose of its frame in the room.
    pub path: Path,
    /// Start and end of the time in which it counts as an object, in seconds since the start. Before and after, its
    /// surface has the label of the static scene, like a chair that has not been moved yet. Always when not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub label_span_s: Option<[f64; 2]>,
}

/// The shape of a moving object, in its own frame.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[expect(clippy::large_enum_variant, reason = "a scene has a handful of them")]
pub enum Figure {
    /// Rigid parts.
    Rigid(Vec<Body>),
    /// A walking person; the gait follows the path.
    Walker(Walker),
}

impl MovingObject {
    /// The label of the object's surface at a time.
    #[must_use]
    pub fn label_at(&self, time_s: f64) -> u16 {
        match self.label_span_s {
            Some([from_s, until_s]) if time_s < from_s || time_s > until_s => STATIC_ID,
            _ => self.id,
        }
    }

    pub(crate) fn solids(&self, time_s: f64) -> Vec<Solid> {
        let room_from_object = self.room_from_object(time_s);
        let label = self.label_at(time_s);
        let parts = |bodies: &[Body]| {
            bodies.iter().map(|body| body.solid(label, &room_from_object)).collect()
        };
        match &self.figure {
            Figure::Rigid(bodies) => parts(bodies),
            Figure::Walker(walker) => walker.solids(label, &room_from_object, &self.path, time_s),
        }
    }

    /// The velocity in the map of the point of the object that is at `point_m` in the map, in m/s.
    pub(crate) fn velocity_of(
        &self,
        time_s: f64,
        map_from_room: &Isometry3<f64>,
        point_m: &Point3<f64>,
    ) -> Vector3<f64> {
        /// Velocities are taken over this time, half before and half after.
        const SPAN_S: f64 = 0.02;
        let map_from_object = |time_s: f64| map_from_room * self.room_from_object(time_s);
        let in_object_m = map_from_object(time_s).inverse_transform_point(point_m);
        let at = |time_s: f64| map_from_object(time_s) * in_object_m;
        (at(time_s + SPAN_S / 2.0) - at(time_s - SPAN_S / 2.0)) / SPAN_S
    }

    pub(crate) fn room_from_object(&self, time_s: f64) -> Isometry3<f64> {
        self.path.pose_at(time_s)
    }
}
