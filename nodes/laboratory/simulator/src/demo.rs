//! The built-in scenarios.

mod flat;

use crate::objects::{PERSON_SPEED_M_PER_S, ROBOT_SPEED_M_PER_S};
use crate::room::{DEPTH_M, HEIGHT_M, WIDTH_M, furnished_room};
use crate::scenario::START;
use crate::{Lighting, MovingObject, Path, Rig, Scenario, Scene, Walker};

/// The label of the robot in the built-in scenarios.
pub const ROBOT_ID: u16 = 1;
/// The label of the person in the built-in scenarios.
pub const PERSON_ID: u16 = 2;

/// The depths of the crossings in the room of the rig of [`Rig::default`]: 1.9 and 2.4 m in front of the camera.
const ROBOT_PATH_X_M: f64 = 2.4;
const PERSON_PATH_X_M: f64 = 2.9;
/// Objects start and stop in the doorways, outside the scanner's forward quarter and the camera's view.
const WAITING_Y_M: f64 = WIDTH_M / 2.0 - 0.1;

impl Scenario {
    /// A furnished room seen by a Kinect v1 and an RPLIDAR A1 that stand still. The robot crosses from left to
    /// right (path A of Rec-HV Figure 2: across the view, parallel to y), then the person from right to
    /// left, each from outside the view to outside the view, with the room empty before, between and after.
    #[must_use]
    pub fn demo() -> Self {
        let robot = robot(2.0);
        let person = person(robot.path.end_s() + 1.5);
        Self {
            name: "demo".to_owned(),
            seed: 1,
            start: START,
            duration_s: person.path.end_s() + 1.95,
            scene: Scene {
                bodies: furnished_room(),
                objects: vec![robot, person],
                lighting: Lighting::of_room(DEPTH_M, WIDTH_M, HEIGHT_M),
            },
            rig: Rig::default(),
        }
    }

    /// The room of [`Scenario::demo`] for fast tests: depth images of 160 x 120 pixels, 8 seconds, and only
    /// the person crosses.
    #[must_use]
    pub fn small() -> Self {
        let demo = Self::demo().with_depth_size(160, 120).with_duration_s(8.0);
        let scene = Scene { objects: vec![person(1.5)], ..demo.scene };
        Self { name: "small".to_owned(), scene, ..demo }
    }
}

fn robot(start_s: f64) -> MovingObject {
    let from_m = [ROBOT_PATH_X_M, WAITING_Y_M];
    let to_m = [ROBOT_PATH_X_M, -WAITING_Y_M];
    MovingObject::robot(ROBOT_ID, Path::straight(start_s, from_m, to_m, ROBOT_SPEED_M_PER_S))
}

fn person(start_s: f64) -> MovingObject {
    let from_m = [PERSON_PATH_X_M, -WAITING_Y_M];
    let to_m = [PERSON_PATH_X_M, WAITING_Y_M];
    let path = Path::straight(start_s, from_m, to_m, PERSON_SPEED_M_PER_S);
    MovingObject::person(PERSON_ID, Walker::default(), path)
}

#[cfg(test)]
mod tests;
