//! Scenarios for experiments: a scene of Table 2, what crosses it, and how the platform moves.
//!
//! The seed of a scenario varies the noise of the sensors and also what no two runs of an experiment have in
//! common: from which side an object comes, when, how fast (5 %), how far from its usual way, in which phase
//! of its gait, and the camera's phase beside the scanner's. So a median over ten seeds means something.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use crate::objects::{PERSON_SPEED_M_PER_S, ROBOT_SPEED_M_PER_S};
use crate::platform::SPEED_SHARE;
use crate::scenes::CROSSING_DEPTHS_M;
use crate::variation::{Quantity, Variation};
use crate::{
    Body, DoorTurn, MovingObject, PERSON_ID, Path, Platform, ROBOT_ID, Scenario, Scene, SceneName,
    Spline, Walker,
};

/// The label of the second person, where there is one.
pub const SECOND_PERSON_ID: u16 = 3;
/// The label of the door, where there is one.
pub const DOOR_ID: u16 = 4;
/// The label of the chair, where one is moved.
pub const CHAIR_ID: u16 = 5;
/// The label of the cart, where there is one.
pub const CART_ID: u16 = 6;

/// What crosses a scene.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum CrossingObject {
    /// The robot of Rec-HV 3.4.1, at 0.98 m/s.
    Robot,
    /// The person of Rec-HV 3.4.1, at 1.4 m/s.
    Person,
    /// A plain box of 0.6 x 0.5 x 1.4 m, at the robot's speed.
    Cart,
}

/// A way of Rec-HV Figure 2.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum PathName {
    /// Across, parallel to y.
    A,
    /// Across, with changing depth.
    B,
    /// Across, not straight.
    C,
    /// The sensors on a rail along x ([`Platform::Rail`]); the object crosses as in A.
    D,
    /// The sensors along x ([`Platform::Drive`]), the object perpendicular to them, as in A.
    E,
}

/// How long a scene is empty before anything sets out: a few windows of scans.
const LEAD_S: f64 = 1.0;
/// How long it is empty after all have arrived.
const TAIL_S: f64 = 1.0;
/// Objects set out at any moment of a turn of the scanner.
const START_SPREAD_S: f64 = 1.0 / 7.0;
/// The length of a scenario in which nothing crosses: about that of the others.
const EMPTY_S: f64 = 10.0;
/// Beside its usual way an object goes at most so far.
const OFFSET_M: f64 = 0.25;
/// Where ways have no room for that, so far.
const SMALL_OFFSET_M: f64 = 0.08;
/// The usual depths of the crossings, along x in the room: those of the demo.
const ROBOT_X_M: f64 = 2.4;
const PERSON_X_M: f64 = 2.9;
const CART_SIZE_M: [f64; 3] = [0.6, 0.5, 1.4];

/// A straight way across in one direction.
struct Crossing {
    from_x_m: f64,
    to_x_m: f64,
    speed_m_per_s: f64,
    start_s: f64,
    /// 1 for the way from left (positive y) to right, -1 for the other.
    side: f64,
}

impl Crossing {
    fn path(&self, waiting_y_m: f64) -> Path {
        let from_m = [self.from_x_m, self.side * waiting_y_m];
        let to_m = [self.to_x_m, -self.side * waiting_y_m];
        Path::straight(self.start_s, from_m, to_m, self.speed_m_per_s)
    }
}

impl CrossingObject {
    /// Its label.
    #[must_use]
    pub fn id(self) -> u16 {
        match self {
            Self::Robot => ROBOT_ID,
            Self::Person => PERSON_ID,
            Self::Cart => CART_ID,
        }
    }

    fn usual_speed_m_per_s(self) -> f64 {
        if self == Self::Person { PERSON_SPEED_M_PER_S } else { ROBOT_SPEED_M_PER_S }
    }

    fn crossing(self, seed: u64) -> Crossing {
        let variation = Variation::new(seed, self.id());
        let usual_x_m = if self == Self::Person { PERSON_X_M } else { ROBOT_X_M };
        let x_m = usual_x_m + OFFSET_M * variation.symmetric(Quantity::Offset);
        Crossing {
            from_x_m: x_m,
            to_x_m: x_m,
            speed_m_per_s: varied_speed(self.usual_speed_m_per_s(), &variation),
            start_s: LEAD_S + START_SPREAD_S * variation.unit(Quantity::Start),
            side: variation.side(Quantity::Direction),
        }
    }

