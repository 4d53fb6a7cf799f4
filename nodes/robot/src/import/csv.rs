//! `stillmap import csv`: a recording exported by the program of the road thesis (section 2.4, option C).

use std::path::{Path, PathBuf};

use clap::Args;
use lidar_odometry::recorded::revolutions_from_csv;
use msgs::convert::message_from_revolution;

use super::print_summary;
use super::velodyne::ModelArg;
use crate::existing::BagOutput;
use crate::failure::{Failure, Outcome};
use crate::interrupt::Interrupt;

/// Arguments of `stillmap import csv`.
#[derive(Args, Debug)]
#[command(after_help = "Example:
  stillmap import csv coordinates.csv intensities.csv -o drive.mcap

Each file has a line for each revolution: the time in milliseconds, and then x y z of each shot in metres, or its intensity.")]
pub struct CsvArgs {
    /// The file of coordinates
    coordinates: PathBuf,
    /// The file of intensities
    intensities: PathBuf,
    /// The model of the scanner
    #[arg(long, value_name = "MODEL", default_value = "hdl32e")]
    model: ModelArg,
    #[command(flatten)]
    pub(super) output: BagOutput,
}

pub(crate) fn import(args: &CsvArgs, interrupt: &Interrupt) -> Result<Outcome, Failure> {
    let (coordinates, intensities) = (read(&args.coordinates)?, read(&args.intensities)?);
    let mut revolutions =
        revolutions_from_csv(&coordinates, &intensities, args.model.model(), "velodyne")
            .map_err(|error| Failure::new(error.to_string()).within(args.coordinates.display()))?
            .peekable();
    if revolutions.peek().is_none() {
        return Err(Failure::new(format!("{} has no revolution", args.coordinates.display()))
            .fix("a line is a revolution: its time in milliseconds, and x y z of each shot"));
    }
    let mut bag = args.output.create()?;
    for revolution in revolutions {
        if interrupt.has_come() {
            break;
        }
        bag.velodyne(revolution.stamp, &message_from_revolution(&revolution))?;
    }
    let summary = bag.finish()?;
    print_summary(&args.output, &summary, interrupt, Outcome::Complete)
}

fn read(path: &Path) -> Result<String, Failure> {
    std::fs::read_to_string(path)
        .map_err(|error| Failure::new(format!("cannot read {}: {error}", path.display())))
}
