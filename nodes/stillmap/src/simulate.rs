//! `stillmap simulate`: a simulated room as a bag, with its truth.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use simulator::{Sample, Scenario};

use crate::failure::{Failure, Outcome};
use crate::progress::Progress;
use crate::sensor_bag::SensorBag;

/// Arguments of `stillmap simulate`.
#[derive(Args, Debug)]
#[command(after_help = "Example:
  stillmap simulate demo --seed 7 -o room.mcap")]
pub(crate) struct SimulateArgs {
    /// Which scenario
    scenario: ScenarioName,
    /// Seed of all noise: the same seed gives the same bag
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Leave the moving objects out
    #[arg(long)]
    empty: bool,
    /// The bag to write
    #[arg(short, long, value_name = "BAG")]
    output: PathBuf,
}

/// The scenarios that come with the suite.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub(crate) enum ScenarioName {
    /// A furnished room; a robot and then a person cross it
    Demo,
    /// The same room with a small depth image and the person only, for quick tests
    Small,
}

impl ScenarioName {
    /// The scenario itself.
    pub(crate) fn scenario(self) -> Scenario {
        match self {
            Self::Demo => Scenario::demo(),
            Self::Small => Scenario::small(),
        }
    }
}

pub(crate) fn run(args: &SimulateArgs) -> Result<Outcome, Failure> {
    let mut scenario = args.scenario.scenario().with_seed(args.seed);
    if args.empty {
        scenario = scenario.without_objects();
    }
    write_bag(&scenario, &args.output)?;
    Ok(Outcome::Complete)
}

/// Simulates a scenario into a bag.
pub(crate) fn write_bag(scenario: &Scenario, path: &Path) -> Result<(), Failure> {
    let wrong = |error: simulator::ScenarioError| Failure::new(error.to_string());
    let samples = scenario.samples().map_err(wrong)?;
    let mut bag = SensorBag::create(path)?;
    bag.object_names(scenario.start, &object_names(scenario))?;
    bag.empty_scene(&scenario.static_scene_cloud().map_err(wrong)?)?;
    // The bar counts simulated milliseconds: the number of samples is not known beforehand.
    let progress = Progress::new("simulating", (scenario.duration_s * 1e3) as u64);
    for sample in samples {
        progress.set((sample.stamp().seconds_since(scenario.start) * 1e3) as u64);
        write_sample(&mut bag, &sample)?;
    }
    bag.finish()?;
    progress.finish();
    Ok(())
}

fn write_sample(bag: &mut SensorBag, sample: &Sample) -> Result<(), Failure> {
    match sample {
        Sample::Pose(pose) => bag.pose(pose),
        Sample::CameraInfo { stamp, camera, .. } => bag.camera(camera, *stamp),
        Sample::Depth { image, labels } => {
            bag.depth(image)?;
            bag.labels(labels)
        }
        Sample::Scan { scan, .. } => bag.scan(scan),
        // The labels say where the objects are; their poses have no message yet.
        Sample::ObjectPoses(_) => Ok(()),
    }
}

fn object_names(scenario: &Scenario) -> BTreeMap<u16, String> {
    scenario.scene.objects.iter().map(|object| (object.id, object.name.clone())).collect()
}
