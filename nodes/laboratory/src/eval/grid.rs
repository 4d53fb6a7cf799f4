//! `stillmap eval grid`: an occupancy grid against the true floor plan.

mod map_file;
mod picture;
mod score;

use std::path::PathBuf;

use clap::Args;

use self::score::{GridScore, Sight, score};
use crate::simulate::choice::ChoiceArgs;
use robot::console;
use robot::{Failure, Outcome, refuse_to_replace};

pub use map_file::read as read_grid;

/// Arguments of `stillmap eval grid`.
#[derive(Args, Debug)]
#[command(after_help = "Example:
  stillmap simulate --scene B --object person -o room.mcap
  stillmap run room.mcap --grid height_band --out room
  stillmap eval grid room/grid.yaml --scene B

The scene is named as for `stillmap simulate`. A cell is right where the grid says occupied and a body of the scene reaches into
the cell between the heights, or the grid says free and none does; unknown cells are neither. A phantom is an occupied cell
with no body in it or in one of the eight cells around it. In sight are the free cells that sensor can see from where the rig was,
by the plan: of the depth camera up to 5 m, with --scan of the scanner up to 8 m. Known cells that are neither in sight nor in a body
are behind something or too far; without them the share that is right is `to be seen`.")]
pub struct GridArgs {
    /// The YAML file of the grid, as map_saver writes it
    grid: PathBuf,
    #[command(flatten)]
    choice: ChoiceArgs,
    /// The heights above the floor that the plan is of
    #[arg(long, num_args = 2, value_names = ["FROM", "TO"], default_values_t = [0.1, 1.5])]
    heights: Vec<f64>,
    /// In sight is what the camera can see at this height above the floor, or lower
    #[arg(long, value_name = "METRES", default_value_t = 0.4)]
    free_below: f64,
    /// The plan is that at the height of the scanner
    #[arg(long)]
    scan: bool,
    /// Draw grid and plan into this PNG file
    #[arg(long, value_name = "FILE")]
    picture: Option<PathBuf>,
    /// Replace an existing picture
    #[arg(long, requires = "picture")]
    overwrite: bool,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &GridArgs) -> Result<Outcome, Failure> {
    refuse_to_replace(args.picture.clone(), args.overwrite, "--picture")?;
    let scenario = args.choice.scenario()?;
    let grid = map_file::read(&args.grid)?;
    let sight = if args.scan {
        Sight::of_scanner(&scenario)
    } else {
        Sight::of_camera(&scenario, args.free_below)
    };
    let heights_m = match args.heights.as_slice() {
        _ if args.scan => sight.height_m..=sight.height_m,
        [from, to] => *from..=*to,
        _ => return Err(Failure::unusable("--heights needs two numbers")),
    };
    let plan = scenario.floor_plan(&grid, &heights_m);
    let in_sight = sight.cells(&plan);
    if let Some(path) = &args.picture {
        picture::write(path, &grid, &plan, &in_sight)?;
    }
    let score = score(&grid, &plan, &in_sight);
    if args.json {
        let json = serde_json::to_string_pretty(&score)
            .map_err(|error| Failure::new(format!("cannot print the score: {error}")))?;
        console::print(format_args!("{json}"))?;
    } else {
        print(&score)?;
    }
    Ok(Outcome::Complete)
}

fn print(score: &GridScore) -> Result<(), Failure> {
    let percent = |share: f64| format!("{:.2} %", 100.0 * share);
    console::print(format_args!(
        "known cells    {}: {} free, {} occupied",
        score.free + score.occupied,
        score.free,
        score.occupied
    ))?;
    console::print(format_args!(
        "right          {} ({} where borders may be a cell off)",
        percent(score.right),
        percent(score.right_to_a_cell)
    ))?;
    console::print(format_args!(
        "to be seen     {} of the {} cells that are in sight or in a body are right",
        percent(score.right_to_be_seen),
        score.known_to_be_seen
    ))?;
    console::print(format_args!(
        "wrong          {} free in a body, {} occupied beside one, {} phantoms",
        score.free_in_body, score.occupied_beside_body, score.phantoms
    ))?;
    console::print(format_args!(
        "in sight       {} free cells, {} of them unknown",
        score.in_sight,
        percent(score.unknown_in_sight)
    ))
}
