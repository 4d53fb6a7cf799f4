//! The objects along a road round a block.

use crate::{Body, Material, Paint, Shape, Texture};

/// Half the width of the road.
const HALF_ROAD_M: f64 = 3.6;
/// The distance from the middle of the road to the houses.
const TO_HOUSES_M: f64 = 9.0;
/// Road, pavements and marks are stacked with small steps, so that none shows through another.
const ROAD_TOP_M: f64 = 0.0;
const GROUND_TOP_M: f64 = -0.03;
const PAVEMENT_TOP_M: f64 = 0.12;
const MARK_TOP_M: f64 = 0.006;

/// Asphalt is measured at grazing angles: to the angle at which it is 60 m away.
const ASPHALT: Material = Material::polished(0.16, 1.55).painted(Paint::with(
    [0.1, 0.1, 0.1],
    Texture::Noise { size_m: 0.6, contrast: 0.2 },
    0.3,
));
const GRASS: Material = Material::polished(0.4, 1.55).painted(Paint::with(
    [0.08, 0.2, 0.05],
    Texture::Noise { size_m: 0.8, contrast: 0.4 },
    0.4,
));
const PAVEMENT: Material = Material::polished(0.3, 1.55).painted(Paint::with(
    [0.35, 0.34, 0.32],
    Texture::Boards { size_m: [0.5, 0.5], joint_m: 0.01, contrast: 0.15, staggered: true },
    0.2,
));
/// Paint with glass beads in it.
const MARK: Material = Material::polished(0.95, 1.56).painted(Paint::plain([0.85, 0.85, 0.82]));

/// Pseudo-random numbers between 0 and 1.
fn scattered(index: usize, which: u32) -> f64 {
    /// The golden ratio's fraction: its multiples fill the unit interval evenly.
    const GOLDEN: f64 = 0.618_033_988_749_895;
    ((index as f64 + 1.0) * GOLDEN * f64::from(2 * which + 1)).fract()
}

/// The whole neighbourhood of a block with these corners, counter-clockwise.
pub(super) fn bodies(corners_m: &[[f64; 2]; 4]) -> Vec<Body> {
    /// How far the ground extends beyond the farthest corner.
    const BEYOND_M: f64 = 160.0;
    let far_m = corners_m.iter().flatten().copied().fold(0.0, f64::max) + BEYOND_M;
    let mut bodies =
        vec![Body::cuboid("ground", [-150.0, -150.0, -0.5], [far_m, far_m, GROUND_TOP_M], GRASS)];
    let next = corners_m.iter().cycle().skip(1);
    for (side, (from, to)) in corners_m.iter().zip(next).enumerate() {
        let street = Street::between(*from, *to);
        street.surface(&mut bodies);
        // The block's inner side is on the left.
        for (left, seed) in [(true, 2 * side), (false, 2 * side + 1)] {
            street.houses(left, 100 * seed, &mut bodies);
            street.parked_cars(left, 100 * seed + 40, &mut bodies);
            street.poles(left, &mut bodies);
        }
    }
    bodies
}

/// A straight piece of road.
struct Street {
    from_m: [f64; 2],
    yaw_rad: f64,
    length_m: f64,
}

impl Street {
    fn between(from_m: [f64; 2], to_m: [f64; 2]) -> Self {
        let (dx_m, dy_m) = (to_m[0] - from_m[0], to_m[1] - from_m[1]);
        Self { from_m, yaw_rad: dy_m.atan2(dx_m), length_m: dx_m.hypot(dy_m) }
    }

    /// A body at a position of the street: the distances along it and to the left of its middle.
    fn body(
        &self,
        name: &str,
        along_m: f64,
        left_m: f64,
        z_m: f64,
        shape: Shape,
        material: Material,
    ) -> Body {
        let (sin, cos) = self.yaw_rad.sin_cos();
        let x_m = self.from_m[0] + cos * along_m - sin * left_m;
        let y_m = self.from_m[1] + sin * along_m + cos * left_m;
        let pose = [x_m, y_m, z_m, self.yaw_rad, 0.0, 0.0];
        Body { name: name.to_owned(), shape, pose, material }
    }

    /// A cuboid between two heights.
    fn block(
        &self,
        name: &str,
        [along_m, left_m]: [f64; 2],
        z_m: (f64, f64),
        [length_m, width_m]: [f64; 2],
        material: Material,
    ) -> Body {
        let shape = Shape::Box { size_m: [length_m, width_m, z_m.1 - z_m.0] };
        self.body(name, along_m, left_m, f64::midpoint(z_m.0, z_m.1), shape, material)
    }

    /// Asphalt, pavements and lane marks.
    fn surface(&self, bodies: &mut Vec<Body>) {
        const DASH_M: f64 = 3.0;
        const DASH_EVERY_M: f64 = 9.0;
        const MARK_WIDTH_M: f64 = 0.15;
        let middle = self.length_m / 2.0;
        let paved_m = self.length_m + 2.0 * HALF_ROAD_M;
        let under = GROUND_TOP_M - 0.05;
        bodies.push(self.block(
            "road",
            [middle, 0.0],
            (under, ROAD_TOP_M),
            [paved_m, 2.0 * HALF_ROAD_M],
            ASPHALT,
        ));
        for side in [-1.0, 1.0] {
            let pavement_m = [middle, side * (HALF_ROAD_M + 1.0)];
            let length_m = self.length_m - 2.0 * HALF_ROAD_M;
            let z_m = (under, PAVEMENT_TOP_M);
            bodies.push(self.block("pavement", pavement_m, z_m, [length_m, 2.0], PAVEMENT));
            let edge_m = [middle, side * (HALF_ROAD_M - 0.3)];
            let z_m = (ROAD_TOP_M, MARK_TOP_M);
            bodies.push(self.block("edge line", edge_m, z_m, [length_m, MARK_WIDTH_M], MARK));
        }
        let dashes = ((self.length_m - 2.0 * HALF_ROAD_M) / DASH_EVERY_M) as u32;
        for dash in 0..dashes {
            let along_m = HALF_ROAD_M + (f64::from(dash) + 0.5) * DASH_EVERY_M;
            let z_m = (ROAD_TOP_M, MARK_TOP_M);
            bodies.push(self.block("dash", [along_m, 0.0], z_m, [DASH_M, MARK_WIDTH_M], MARK));
        }
    }

