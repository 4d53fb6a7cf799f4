//! The eight rooms of Rec-HV Table 2, as far as the table and Figure 43's discussion (Rec-HV 5) describe them.
//!
//! All have doorways that face each other in their side walls. The furniture leaves [`CROSSING_DEPTHS_M`] free from one
//! corridor to the other, for the moving objects; the rig is at [`RIG_POSE`].

mod furniture;
mod shell;
mod table_2;

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::Scene;
pub(crate) use furniture::{block, plant, post, rack, sheet, sofa, table};
pub(crate) use shell::{Shell, boarded, with_pictures};

/// A room of Rec-HV Table 2.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Serialize, Deserialize)]
pub enum SceneName {
    /// Empty; 4 m to the far wall.
    A,
    /// Varnish, enamel and bare metal, at angles that reflect a part of the light away; 4 m.
    B,
    /// Surfaces of low reflectivity; 4 m.
    C,
    /// An opening in the far wall above the scanner's plane, uneven surfaces of all kinds; 6 m.
    D,
    /// An opening in the far wall, on the right and in the scanner's plane, half of it behind glass, and surfaces of high
    /// reflectivity, including the floor; 5 m.
    E,
    /// Furniture at all depths, some black, some thin, and a table in front of the moving objects; 8 m.
    F,
    /// A television, a window and screens of glass; 6 m.
    G,
    /// A small, dark room; 4 m.
    H,
}

impl SceneName {
    /// All of them, in the order of the table.
    pub const ALL: [Self; 8] =
        [Self::A, Self::B, Self::C, Self::D, Self::E, Self::F, Self::G, Self::H];

    /// The distance from the room's middle, along y, at which an object is well inside a corridor, out of sight.
    pub(crate) fn waiting_y_m(self) -> f64 {
        let shell = table_2::shell(self);
        shell.width_m / 2.0 + shell.corridor_m * WAITING_SHARE
    }
}

impl fmt::Display for SceneName {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{self:?}")
    }
}

/// How deep in a corridor an object waits, as a share of the corridor's width: far enough that a person who
/// swings an arm is out of the room, and half a metre from the corridor's wall.
const WAITING_SHARE: f64 = 0.7;
/// The pose of the rig in all of them: `[x_m, y_m, z_m, yaw_rad, pitch_rad, roll_rad]`. In the middle, half a
/// metre before the rear wall; the camera at 120 cm and the scanner at 115 cm, the third mounting of Rec-HV 3.4.2.
pub(crate) const RIG_POSE: [f64; 6] = [0.5, 0.0, 1.2, 0.0, 0.0, 0.0];
/// The depths, along x in the room, that are free for moving objects: those of the doorways, minus half of an object.
pub(crate) const CROSSING_DEPTHS_M: (f64, f64) = (2.0, 3.45);

impl Scene {
    /// A furnished room of Rec-HV Table 2, without moving objects.
    #[must_use]
    pub fn of_table_2(name: SceneName) -> Self {
        let shell = table_2::shell(name);
        let mut bodies = shell.bodies();
        bodies.extend(table_2::furniture(name));
        Self { bodies, objects: Vec::new(), lighting: shell.lighting() }
    }
}

#[cfg(test)]
mod tests;
