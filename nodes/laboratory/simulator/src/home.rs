//! Flats for tests of maps of another day: the layout has a seed, the furniture another one, and the visit a third.

use std::f64::consts::TAU;

use estimation::Random;

use crate::scenes::{block, plant, post, sofa, table};
use crate::{Body, Material, Path, Scenario, Scene, Waypoint};

const HEIGHT_M: f64 = 2.6;
const DOOR_M: f64 = 0.9;
const DOOR_HEIGHT_M: f64 = 2.05;
/// The narrowest room.
const NARROWEST_M: f64 = 2.6;
/// Nothing stands so near to the middle of a door.
const BEFORE_DOOR_M: f64 = 1.0;
/// Between pieces of furniture.
const GAP_M: f64 = 0.1;
/// Between furniture and the camera: nearer by it would be blind.
const CAMERA_GAP_M: f64 = 0.55;
/// Attempts to find a place for a piece of furniture.
const ATTEMPTS: usize = 40;
/// Images of the camera come at the rate of a Kinect.
const PERIOD_S: f64 = 1.0 / 30.0;

/// An area on the floor: the least and the greatest x and y.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct FloorArea {
    /// The least x and y.
    pub least_m: [f64; 2],
    /// The greatest x and y.
    pub most_m: [f64; 2],
}

impl FloorArea {
    fn around([x_m, y_m]: [f64; 2], half_m: [f64; 2]) -> Self {
        Self {
            least_m: [x_m - half_m[0], y_m - half_m[1]],
            most_m: [x_m + half_m[0], y_m + half_m[1]],
        }
    }

    fn size_m(&self, axis: usize) -> f64 {
        self.most_m[axis] - self.least_m[axis]
    }

    fn wider(&self, by_m: f64) -> Self {
        Self {
            least_m: self.least_m.map(|side| side - by_m),
            most_m: self.most_m.map(|side| side + by_m),
        }
    }

    fn meets(&self, other: &Self) -> bool {
        (0..2).all(|axis| {
            self.least_m[axis] < other.most_m[axis] && other.least_m[axis] < self.most_m[axis]
        })
    }

    fn contains(&self, point_m: [f64; 2]) -> bool {
        self.meets(&Self { least_m: point_m, most_m: point_m })
    }
}

/// A piece of furniture.
#[derive(Clone, PartialEq, Debug)]
pub struct Piece {
    /// Its parts.
    pub bodies: Vec<Body>,
    /// What it takes up of the floor.
    pub area: FloorArea,
    /// The index of its room.
    pub room: usize,
}

/// A flat: a corridor with rooms of all sizes on both sides, the layout of which comes from a seed.
#[derive(Clone, PartialEq, Debug)]
pub struct Home {
    /// Floor, ceiling and walls.
    pub shell: Vec<Body>,
    /// The rooms; the first one is the corridor.
    pub rooms: Vec<FloorArea>,
    /// What stands in them.
    pub furniture: Vec<Piece>,
    /// The middles of the doors.
    doors_m: Vec<[f64; 2]>,
}