    fn along(self, path: Path, seed: u64) -> MovingObject {
        match self {
            Self::Robot => MovingObject::robot(ROBOT_ID, path),
            Self::Person => person(PERSON_ID, path, seed),
            Self::Cart => MovingObject::cart(CART_ID, CART_SIZE_M, path),
        }
    }
}

fn varied_speed(usual_m_per_s: f64, variation: &Variation) -> f64 {
    usual_m_per_s * (1.0 + SPEED_SHARE * variation.symmetric(Quantity::Speed))
}

/// A person from 1.6 to 1.9 m in any phase of the gait.
fn person(id: u16, path: Path, seed: u64) -> MovingObject {
    let variation = Variation::new(seed, id);
    let walker = Walker {
        gait_phase_rad: TAU * variation.unit(Quantity::GaitPhase),
        ..Walker::of_height(1.75 + 0.15 * variation.symmetric(Quantity::Height))
    };
    MovingObject::person(id, walker, path)
}

/// The way of an object through a scene.
fn way(scene: SceneName, object: CrossingObject, path: PathName, seed: u64) -> Path {
    let waiting_y_m = scene.waiting_y_m();
    let usual = object.crossing(seed);
    let (nearest_m, farthest_m) = CROSSING_DEPTHS_M;
    match path {
        PathName::A | PathName::D | PathName::E => usual.path(waiting_y_m),
        PathName::B => {
            // From near to far or from far to near, as far as the doorways are wide.
            let shift_m =
                SMALL_OFFSET_M * Variation::new(seed, object.id()).symmetric(Quantity::Offset);
            let (near_m, far_m) =
                (nearest_m + SMALL_OFFSET_M + shift_m, farthest_m - SMALL_OFFSET_M + shift_m);
            let nears = Variation::new(seed, object.id()).side(Quantity::Height) > 0.0;
            let (from_x_m, to_x_m) = if nears { (far_m, near_m) } else { (near_m, far_m) };
            Crossing { from_x_m, to_x_m, ..usual }.path(waiting_y_m)
        }
        PathName::C => {
            let shift_m =
                SMALL_OFFSET_M * Variation::new(seed, object.id()).symmetric(Quantity::Offset);
            // Nowhere does it turn back: it goes on towards the other side all the way.
            let places_m = [(2.5, 1.0), (3.15, 0.45), (2.4, -0.02), (3.1, -0.4), (2.8, -1.0)];
            let through_m =
                places_m.map(|(x_m, share)| [x_m + shift_m, usual.side * share * waiting_y_m]);
            Spline::new(usual.start_s, &through_m, usual.speed_m_per_s).path()
        }
    }
}

impl Scenario {
    /// A scene of Table 2 in which nothing moves.
    #[must_use]
    pub fn empty(scene: SceneName, seed: u64) -> Self {
        Self::with_objects(format!("{scene}, empty"), scene, seed, Vec::new())
    }

    /// An object crosses a scene, from out of sight to out of sight.
    #[must_use]
    pub fn crossing(scene: SceneName, object: CrossingObject, path: PathName, seed: u64) -> Self {
        let moving = object.along(way(scene, object, path, seed), seed);
        let name = format!("{scene}, {} on path {path:?}", moving.name);
        let scenario = Self::with_objects(name, scene, seed, vec![moving]);
        match path {
            PathName::A | PathName::B | PathName::C => scenario,
            PathName::D => scenario.with_platform(Platform::Rail),
            PathName::E => scenario.with_platform(Platform::Drive),
        }
    }

