//! Saving of the map to its file: periodically, on request and at the end. A map that continues the one in the file
//! replaces it; before another map does, the file is kept as a numbered version.

mod job;

use std::time::Duration;

use msgs::std_srvs::Trigger;
use node_shell::{Counters, NodeFailure, Request};
use tokio::task::JoinHandle;
use tokio::time::Instant;

use super::Stage;
use super::grid_output::GridFile;
use super::map_file::{Former, MapFile, Saved, Snapshot};
use super::mesh_file::MeshFile;
use super::parameters::Settings;
pub(super) use job::Done;
use job::Job;

/// The error of a service without a file.
pub(super) const NO_MAP_FILE: &str =
    "the parameter map_file is empty: a path that ends in .ply, .pcd or .bt";

/// The name of the file on `/diagnostics`.
pub(super) const CONDITION: &str = "map file";
/// The names of the other files there.
const GRID_CONDITION: &str = "grid file";
const MESH_CONDITION: &str = "mesh file";

/// A map with less than this fraction (1 / 2) of the points of its file counts as another map: less is cleared within
/// one run, unless the poses are wrong.
const SHRUNK: usize = 2;

/// How the map differs from its file.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(super) struct Unsaved {
    /// The map has changed since it was saved.
    pub(super) is_changed: bool,
    /// It does not continue the map that was saved last.
    pub(super) is_another: bool,
}

impl Unsaved {
    /// The map was replaced, by an empty one or one of a file.
    pub(super) const ANOTHER_MAP: Self = Self { is_changed: true, is_another: true };
}

/// Decides when the map is saved, and whether the existing file is kept. One save at a time, by another thread.
pub(super) struct Saving<'a> {
    file: Option<MapFile>,
    grid_file: Option<GridFile>,
    /// The file of the grid has one of another run, or of another map.
    keeps_grid: bool,
    mesh_file: Option<MeshFile>,
    period: Duration,
    /// The time of the start of the last save, or of the node.
    last: Instant,
    /// The most points that the file has had of this map; `None` while it has another map.
    most_points: Option<usize>,
    running: Option<Running<'a>>,
    counters: Counters,
}

struct Running<'a> {
    /// The request that is answered when it is done; `None` for a periodic save.
    request: Option<Request<'a, Trigger>>,
    file: Option<MapFile>,
    task: JoinHandle<Done>,
}

impl<'a> Saving<'a> {
    pub(super) fn new(settings: &Settings, counters: Counters) -> Self {
        Self {
            file: settings.file.clone(),
            grid_file: settings.grid_file.clone(),
            keeps_grid: true,
            mesh_file: settings.mesh_file.clone(),
            period: settings.save_period,
            last: Instant::now(),
            most_points: None,
            running: None,
            counters,
        }
    }

    /// The file of the map.
    pub(super) fn file(&self) -> Option<&MapFile> {
        self.file.as_ref()
    }

    fn has_file(&self) -> bool {
        self.file.is_some() || self.grid_file.is_some() || self.mesh_file.is_some()
    }

    /// Whether another save may begin.
    pub(super) fn is_idle(&self) -> bool {
        self.running.is_none()
    }

    /// Applies changed settings. The files stay those of the start.
    pub(super) fn change(&mut self, settings: &Settings) {
        self.period = settings.save_period;
    }

    /// Begins to save a changed map, once in a period.
    pub(super) fn look(&mut self, stage: &mut Stage, now: Instant) {
        let is_due = now.saturating_duration_since(self.last) >= self.period;
        let is_changed = stage.unsaved.is_changed && !self.would_be_the_first_and_empty(stage);
        if is_due && is_changed && self.has_file() && self.is_idle() {
            self.begin(stage, None);
        }
    }

    /// Begins to save the map as it is now. The request is answered when it is done.
    pub(super) fn begin(&mut self, stage: &mut Stage, request: Option<Request<'a, Trigger>>) {
        self.last = Instant::now();
        // A node saves the map also where there is no grid or mesh yet; who asks for all gets the reason.
        match self.prepare(stage, request.is_some()) {
            Ok(job) => {
                let file = job.map.as_ref().map(|(file, ..)| file.clone());
                let task = tokio::task::spawn_blocking(move || job.write());
                self.running = Some(Running { request, file, task });
            }
            Err(error) => {
                if self.has_file() {
                    stage.unsaved.is_changed = true;
                    self.failed(CONDITION, &error);
                }
                if let Some(request) = request {
                    request.answer(Err(error));
                }
            }
        }
    }

    /// The result of the running save; never returns if there is none. The future may be dropped while it waits.
    pub(super) async fn finish(&mut self) -> Result<Done, NodeFailure> {
        let Some(running) = &mut self.running else { return std::future::pending().await };
        Ok((&mut running.task).await?)
    }

    /// Processes the result of [`Self::finish`].
    pub(super) fn finished(&mut self, saved: Result<Done, NodeFailure>, stage: &mut Stage) {
        let Some(running) = self.running.take() else { return };
        let done = self.note(saved, running.file.as_ref(), stage);
        if let Some(request) = running.request {
            request.answer(done);
        }
    }

    /// Whether nothing was mapped, and there is no map in the file either: a file without a point would be the next start's former map.
    fn would_be_the_first_and_empty(&self, stage: &Stage) -> bool {
        stage.map.is_empty() && self.file().is_none_or(|file| !file.exists())
    }

