//! The choice of the scenario.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use simulator::{CrossingObject, PathName, Platform, Scenario, SceneName, VelodyneModel};

use super::mesh_file;
use super::scenario_name::ScenarioName;
use super::scenario_source::{ScenarioSource, ScenarioSourceParser};
use robot::Failure;

/// A scenario of the suite, a scene with moving objects, or a file.
#[derive(Args, Debug)]
pub(crate) struct ChoiceArgs {
    /// A scenario of the suite, a scene as with --scene, or a file as with --file
    #[arg(
        value_name = "SCENE",
        value_parser = ScenarioSourceParser::new(),
        ignore_case = true,
        required_unless_present_any = ["scene", "file"]
    )]
    scenario: Option<ScenarioSource>,
    /// A scene of Table 2 of Rec-HV
    #[arg(long, ignore_case = true, conflicts_with = "scenario")]
    scene: Option<SceneLetter>,
    /// Your own scenario in YAML; nodes/laboratory/simulator/scenes/example.yaml shows and explains the keys
    #[arg(
        long,
        value_name = "YAML",
        conflicts_with_all = ["scenario", "scene", "object", "path", "platform", "pause"]
    )]
    file: Option<PathBuf>,
    /// The moving object in a scene of A to H [default: person]
    #[arg(long)]
    object: Option<ObjectName>,
    /// The object's path in Figure 2 of Rec-HV: across, across with changing depth, not straight; D and E move the
    /// sensors too [default: A]
    #[arg(long, ignore_case = true)]
    path: Option<PathLetter>,
    /// The motion of the sensors [default: still, or that of the path]
    #[arg(long)]
    platform: Option<PlatformName>,
    /// How long the person stops in the middle
    #[arg(long, value_name = "S", allow_negative_numbers = true, conflicts_with_all = ["object", "path"])]
    pause: Option<f64>,
    /// Seed of all noise: the same seed gives the same bag [default: 1, or the file's]
    #[arg(long)]
    seed: Option<u64>,
    /// Leave out the moving objects
    #[arg(long)]
    empty: bool,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
#[value(rename_all = "UPPER")]
pub(crate) enum SceneLetter {
    /// Empty, 4 m
    A,
    /// Reflecting surfaces, 4 m
    B,
    /// Surfaces of low reflectivity, 4 m
    C,
    /// An open space above the scanner, 6 m
    D,
    /// An open space on the right, many reflecting surfaces, glass, 5 m
    E,
    /// Furniture at all depths, 8 m
    F,
    /// Glass and a television, 6 m
    G,
    /// Dark, 4 m
    H,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
enum ObjectName {
    /// At 1.4 m/s
    Person,
    /// With its screen, at 0.98 m/s
    Robot,
    /// A plain box, at 0.98 m/s
    Cart,
    /// A robot and two persons who meet in the middle
    Three,
    /// A person who opens the door of a cupboard
    Door,
    /// A person who pushes a chair
    Chair,
    /// Nothing
    None,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
#[value(rename_all = "UPPER")]
pub(crate) enum PathLetter {
    A,
    B,
    C,
    D,
    E,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
enum PlatformName {
    Still,
    /// Forward on a rail and back, 0.2 m/s
    Rail,
    /// Forward, 0.1 m/s
    Drive,
    /// Along a curve, 0.2 m/s
    Tour,
    /// Back and forth and turning, up to 0.5 m/s and 0.5 rad/s
    Sway,
}

impl ChoiceArgs {
    pub(crate) fn scenario(&self) -> Result<Scenario, Failure> {
        let mut scenario = match (self.file()?, self.scene_name()) {
            (Some(file), _) => self.read(file)?,
            (None, Some(scene)) => self.in_scene(scene)?,
            (None, None) => self.of_the_suite()?,
        };
        if let Some(platform) = self.platform {
            scenario = scenario.with_platform(platform.platform());
        }
        if self.empty {
            scenario = scenario.without_objects();
        }
        Ok(scenario)
    }

    fn scene_name(&self) -> Option<SceneName> {
        self.scene.map(SceneLetter::scene).or_else(|| self.name().and_then(ScenarioName::scene))
    }

    fn name(&self) -> Option<ScenarioName> {
        match self.scenario {
            Some(ScenarioSource::Named(name)) => Some(name),
            _ => None,
        }
    }

    /// The user's file, given as the scenario or with --file.
    fn file(&self) -> Result<Option<&Path>, Failure> {
        let Some(ScenarioSource::File(file)) = &self.scenario else {
            return Ok(self.file.as_deref());
        };
        // With --file, clap rejects these.
        let refused = [
            ("--object", self.object.is_some()),
            ("--path", self.path.is_some()),
            ("--platform", self.platform.is_some()),
            ("--pause", self.pause.is_some()),
        ];
        match refused.iter().find(|(_, is_given)| *is_given) {
            Some((option, _)) => {
                Err(Failure::new(format!("{option} cannot be used with a scenario file"))
                    .fix(format!("{} defines what moves, and how", file.display())))
            }
            None => Ok(Some(file)),
        }
    }

