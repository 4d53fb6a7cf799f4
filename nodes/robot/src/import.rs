//! `stillmap import`: recorded data sets become bags.

mod clouds;
mod csv;
mod depth;
mod depth_png;
pub mod kitti;
mod ros1;
mod scan_cut;
pub mod tum;
mod velodyne;

use clap::Subcommand;

use crate::failure::{Failure, Outcome};

/// What to import.
#[derive(Subcommand, Debug)]
pub enum ImportArgs {
    /// A TUM RGB-D sequence: colour, depth and motion-capture poses
    Tum(tum::TumArgs),
    /// Numbered 16-bit depth pictures of a camera that stands still
    Depth(depth::DepthArgs),
    /// A bag of ROS 1
    Ros1(ros1::Ros1Args),
    /// A capture of a Velodyne's packets, pcap or pcapng
    Velodyne(velodyne::VelodyneArgs),
    /// Laser scans of KITTI or KITTI-360, with true poses where there are any
    Kitti(kitti::KittiArgs),
    /// A recording as the road thesis' program exported it: coordinates and intensities
    Csv(csv::CsvArgs),
    /// Scans of a LiDAR, each a PLY or PCD file
    Clouds(clouds::CloudsArgs),
}

/// Runs `stillmap import`.
pub(crate) fn run(args: ImportArgs) -> Result<Outcome, Failure> {
    match args {
        ImportArgs::Tum(args) => tum::import(&args),
        ImportArgs::Depth(args) => depth::import(&args),
        ImportArgs::Ros1(args) => ros1::import(&args),
        ImportArgs::Velodyne(args) => velodyne::import(&args),
        ImportArgs::Kitti(args) => kitti::import(&args),
        ImportArgs::Csv(args) => csv::import(&args),
        ImportArgs::Clouds(args) => clouds::import(&args),
    }
}
