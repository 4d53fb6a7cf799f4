//! A drive through a flat while people walk in it: the demo with colours.

use std::f64::consts::{FRAC_PI_2, PI};

use super::PERSON_ID;
use crate::experiments::SECOND_PERSON_ID;
use crate::scenario::START;
use crate::slam::flat;
use crate::{
    ColourCamera, Material, MovingObject, Paint, Path, Rig, Scenario, Texture, Walker, Waypoint,
};

/// The label of the third person.
const THIRD_PERSON_ID: u16 = 7;
/// The speed of an indoor robot, and how fast it turns.
const DRIVE_M_PER_S: f64 = 0.8;
const TURN_RAD_PER_S: f64 = 1.0;
/// A turn is made of pieces of this length at most: half a turn at once has no direction.
const MOST_TURN_RAD: f64 = FRAC_PI_2;
/// The camera's height of [`Rig::default`].
const RIG_HEIGHT_M: f64 = 1.2;
/// Half the columns and rows of a Kinect, and half of its images: a second of it is simulated in less than a second.
const DEPTH_SIZE_PX: (usize, usize) = (320, 240);
const IMAGE_RATE_HZ: f64 = 15.0;
/// The furniture of the flat's rooms.
const FURNITURE_SEED: u64 = 3;
/// The doors of the first two rooms are on both sides of the corridor here, and those of the next two here.
const FIRST_DOORS_X_M: f64 = 2.25;
const SECOND_DOORS_X_M: f64 = 6.75;
const STROLL_M_PER_S: f64 = 0.9;

/// A part of a drive.
enum Leg {
    /// Straight to a place.
    To([f64; 2]),
    /// On the spot, to the left where it is positive.
    Turn(f64),
    Rest(f64),
}

impl Scenario {
    /// A furnished flat of six rooms along a corridor, of which a robot with a colour camera visits three in half a minute. Somebody
    /// walks in each of two rooms, and two persons meet it in the corridor.
    #[must_use]
    pub fn demo_flat() -> Self {
        let path = drive();
        let duration_s = path.end_s() + 0.5;
        let mut scene = flat::flat(FURNITURE_SEED);
        scene.objects = people(duration_s);
        let mut rig = Rig { path, colour_camera: Some(ColourCamera::default()), ..Rig::default() };
        rig.depth_camera.rate_hz = IMAGE_RATE_HZ;
        let name = "demo-flat".to_owned();
        Self { name, seed: 1, start: START, duration_s, scene, rig }
            .with_depth_size(DEPTH_SIZE_PX.0, DEPTH_SIZE_PX.1)
    }
}

fn drive() -> Path {
    let legs = [
        Leg::Rest(1.0),
        Leg::To([FIRST_DOORS_X_M, 0.0]),
        Leg::Turn(FRAC_PI_2),
        Leg::To([FIRST_DOORS_X_M, 2.3]),
        Leg::Turn(PI),
        Leg::To([FIRST_DOORS_X_M, -2.1]),
        Leg::Turn(PI),
        Leg::To([FIRST_DOORS_X_M, 0.0]),
        Leg::Turn(-FRAC_PI_2),
        Leg::To([SECOND_DOORS_X_M, 0.0]),
        Leg::Turn(FRAC_PI_2),
    ];
    let mut waypoint = Waypoint { time_s: 0.0, pose: [0.9, 0.0, RIG_HEIGHT_M, 0.0, 0.0, 0.0] };
    let mut waypoints = vec![waypoint];
    for leg in legs {
        match leg {
            Leg::To([x_m, y_m]) => {
                let length_m = (x_m - waypoint.pose[0]).hypot(y_m - waypoint.pose[1]);
                waypoint.time_s += length_m / DRIVE_M_PER_S;
                (waypoint.pose[0], waypoint.pose[1]) = (x_m, y_m);
                waypoints.push(waypoint);
            }
            Leg::Turn(turn_rad) => {
                let pieces = (turn_rad.abs() / MOST_TURN_RAD).ceil().max(1.0);
                for _ in 0..pieces as u32 {
                    waypoint.time_s += turn_rad.abs() / pieces / TURN_RAD_PER_S;
                    waypoint.pose[3] += turn_rad / pieces;
                    waypoints.push(waypoint);
                }
            }
            Leg::Rest(rest_s) => {
                waypoint.time_s += rest_s;
                waypoints.push(waypoint);
            }
        }
    }
    Path { waypoints }
}