    /// Saves the map before it is dropped, if it has changed or there is no file yet. Returns what was done.
    ///
    /// # Errors
    /// When the map cannot be saved.
    pub(super) async fn save_now(
        &mut self,
        stage: &mut Stage,
    ) -> Result<Option<String>, NodeFailure> {
        if !self.is_idle() {
            let saved = self.finish().await;
            self.finished(saved, stage);
        }
        let is_missing = self.file().is_some_and(|file| !file.exists())
            || self.grid_file.as_ref().is_some_and(|file| !file.path().exists())
            || self.mesh_file.as_ref().is_some_and(|file| !file.path().exists());
        if !(is_missing || self.has_file() && stage.unsaved.is_changed) {
            return Ok(None);
        }
        if self.would_be_the_first_and_empty(stage) {
            tracing::info!("nothing was mapped: no map is saved");
            return Ok(None);
        }
        let job = self.prepare(stage, false)?;
        let file = job.map.as_ref().map(|(file, ..)| file.clone());
        self.note(Ok(job.write()), file.as_ref(), stage).map(Some)
    }

    /// What is to be written. A missing grid or mesh is a part of the result only if `needs_all`; otherwise it is logged.
    fn prepare(&mut self, stage: &mut Stage, needs_all: bool) -> Result<Job, NodeFailure> {
        if !self.has_file() {
            return Err(NO_MAP_FILE.into());
        }
        // A grid of scans is of this run alone, and cannot be made of the map.
        self.keeps_grid |= stage.unsaved.is_another;
        let keeps_grid = self.keeps_grid && stage.map.has_grid_of_scans();
        let grid = self.grid_file.clone();
        let grid = grid.map(|file| Ok((file, stage.map.occupancy_grid()?, keeps_grid)));
        let grid = grid.and_then(|grid| self.or_log(GRID_CONDITION, grid, needs_all));
        let mesh = self.mesh_file.clone().map(|file| Ok((file, stage.map.mesh()?)));
        let mesh = mesh.and_then(|mesh| self.or_log(MESH_CONDITION, mesh, needs_all));
        let map = self.file.clone().map(|file| self.prepare_map(file, stage)).transpose()?;
        stage.unsaved = Unsaved::default();
        Ok(Job { map, grid, mesh })
    }

    /// A result that may be missing.
    fn or_log<T>(
        &self,
        condition: &'static str,
        made: Result<T, NodeFailure>,
        is_needed: bool,
    ) -> Option<Result<T, NodeFailure>> {
        if let (Err(error), false) = (&made, is_needed) {
            self.failed(condition, error);
            return None;
        }
        Some(made)
    }

    /// The file, its new content, and whether the existing file is kept.
    fn prepare_map(
        &mut self,
        file: MapFile,
        stage: &mut Stage,
    ) -> Result<(MapFile, Snapshot, bool), NodeFailure> {
        let snapshot = Snapshot::of(&stage.map)?;
        if std::mem::take(&mut stage.unsaved).is_another {
            self.most_points = None;
        }
        let points = snapshot.points();
        let keeps_former = self.most_points.is_none_or(|most| points.saturating_mul(SHRUNK) < most);
        if keeps_former {
            self.most_points = None;
        }
        Ok((file, snapshot, keeps_former))
    }

    /// Processes the result of a save. Returns what was done.
    fn note(
        &mut self,
        saved: Result<Done, NodeFailure>,
        file: Option<&MapFile>,
        stage: &mut Stage,
    ) -> Result<String, NodeFailure> {
        let Done { map, grid, mesh } = saved.inspect_err(|error| {
            stage.unsaved.is_changed = true;
            self.failed(CONDITION, error);
        })?;
        let map = map.zip(file).map(|(saved, file)| match saved {
            Ok(saved) => Ok(self.note_map(saved, file)),
            Err(error) => {
                self.failed(CONDITION, &error);
                Err(error)
            }
        });
        if matches!(grid, Some(Ok(_))) {
            self.keeps_grid = false;
        }
        let others = [(GRID_CONDITION, grid), (MESH_CONDITION, mesh)];
        let others = others.into_iter().filter_map(|(condition, saved)| {
            let saved = saved?.inspect_err(|error| self.failed(condition, error));
            Some(saved.map(|saved| {
                let done = format!("saved {saved}");
                self.counters.note_condition(condition, &done, false);
                done
            }))
        });
        let done: Result<Vec<String>, NodeFailure> = map.into_iter().chain(others).collect();
        let done = done.inspect_err(|_| stage.unsaved.is_changed = true)?;
        Ok(done.join("; "))
    }

    fn note_map(&mut self, saved: Saved, file: &MapFile) -> String {
        let Saved { points, former } = saved;
        let mut done = format!("saved a map of {points} points to {}", file.path().display());
        let is_first = self.most_points.is_none();
        self.most_points = Some(self.most_points.map_or(points, |most| most.max(points)));
        self.counters.note_condition(CONDITION, &done, false);
        if let Some(Former { version, points: before }) = former {
            let before_text =
                before.map_or("no points that could be read".to_owned(), |n| format!("{n} points"));
            done =
                format!("{done}; the file had {before_text}, and is kept as {}", version.display());
            if before.is_none_or(|before| points < before) {
                tracing::warn!("{done}");
                return done;
            }
        }
        if is_first {
            tracing::info!("{done}");
        } else {
            tracing::debug!("{done}");
        }
        done
    }

    fn failed(&self, condition: &'static str, error: &NodeFailure) {
        let error = error.to_string();
        tracing::warn!("{error}");
        self.counters.note_condition(condition, &error, true);
    }
}
