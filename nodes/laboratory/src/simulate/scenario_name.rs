//! The scenarios that have a name on the command line, and their help texts. The names are the simulator's.

use std::sync::LazyLock;

use clap::ValueEnum;
use clap::builder::PossibleValue;
use simulator::{OdometryRun, SceneName, SlamRun};

/// The scenarios that come with the suite, and the scenes of Table 2.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum ScenarioName {
    Demo,
    DemoFlat,
    Small,
    Scene(SceneName),
    Odometry(OdometryRun),
    Slam(SlamRun),
    Road,
}

impl ValueEnum for ScenarioName {
    fn value_variants<'a>() -> &'a [Self] {
        static ALL: LazyLock<Vec<ScenarioName>> = LazyLock::new(|| {
            let mut all = vec![ScenarioName::Demo, ScenarioName::DemoFlat, ScenarioName::Small];
            all.extend(SceneName::ALL.map(ScenarioName::Scene));
            all.extend(OdometryRun::ALL.map(ScenarioName::Odometry));
            all.extend(SlamRun::ALL.map(ScenarioName::Slam));
            all.push(ScenarioName::Road);
            all
        });
        &ALL
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        let (name, about) = match *self {
            Self::Demo => ("demo", "A furnished room; a robot and then a person cross it"),
            Self::DemoFlat => (
                "demo-flat",
                "A furnished flat in colour; a robot drives through three of its rooms, in which people walk",
            ),
            Self::Small => (
                "small",
                "The same room with a small depth image and the person only, for quick tests",
            ),
            // `--scene` describes them.
            Self::Scene(scene) => return Some(PossibleValue::new(letter(scene))),
            Self::Odometry(run) => (run.name(), about_odometry(run)),
            Self::Slam(run) => (run.name(), about_slam(run)),
            Self::Road => (
                "road",
                "For LiDAR odometry: a car with an HDL-32E drives round a block of houses; --velodyne selects another model",
            ),
        };
        Some(PossibleValue::new(name).help(about))
    }
}

impl ScenarioName {
    pub(super) fn scene(self) -> Option<SceneName> {
        match self {
            Self::Scene(scene) => Some(scene),
            _ => None,
        }
    }
}

/// In lower case, as all names of scenarios.
fn letter(scene: SceneName) -> &'static str {
    match scene {
        SceneName::A => "a",
        SceneName::B => "b",
        SceneName::C => "c",
        SceneName::D => "d",
        SceneName::E => "e",
        SceneName::F => "f",
        SceneName::G => "g",
        SceneName::H => "h",
    }
}

fn about_odometry(run: OdometryRun) -> &'static str {
    match run {
        OdometryRun::Office => "For odometry: an office, a hand-held camera that hardly turns",
        OdometryRun::Desk => "For odometry: round a cluttered desk",
        OdometryRun::Turning => "For odometry: the office, turning about all axes",
        OdometryRun::Loop => "For odometry: once round the office and back to the start",
        OdometryRun::Hall => {
            "For odometry: a large hall, most of it out of the depth camera's reach"
        }
        OdometryRun::Corridor => "For odometry: a bare corridor",
        OdometryRun::Wall => "For odometry: a single wall",
        OdometryRun::LowLight => "For odometry: the office in the dark",
        OdometryRun::Blur => "For odometry: the office, fast, with motion blur",
        OdometryRun::Person => {
            "For odometry: the office, a person walks back and forth before the camera at 1.4 m/s"
        }
        OdometryRun::Rail => "For odometry: scene B on a rail along x, the thesis' experiment 10",
    }
}

fn about_slam(run: SlamRun) -> &'static str {
    match run {
        SlamRun::DeskXyz => {
            "For mapping: at a desk, along the axes; counterpart of TUM's freiburg1_xyz"
        }
        SlamRun::SlowXyz => "For mapping: the same, slowly (freiburg2_xyz)",
        SlamRun::LongOffice => {
            "For mapping: once round a desk and back to the start (freiburg3_long_office_household)"
        }
        SlamRun::TexturedPlane => {
            "For mapping: along a textured plane and back (freiburg3_nostructure_texture_near_withloop)"
        }
        SlamRun::ZigZag => {
            "For mapping: along panels in a zig-zag (freiburg3_structure_texture_near)"
        }
        SlamRun::DeskWithPerson => {
            "For mapping: round a desk at which a person works (freiburg2_desk_with_person)"
        }
        SlamRun::SittingXyz => {
            "For mapping: two persons sit and gesture; along the axes (freiburg3_sitting_xyz)"
        }
        SlamRun::SittingHalfsphere => {
            "For mapping: the same; on half a sphere (freiburg3_sitting_halfsphere)"
        }
        SlamRun::WalkingXyz => {
            "For mapping: two persons walk through the image; along the axes (freiburg3_walking_xyz)"
        }
        SlamRun::WalkingHalfsphere => {
            "For mapping: the same; on half a sphere (freiburg3_walking_halfsphere)"
        }
        SlamRun::Flat => "For mapping: through six rooms of a flat and back to the start, 80 m",
        SlamRun::Kidnapped => {
            "For mapping: round the office, with two jumps of the camera to another place in it"
        }
        SlamRun::Dark => "For mapping: round the office three times, 30 s of it without light",
    }
}