fn people(end_s: f64) -> Vec<MovingObject> {
    let clothes = |colour: [f64; 3]| {
        Material::CLOTH.painted(Paint::with(
            colour,
            Texture::Noise { size_m: 0.25, contrast: 0.4 },
            0.2,
        ))
    };
    let dressed =
        |height_m: f64, colour| Walker { clothes: clothes(colour), ..Walker::of_height(height_m) };
    // Through the corridor towards the robot, and before it into the second room, where it walks up and down.
    let mut first = walk(0.0, &[[7.6, -0.35], [2.9, -0.35], [2.3, -1.1], [1.7, -3.0]]);
    pace(&mut first, [1.5, -3.6], [3.0, -3.5], end_s);
    // Up and down in the first room.
    let mut second = walk(0.5, &[[3.2, 3.9], [1.4, 3.8]]);
    pace(&mut second, [3.1, 3.6], [1.4, 3.8], end_s);
    // Out of the fourth room and past the robot when it comes along the corridor.
    let third = walk(20.5, &[[6.6, -2.6], [6.7, -0.9], [6.2, -0.5], [0.8, -0.5]]);
    let person = |id, name: &str, walker, path| MovingObject {
        name: format!("{name} person"),
        ..MovingObject::person(id, walker, path)
    };
    vec![
        person(PERSON_ID, "first", dressed(1.75, [0.1, 0.15, 0.32]), first),
        person(SECOND_PERSON_ID, "second", dressed(1.68, [0.32, 0.06, 0.08]), second),
        person(THIRD_PERSON_ID, "third", dressed(1.85, [0.05, 0.25, 0.16]), third),
    ]
}

/// From place to place, facing forward.
fn walk(start_s: f64, places_m: &[[f64; 2]]) -> Path {
    let mut path = Path { waypoints: Vec::new() };
    let mut start_s = start_s;
    for pair in places_m.windows(2) {
        let leg = Path::straight(start_s, pair[0], pair[1], STROLL_M_PER_S);
        // A moment to turn: waypoints follow each other.
        start_s = leg.end_s() + 0.25;
        path.waypoints.extend(leg.waypoints);
    }
    path
}

/// On to a place, and then between it and another until the end.
fn pace(path: &mut Path, to_m: [f64; 2], and_m: [f64; 2], end_s: f64) {
    let mut ends = [to_m, and_m].into_iter().cycle();
    while path.end_s() < end_s {
        let (Some(last), Some(next)) = (path.waypoints.last(), ends.next()) else { return };
        let from_m = [last.pose[0], last.pose[1]];
        path.waypoints
            .extend(Path::straight(last.time_s + 0.4, from_m, next, STROLL_M_PER_S).waypoints);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The robot keeps clear of the people, so that none is within the blind range of its camera for long, and of the walls.
    #[test]
    fn nobody_walks_into_the_robot_and_it_drives_through_doors() {
        let scenario = Scenario::demo_flat();
        assert!((28.0..34.0).contains(&scenario.duration_s), "{} s", scenario.duration_s);
        for tenth in 0..(scenario.duration_s * 10.0) as u32 {
            let time_s = f64::from(tenth) / 10.0;
            let robot_m = scenario.rig.path.position_at(time_s);
            for person in &scenario.scene.objects {
                let apart = person.path.position_at(time_s) - robot_m;
                let apart_m = apart.x.hypot(apart.y);
                assert!(apart_m > 0.45, "{} at {time_s} s: {apart_m} m", person.id);
            }
            let in_corridor = robot_m.y.abs() < 0.85;
            let in_doorway = (robot_m.x - FIRST_DOORS_X_M).abs() < 0.2;
            assert!(in_corridor || in_doorway, "{robot_m} at {time_s} s");
        }
    }

    #[test]
    fn it_can_be_simulated() {
        assert!(Scenario::demo_flat().samples().is_ok());
    }
}