impl Home {
    /// An empty flat.
    #[must_use]
    pub fn new(layout_seed: u64) -> Self {
        let mut random = Random::new(layout_seed);
        let length_m = random.between(7.0, 12.0);
        let half_corridor_m = random.between(0.6, 0.95);
        let wall_m = random.between(0.1, 0.16);
        let corridor =
            FloorArea { least_m: [0.0, -half_corridor_m], most_m: [length_m, half_corridor_m] };
        let mut home = Self {
            shell: Vec::new(),
            rooms: vec![corridor],
            furniture: Vec::new(),
            doors_m: Vec::new(),
        };
        for side in [-1.0, 1.0] {
            let depth_m = random.between(2.8, 4.6);
            let near_m = side * (half_corridor_m + wall_m);
            let far_m = near_m + side * depth_m;
            let (low_m, high_m) = (near_m.min(far_m), near_m.max(far_m));
            let most = (length_m / (NARROWEST_M + wall_m)) as usize;
            let count = 1 + random.below(most.min(3));
            let spare_m = length_m - count as f64 * NARROWEST_M - (count - 1) as f64 * wall_m;
            let shares: Vec<f64> = (0..count).map(|_| random.between(0.2, 1.0)).collect();
            let all: f64 = shares.iter().sum();
            let mut from_m = 0.0;
            for (index, share) in shares.iter().enumerate() {
                let to_m = from_m + NARROWEST_M + spare_m * share / all;
                home.rooms.push(FloorArea { least_m: [from_m, low_m], most_m: [to_m, high_m] });
                let door_m = random.between(from_m + 0.7, to_m - 0.7);
                home.corridor_wall([from_m, to_m], door_m, [half_corridor_m * side, near_m]);
                if index + 1 < count {
                    home.wall([to_m, low_m], [to_m + wall_m, high_m], [0.0, HEIGHT_M]);
                    // The piece of the corridor's wall at the end of this one.
                    home.wall_between(
                        [to_m, to_m + wall_m],
                        [half_corridor_m * side, near_m],
                        [0.0, HEIGHT_M],
                    );
                }
                from_m = to_m + wall_m;
            }
            home.wall_between(
                [-wall_m, length_m + wall_m],
                [far_m, far_m + side * wall_m],
                [0.0, HEIGHT_M],
            );
            for end_m in [-wall_m, length_m] {
                home.wall_between([end_m, end_m + wall_m], [0.0, far_m], [0.0, HEIGHT_M]);
            }
        }
        let far_m = 8.0;
        home.wall([-wall_m, -far_m], [length_m + wall_m, far_m], [-0.1, 0.0]);
        home.wall([-wall_m, -far_m], [length_m + wall_m, far_m], [HEIGHT_M, HEIGHT_M + 0.1]);
        home
    }

    fn wall(&mut self, least_m: [f64; 2], most_m: [f64; 2], z_m: [f64; 2]) {
        let (min_m, max_m) = ([least_m[0], least_m[1], z_m[0]], [most_m[0], most_m[1], z_m[1]]);
        self.shell.push(Body::cuboid("wall", min_m, max_m, Material::PLASTER));
    }

    fn wall_between(&mut self, x_m: [f64; 2], y_m: [f64; 2], z_m: [f64; 2]) {
        self.wall([x_m[0], y_m[0].min(y_m[1])], [x_m[1], y_m[0].max(y_m[1])], z_m);
    }

    fn corridor_wall(&mut self, [from_m, to_m]: [f64; 2], door_m: f64, y_m: [f64; 2]) {
        self.wall_between([from_m, door_m - DOOR_M / 2.0], y_m, [0.0, HEIGHT_M]);
        self.wall_between([door_m + DOOR_M / 2.0, to_m], y_m, [0.0, HEIGHT_M]);
        self.wall_between(
            [door_m - DOOR_M / 2.0, door_m + DOOR_M / 2.0],
            y_m,
            [DOOR_HEIGHT_M, HEIGHT_M],
        );
        self.doors_m.push([door_m, f64::midpoint(y_m[0], y_m[1])]);
    }

    /// The same flat with furniture, which a seed decides: three to six pieces in each room.
    #[must_use]
    pub fn furnished(&self, seed: u64) -> Self {
        let mut home = Self { furniture: Vec::new(), ..self.clone() };
        let mut random = Random::new(seed);
        for room in 1..home.rooms.len() {
            for _ in 0..3 + random.below(4) {
                home.add_piece(room, &mut random);
            }
        }
        home
    }

    /// The same flat after a part of its furniture was taken to another place of its room, was taken away, or came in new. About
    /// `share` of the pieces are concerned.
    #[must_use]
    pub fn rearranged(&self, seed: u64, share: f64) -> Self {
        let mut random = Random::new(seed);
        let (stays, goes): (Vec<_>, Vec<_>) =
            self.furniture.iter().cloned().partition(|_| random.uniform() >= share);
        let mut home = Self { furniture: stays, ..self.clone() };
        for piece in &goes {
            // Half of those that go come back as something else, in another place.
            if random.uniform() < 0.7 {
                home.add_piece_clear_of(piece.room, &goes, &mut random);
            }
        }
        home
    }

