//! `stillmap eval map`: how alike a map and the empty scene are.

use std::path::{Path, PathBuf};

use clap::Args;
use evaluation::{CloudDistance, Correlation, cloud_distance, correlation};
use geometry::{VoxelGrid, pcd, ply};
use nalgebra::Point3;
use serde::Serialize;

use crate::console;
use crate::failure::{Failure, Outcome};

/// Arguments of `stillmap eval map`.
#[derive(Args, Debug)]
#[command(after_help = "Example:
  stillmap eval map out/map.ply --ref empty_room.ply

Both clouds are reduced to one point a voxel first, so that how often a place was seen does not count.")]
pub(crate) struct MapArgs {
    /// The map, a .ply or .pcd file
    map: PathBuf,
    /// The empty scene in the same frame, a .ply or .pcd file
    #[arg(long = "ref", value_name = "FILE")]
    reference: PathBuf,
    /// The edge of the voxels that both are reduced to
    #[arg(long, value_name = "METRES", default_value_t = 0.08)]
    edge: f64,
    /// Points nearer than this are the same; the edge where it is not given
    #[arg(long, value_name = "METRES")]
    tolerance: Option<f64>,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// What is printed.
#[derive(Serialize)]
struct MapScore {
    edge_m: f64,
    map_points: usize,
    reference_points: usize,
    correlation: Correlation,
    distance: CloudDistance,
}

pub(crate) fn run(args: &MapArgs) -> Result<Outcome, Failure> {
    let score = score(args)?;
    if args.json {
        let json = serde_json::to_string_pretty(&score)
            .map_err(|error| Failure::new(format!("cannot print the score: {error}")))?;
        console::print(format_args!("{json}"))?;
    } else {
        print(&score)?;
    }
    Ok(Outcome::Complete)
}

fn score(args: &MapArgs) -> Result<MapScore, Failure> {
    let grid =
        VoxelGrid::new(args.edge).map_err(|error| Failure::new(format!("--edge: {error}")))?;
    let map = grid.reduce(&read(&args.map)?);
    let reference = grid.reduce(&read(&args.reference)?);
    let tolerance_m = args.tolerance.unwrap_or(args.edge);
    Ok(MapScore {
        edge_m: args.edge,
        map_points: map.len(),
        reference_points: reference.len(),
        correlation: correlation(&reference, &map, args.edge)
            .map_err(|error| Failure::new(error.to_string()))?,
        distance: cloud_distance(&reference, &map, tolerance_m)
            .map_err(|error| Failure::new(error.to_string()))?,
    })
}

fn read(path: &Path) -> Result<Vec<Point3<f32>>, Failure> {
    let extension = path.extension().and_then(|extension| extension.to_str()).unwrap_or_default();
    let decode = match extension.to_ascii_lowercase().as_str() {
        "ply" => ply::decode,
        "pcd" => pcd::decode,
        _ => {
            return Err(Failure::new(format!("{} is no cloud that is known", path.display()))
                .mend("its name must end in .ply or .pcd"));
        }
    };
    let bytes = std::fs::read(path)
        .map_err(|error| Failure::new(format!("cannot read {}: {error}", path.display())))?;
    decode(&bytes).map_err(|error| Failure::new(format!("{}: {error}", path.display())))
}

fn print(score: &MapScore) -> Result<(), Failure> {
    let MapScore { map_points, reference_points, correlation, distance, edge_m } = score;
    let percent = |share: f64| format!("{:.2} %", 100.0 * share);
    console::print(format_args!(
        "map {map_points} points, reference {reference_points} points, voxels of {edge_m} m"
    ))?;
    console::print(format_args!(
        "correlation    front {}, top {}, side {}",
        percent(correlation.front),
        percent(correlation.top),
        percent(correlation.side)
    ))?;
    console::print(format_args!(
        "accuracy {:.4} m, completeness {:.4} m, Chamfer {:.4} m",
        distance.accuracy_m, distance.completeness_m, distance.chamfer_m
    ))?;
    console::print(format_args!(
        "within {} m    precision {}, recall {}, F-score {}",
        distance.tolerance_m,
        percent(distance.precision),
        percent(distance.recall),
        percent(distance.f_score)
    ))
}
