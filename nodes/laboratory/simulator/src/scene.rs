//! What a scene is made of.

use geometry::pose_from_vector;
use nalgebra::Isometry3;
use serde::{Deserialize, Serialize};

use crate::solid::{STATIC_ID, Solid};
use crate::{Lighting, Material, MovingObject, Shape};

/// One shape in its place.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Body {
    /// What it is, for people: "far wall", "table leg".
    pub name: String,
    /// The shape, centred on the body's origin.
    pub shape: Shape,
    /// `[x_m, y_m, z_m, yaw_rad, pitch_rad, roll_rad]` in the room, or in the frame of the object that it
    /// is a part of.
    pub pose: [f64; 6],
    /// What its surface gives back.
    pub material: Material,
}

impl Body {
    /// A cuboid along the axes between two opposite corners.
    #[must_use]
    pub fn cuboid(name: &str, min_m: [f64; 3], max_m: [f64; 3], material: Material) -> Self {
        let middle = |axis: usize| f64::midpoint(min_m[axis], max_m[axis]);
        let size = |axis: usize| max_m[axis] - min_m[axis];
        Self {
            name: name.to_owned(),
            shape: Shape::Box { size_m: [size(0), size(1), size(2)] },
            pose: [middle(0), middle(1), middle(2), 0.0, 0.0, 0.0],
            material,
        }
    }

    pub(crate) fn solid(&self, id: u16, room_from_parent: &Isometry3<f64>) -> Solid {
        Solid::new(
            self.shape.clone(),
            &(room_from_parent * pose_from_vector(&self.pose)),
            &self.material,
            id,
            self.pattern_seed(),
        )
    }

    /// By name and place in its frame, so that a pattern stays what it was when other bodies come and go (FNV-1a,
    /// Fowler, Noll and Vo).
    fn pattern_seed(&self) -> u32 {
        const OFFSET_BASIS: u32 = 0x811c_9dc5;
        const PRIME: u32 = 0x0100_0193;
        let numbers = self.pose.iter().flat_map(|value| value.to_bits().to_le_bytes());
        self.name
            .bytes()
            .chain(numbers)
            .fold(OFFSET_BASIS, |hash, byte| (hash ^ u32::from(byte)).wrapping_mul(PRIME))
    }
}

/// A room with what stands in it and what moves through it.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Scene {
    /// Walls and furniture.
    pub bodies: Vec<Body>,
    /// What moves.
    pub objects: Vec<MovingObject>,
    /// The light that a colour camera sees all this in.
    pub lighting: Lighting,
}

impl Scene {
    /// What never moves, ready for rays.
    pub(crate) fn static_solids(&self) -> Vec<Solid> {
        self.bodies.iter().map(|body| body.solid(STATIC_ID, &Isometry3::identity())).collect()
    }

    /// What moves, where it is at a time, ready for rays.
    pub(crate) fn moving_solids(&self, time_s: f64) -> Vec<Solid> {
        self.objects.iter().flat_map(|object| object.solids(time_s)).collect()
    }
}
