//! `stillmap demo`: the whole pipeline on a simulated room, without any other files.

use std::path::PathBuf;

use clap::Args;
use simulator::Scenario;

use crate::{simulate, truth};
use robot::run::{self, HowArgs, TransportName};
use robot::{Failure, Interrupt, Outcome, refuse_to_replace};

/// Arguments of `stillmap demo`.
#[derive(Args, Debug)]
#[command(after_help = "Example:
  stillmap demo --out /tmp/demo")]
pub struct DemoArgs {
    /// The folder for the bag, the map, the pictures and the report
    #[arg(short, long, value_name = "DIR", default_value = "stillmap-demo")]
    out: PathBuf,
    /// Seed of the sensors' noise
    #[arg(long, default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    how: HowArgs,
}

pub(crate) fn run(args: &DemoArgs, interrupt: &Interrupt) -> Result<Outcome, Failure> {
    let bag = args.out.join("demo.mcap");
    refuse_to_replace([bag.clone()], args.how.overwrite, "--out")?;
    run::refuse_results(&args.out, args.how.overwrite)?;
    std::fs::create_dir_all(&args.out).map_err(|error| {
        Failure::new(format!("cannot make {}: {error}", args.out.display()))
            .fix("give a folder that can be written with --out")
    })?;
    let scenario = Scenario::demo().with_seed(args.seed);
    if simulate::write_bag(&scenario, &bag, interrupt)? == Outcome::Interrupted {
        return Ok(Outcome::Interrupted);
    }
    let transport = args.how.transport.unwrap_or(TransportName::Dds);
    let how = (&args.how, transport);
    run::run_bag(&bag, &args.out, &Default::default(), how, Some(truth::score), interrupt)
}
