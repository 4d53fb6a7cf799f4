//! Scenarios for experiments: a scene of Table 2, the moving objects, and the motion of the platform.
//!
//! The seed of a scenario varies the noise of the sensors and also everything that differs between two real runs of an
//! experiment: from which side an object comes, when, its speed (5 %), its offset from the nominal path, the phase of
//! its gait, and the phase of the camera relative to the scanner. So a median over ten seeds is meaningful.

mod crossing;

use std::f64::consts::{FRAC_PI_2, PI};

use crate::objects::{PERSON_SPEED_M_PER_S, ROBOT_SPEED_M_PER_S};
use crate::platform::SPEED_SHARE;
use crate::variation::{Quantity, Variation};
use crate::{
    Body, DoorTurn, MovingObject, PERSON_ID, Path, Platform, ROBOT_ID, Scenario, Scene, SceneName,
    Spline,
};
use crossing::{Crossing, SMALL_OFFSET_M, person, varied_speed, way};
pub use crossing::{CrossingObject, PathName};

/// The label of the second person, if there is one.
pub const SECOND_PERSON_ID: u16 = 3;
/// The label of the door, if there is one.
pub const DOOR_ID: u16 = 4;
/// The label of the chair, if one is moved.
pub const CHAIR_ID: u16 = 5;
/// The label of the cart, if there is one.
pub const CART_ID: u16 = 6;

/// How long a scene is empty before the first object starts: a few windows of scans.
const LEAD_S: f64 = 1.0;
/// How long it is empty after the last object has arrived.
const TAIL_S: f64 = 1.0;
/// Objects start at any moment of a revolution of the scanner.
const START_SPREAD_S: f64 = 1.0 / 7.0;
/// The length of a scenario without objects: about that of the others.
const EMPTY_S: f64 = 10.0;
impl Scenario {
    /// A scene of Table 2 without moving objects.
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
        /// How much earlier or later each is at the middle.
        const MEETING_SPREAD_S: f64 = 0.2;
        /// The delay of the second person: more than an arm's length between the two in the image.
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
        /// The largest distance of the stop from the middle: well within the camera's view.
        const MIDDLE_M: f64 = 0.5;
        let crossing = CrossingObject::Person.crossing(seed);
        let variation = Variation::new(seed, PERSON_ID);
        let rest_m = scene.waiting_y_m() + MIDDLE_M * variation.symmetric(Quantity::PlaceOfPause);
        let rest_s = crossing.start_s + rest_m / crossing.speed_m_per_s;
        let path = crossing.path(scene.waiting_y_m()).pausing(rest_s, pause_s);
        let name = format!("{scene}, person pausing {pause_s} s");
        Self::with_objects(name, scene, seed, vec![person(PERSON_ID, path, seed)])
    }

    /// The platform drives through the rear of the room while a person crosses (Rec-HV experiment 11).
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
        /// Half of the usual speed, since it is pushed.
        const SPEED_M_PER_S: f64 = PERSON_SPEED_M_PER_S / 2.0;
        /// The distance of the person behind the chair.
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

    /// With another motion of the platform, for the length of the scenario.
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

/// When a path reaches a place, in seconds since the start.
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