    /// A robot, and two persons who come from the other side, one after the other, each farther away than the one
    /// before: the first meets the robot in the middle of the view, the second a moment later. (Side by side
    /// with the robot a person at twice its distance would stay in the shadow of its screen.)
    #[must_use]
    pub fn three_crossing(scene: SceneName, seed: u64) -> Self {
        /// Each is at the middle so much earlier or later.
        const MEETING_SPREAD_S: f64 = 0.2;
        /// So much later comes the second person: an arm's length and more between the two, as they are seen.
        const FOLLOWS_S: f64 = 1.1;
        let waiting_y_m = scene.waiting_y_m();
        let meeting_s =
            LEAD_S + MEETING_SPREAD_S + waiting_y_m / (ROBOT_SPEED_M_PER_S * (1.0 - SPEED_SHARE));
        let side = Variation::new(seed, Variation::PLATFORM).side(Quantity::Direction);
        let path = |id: u16, x_m: f64, usual_m_per_s: f64, later_s: f64, side: f64| {
            let variation = Variation::new(seed, id);
            let x_m = x_m + SMALL_OFFSET_M * variation.symmetric(Quantity::Offset);
            let speed_m_per_s = varied_speed(usual_m_per_s, &variation);
            let meeting_s =
                meeting_s + later_s + MEETING_SPREAD_S * variation.symmetric(Quantity::Start);
            let start_s = meeting_s - waiting_y_m / speed_m_per_s;
            Crossing { from_x_m: x_m, to_x_m: x_m, speed_m_per_s, start_s, side }.path(waiting_y_m)
        };
        let objects = vec![
            MovingObject::robot(ROBOT_ID, path(ROBOT_ID, 2.15, ROBOT_SPEED_M_PER_S, 0.0, side)),
            person(PERSON_ID, path(PERSON_ID, 2.75, PERSON_SPEED_M_PER_S, 0.0, -side), seed),
            person(
                SECOND_PERSON_ID,
                path(SECOND_PERSON_ID, 3.3, PERSON_SPEED_M_PER_S, FOLLOWS_S, -side),
                seed,
            ),
        ];
        Self::with_objects(format!("{scene}, three crossing"), scene, seed, objects)
    }

    /// A person crosses, and rests for `pause_s` in the middle of the view before going on.
    #[must_use]
    pub fn pausing(scene: SceneName, pause_s: f64, seed: u64) -> Self {
        /// It rests so far from the middle at most: well within the camera's view.
        const MIDDLE_M: f64 = 0.5;
        let crossing = CrossingObject::Person.crossing(seed);
        let variation = Variation::new(seed, PERSON_ID);
        let rest_m = scene.waiting_y_m() + MIDDLE_M * variation.symmetric(Quantity::PlaceOfPause);
        let rest_s = crossing.start_s + rest_m / crossing.speed_m_per_s;
        let path = crossing.path(scene.waiting_y_m()).pausing(rest_s, pause_s);
        let name = format!("{scene}, person pausing {pause_s} s");
        Self::with_objects(name, scene, seed, vec![person(PERSON_ID, path, seed)])
    }

    /// The platform goes through the rear of the room while a person crosses (Rec-HV experiment 11).
    #[must_use]
    pub fn touring(scene: SceneName, seed: u64) -> Self {
        let name = format!("{scene}, touring");
        let crossing = Self::crossing(scene, CrossingObject::Person, PathName::A, seed);
        Self { name, ..crossing }.with_platform(Platform::Tour)
    }

    /// A person comes to a cupboard, opens its door, rests, and goes on; the door stays open. The cupboard stands
    /// left of the middle, before whatever the scene has there.
    #[must_use]
    pub fn opening_door(scene: SceneName, seed: u64) -> Self {
        const REST_S: f64 = 3.0;
        let variation = Variation::new(seed, PERSON_ID);
        let waiting_y_m = scene.waiting_y_m();
        let at_door_m = [3.15, 1.65];
        let way = Spline::new(
            LEAD_S + START_SPREAD_S * variation.unit(Quantity::Start),
            &[[3.0, waiting_y_m], at_door_m, [2.3, 0.6], [2.2, -0.5], [2.4, -waiting_y_m]],
            varied_speed(PERSON_SPEED_M_PER_S, &variation),
        )
        .path();
        let arrival_s = time_at(&way, at_door_m);
        let turn = DoorTurn {
            start_s: arrival_s + 0.5,
            duration_s: 2.0,
            from_yaw_rad: FRAC_PI_2,
            to_yaw_rad: PI,
        };
        let objects = vec![
            person(PERSON_ID, way.pausing(arrival_s, REST_S), seed),
            MovingObject::door(DOOR_ID, [3.6, 0.4], 0.8, turn),
        ];
        let name = format!("{scene}, opening a door");
        let mut scenario = Self::with_objects(name, scene, seed, objects);
        scenario.scene.bodies.extend(cupboard());
        scenario
    }

