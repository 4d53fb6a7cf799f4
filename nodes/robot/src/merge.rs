//! `stillmap merge`: two saved maps of one place as one, and what changed between them.

mod report;
#[cfg(test)]
mod tests;

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use clap::Args;
use estimation::ScopedThreads;
use geometry::{OrientedPoints, ply};
use map_merge::{Group, Merge, MergeError, SavedMap, merge};
use nalgebra::Isometry3;
use reconstruction::mesh::edge_of_map_points_m;

use self::report::Report;
use crate::console;
use crate::existing::{check_output_file, refuse_same_file};
use crate::failure::{Failure, Outcome};
use crate::interrupt::Interrupt;
use crate::map_file::{MapFile, write};
use crate::pose_numbers::pose_of_numbers;

/// Colours of the change map, of the palette of Okabe and Ito, which people who see few colours tell apart too: vermilion and bluish green, and
/// where it is not known where the other map looked orange and sky blue.
const GONE: [u8; 3] = [213, 94, 0];
const ADDED: [u8; 3] = [0, 158, 115];
const ONLY_IN_FIRST: [u8; 3] = [230, 159, 0];
const ONLY_IN_SECOND: [u8; 3] = [86, 180, 233];

/// Arguments of `stillmap merge`.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  stillmap merge monday.ply tuesday.ply -o house.ply
  stillmap merge monday.ply tuesday.ply -o house.ply --changes changed.ply
  stillmap merge house.bt kitchen.pcd -o house.ply --guess 3.2 -1 0 0 0 1.57

The second map may lie in any place and heading; up is z in both. What has gone since the first map is left out of the result, and what the
second map has besides is in it, in the frame of the first.")]
pub struct MergeArgs {
    /// The older map: a .ply, .pcd or octomap .bt file
    first: PathBuf,
    /// The newer map
    second: PathBuf,
    /// The merged map to write, a .ply file
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Write what changed, a .ply file: gone in vermilion, added in green
    #[arg(long, value_name = "FILE")]
    changes: Option<PathBuf>,
    /// Where the second map lies in the first, to some decimetres and degrees: no other place is looked for
    #[arg(long, num_args = 6, value_names = ["X", "Y", "Z", "ROLL", "PITCH", "YAW"], allow_negative_numbers = true)]
    guess: Option<Vec<f64>>,
    /// Replace files of these names
    #[arg(long)]
    overwrite: bool,
    /// Print the figures as JSON
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &MergeArgs, interrupt: &Interrupt) -> Result<Outcome, Failure> {
    let outputs = || std::iter::once(&args.output).chain(&args.changes);
    for (path, option) in outputs().zip(["-o", "--changes"]) {
        check(path, option)?;
        check_output_file(path, args.overwrite, option)?;
    }
    if let Some(changes) = &args.changes {
        refuse_same_file((&args.output, "-o"), (changes, "--changes"))?;
    }
    let guess = args.guess.as_deref().map(|numbers| pose_of_numbers("--guess", numbers));
    let guess = guess.transpose()?;
    let first = read(&args.first)?;
    let second = read(&args.second)?;
    let threads = std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN);
    let is_over = || interrupt.has_come();
    let merged =
        match merge(&first, &second, guess.as_ref(), &ScopedThreads::new(threads), &is_over) {
            Ok(merged) => merged,
            Err(MergeError::Interrupted) => {
                console::note("interrupted: nothing was written");
                return Ok(Outcome::Interrupted);
            }
            Err(error) => return Err(refused(args, &error)),
        };
    write(&args.output, &ply::encode_map(&merged.merged.points, &merged.merged.views))?;
    if let Some(path) = &args.changes {
        let OrientedPoints { points_m, normals, colours } = change_map(&first, &second, &merged);
        write(path, &ply::encode_with_colours(&points_m, &normals, &colours))?;
    }
    let report = Report::of(&merged, &first, &second);
    if args.json {
        let json = serde_json::to_string_pretty(&report)
            .map_err(|error| Failure::new(format!("cannot print the figures: {error}")))?;
        console::print(json)?;
    } else {
        console::print(format_args!("{}: {report}", args.output.display()))?;
    }
    Ok(Outcome::Complete)
}

/// That a file of this name can be written, as far as it is known before.
fn check(path: &Path, option: &str) -> Result<(), Failure> {
    let is_ply = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("ply"));
    if !is_ply {
        return Err(Failure::new(format!("{} is no .ply file", path.display()))
            .fix(format!("{option} must end in .ply; stillmap export makes other forms of it")));
    }
    Ok(())
}

fn read(path: &Path) -> Result<SavedMap, Failure> {
    let MapFile { points, views, edge_m } = MapFile::read(path)?;
    let wrong = |what: &str| Failure::new(format!("{}: {what}", path.display()));
    if points.points_m.is_empty() {
        return Err(wrong("the map is empty"));
    }
    let edge_m = edge_m
        .or_else(|| edge_of_map_points_m(&points))
        .ok_or_else(|| wrong("these points are too few, or too far apart, to be a map"))?;
    Ok(SavedMap { points, views, edge_m })
}

/// Why maps are not merged, and what to do.
fn refused(args: &MergeArgs, error: &MergeError) -> Failure {
    let both = format!("{} and {}", args.first.display(), args.second.display());
    let failure = Failure::new(error.to_string()).within(both);
    match error {
        MergeError::Ambiguous { .. } => failure.fix("--guess says where the second map lies in the first"),
        MergeError::NoAgreement { .. } | MergeError::NoOverlap if args.guess.is_some() => {
            failure.fix("is --guess right to some decimetres and degrees? Without it every place is looked at")
        }
        MergeError::NoAgreement { .. } | MergeError::NoOverlap => {
            failure.fix("are they of one place, do they share a room or two, and is z up in both?")
        }
        _ => failure,
    }
}

/// The points of all groups in the frame of the first map, coloured by what they are.
fn change_map(first: &SavedMap, second: &SavedMap, merged: &Merge) -> OrientedPoints {
    let (here, there) = (Isometry3::identity(), merged.alignment.a_from_b);
    let changes = &merged.changes;
    let mut all = OrientedPoints::default();
    let mut add = |map: &SavedMap, pose: &Isometry3<f64>, groups: &[Group], colour| {
        for index in groups.iter().flat_map(|group| &group.points) {
            let Some(point_m) = map.points.points_m.get(*index) else { continue };
            all.points_m.push((pose * point_m.cast::<f64>()).cast());
            let normal = map.points.normals.get(*index);
            all.normals
                .extend(normal.map(|normal| (pose.rotation * normal.cast::<f64>()).cast::<f32>()));
            all.colours.push(colour);
        }
    };
    add(first, &here, &changes.gone, GONE);
    add(second, &there, &changes.added, ADDED);
    add(first, &here, &changes.only_in_a, ONLY_IN_FIRST);
    add(second, &there, &changes.only_in_b, ONLY_IN_SECOND);
    all
}
