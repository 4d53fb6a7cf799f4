//! `stillmap experiments`: the eleven experiments of Rec-HV run again, with the method as published and with free_space,
//! each compared with its published table.
//!
//! The experiments list the scenarios that they need (`plan`), each scenario runs once through all three nodes with both
//! methods ([`runs`]), and the experiments make tables, charts and images from the recorded figures (`present`).

mod acceptance;
mod charts;
mod e01_raw_ranges;
mod e02_gap_fill;
mod e03_deviations;
mod e04_voxel_edge;
mod e05_found;
mod e06_two_stages;
mod e07_correlation;
mod e08_everyday_scenes;
mod e09_centroid;
mod e10_rail;
mod e11_tour;
mod figures;
mod filter;
mod map_pictures;
mod output;
mod page;
mod pool;
mod positions;
mod published;
mod runs;
mod scans;
mod scenarios;
mod section;
mod settings;
mod sightings;
mod table;
mod text;

use std::path::PathBuf;

use clap::Args;
use clap::builder::PossibleValuesParser;

use self::filter::FilterArgs;
use self::runs::{Run, Runs, count_of_scenarios};
use self::section::Section;
use self::settings::Settings;
use robot::{Failure, Interrupt, Outcome, Progress, console, refuse_to_replace};

/// Arguments of `stillmap experiments`.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  stillmap experiments --quick
  stillmap experiments --only 1 5 9 --seeds 10 -o out
  stillmap experiments --only acceptance --scenes H --objects person --paths C --seeds 1 --first-seed 2

It writes experiments.html (one page that needs nothing else), experiments.json and sightings.csv (each object in
each cycle), and prints the tables.
Times depend on the machine; all other figures are the same for the same arguments.")]
pub struct ExperimentsArgs {
    /// Run only these: experiments 1 to 11, or the targets of the suite (`acceptance`)
    #[arg(long, num_args = 1.., value_name = "EXPERIMENT", value_parser = PossibleValuesParser::new(KEYS))]
    only: Vec<String>,
    /// Runs per experiment, for those with several; the full tables have 10
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u64).range(1..=1000))]
    seeds: u64,
    /// The first seed; the others are consecutive
    #[arg(long, value_name = "SEED", default_value_t = 1, value_parser = clap::value_parser!(u64).range(..=1_000_000))]
    first_seed: u64,
    #[command(flatten)]
    filter: FilterArgs,
    /// One seed, few cycles, small images: checks in a minute or two that everything works
    #[arg(long, conflicts_with = "seeds")]
    quick: bool,
    /// The folder for the page and the figures
    #[arg(short, long, value_name = "DIR", default_value = "stillmap-experiments")]
    out: PathBuf,
    /// Replace existing results of experiments in that folder
    #[arg(long)]
    overwrite: bool,
    /// Print the figures as JSON instead of the tables
    #[arg(long)]
    json: bool,
}

/// The names of the experiments on the command line, in the order of the page.
const KEYS: [&str; 12] = ["1", "2", "3", "4", "5", "6", "7", "8", "9", "10", "11", "acceptance"];

/// An experiment.
struct Experiment {
    /// The scenarios that both methods have to run.
    plan: fn(&Settings) -> Vec<Run>,
    present: fn(&Settings, &Runs) -> Result<Section, Failure>,
}

/// An experiment that uses scans alone, or runs its scenarios itself.
const NOTHING: fn(&Settings) -> Vec<Run> = |_| Vec::new();

/// The experiments, in the order of [`KEYS`].
const EXPERIMENTS: [Experiment; KEYS.len()] = [
    Experiment { plan: NOTHING, present: |settings, _| e01_raw_ranges::present(settings) },
    Experiment { plan: NOTHING, present: |settings, _| e02_gap_fill::present(settings) },
    Experiment { plan: NOTHING, present: |settings, _| e03_deviations::present(settings) },
    Experiment { plan: NOTHING, present: |settings, _| e04_voxel_edge::present(settings) },
    Experiment { plan: e05_found::plan, present: e05_found::present },
    Experiment { plan: e06_two_stages::plan, present: e06_two_stages::present },
    Experiment { plan: e07_correlation::plan, present: e07_correlation::present },
    Experiment { plan: e08_everyday_scenes::plan, present: e08_everyday_scenes::present },
    Experiment { plan: e09_centroid::plan, present: e09_centroid::present },
    Experiment { plan: NOTHING, present: |_, _| e10_rail::present() },
    Experiment { plan: e11_tour::plan, present: e11_tour::present },
    Experiment { plan: acceptance::plan, present: acceptance::present },
];

pub(crate) fn run(args: &ExperimentsArgs, interrupt: &Interrupt) -> Result<Outcome, Failure> {
    let settings = args.filter.of(Settings {
        first_seed: args.first_seed,
        ..if args.quick { Settings::quick() } else { Settings::new(args.seeds) }
    });
    let results = output::RESULTS.map(|name| args.out.join(name));
    refuse_to_replace(results, args.overwrite, "--out")?;
    let folder = output::Folder::create(&args.out)?;
    let chosen = chosen(&args.only);
    let plan: Vec<Run> =
        chosen.iter().flat_map(|experiment| (experiment.plan)(&settings)).collect();
    let progress = Progress::new("scenarios", count_of_scenarios(&plan) as u64);
    let threads = pool::threads_of_machine();
    let runs = Runs::execute(plan, threads, interrupt, || progress.advance())?;
    progress.finish();
    let progress = Progress::new("experiments", chosen.len() as u64);
    let mut sections = Vec::new();
    for experiment in &chosen {
        let plan = (experiment.plan)(&settings);
        // The finished experiments are still shown.
        if interrupt.has_come() && (plan.is_empty() || !runs.has_all(&plan)) {
            continue;
        }
        sections.push((experiment.present)(&settings, &runs)?);
        progress.advance();
    }
    progress.finish();
    if sections.is_empty() {
        console::note("interrupted before an experiment was done: nothing is written");
        return Ok(Outcome::Interrupted);
    }
    let json = output::json(&settings, &sections, &runs)?;
    folder.write("experiments.html", &page::page(&settings, &sections))?;
    folder.write("experiments.json", &json)?;
    folder.write("sightings.csv", &sightings::csv(&runs))?;
    if args.json {
        console::print(json.trim_end())?;
    } else {
        print_text(&settings, &sections)?;
    }
    if sections.len() < chosen.len() {
        let (done, all) = (sections.len(), chosen.len());
        console::note(format_args!(
            "interrupted: {done} of {all} experiments are done and written"
        ));
        return Ok(Outcome::Interrupted);
    }
    Ok(Outcome::Complete)
}

/// All of them when none is named.
fn chosen(only: &[String]) -> Vec<&'static Experiment> {
    let is_chosen = |key: &str| only.is_empty() || only.iter().any(|name| name == key);
    let pairs = KEYS.iter().zip(&EXPERIMENTS);
    pairs.filter(|(key, _)| is_chosen(key)).map(|(_, experiment)| experiment).collect()
}

fn print_text(settings: &Settings, sections: &[Section]) -> Result<(), Failure> {
    for section in sections {
        console::print(text::section_text(section))?;
    }
    for sentence in page::lead(settings, sections) {
        console::print(sentence)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests;
