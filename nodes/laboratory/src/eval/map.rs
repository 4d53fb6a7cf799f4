//! `stillmap eval map`: comparison of a map with the empty scene.

use std::path::{Path, PathBuf};

use bag_player::Bag;
use clap::Args;
use evaluation::{Correlation, ReducedClouds, correlation};
use geometry::{pcd, ply};
use nalgebra::Point3;
use report::CloudDistance;
use serde::Serialize;

use crate::truth;
use robot::console;
use robot::sensor_bag::TRUE_EMPTY_SCENE;
use robot::{Failure, Outcome};

/// Arguments of `stillmap eval map`.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  stillmap eval map out/map.ply --ref empty_room.ply
  stillmap eval map out/map.ply --ref room.mcap

The second takes the empty scene from the bag that the map was made of: `stillmap simulate` writes it to
/truth/empty_scene, in the frame of the bag's own poses.

Both clouds are reduced to one point a voxel first, so that how often a place was seen does not count. With
--edge 0.05 the distances are those that `stillmap run` prints of a bag with the truth.")]
pub struct MapArgs {
    /// The map, a .ply or .pcd file
    map: PathBuf,
    /// The empty scene in the same frame: a .ply or .pcd file, or a bag that has it on /truth/empty_scene
    #[arg(long = "ref", value_name = "FILE")]
    reference: PathBuf,
    /// Edge of the voxels to which both are reduced
    #[arg(long, value_name = "METRES", default_value_t = 0.08)]
    edge: f64,
    /// Points nearer than this match [default: the edge]
    #[arg(long, value_name = "METRES")]
    tolerance: Option<f64>,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// The printed result.
#[derive(Serialize)]
pub(crate) struct MapScore {
    edge_m: f64,
    map_points: usize,
    reference_points: usize,
    correlation: Correlation,
    pub(crate) distance: CloudDistance,
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

pub(crate) fn score(args: &MapArgs) -> Result<MapScore, Failure> {
    let (map_m, reference_m) = (read(&args.map)?, read_reference(&args.reference)?);
    let clouds = ReducedClouds::of(&reference_m, &map_m, args.edge)
        .map_err(|error| Failure::unusable(format!("--edge: {error}")))?;
    let tolerance_m = args.tolerance.unwrap_or(args.edge);
    Ok(MapScore {
        edge_m: args.edge,
        map_points: clouds.map_m.len(),
        reference_points: clouds.reference_m.len(),
        correlation: correlation(&clouds.reference_m, &clouds.map_m, args.edge)
            .map_err(|error| Failure::new(error.to_string()))?,
        distance: clouds.distance(tolerance_m).map_err(|error| Failure::new(error.to_string()))?,
    })
}

fn extension(path: &Path) -> String {
    let extension = path.extension().and_then(|extension| extension.to_str());
    extension.unwrap_or_default().to_ascii_lowercase()
}

fn read_reference(path: &Path) -> Result<Vec<Point3<f32>>, Failure> {
    // A folder may be a bag with several files.
    if extension(path) == "mcap" || path.is_dir() { empty_scene_of_bag(path) } else { read(path) }
}

/// The cloud of the empty scene in a bag.
fn empty_scene_of_bag(path: &Path) -> Result<Vec<Point3<f32>>, Failure> {
    let unusable = |error: &dyn std::error::Error| {
        Failure::new(format!("{} on {TRUE_EMPTY_SCENE}: {error}", path.display()))
    };
    let bag = Bag::open(path).map_err(|error| Failure::new(error.to_string()))?;
    let scene = truth::empty_scene(&bag).map_err(|error| unusable(&error))?;
    scene.map(|scene| scene.points_m).ok_or_else(|| {
        Failure::new(format!("{} has no cloud on {TRUE_EMPTY_SCENE}", path.display())).fix(
            "only a bag of `stillmap simulate` has the empty scene; for others give a .ply or .pcd file of it",
        )
    })
}

fn read(path: &Path) -> Result<Vec<Point3<f32>>, Failure> {
    let decode = match extension(path).as_str() {
        "ply" => ply::decode,
        "pcd" => pcd::decode,
        _ => {
            return Err(Failure::new(format!(
                "{} is not a cloud of a known format",
                path.display()
            ))
            .fix("its name must end in .ply or .pcd"));
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

#[cfg(test)]
mod tests {
    use geometry::{Cloud, Scan, Stamp};

    use super::*;
    use robot::sensor_bag::SensorBag;

    /// Two walls that meet in a corner.
    fn corner() -> Vec<Point3<f32>> {
        let wall = |at: fn(f32, f32) -> Point3<f32>| {
            (0..400).map(move |cell| at((cell % 20) as f32 * 0.1, (cell / 20) as f32 * 0.1))
        };
        wall(|y, z| Point3::new(3.0, y, z))
            .chain(wall(|x, z| Point3::new(1.0 + x, 2.0, z)))
            .collect()
    }

    fn bag(folder: &Path, fill: impl FnOnce(&mut SensorBag)) -> PathBuf {
        let path = folder.join("room.mcap");
        let mut bag = SensorBag::create(&path).unwrap();
        fill(&mut bag);
        bag.finish().unwrap();
        path
    }

    fn scored(map: &Path, reference: &Path) -> Result<MapScore, Failure> {
        score(&MapArgs {
            map: map.to_owned(),
            reference: reference.to_owned(),
            edge: 0.08,
            tolerance: None,
            json: false,
        })
    }

    #[test]
    fn the_empty_scene_of_a_bag_is_a_reference_as_its_file_is() {
        let folder = tempfile::tempdir().unwrap();
        let map = folder.path().join("map.ply");
        std::fs::write(&map, ply::encode(&corner()[..600])).unwrap();
        let file = folder.path().join("empty.ply");
        std::fs::write(&file, ply::encode(&corner())).unwrap();
        let frame_id = "map".to_owned();
        let cloud = Cloud { stamp: Stamp::from_nanos(1), frame_id, points_m: corner() };
        let bag = bag(folder.path(), |bag| bag.empty_scene(&cloud).unwrap());
        let (of_bag, of_file) = (scored(&map, &bag).unwrap(), scored(&map, &file).unwrap());
        assert_eq!(of_bag.reference_points, of_file.reference_points);
        assert_eq!(of_bag.distance, of_file.distance);
        assert!(of_bag.distance.recall < 0.9 && of_bag.distance.precision > 0.99);
    }

    #[test]
    fn a_bag_without_the_empty_scene_says_so_and_what_to_give() {
        let folder = tempfile::tempdir().unwrap();
        let scan = Scan {
            stamp: Stamp::from_nanos(1),
            frame_id: "laser".to_owned(),
            angle_min_rad: 0.0,
            angle_increment_rad: 0.1,
            time_increment_s: 0.0,
            scan_time_s: 0.1,
            range_min_m: 0.1,
            range_max_m: 8.0,
            ranges_m: vec![1.0; 3],
        };
        let bag = bag(folder.path(), |bag| bag.scan(&scan).unwrap());
        let error = read_reference(&bag).unwrap_err().to_string();
        assert!(error.contains("room.mcap has no cloud on /truth/empty_scene"), "{error}");
        assert!(error.contains(".ply or .pcd"), "{error}");
        // The map itself is a file.
        assert!(read(&bag).unwrap_err().to_string().contains("not a cloud of a known format"));
        let missing = read_reference(&folder.path().join("none.mcap")).unwrap_err().to_string();
        assert!(missing.contains("none.mcap"), "{missing}");
        let neither = read_reference(Path::new("room.csv")).unwrap_err().to_string();
        assert!(neither.contains(".ply or .pcd"), "{neither}");
    }
}