    /// A person pushes a chair 0.9 m aside and goes on; the chair stays where it was pushed to.
    #[must_use]
    pub fn moving_chair(scene: SceneName, seed: u64) -> Self {
        /// Half of the usual: it is pushed.
        const SPEED_M_PER_S: f64 = PERSON_SPEED_M_PER_S / 2.0;
        /// How far the person is behind the chair.
        const REACH_M: f64 = 0.55;
        let variation = Variation::new(seed, PERSON_ID);
        let waiting_y_m = scene.waiting_y_m();
        let (chair_x_m, from_y_m, to_y_m) = (3.0, 0.3, -0.6);
        let [meets_m, leaves_m] = [from_y_m, to_y_m].map(|y_m| [chair_x_m, y_m + REACH_M]);
        let way = Spline::new(
            LEAD_S + START_SPREAD_S * variation.unit(Quantity::Start),
            &[[chair_x_m, waiting_y_m], meets_m, leaves_m, [2.2, -0.6], [2.4, -waiting_y_m]],
            varied_speed(SPEED_M_PER_S, &variation),
        )
        .path();
        let (from_s, to_s) = (time_at(&way, meets_m), time_at(&way, leaves_m));
        let speed_m_per_s = (from_y_m - to_y_m) / (to_s - from_s);
        let pushed =
            Path::straight(from_s, [chair_x_m, from_y_m], [chair_x_m, to_y_m], speed_m_per_s);
        let objects = vec![person(PERSON_ID, way, seed), MovingObject::chair(CHAIR_ID, pushed)];
        Self::with_objects(format!("{scene}, moving a chair"), scene, seed, objects)
    }

    /// With another motion of the platform, over as long as the scenario lasts.
    #[must_use]
    pub fn with_platform(mut self, platform: Platform) -> Self {
        self.rig.path = platform.path(self.duration_s, self.seed);
        self
    }

    fn with_objects(name: String, scene: SceneName, seed: u64, objects: Vec<MovingObject>) -> Self {
        let arrival_s = objects.iter().map(|object| object.path.end_s()).fold(0.0, f64::max);
        let duration_s = if objects.is_empty() { EMPTY_S } else { arrival_s + TAIL_S };
        let scene = Scene { objects, ..Scene::of_table_2(scene) };
        let mut scenario = Self { name, seed, duration_s, scene, ..Self::default() };
        let camera = &mut scenario.rig.depth_camera;
        let variation = Variation::new(seed, Variation::PLATFORM);
        camera.first_image_s = variation.unit(Quantity::ImagePhase) / camera.rate_hz;
        scenario
    }
}

/// When a way comes to a place, in seconds since the start.
fn time_at(path: &Path, place_m: [f64; 2]) -> f64 {
    let distance_m = |pose: &[f64; 6]| (pose[0] - place_m[0]).hypot(pose[1] - place_m[1]);
    path.waypoints
        .iter()
        .min_by(|a, b| distance_m(&a.pose).total_cmp(&distance_m(&b.pose)))
        .map_or(0.0, |waypoint| waypoint.time_s)
}

/// A cupboard without its door, which closes it at x = 3.6 m, from y = 0.4 to 1.2 m.
fn cupboard() -> Vec<Body> {
    use crate::Material;
    let (front_m, rear_m, right_m, left_m, top_m) = (3.62, 4.05, 0.38, 1.22, 1.92);
    let wall = |name: &str, min_m, max_m| Body::cuboid(name, min_m, max_m, Material::WOOD);
    vec![
        wall("cupboard side", [front_m, right_m, 0.0], [rear_m, right_m + 0.02, top_m]),
        wall("cupboard side", [front_m, left_m - 0.02, 0.0], [rear_m, left_m, top_m]),
        wall("cupboard back", [rear_m - 0.02, right_m, 0.0], [rear_m, left_m, top_m]),
        wall("cupboard top", [front_m, right_m, top_m - 0.02], [rear_m, left_m, top_m]),
        wall("cupboard shelf", [front_m + 0.05, right_m, 0.98], [rear_m, left_m, 1.0]),
    ]
}

#[cfg(test)]
mod tests;
