//! The built-in moving objects.

use std::f64::consts::FRAC_PI_2;

use crate::{Body, Figure, Material, MovingObject, Path, Shape, Walker, Waypoint};

/// The mean speed of the robot of Rec-HV 3.4.1.
pub(crate) const ROBOT_SPEED_M_PER_S: f64 = 0.98;
/// The mean speed of the person of Rec-HV 3.4.1.
pub(crate) const PERSON_SPEED_M_PER_S: f64 = 1.4;

impl MovingObject {
    fn new(id: u16, name: &str, figure: Figure, path: Path) -> Self {
        Self { id, name: name.to_owned(), figure, path, label_span_s: None }
    }

    /// A robot with the screen of 0.64 x 0.27 m of Rec-HV 3.4.1 at its side. The thesis drives it low, past
    /// sensors at ankle height; here the screen stands on a mast, so that one mounting sees robot and person.
    #[must_use]
    pub fn robot(id: u16, path: Path) -> Self {
        let wheel = |x_m: f64, y_m: f64| Body {
            name: "wheel".to_owned(),
            shape: Shape::Cylinder { radius_m: 0.05, height_m: 0.03 },
            pose: [x_m, y_m, 0.05, 0.0, 0.0, FRAC_PI_2],
            material: Material::DARK_PLASTIC,
        };
        let mut bodies = vec![
            Body::cuboid("chassis", [-0.22, -0.18, 0.04], [0.22, 0.18, 0.4], Material::matt(0.5)),
            Body::cuboid("mast", [-0.03, -0.13, 0.4], [0.03, -0.07, 1.27], Material::matt(0.4)),
            Body::cuboid("screen", [-0.32, -0.15, 1.0], [0.32, -0.13, 1.27], Material::CARD),
        ];
        for x_m in [-0.14, 0.14] {
            bodies.extend([wheel(x_m, -0.19), wheel(x_m, 0.19)]);
        }
        Self::new(id, "robot", Figure::Rigid(bodies), path)
    }

    /// A person.
    #[must_use]
    pub fn person(id: u16, walker: Walker, path: Path) -> Self {
        Self::new(id, "person", Figure::Walker(walker), path)
    }

    /// A plain box on the floor, such as a loaded cart: its extent along x (its direction of travel), y and z.
    #[must_use]
    pub fn cart(id: u16, [x_m, y_m, z_m]: [f64; 3], path: Path) -> Self {
        let (min_m, max_m) = ([-x_m / 2.0, -y_m / 2.0, 0.0], [x_m / 2.0, y_m / 2.0, z_m]);
        let body = Body::cuboid("load", min_m, max_m, Material::CARD);
        Self::new(id, "cart", Figure::Rigid(vec![body]), path)
    }

    /// An office chair with a back 1.3 m high, so that a scanner at the height of a person's chest meets it. It
    /// counts as an object only while it moves, from the path's first waypoint to its last.
    #[must_use]
    pub fn chair(id: u16, path: Path) -> Self {
        let cloth = Material::CLOTH;
        let mut bodies = vec![
            Body::cuboid("seat", [-0.23, -0.23, 0.42], [0.23, 0.23, 0.5], cloth),
            Body::cuboid("back", [-0.25, -0.23, 0.5], [-0.19, 0.23, 1.3], cloth),
        ];
        for (x_m, y_m) in [(-0.2, -0.2), (-0.2, 0.2), (0.2, -0.2), (0.2, 0.2)] {
            bodies.push(Body {
                name: "leg".to_owned(),
                shape: Shape::Cylinder { radius_m: 0.02, height_m: 0.42 },
                pose: [x_m, y_m, 0.21, 0.0, 0.0, 0.0],
                material: Material::DARK_PLASTIC,
            });
        }
        Self::new(id, "chair", Figure::Rigid(bodies), path).counting_while_it_moves()
    }

    /// The leaf of a door, `width_m` wide and 1.9 m high, that turns about its hinge. It counts as an object
    /// only while it turns.
    #[must_use]
    pub fn door(id: u16, hinge_m: [f64; 2], width_m: f64, turn: DoorTurn) -> Self {
        const HEIGHT_M: f64 = 1.9;
        const THICKNESS_M: f64 = 0.03;
        let half_m = THICKNESS_M / 2.0;
        let leaf =
            Body::cuboid("leaf", [0.0, -half_m, 0.02], [width_m, half_m, HEIGHT_M], Material::WOOD);
        let waypoint = |time_s: f64, yaw_rad: f64| Waypoint {
            time_s,
            pose: [hinge_m[0], hinge_m[1], 0.0, yaw_rad, 0.0, 0.0],
        };
        let path = Path {
            waypoints: vec![
                waypoint(turn.start_s, turn.from_yaw_rad),
                waypoint(turn.start_s + turn.duration_s, turn.to_yaw_rad),
            ],
        };
        Self::new(id, "door", Figure::Rigid(vec![leaf]), path).counting_while_it_moves()
    }

    fn counting_while_it_moves(self) -> Self {
        let label_span_s = Some([self.path.start_s(), self.path.end_s()]);
        Self { label_span_s, ..self }
    }
}

/// The motion of a door. Yaws are those of its leaf, from the hinge outwards; less than half a turn apart.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct DoorTurn {
    /// The start of the motion, in seconds since the start of the scenario.
    pub start_s: f64,
    /// The duration of the motion; positive.
    pub duration_s: f64,
    /// The yaw before.
    pub from_yaw_rad: f64,
    /// The yaw after.
    pub to_yaw_rad: f64,
}
