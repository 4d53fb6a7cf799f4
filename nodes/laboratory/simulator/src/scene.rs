//! Scenes and bodies.

use geometry::pose_from_vector;
use nalgebra::Isometry3;
use serde::{Deserialize, Serialize};

use crate::solid::{STATIC_ID, Solid};
use crate::{Lighting, Material, MovingObject, Shape};

/// A shape with a pose and a material.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Body {
    /// A name for people: "far wall", "table leg".
    pub name: String,
    /// The shape, centred on the body's origin.
    pub shape: Shape,
    /// `[x_m, y_m, z_m, yaw_rad, pitch_rad, roll_rad]` in the room, or in the frame of the object that it
    /// is a part of.
    pub pose: [f64; 6],
    /// The material of its surface.
    pub material: Material,
}

impl Body {
    /// An axis-aligned cuboid between two opposite corners.
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

    /// A hash of its name and position in its frame, so that its pattern does not depend on other bodies (FNV-1a, Fowler,
    /// Noll and Vo).
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

/// A room with its furniture and moving objects.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Scene {
    /// Walls and furniture.
    pub bodies: Vec<Body>,
    /// The moving objects.
    pub objects: Vec<MovingObject>,
    /// The lighting for the colour camera.
    pub lighting: Lighting,
}

impl Scene {
    /// The static solids.
    pub(crate) fn static_solids(&self) -> Vec<Solid> {
        self.bodies.iter().map(|body| body.solid(STATIC_ID, &Isometry3::identity())).collect()
    }

    /// The solids of the moving objects at a time.
    pub(crate) fn moving_solids(&self, time_s: f64) -> Vec<Solid> {
        self.objects.iter().flat_map(|object| object.solids(time_s)).collect()
    }
}
