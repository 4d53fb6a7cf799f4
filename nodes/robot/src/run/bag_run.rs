//! The run of one bag: it is read over either transport, scored, and its results are written.

use std::path::Path;

use bag_player::Bag;
use nalgebra::Isometry3;
use report::{DynamicScore, RunRecord, Summary};

use super::chosen::Chosen;
use super::closing::{open_report, print_summary};
use super::inputs::{Inputs, TopicArgs};
use super::output::OutputFolder;
use super::parameters::PipelineParameters;
use super::scanned_bag::ScannedBag;
use super::transports::{Finished, run_locally, run_over_dds};
use super::{HowArgs, TransportName, bag_name, dds, drawings, findings, mesh_output};
use crate::console;
use crate::failure::{Failure, Outcome};
use crate::interrupt::Interrupt;
use crate::visual::write_trajectory;

/// Scores a run against the ground truth in its bag; `None` if the bag has none.
pub type Scoring =
    fn(&Bag, &Inputs, &PipelineParameters, &RunRecord) -> Result<Option<DynamicScore>, Failure>;

/// Runs a bag and writes the results.
///
/// # Errors
/// When the bag cannot be read, or there is no result.
pub fn run_bag(
    bag_path: &Path,
    out: &Path,
    topics: &TopicArgs,
    (how, transport): (&HowArgs, TransportName),
    scoring: Option<Scoring>,
    interrupt: &Interrupt,
) -> Result<Outcome, Failure> {
    how.refuse_outputs(out)?;
    how.check()?;
    let chosen = Chosen::of(bag_path, topics, (&how.parameters, how.no_colour), interrupt)?;
    let Chosen { bag, info, added_scans, inputs, parameters, notes } = chosen;
    notes.into_iter().for_each(console::note);
    let yaml = parameters.to_yaml()?;
    let folder = OutputFolder::create(out, &yaml)?;
    let grid_file = parameters.wants_grid().then(|| folder.grid_file()).transpose()?;
    let map_file = folder.node_map_file()?;
    let grid_before = folder.grid_saved_at();
    let mesh_file = how.mesh.map(|form| folder.mesh_file(form)).transpose()?;
    let mesh_before = how.mesh.and_then(|form| folder.mesh_saved_at(form));

    let Finished { mut record, losses, failure, poses, grid, mesh, is_interrupted } =
        match transport {
            TransportName::Local => {
                let how = (&parameters, how.mesh.is_some());
                run_locally(&bag, &info, (&inputs, added_scans), how, interrupt)?
            }
            TransportName::Dds => {
                let bag_name = bag_name(bag_path);
                // The player needs them in a bag.
                let scanned = added_scans
                    .map(|added| ScannedBag::of((&bag, &info), &bag_name, added, interrupt))
                    .transpose()?;
                let playback = dds::Playback {
                    bag: scanned.as_ref().map_or(bag_path, |scanned| &scanned.bag),
                    bag_name: &bag_name,
                    rate: how.rate,
                    parameters: folder.parameters(),
                    map_file: &map_file,
                    grid_file: grid_file.as_deref(),
                    mesh_file: mesh_file.as_deref(),
                };
                run_over_dds(&playback, &info, &inputs, &parameters, interrupt)?
            }
        };
    if is_interrupted && record.cycles.is_empty() {
        console::note("interrupted before the first cycle: nothing is written");
        return Ok(Outcome::Interrupted);
    }
    let scored = scoring.map(|score| score(&bag, &inputs, &parameters, &record));
    let (score, unscored) = match scored.transpose() {
        Ok(score) => (score.flatten(), None),
        Err(failure) => (None, Some(failure)),
    };
    let summary = Summary::of_run(&record, score, !how.no_timing)
        .map_err(|error| Failure::new(error.to_string()))?;
    // The report has it as a layer.
    let mesh_error = match mesh {
        Some(Ok(mesh)) => {
            record.mesh = Some(mesh);
            None
        }
        Some(Err(error)) => Some(error),
        None => None,
    };
    folder.write(&record, &summary)?;
    let drawings = drawings::draw(&how.drawings, &folder, &record, how.json)?;
    if let Some(poses) = &poses {
        let trajectory = folder.path().join("trajectory.txt");
        write_trajectory(&trajectory, poses, &Isometry3::identity())?;
    }

    let mut findings = findings::findings(&losses, &record, &inputs);
    match grid {
        Some(Ok(grid)) => folder.write_grid(&grid)?,
        Some(Err(error)) => {
            folder.remove_grid()?;
            findings.push(Failure::new(error.to_string()));
        }
        // The node of the map has saved it, or said why not.
        None if grid_file.is_some() && folder.grid_saved_at() != grid_before => {}
        None => {
            folder.remove_grid()?;
            findings.extend(grid_file.map(|_| Failure::new(NO_GRID)));
        }
    }
    let mesh = mesh_error.map_or_else(|| record.mesh.as_ref().map(Ok), |error| Some(Err(error)));
    findings.extend(mesh_output::settle(&folder, how.mesh, mesh, mesh_before)?);
    findings.extend(unscored);
    for finding in &findings {
        console::print_failure(finding);
    }
    let no_result = || findings::no_result(&record).filter(|_| !is_interrupted);
    if let Some(failure) = failure.or_else(no_result) {
        return Err(failure);
    }
    print_summary(&folder, &summary, &drawings, how.json)?;
    if how.open {
        open_report(&folder);
    }
    if is_interrupted {
        console::note("interrupted: the results are of what was read until then");
        return Ok(Outcome::Interrupted);
    }
    Ok(if findings.is_empty() { Outcome::Complete } else { Outcome::WithLosses })
}

/// Over DDS the node of the map says why.
const NO_GRID: &str = "reconstruction has saved no occupancy grid: its log says why";