    fn seed(&self) -> u64 {
        self.seed.unwrap_or(1)
    }

    fn read(&self, file: &Path) -> Result<Scenario, Failure> {
        let within = |reason: String| Failure::new(format!("{}: {reason}", file.display()));
        let text = std::fs::read_to_string(file).map_err(|error| within(error.to_string()))?;
        // Meshes stand beside the scene that names them.
        let folder = file.parent().unwrap_or(Path::new(""));
        let mesh = |name: &str| mesh_file::read(&folder.join(name));
        let scenario = Scenario::from_yaml_with_meshes(&text, mesh).map_err(|error| {
            within(error.to_string())
                .fix("nodes/laboratory/simulator/scenes/example.yaml explains the keys")
        })?;
        Ok(match self.seed {
            Some(seed) => scenario.with_seed(seed),
            None => scenario,
        })
    }

    fn of_the_suite(&self) -> Result<Scenario, Failure> {
        if self.object.is_some() || self.path.is_some() || self.pause.is_some() {
            return Err(Failure::unusable("--object, --path and --pause are for scenes of A to H")
                .fix("give one with --scene"));
        }
        let seed = self.seed();
        Ok(match self.name() {
            Some(ScenarioName::Odometry(run)) => Scenario::odometry(run, seed),
            Some(ScenarioName::Slam(run)) => Scenario::slam(run, seed),
            Some(ScenarioName::Road) => Scenario::road(VelodyneModel::Hdl32e, seed),
            Some(ScenarioName::DemoFlat) => Scenario::demo_flat().with_seed(seed),
            Some(ScenarioName::Small) => Scenario::small().with_seed(seed),
            Some(ScenarioName::Demo | ScenarioName::Scene(_)) | None => {
                Scenario::demo().with_seed(seed)
            }
        })
    }

    fn in_scene(&self, scene: SceneName) -> Result<Scenario, Failure> {
        let seed = self.seed();
        if let Some(pause_s) = self.pause {
            if !(pause_s > 0.0 && pause_s.is_finite()) {
                return Err(Failure::unusable(format!(
                    "--pause is {pause_s}, but must be positive"
                )));
            }
            return Ok(Scenario::pausing(scene, pause_s, seed));
        }
        let path = self.path.unwrap_or(PathLetter::A).path();
        let crossing = |object| Scenario::crossing(scene, object, path, seed);
        let object = self.object.unwrap_or(ObjectName::Person);
        let goes_its_own_way =
            matches!(object, ObjectName::Three | ObjectName::Door | ObjectName::Chair);
        if goes_its_own_way && self.path.is_some() {
            return Err(Failure::new("three, door and chair have fixed paths")
                .fix("leave --path out; --platform moves the sensors"));
        }
        Ok(match object {
            ObjectName::Person => crossing(CrossingObject::Person),
            ObjectName::Robot => crossing(CrossingObject::Robot),
            ObjectName::Cart => crossing(CrossingObject::Cart),
            ObjectName::Three => Scenario::three_crossing(scene, seed),
            ObjectName::Door => Scenario::opening_door(scene, seed),
            ObjectName::Chair => Scenario::moving_chair(scene, seed),
            // The sensors may move along a path without an object (Figure 2 D).
            ObjectName::None if self.path.is_some() => {
                crossing(CrossingObject::Person).without_objects()
            }
            ObjectName::None => Scenario::empty(scene, seed),
        })
    }
}

impl SceneLetter {
    pub(crate) fn scene(self) -> SceneName {
        match self {
            Self::A => SceneName::A,
            Self::B => SceneName::B,
            Self::C => SceneName::C,
            Self::D => SceneName::D,
            Self::E => SceneName::E,
            Self::F => SceneName::F,
            Self::G => SceneName::G,
            Self::H => SceneName::H,
        }
    }
}

impl PathLetter {
    pub(crate) fn path(self) -> PathName {
        match self {
            Self::A => PathName::A,
            Self::B => PathName::B,
            Self::C => PathName::C,
            Self::D => PathName::D,
            Self::E => PathName::E,
        }
    }
}

impl PlatformName {
    fn platform(self) -> Platform {
        match self {
            Self::Still => Platform::Still,
            Self::Rail => Platform::Rail,
            Self::Drive => Platform::Drive,
            Self::Tour => Platform::Tour,
            Self::Sway => Platform::Sway,
        }
    }
}
