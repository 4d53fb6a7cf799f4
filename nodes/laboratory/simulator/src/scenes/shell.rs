//! Walls, floor, ceiling, doorways and corridors.

use crate::{Body, Lighting, Material, Paint, Texture};

const WALL_M: f64 = 0.1;
const DOOR_HEIGHT_M: f64 = 2.1;

/// A room as a box: x = 0 at the rear wall, y = 0 in the middle, the floor at z = 0. Doorways in the side walls
/// face each other, so that something can come in on one side and leave on the other; behind each
/// runs a corridor.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shell {
    /// The extent along x, y and z.
    pub(crate) depth_m: f64,
    pub(crate) width_m: f64,
    pub(crate) height_m: f64,
    /// The start and end of the doorways along x.
    pub(crate) door_m: (f64, f64),
    /// The width of the corridors behind the doorways.
    pub(crate) corridor_m: f64,
    /// A hole in the far wall, with nothing behind it.
    pub(crate) opening: Option<Opening>,
    pub(crate) walls: Material,
    pub(crate) floor: Material,
}

/// A hole in the far wall.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Opening {
    /// From the right to the left.
    pub(crate) y_m: (f64, f64),
    /// From below to above.
    pub(crate) z_m: (f64, f64),
}

impl Default for Shell {
    /// A room of 4 m in front of a rig that stands half a metre before the rear wall; doorways wide enough for
    /// ways that change in depth, and corridors in which an object is out of sight of a rig that turns by
    /// 20 degrees.
    fn default() -> Self {
        Self {
            depth_m: 4.5,
            width_m: 6.0,
            height_m: 2.6,
            door_m: (1.6, 3.8),
            corridor_m: 2.0,
            opening: None,
            walls: Material::PLASTER,
            floor: Material::PLASTER,
        }
    }
}

impl Shell {
    /// Two lamps below the ceiling.
    pub(crate) fn lighting(&self) -> Lighting {
        Lighting::of_room(self.depth_m, self.width_m, self.height_m)
    }

    /// Floor, ceiling and walls.
    pub(crate) fn bodies(&self) -> Vec<Body> {
        let Self { depth_m, height_m, .. } = *self;
        let half_m = self.width_m / 2.0;
        let outer_m = half_m + self.corridor_m;
        let walls = with_pictures(self.walls);
        let wall = |name: &str, min_m, max_m| Body::cuboid(name, min_m, max_m, walls);
        let mut bodies = vec![
            Body::cuboid(
                "floor",
                [-WALL_M, -outer_m, -WALL_M],
                [depth_m + WALL_M, outer_m, 0.0],
                boarded(self.floor),
            ),
            Body::cuboid(
                "ceiling",
                [-WALL_M, -outer_m, height_m],
                [depth_m + WALL_M, outer_m, height_m + WALL_M],
                self.walls,
            ),
        ];
        bodies.extend(self.far_wall(outer_m));
        bodies.push(wall("rear wall", [-WALL_M, -outer_m, 0.0], [0.0, outer_m, height_m]));
        for (side, inner_m) in [("left", half_m), ("right", -half_m)] {
            // The wall and the corridor lie beyond the room, whichever side that is.
            let between = |a_m: f64, b_m: f64| (a_m.min(b_m), a_m.max(b_m));
            let outwards = inner_m.signum();
            let (near_m, far_m) = between(inner_m, inner_m + outwards * WALL_M);
            let piece = |name: &str, x_m: (f64, f64), z_m: (f64, f64)| {
                let name = format!("{side} wall {name}");
                wall(&name, [x_m.0, near_m, z_m.0], [x_m.1, far_m, z_m.1])
            };
            let door_m = self.door_m;
            bodies.push(piece("before the doorway", (0.0, door_m.0), (0.0, height_m)));
            bodies.push(piece("behind the doorway", (door_m.1, depth_m), (0.0, height_m)));
            bodies.push(piece("above the doorway", door_m, (DOOR_HEIGHT_M, height_m)));
            let (near_m, far_m) = between(outwards * outer_m, outwards * (outer_m + WALL_M));
            let name = format!("{side} corridor");
            bodies.push(wall(&name, [0.0, near_m, 0.0], [depth_m, far_m, height_m]));
        }
        bodies
    }

    /// The far wall, in four pieces where there is a hole in it.
    fn far_wall(&self, outer_m: f64) -> Vec<Body> {
        let (depth_m, height_m) = (self.depth_m, self.height_m);
        let piece = |name: &str, y_m: (f64, f64), z_m: (f64, f64)| {
            let (min_m, max_m) = ([depth_m, y_m.0, z_m.0], [depth_m + WALL_M, y_m.1, z_m.1]);
            Body::cuboid(name, min_m, max_m, with_pictures(self.walls))
        };
        let Some(Opening { y_m, z_m }) = self.opening else {
            return vec![piece("far wall", (-outer_m, outer_m), (0.0, height_m))];
        };
        let mut pieces = vec![
            piece("far wall right of the opening", (-outer_m, y_m.0), (0.0, height_m)),
            piece("far wall left of the opening", (y_m.1, outer_m), (0.0, height_m)),
            piece("far wall above the opening", y_m, (z_m.1, height_m)),
        ];
        if z_m.0 > 0.0 {
            pieces.push(piece("far wall below the opening", y_m, (0.0, z_m.0)));
        }
        pieces
    }
}

/// The same material with pictures on it.
pub(crate) fn with_pictures(material: Material) -> Material {
    let paint = material.visible_paint();
    let texture = Texture::Posters { spacing_m: 0.8, share: 0.55 };
    material.painted(Paint { texture, grain: paint.grain.max(0.05), ..paint })
}

/// The same material as a floor of wooden boards, as bright as it is.
pub(crate) fn boarded(material: Material) -> Material {
    const WOOD: [f64; 3] = [0.62, 0.42, 0.24];
    let shade = material.reflectivity;
    let size_m = [1.2, 0.14];
    let texture = Texture::Boards { size_m, joint_m: 0.003, contrast: 0.2, staggered: true };
    material.painted(Paint::with(WOOD.map(|channel| channel * shade), texture, 0.1))
}
