//! `stillmap info`: what is in a bag.

use std::path::PathBuf;

use clap::Args;

use crate::console;
use crate::failure::{Failure, Outcome};
use crate::open_bag::open_bag;

/// Arguments of `stillmap info`.
#[derive(Args, Debug)]
#[command(after_help = "Example:
  stillmap info room.mcap --json")]
pub struct InfoArgs {
    /// A bag (MCAP, sqlite3 or ROS 1, recognised by its content) or a rosbag2 folder
    bag: PathBuf,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &InfoArgs) -> Result<Outcome, Failure> {
    let info = open_bag(&args.bag)?.info().map_err(|error| Failure::new(error.to_string()))?;
    if args.json {
        let json = serde_json::to_string_pretty(&info)
            .map_err(|error| Failure::new(format!("cannot print the information: {error}")))?;
        console::print(format_args!("{json}"))?;
    } else {
        console::print(format_args!("{info}"))?;
    }
    Ok(if info.losses.is_empty() { Outcome::Complete } else { Outcome::WithLosses })
}
