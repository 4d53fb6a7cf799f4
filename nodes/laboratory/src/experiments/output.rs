//! The output folder of the experiments.

use std::fs;
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::figures::{ObjectFigures, RunFigures};
use super::positions::{Along, MEAN_OF_POINTS, PositionErrors, TRACK};
use super::runs::Runs;
use super::section::Section;
use super::settings::Settings;
use robot::Failure;

/// The output files of the experiments.
pub(crate) const RESULTS: [&str; 3] = ["experiments.html", "experiments.json", "sightings.csv"];

/// The output folder. It is removed if nothing is written.
pub(crate) struct Folder {
    path: PathBuf,
    is_new: bool,
}

impl Drop for Folder {
    fn drop(&mut self) {
        if self.is_new {
            // It is not empty when there are results.
            let _ = fs::remove_dir(&self.path);
        }
    }
}

impl Folder {
    /// Makes the folder before the work starts, so that a folder that cannot be written is an error at once.
    pub(crate) fn create(path: &Path) -> Result<Self, Failure> {
        let is_new = !path.exists();
        fs::create_dir_all(path).map_err(|error| cannot_write(path, &error))?;
        Ok(Self { path: path.to_owned(), is_new })
    }

    /// First under a temporary name, so that no reader gets a partial file.
    pub(crate) fn write(&self, name: &str, text: &str) -> Result<(), Failure> {
        let path = self.path.join(name);
        let temporary = self.path.join(format!("{name}.part"));
        fs::write(&temporary, text)
            .and_then(|()| fs::rename(&temporary, &path))
            .map_err(|error| cannot_write(&path, &error))
    }
}

fn cannot_write(path: &Path, error: &std::io::Error) -> Failure {
    Failure::new(format!("cannot write {}: {error}", path.display()))
        .fix("give a folder that can be written with --out")
}

/// The content of `experiments.json`.
#[derive(Serialize)]
struct Document<'a> {
    seeds: u64,
    quick: bool,
    experiments: &'a [Section],
    /// All scenarios by all methods.
    runs: Vec<RunLine<'a>>,
}

/// A run, and the figures of its first object.
#[derive(Serialize)]
struct RunLine<'a> {
    #[serde(flatten)]
    figures: &'a RunFigures,
    cycles: usize,
    cycles_with_measured_zone: usize,
    found_share: Option<f64>,
    removed_share: Option<f64>,
    /// By the mean of the points classified as dynamic.
    depth_of_points: Option<PositionErrors>,
    place_of_points: Option<PositionErrors>,
    /// By the nearest track.
    depth_of_track: Option<PositionErrors>,
    place_of_track: Option<PositionErrors>,
}

impl<'a> RunLine<'a> {
    fn of(figures: &'a RunFigures) -> Self {
        let object = figures.object();
        let errors =
            |position_of, along| PositionErrors::of(&object?.sightings, position_of, along);
        Self {
            cycles: figures.cycles.len(),
            cycles_with_measured_zone: figures
                .cycles
                .iter()
                .filter(|cycle| cycle.has_measured_zone())
                .count(),
            found_share: object.and_then(ObjectFigures::found_share),
            removed_share: object.and_then(ObjectFigures::removed_share),
            depth_of_points: errors(MEAN_OF_POINTS, Along::Depth),
            place_of_points: errors(MEAN_OF_POINTS, Along::Plane),
            depth_of_track: errors(TRACK, Along::Depth),
            place_of_track: errors(TRACK, Along::Plane),
            figures,
        }
    }
}

/// All figures as JSON, with a newline at the end.
pub(crate) fn json(
    settings: &Settings,
    sections: &[Section],
    runs: &Runs,
) -> Result<String, Failure> {
    let document = Document {
        seeds: settings.seeds,
        quick: settings.is_quick(),
        experiments: sections,
        runs: runs.figures().map(RunLine::of).collect(),
    };
    let mut json = serde_json::to_string_pretty(&document)
        .map_err(|error| Failure::new(format!("cannot write the figures: {error}")))?;
    json.push('\n');
    Ok(json)
}