    fn add_piece(&mut self, room: usize, random: &mut Random) {
        self.add_piece_clear_of(room, &[], random);
    }

    /// A piece along a wall, or now and then in the middle of the room. Where no place is found there is none.
    fn add_piece_clear_of(&mut self, room: usize, clear_of: &[Piece], random: &mut Random) {
        let Some(area) = self.rooms.get(room).copied() else { return };
        for _ in 0..ATTEMPTS {
            let kind = random.below(6);
            let is_along_x = random.uniform() < 0.5;
            let size_m = match kind {
                0 => [random.between(0.3, 0.6), random.between(0.6, 1.6)],
                1 => [random.between(0.6, 0.9), random.between(0.8, 1.4)],
                2 => [0.8, random.between(1.2, 1.9)],
                3 => [0.5, 0.5],
                4 => [random.between(0.9, 1.4), 2.0],
                _ => [random.between(0.3, 0.6), random.between(0.3, 0.6)],
            };
            // A sofa faces along x.
            let is_turned = is_along_x && kind != 2;
            let half_m = if is_turned {
                [size_m[1] / 2.0, size_m[0] / 2.0]
            } else {
                [size_m[0] / 2.0, size_m[1] / 2.0]
            };
            if (0..2).any(|axis| area.size_m(axis) < 2.0 * half_m[axis] + 0.1) {
                continue;
            }
            let along = |axis: usize, random: &mut Random| {
                random.between(
                    area.least_m[axis] + half_m[axis] + 0.02,
                    area.most_m[axis] - half_m[axis] - 0.02,
                )
            };
            let mut place_m = [along(0, random), along(1, random)];
            // With its back to a wall.
            if random.uniform() < 0.8 {
                let axis = usize::from(is_turned);
                place_m[axis] = if random.uniform() < 0.5 {
                    area.least_m[axis] + half_m[axis] + 0.02
                } else {
                    area.most_m[axis] - half_m[axis] - 0.02
                };
            }
            let taken = FloorArea::around(place_m, half_m);
            let before_door =
                |door_m: &[f64; 2]| FloorArea::around(*door_m, [BEFORE_DOOR_M; 2]).meets(&taken);
            let is_taken = |piece: &Piece| piece.area.wider(GAP_M).meets(&taken);
            if self.doors_m.iter().any(before_door)
                || self.furniture.iter().chain(clear_of).any(is_taken)
            {
                continue;
            }
            let bodies = bodies(kind, place_m, half_m.map(|half_m| 2.0 * half_m), random);
            self.furniture.push(Piece { bodies, area: taken, room });
            return;
        }
    }

    /// The scene of the flat.
    #[must_use]
    pub fn scene(&self) -> Scene {
        let furniture = self.furniture.iter().flat_map(|piece| &piece.bodies);
        Scene { bodies: self.shell.iter().chain(furniture).cloned().collect(), ..Scene::default() }
    }

