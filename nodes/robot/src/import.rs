//! `stillmap import`: conversion of recorded data sets to bags.

mod added_scans;
pub(crate) mod bag;
mod clouds;
mod csv;
mod depth;
mod depth_png;
pub mod kitti;
mod scan_cut;
pub mod tum;
mod velodyne;

pub(crate) use added_scans::AddedScans;
pub(crate) use depth_png::numbered_pictures;

use bag_player::BagSummary;
use clap::Subcommand;

use crate::console;
use crate::existing::BagOutput;
use crate::failure::{Failure, Outcome};
use crate::interrupt::Interrupt;

/// The format of the data set.
#[derive(Subcommand, Debug)]
pub enum ImportArgs {
    /// A TUM RGB-D sequence: colour, depth and motion-capture poses
    Tum(tum::TumArgs),
    /// Numbered 16-bit depth images of a static camera
    Depth(depth::DepthArgs),
    /// A bag of ROS 1, sqlite3 or MCAP, as an MCAP file
    #[command(alias = "ros1")]
    Bag(bag::BagArgs),
    /// A capture of a Velodyne's packets, pcap or pcapng
    Velodyne(velodyne::VelodyneArgs),
    /// Laser scans of KITTI or KITTI-360, with true poses if there are any
    Kitti(kitti::KittiArgs),
    /// A recording as the road thesis' program exported it: coordinates and intensities
    Csv(csv::CsvArgs),
    /// Scans of a LiDAR, each a PLY or PCD file
    Clouds(clouds::CloudsArgs),
}

/// Runs `stillmap import`.
pub(crate) fn run(args: ImportArgs, interrupt: &Interrupt) -> Result<Outcome, Failure> {
    args.output().check()?;
    match args {
        ImportArgs::Tum(args) => tum::import(&args, interrupt),
        ImportArgs::Depth(args) => depth::import(&args, interrupt),
        ImportArgs::Bag(args) => bag::import(&args, interrupt),
        ImportArgs::Velodyne(args) => velodyne::import(&args, interrupt),
        ImportArgs::Kitti(args) => kitti::import(&args, interrupt),
        ImportArgs::Csv(args) => csv::import(&args, interrupt),
        ImportArgs::Clouds(args) => clouds::import(&args, interrupt),
    }
}

impl ImportArgs {
    fn output(&self) -> &BagOutput {
        match self {
            Self::Tum(args) => &args.output,
            Self::Depth(args) => &args.output,
            Self::Bag(args) => &args.output,
            Self::Velodyne(args) => &args.output,
            Self::Kitti(args) => &args.output,
            Self::Csv(args) => &args.output,
            Self::Clouds(args) => &args.output,
        }
    }
}

/// Prints the content of a bag, and a note if the import was interrupted.
fn print_summary(
    output: &BagOutput,
    summary: &BagSummary,
    interrupt: &Interrupt,
    outcome: Outcome,
) -> Result<Outcome, Failure> {
    let path = output.path().display();
    console::print(format_args!("{path}: {} messages", summary.message_count))?;
    if interrupt.has_come() {
        console::note(format_args!("interrupted: {path} has what was imported until then"));
        return Ok(Outcome::Interrupted);
    }
    Ok(outcome)
}
