//! Scenarios for tests of mapping: counterparts of the ten sequences of the TUM RGB-D benchmark (Sturm et al. 2012) that
//! the PL-SLAM thesis uses, and paths with loop closure, a kidnapped camera, or no light.
//!
//! All have a registered colour camera with the noise of a Kinect, and an IMU. Sizes, paths and people are chosen here; they
//! share with the benchmark's sequences what makes these difficult: the motion of the camera and the people in view. The
//! seed varies the noise of the sensors, the tremor of the hand and, by centimetres, the path; in the flat also the
//! furniture.

pub(crate) mod flat;
mod panels;
mod people;
mod ways;

use crate::odometry::{self, TAIL_S, rooms};
use crate::{ColourCamera, Imu, MovingObject, Path, Scenario, Scene};

/// A scenario for mapping.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum SlamRun {
    /// As `freiburg1_xyz`: at a desk, along the axes.
    DeskXyz,
    /// As `freiburg2_xyz`: the same, slowly.
    SlowXyz,
    /// As `freiburg3_long_office_household`: once round a desk, looking at it, back to the start.
    LongOffice,
    /// As `freiburg3_nostructure_texture_near_withloop`: along a textured plane and back.
    TexturedPlane,
    /// As `freiburg3_structure_texture_near`: along textured panels in a zig-zag.
    ZigZag,
    /// As `freiburg2_desk_with_person`: round a desk at which a person sits and works.
    DeskWithPerson,
    /// As `freiburg3_sitting_xyz`: two persons who sit and gesture; along the axes.
    SittingXyz,
    /// As `freiburg3_sitting_halfsphere`: the same; on half a sphere of a metre.
    SittingHalfsphere,
    /// As `freiburg3_walking_xyz`: two persons who walk through the image; along the axes.
    WalkingXyz,
    /// As `freiburg3_walking_halfsphere`: the same; on half a sphere of a metre.
    WalkingHalfsphere,
    /// Through all six rooms of a flat and back to the start, some 85 m.
    Flat,
    /// Round the office, with a jump to another place between two images, and another one back.
    Kidnapped,
    /// Round the office three times; for most of the path there is no light.
    Dark,
}

impl SlamRun {
    /// All of them.
    pub const ALL: [Self; 13] = [
        Self::DeskXyz,
        Self::SlowXyz,
        Self::LongOffice,
        Self::TexturedPlane,
        Self::ZigZag,
        Self::DeskWithPerson,
        Self::SittingXyz,
        Self::SittingHalfsphere,
        Self::WalkingXyz,
        Self::WalkingHalfsphere,
        Self::Flat,
        Self::Kidnapped,
        Self::Dark,
    ];

    /// Its name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::DeskXyz => "desk-xyz",
            Self::SlowXyz => "slow-xyz",
            Self::LongOffice => "long-office",
            Self::TexturedPlane => "textured-plane",
            Self::ZigZag => "zig-zag",
            Self::DeskWithPerson => "desk-with-person",
            Self::SittingXyz => "sitting-xyz",
            Self::SittingHalfsphere => "sitting-halfsphere",
            Self::WalkingXyz => "walking-xyz",
            Self::WalkingHalfsphere => "walking-halfsphere",
            Self::Flat => "flat",
            Self::Kidnapped => "kidnapped",
            Self::Dark => "dark",
        }
    }

    fn scene(self, seed: u64) -> Scene {
        match self {
            Self::TexturedPlane => rooms::wall(),
            Self::ZigZag => panels::zig_zag(),
            Self::Flat => flat::flat(seed),
            Self::Kidnapped | Self::Dark => rooms::office(),
            Self::DeskXyz
            | Self::SlowXyz
            | Self::LongOffice
            | Self::DeskWithPerson
            | Self::SittingXyz
            | Self::SittingHalfsphere
            | Self::WalkingXyz
            | Self::WalkingHalfsphere => rooms::desk(),
        }
    }

    fn path(self, seed: u64) -> Path {
        match self {
            Self::DeskXyz => ways::along_the_axes(1.1, 0.3, seed),
            Self::SlowXyz => ways::along_the_axes(2.0, 0.15, seed),
            Self::LongOffice => ways::all_round_a_desk(seed),
            Self::TexturedPlane => ways::along_a_plane(seed),
            Self::ZigZag => ways::along_panels(seed),
            Self::DeskWithPerson => odometry::ways::round_a_desk(seed).path(),
            Self::SittingXyz | Self::WalkingXyz => ways::along_the_axes(1.3, 0.3, seed),
            Self::SittingHalfsphere | Self::WalkingHalfsphere => ways::on_half_a_sphere(seed),
            Self::Flat => flat::through_all_rooms(seed),
            Self::Kidnapped => ways::carried_off(seed),
            Self::Dark => ways::round_and_round(seed),
        }
    }

    fn people(self, end_s: f64) -> Vec<MovingObject> {
        match self {
            Self::DeskWithPerson => people::at_work(end_s),
            Self::SittingXyz | Self::SittingHalfsphere => people::sitting(end_s),
            Self::WalkingXyz | Self::WalkingHalfsphere => people::walking(end_s),
            _ => Vec::new(),
        }
    }
}

impl Scenario {
    /// A scenario for mapping.
    #[must_use]
    pub fn slam(run: SlamRun, seed: u64) -> Self {
        /// Long paths with half the images, which is enough for their tests.
        const LONG_RATE_HZ: f64 = 15.0;
        let path = run.path(seed);
        let duration_s = path.end_s() + TAIL_S;
        let mut scene = run.scene(seed);
        scene.objects = run.people(duration_s);
        if run == SlamRun::Dark {
            scene.lighting.dark_s = Some(ways::DARK_S);
        }
        let mut scenario =
            Self { name: run.name().to_owned(), seed, duration_s, scene, ..Self::default() };
        if matches!(run, SlamRun::Flat | SlamRun::Dark) {
            scenario.rig.depth_camera.rate_hz = LONG_RATE_HZ;
        }
        scenario.rig.path = path;
        scenario.rig.colour_camera = Some(ColourCamera::default());
        scenario.rig.imu = Some(Imu::default());
        scenario
    }
}

#[cfg(test)]
mod tests;