    fn houses(&self, left: bool, seed: usize, bodies: &mut Vec<Body>) {
        let side = if left { 1.0 } else { -1.0 };
        // Inside the block houses keep clear of the other streets.
        let (mut along_m, end_m) = if left {
            (TO_HOUSES_M, self.length_m - TO_HOUSES_M)
        } else {
            (-12.0, self.length_m + 12.0)
        };
        for index in seed.. {
            let length_m = 9.0 + 9.0 * scattered(index, 0);
            let gap_m = if scattered(index, 1) < 0.3 { 6.0 } else { 1.5 };
            if along_m + length_m > end_m {
                break;
            }
            let depth_m = 7.0 + 2.0 * scattered(index, 2);
            let set_back_m = 1.5 * scattered(index, 3);
            let height_m = 4.0 + 6.0 * scattered(index, 4);
            let left_m = side * (TO_HOUSES_M + set_back_m + depth_m / 2.0);
            let front_m = side * (TO_HOUSES_M + set_back_m - 0.05);
            let shade = 0.35 + 0.4 * scattered(index, 5);
            let wall = Material::matt(shade).painted(Paint::with(
                [shade, 0.85 * shade, 0.7 * shade],
                Texture::Boards {
                    size_m: [0.25, 0.08],
                    joint_m: 0.01,
                    contrast: 0.2,
                    staggered: true,
                },
                0.15,
            ));
            let middle_m = along_m + length_m / 2.0;
            let size_m = [length_m, depth_m];
            bodies.push(self.block("house", [middle_m, left_m], (-0.1, height_m), size_m, wall));
            // A door and windows are a little in front of the wall.
            let windows = (length_m / 2.5) as u32;
            for window in 0..windows {
                let window_m = along_m + 1.2 + 2.4 * f64::from(window);
                let z_m = if window == 1 { (0.0, 2.1) } else { (1.0, 2.3) };
                let material = if window == 1 { Material::WOOD } else { Material::BLACK_GLASS };
                bodies.push(self.block("window", [window_m, front_m], z_m, [1.1, 0.2], material));
            }
            along_m += length_m + gap_m;
        }
    }

    fn parked_cars(&self, left: bool, seed: usize, bodies: &mut Vec<Body>) {
        let side = if left { 1.0 } else { -1.0 };
        let mut along_m = 9.0;
        for index in seed.. {
            along_m += 5.2 + 14.0 * scattered(index, 6).powi(2);
            if along_m > self.length_m - 12.0 {
                break;
            }
            // Half on the pavement.
            let left_m = side * (HALF_ROAD_M + 0.5);
            let shade = 0.1 + 0.7 * scattered(index, 7);
            let colour = [shade, 0.2 + 0.4 * scattered(index, 8), 1.0 - shade];
            let paint = Material::polished(0.2 + 0.6 * shade, 1.2).painted(Paint::plain(colour));
            let height_m = 1.35 + 0.4 * scattered(index, 9);
            bodies.push(self.block("car", [along_m, left_m], (0.25, 0.85), [4.2, 1.75], paint));
            let cabin_m = [along_m - 0.2, left_m];
            bodies.push(self.block("cabin", cabin_m, (0.85, height_m), [2.2, 1.55], paint));
            for wheel in [-1.3, 1.3] {
                let size_m = [0.6, 1.7];
                let material = Material::DARK_PLASTIC;
                bodies.push(self.block(
                    "wheels",
                    [along_m + wheel, left_m],
                    (0.0, 0.6),
                    size_m,
                    material,
                ));
            }
        }
    }

    /// Lamp posts, and now and then a tree.
    fn poles(&self, left: bool, bodies: &mut Vec<Body>) {
        let side = if left { 1.0 } else { -1.0 };
        let metal = Material::matt(0.5);
        let count = ((self.length_m - 16.0) / 11.0) as u32;
        for pole in 0..count {
            let shift_m = if left { 0.0 } else { 5.0 };
            let along_m = 8.0 + shift_m + 11.0 * f64::from(pole);
            let left_m = side * (HALF_ROAD_M + 2.3);
            let upright = |radius_m: f64, height_m: f64| Shape::Cylinder { radius_m, height_m };
            if pole % 3 == 1 {
                let trunk = upright(0.16, 2.6);
                bodies.push(self.body("trunk", along_m, left_m, 1.3, trunk, Material::WOOD));
                for (dx_m, dz_m, radius_m) in [(0.0, 3.4, 1.3), (0.7, 2.9, 0.8), (-0.6, 4.2, 0.9)] {
                    let crown = Shape::Sphere { radius_m };
                    bodies.push(self.body(
                        "crown",
                        along_m + dx_m,
                        left_m,
                        dz_m,
                        crown,
                        Material::LEAVES,
                    ));
                }
            } else {
                bodies.push(self.body("pole", along_m, left_m, 2.75, upright(0.08, 5.5), metal));
            }
        }
    }
}
