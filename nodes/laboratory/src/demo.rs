//! `stillmap demo`: the whole pipeline on a simulated room or flat, without any other files.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use simulator::Scenario;

use crate::{simulate, truth};
use robot::run::{self, HowArgs, TransportName};
use robot::{Failure, Interrupt, Outcome, refuse_to_replace};

/// Arguments of `stillmap demo`.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  stillmap demo --out /tmp/demo
  stillmap demo --scene flat --png --animation flat.png --open")]
pub struct DemoArgs {
    /// The folder for the bag, the map, the pictures and the report
    #[arg(short, long, value_name = "DIR", default_value = "stillmap-demo")]
    out: PathBuf,
    /// What is simulated
    #[arg(long, value_enum, default_value_t = DemoScene::Room)]
    scene: DemoScene,
    /// Seed of the sensors' noise
    #[arg(long, default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    how: HowArgs,
}

/// What a demo simulates.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
enum DemoScene {
    /// A furnished room that a robot and then a person cross, seen by sensors that stand still
    Room,
    /// A furnished flat in colour: a robot drives through three of its rooms for half a minute, in which people walk
    Flat,
}

impl DemoScene {
    fn scenario(self) -> Scenario {
        match self {
            Self::Room => Scenario::demo(),
            Self::Flat => Scenario::demo_flat(),
        }
    }
}

pub(crate) fn run(args: &DemoArgs, interrupt: &Interrupt) -> Result<Outcome, Failure> {
    let bag = args.out.join("demo.mcap");
    refuse_to_replace([bag.clone()], args.how.overwrite, "--out")?;
    args.how.refuse_outputs(&args.out)?;
    args.how.check()?;
    std::fs::create_dir_all(&args.out).map_err(|error| {
        Failure::new(format!("cannot make {}: {error}", args.out.display()))
            .fix("give a folder that can be written with --out")
    })?;
    let scenario = args.scene.scenario().with_seed(args.seed);
    if simulate::write_bag(&scenario, &bag, interrupt)? == Outcome::Interrupted {
        return Ok(Outcome::Interrupted);
    }
    let transport = args.how.transport.unwrap_or(TransportName::Dds);
    let how = (&args.how, transport);
    run::run_bag(&bag, &args.out, &Default::default(), how, Some(truth::score), interrupt)
}
