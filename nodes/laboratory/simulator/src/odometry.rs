//! Scenarios for tests of odometry: ten rooms and paths, and the rail of Rec-HV's experiment 10.
//!
//! All have a registered colour camera and an IMU, and last about 20 s. The seed varies the noise of
//! the sensors, the tremor of the hand and, by centimetres, the path.

pub(crate) mod rooms;
pub(crate) mod ways;

use crate::objects::PERSON_SPEED_M_PER_S;
use crate::{
    ColourCamera, CrossingObject, Handheld, Imu, MovingObject, PERSON_ID, Path, PathName, Scenario,
    Scene, SceneName, Walker,
};

/// A scenario for odometry.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum OdometryRun {
    /// A furnished office; the camera moves along all axes, about half a metre, and hardly turns.
    Office,
    /// A cluttered desk at close range; the camera goes round it and looks down on it.
    Desk,
    /// The office; the camera stays where it is and turns about all axes, about z all the way round.
    Turning,
    /// The office; once round the room and back to the first pose.
    Loop,
    /// A large hall: most of it is out of the depth camera's reach.
    Hall,
    /// A bare corridor: only edges, and only doors to measure the motion along it.
    Corridor,
    /// A single wall with pictures: everything in view lies in a plane.
    Wall,
    /// The office in the dark: few electrons, much noise.
    LowLight,
    /// The office; fast turns, and images blurred by them.
    Blur,
    /// The office; a person walks back and forth before the camera at 1.4 m/s.
    Person,
    /// Rec-HV's experiment 10: the sensors go along x on a rail and back while the robot crosses scene B.
    Rail,
}

impl OdometryRun {
    /// All of them.
    pub const ALL: [Self; 11] = [
        Self::Office,
        Self::Desk,
        Self::Turning,
        Self::Loop,
        Self::Hall,
        Self::Corridor,
        Self::Wall,
        Self::LowLight,
        Self::Blur,
        Self::Person,
        Self::Rail,
    ];

    /// Its name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Office => "office",
            Self::Desk => "desk",
            Self::Turning => "turning",
            Self::Loop => "loop",
            Self::Hall => "hall",
            Self::Corridor => "corridor",
            Self::Wall => "wall",
            Self::LowLight => "low-light",
            Self::Blur => "blur",
            Self::Person => "person",
            Self::Rail => "rail",
        }
    }

    fn scene(self) -> Scene {
        match self {
            Self::Desk => rooms::desk(),
            Self::Hall => rooms::hall(),
            Self::Corridor => rooms::corridor(),
            Self::Wall => rooms::wall(),
            Self::Office
            | Self::Turning
            | Self::Loop
            | Self::LowLight
            | Self::Blur
            | Self::Person => rooms::office(),
            Self::Rail => Scene::of_table_2(SceneName::B),
        }
    }

    fn way(self, seed: u64) -> Handheld {
        match self {
            Self::Office | Self::LowLight | Self::Rail => ways::along_the_axes(seed),
            Self::Desk => ways::round_a_desk(seed),
            Self::Turning => ways::turning(seed),
            Self::Loop => ways::round_the_room(seed),
            Self::Hall => ways::through_a_hall(seed),
            Self::Corridor => ways::along_a_corridor(seed),
            Self::Wall => ways::along_a_wall(seed),
            Self::Blur => ways::shaking(seed),
            Self::Person => ways::looking_on(seed),
        }
    }

    fn colour_camera(self) -> ColourCamera {
        let usual = ColourCamera::default();
        match self {
            Self::LowLight => usual.in_low_light(),
            // Indoors such a camera exposes for 25 ms; the sub-exposures smooth edges as rays would.
            Self::Blur => ColourCamera { supersampling: 1, ..usual.with_motion_blur(0.025, 6) },
            _ => usual,
        }
    }
}

impl Scenario {
    /// A scenario for odometry.
    #[must_use]
    pub fn odometry(run: OdometryRun, seed: u64) -> Self {
        let mut scenario = if run == OdometryRun::Rail {
            Self::crossing(SceneName::B, CrossingObject::Robot, PathName::D, seed)
        } else {
            let path = run.way(seed).path();
            let duration_s = path.end_s() + TAIL_S;
            let mut scenario = Self { seed, duration_s, scene: run.scene(), ..Self::default() };
            scenario.rig.path = path;
            scenario
        };
        if run == OdometryRun::Person {
            scenario.scene.objects.push(person(scenario.duration_s));
        }
        run.name().clone_into(&mut scenario.name);
        scenario.rig.colour_camera = Some(run.colour_camera());
        scenario.rig.imu = Some(Imu::default());
        scenario
    }
}

/// How long the platform rests at the end.
pub(crate) const TAIL_S: f64 = 0.5;

/// Walks back and forth between the camera and the far wall, from out of view to out of view, until the end.
fn person(duration_s: f64) -> MovingObject {
    const X_M: f64 = 3.4;
    const REACH_M: f64 = 2.6;
    const REST_S: f64 = 0.6;
    let mut waypoints = Vec::new();
    let (mut start_s, mut side) = (1.5, 1.0);
    while start_s < duration_s {
        let from_m = [X_M, side * REACH_M];
        let to_m = [X_M, -side * REACH_M];
        let crossing = Path::straight(start_s, from_m, to_m, PERSON_SPEED_M_PER_S);
        start_s = crossing.end_s() + REST_S;
        side = -side;
        waypoints.extend(crossing.waypoints);
    }
    MovingObject::person(PERSON_ID, Walker::default(), Path { waypoints })
}

#[cfg(test)]
mod tests;
