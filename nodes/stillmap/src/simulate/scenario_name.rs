//! The scenarios that have a name on the command line.

use clap::ValueEnum;
use simulator::{OdometryRun, SceneName, SlamRun};

/// The scenarios that come with the suite, and the scenes of Table 2.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub(super) enum ScenarioName {
    /// A furnished room; a robot and then a person cross it
    Demo,
    /// The same room with a small depth image and the person only, for quick tests
    Small,
    A,
    B,
    C,
    D,
    E,
    F,
    G,
    H,
    /// For odometry: an office, a camera in the hand that hardly turns
    Office,
    /// For odometry: round a cluttered desk
    Desk,
    /// For odometry: the office, turning about all axes
    Turning,
    /// For odometry: once round the office and back to the start
    Loop,
    /// For odometry: a large hall, most of it out of the depth camera's reach
    Hall,
    /// For odometry: a bare corridor
    Corridor,
    /// For odometry: one wall and nothing else
    Wall,
    /// For odometry: the office in the dark
    LowLight,
    /// For odometry: the office, fast, with motion blur
    Blur,
    /// For odometry: the office, a person to and fro before the camera at 1.4 m/s
    Person,
    /// For odometry: scene B on a rail along x, the thesis' experiment 10
    Rail,
    /// For mapping: at a desk, along the axes; counterpart of TUM's freiburg1_xyz
    DeskXyz,
    /// For mapping: the same, slowly (freiburg2_xyz)
    SlowXyz,
    /// For mapping: all round a desk and back to the start (freiburg3_long_office_household)
    LongOffice,
    /// For mapping: along a plane with pictures and back (freiburg3_nostructure_texture_near_withloop)
    TexturedPlane,
    /// For mapping: along panels set up in a zig-zag (freiburg3_structure_texture_near)
    ZigZag,
    /// For mapping: round a desk at which a person works (freiburg2_desk_with_person)
    DeskWithPerson,
    /// For mapping: two persons sit and gesture; along the axes (freiburg3_sitting_xyz)
    SittingXyz,
    /// For mapping: the same; on half a sphere (freiburg3_sitting_halfsphere)
    SittingHalfsphere,
    /// For mapping: two persons walk through the picture; along the axes (freiburg3_walking_xyz)
    WalkingXyz,
    /// For mapping: the same; on half a sphere (freiburg3_walking_halfsphere)
    WalkingHalfsphere,
    /// For mapping: through six rooms of a flat and back to the start, 80 m
    Flat,
    /// For mapping: round the office, then from one image to the next elsewhere in it, and back
    Kidnapped,
    /// For mapping: round the office three times, 30 s of it without light
    Dark,
    /// For LiDAR odometry: a car with an HDL-32E goes round a block of houses; --velodyne takes another model
    Road,
}

impl ScenarioName {
    pub(super) fn odometry(self) -> Option<OdometryRun> {
        match self {
            Self::Office => Some(OdometryRun::Office),
            Self::Desk => Some(OdometryRun::Desk),
            Self::Turning => Some(OdometryRun::Turning),
            Self::Loop => Some(OdometryRun::Loop),
            Self::Hall => Some(OdometryRun::Hall),
            Self::Corridor => Some(OdometryRun::Corridor),
            Self::Wall => Some(OdometryRun::Wall),
            Self::LowLight => Some(OdometryRun::LowLight),
            Self::Blur => Some(OdometryRun::Blur),
            Self::Person => Some(OdometryRun::Person),
            Self::Rail => Some(OdometryRun::Rail),
            _ => None,
        }
    }

    pub(super) fn slam(self) -> Option<SlamRun> {
        match self {
            Self::DeskXyz => Some(SlamRun::DeskXyz),
            Self::SlowXyz => Some(SlamRun::SlowXyz),
            Self::LongOffice => Some(SlamRun::LongOffice),
            Self::TexturedPlane => Some(SlamRun::TexturedPlane),
            Self::ZigZag => Some(SlamRun::ZigZag),
            Self::DeskWithPerson => Some(SlamRun::DeskWithPerson),
            Self::SittingXyz => Some(SlamRun::SittingXyz),
            Self::SittingHalfsphere => Some(SlamRun::SittingHalfsphere),
            Self::WalkingXyz => Some(SlamRun::WalkingXyz),
            Self::WalkingHalfsphere => Some(SlamRun::WalkingHalfsphere),
            Self::Flat => Some(SlamRun::Flat),
            Self::Kidnapped => Some(SlamRun::Kidnapped),
            Self::Dark => Some(SlamRun::Dark),
            _ => None,
        }
    }

    pub(super) fn scene(self) -> Option<SceneName> {
        match self {
            Self::A => Some(SceneName::A),
            Self::B => Some(SceneName::B),
            Self::C => Some(SceneName::C),
            Self::D => Some(SceneName::D),
            Self::E => Some(SceneName::E),
            Self::F => Some(SceneName::F),
            Self::G => Some(SceneName::G),
            Self::H => Some(SceneName::H),
            _ => None,
        }
    }
}