    /// A visit of some rooms with a depth camera in the hand: from each of some places it looks all around, once ahead and down and
    /// once up. The map begins at one of them, with a heading by chance and not quite level.
    #[must_use]
    pub fn visit(&self, rooms: &[usize], seed: u64) -> Scenario {
        const DIRECTIONS: usize = 9;
        const PITCHES_RAD: [f64; 2] = [0.3, -0.2];
        let mut random = Random::new(seed);
        let mut poses = Vec::new();
        for room in rooms {
            for [x_m, y_m] in self.places(*room, &mut random) {
                let first_rad = random.between(0.0, TAU);
                for pitch_rad in PITCHES_RAD {
                    for direction in 0..DIRECTIONS {
                        let yaw_rad = first_rad + TAU * direction as f64 / DIRECTIONS as f64;
                        let wobble = |random: &mut Random| random.between(-0.05, 0.05);
                        let height_m = 1.25 + wobble(&mut random);
                        let (pitch_rad, roll_rad) =
                            (pitch_rad + wobble(&mut random), wobble(&mut random));
                        poses.push([x_m, y_m, height_m, yaw_rad, pitch_rad, roll_rad]);
                    }
                }
            }
        }
        if let Some(first) = poses.first_mut() {
            let tilt = |random: &mut Random| random.between(-0.035, 0.035);
            (first[4], first[5]) = (tilt(&mut random), tilt(&mut random));
        }
        let duration_s = poses.len() as f64 * PERIOD_S;
        let at = |(index, pose)| Waypoint { time_s: index as f64 * PERIOD_S, pose };
        let waypoints = poses.into_iter().enumerate().map(at).collect();
        let mut scenario = Scenario {
            name: "home".to_owned(),
            seed,
            duration_s,
            scene: self.scene(),
            ..Scenario::default()
        };
        scenario.rig.path = Path { waypoints };
        scenario.rig.depth_camera.first_image_s = 0.0;
        scenario
    }

    /// Places of the camera in a room, clear of walls and furniture: two far from each other, in a corridor one every two metres.
    fn places(&self, room: usize, random: &mut Random) -> Vec<[f64; 2]> {
        let Some(area) = self.rooms.get(room) else { return Vec::new() };
        let middle_m = [0, 1].map(|axis| f64::midpoint(area.least_m[axis], area.most_m[axis]));
        if room == 0 {
            let count = (area.size_m(0) / 2.0).round().max(1.0);
            let step_m = area.size_m(0) / count;
            return (0..count as usize)
                .map(|index| {
                    [
                        area.least_m[0] + (index as f64 + 0.5) * step_m + random.between(-0.2, 0.2),
                        middle_m[1],
                    ]
                })
                .collect();
        }
        let is_clear = |place_m: &[f64; 2]| {
            self.furniture.iter().all(|piece| !piece.area.wider(CAMERA_GAP_M).contains(*place_m))
        };
        let inner = area.wider(-0.6);
        let mut any = || {
            [0, 1].map(|axis| {
                random.between(
                    inner.least_m[axis],
                    inner.most_m[axis].max(inner.least_m[axis] + 0.01),
                )
            })
        };
        let free: Vec<[f64; 2]> = (0..60).map(|_| any()).filter(is_clear).collect();
        let Some(first) = free.first().copied() else { return vec![middle_m] };
        let apart_m = |place: &[f64; 2]| (place[0] - first[0]).hypot(place[1] - first[1]);
        let second = free.iter().copied().max_by(|a, b| apart_m(a).total_cmp(&apart_m(b)));
        std::iter::once(first).chain(second.filter(|place| apart_m(place) > 1.0)).collect()
    }
}

/// The parts of a piece of furniture of a kind.
fn bodies(kind: usize, place_m: [f64; 2], size_m: [f64; 2], random: &mut Random) -> Vec<Body> {
    match kind {
        0 => vec![block(
            "cabinet",
            place_m,
            0.0,
            (0.0, random.between(0.8, 2.0)),
            size_m,
            Material::VARNISH,
        )],
        1 => {
            let mut desk = table(place_m, size_m, 0.74, Material::WOOD);
            desk.push(block("box", place_m, 0.0, (0.74, 1.05), [0.3, 0.4], Material::CARD));
            desk
        }
        2 => sofa([0.0, 0.0], size_m[1], Material::CLOTH)
            .into_iter()
            .map(|mut body| {
                body.pose[0] += place_m[0];
                body.pose[1] += place_m[1];
                body
            })
            .collect(),
        3 => plant(place_m),
        4 => vec![block("bed", place_m, 0.0, (0.0, 0.5), size_m, Material::CLOTH)],
        _ => {
            let height_m = random.between(0.5, 1.3);
            vec![
                block("chest", place_m, 0.0, (0.0, height_m), size_m, Material::WOOD),
                post("lamp", place_m, 0.08, (height_m, height_m + 0.4), Material::CARD),
            ]
        }
    }
}
