//! The scenarios that come with the suite.

use std::f64::consts::FRAC_PI_2;

use geometry::Stamp;

use crate::room::{WIDTH_M, furnished_room};
use crate::{
    Body, DepthCamera, Figure, Lidar, Material, MovingObject, Path, PoseSource, Rig, Scenario,
    Scene, Shape, Walker,
};

/// The label of the robot in the scenarios that come with the suite.
pub const ROBOT_ID: u16 = 1;
/// The label of the person in the scenarios that come with the suite.
pub const PERSON_ID: u16 = 2;

/// The speeds of Rec-HV 3.4.1.
const ROBOT_SPEED_M_PER_S: f64 = 0.98;
const PERSON_SPEED_M_PER_S: f64 = 1.4;
/// Where the crossings lie in the room: 1.9 and 2.4 m in front of the camera.
const ROBOT_PATH_X_M: f64 = 2.4;
const PERSON_PATH_X_M: f64 = 2.9;
/// Objects wait in the doorways, outside the scanner's forward quarter and the camera's view.
const WAITING_Y_M: f64 = WIDTH_M / 2.0 - 0.1;
/// The rig stands in the middle, half a metre before the rear wall; the camera at 120 cm and the scanner at
/// 115 cm, the third mounting of Rec-HV 3.4.2. The floor comes into view at 2.8 m, behind both paths.
const RIG_POSE: [f64; 6] = [0.5, 0.0, 1.2, 0.0, 0.0, 0.0];

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
            start: Stamp::from_secs_nanos(1_700_000_000, 0),
            duration_s: person.path.end_s() + 1.95,
            scene: Scene { bodies: furnished_room(), objects: vec![robot, person] },
            rig: Rig {
                path: Path::still(RIG_POSE),
                lidar: Lidar::rplidar_a1(),
                depth_camera: DepthCamera::kinect_v1(),
                pose_source: PoseSource::default(),
            },
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

/// A robot with the speed and the screen of 0.64 x 0.27 m of Rec-HV 3.4.1. The thesis drives it low, past
/// sensors at ankle height; here the screen stands on a mast, so that one mounting sees robot and person.
fn robot(start_s: f64) -> MovingObject {
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
    let from_m = [ROBOT_PATH_X_M, WAITING_Y_M];
    let to_m = [ROBOT_PATH_X_M, -WAITING_Y_M];
    MovingObject {
        id: ROBOT_ID,
        name: "robot".to_owned(),
        figure: Figure::Rigid(bodies),
        path: Path::straight(start_s, from_m, to_m, ROBOT_SPEED_M_PER_S),
    }
}

fn person(start_s: f64) -> MovingObject {
    let from_m = [PERSON_PATH_X_M, -WAITING_Y_M];
    let to_m = [PERSON_PATH_X_M, WAITING_Y_M];
    MovingObject {
        id: PERSON_ID,
        name: "person".to_owned(),
        figure: Figure::Walker(Walker::default()),
        path: Path::straight(start_s, from_m, to_m, PERSON_SPEED_M_PER_S),
    }
}

#[cfg(test)]
mod tests;
