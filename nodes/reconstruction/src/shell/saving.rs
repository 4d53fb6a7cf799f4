//! Saving of the map to its file: periodically, on request and at the end. A map that continues the one in the file
//! replaces it; before another map does, the file is kept as a numbered version.

use std::time::Duration;

use msgs::std_srvs::Trigger;
use node_shell::{Counters, NodeFailure, Request};
use tokio::task::JoinHandle;
use tokio::time::Instant;

use super::Stage;
use super::map_file::{Former, MapFile, Saved, Snapshot};
use super::parameters::Settings;

/// The error of a service without a file.
pub(super) const NO_MAP_FILE: &str =
    "the parameter map_file is empty: a path that ends in .ply, .pcd or .bt";

/// The name of the file on `/diagnostics`.
const CONDITION: &str = "map file";

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
    file: MapFile,
    task: JoinHandle<Result<Saved, NodeFailure>>,
}

impl<'a> Saving<'a> {
    pub(super) fn new(settings: &Settings, counters: Counters) -> Self {
        Self {
            file: settings.file.clone(),
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

    /// Whether another save may begin.
    pub(super) fn is_idle(&self) -> bool {
        self.running.is_none()
    }

    /// Applies changed settings. Another file has another map.
    pub(super) fn change(&mut self, settings: &Settings) {
        self.period = settings.save_period;
        if self.file != settings.file {
            self.file = settings.file.clone();
            self.most_points = None;
        }
    }

    /// Begins to save a changed map, once in a period.
    pub(super) fn look(&mut self, stage: &mut Stage, now: Instant) {
        let is_due = now.saturating_duration_since(self.last) >= self.period;
        if is_due && stage.unsaved.is_changed && self.file.is_some() && self.is_idle() {
            self.begin(stage, None);
        }
    }

    /// Begins to save the map as it is now. The request is answered when it is done.
    pub(super) fn begin(&mut self, stage: &mut Stage, request: Option<Request<'a, Trigger>>) {
        self.last = Instant::now();
        match self.prepare(stage) {
            Ok((file, snapshot, keeps_former)) => {
                let writer = file.clone();
                let write = move || writer.write(&snapshot, keeps_former);
                let task = tokio::task::spawn_blocking(write);
                self.running = Some(Running { request, file, task });
            }
            Err(error) => {
                if self.file.is_some() {
                    self.failed(&error);
                }
                if let Some(request) = request {
                    request.answer(Err(error));
                }
            }
        }
    }

    /// The result of the running save; never returns if there is none. The future may be dropped while it waits.
    pub(super) async fn finish(&mut self) -> Result<Saved, NodeFailure> {
        let Some(running) = &mut self.running else { return std::future::pending().await };
        (&mut running.task).await.unwrap_or_else(|error| Err(error.into()))
    }

    /// Processes the result of [`Self::finish`].
    pub(super) fn finished(&mut self, saved: Result<Saved, NodeFailure>, stage: &mut Stage) {
        let Some(running) = self.running.take() else { return };
        let done = self.note(saved, &running.file, stage);
        if let Some(request) = running.request {
            request.answer(done);
        }
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
        let is_needed = |file: &MapFile| stage.unsaved.is_changed || !file.exists();
        if !self.file().is_some_and(is_needed) {
            return Ok(None);
        }
        let (file, snapshot, keeps_former) = self.prepare(stage)?;
        let saved = file.write(&snapshot, keeps_former);
        self.note(saved, &file, stage).map(Some)
    }

    /// The file, its new content, and whether the existing file is kept.
    fn prepare(&mut self, stage: &mut Stage) -> Result<(MapFile, Snapshot, bool), NodeFailure> {
        let file = self.file.clone().ok_or(NO_MAP_FILE)?;
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
        saved: Result<Saved, NodeFailure>,
        file: &MapFile,
        stage: &mut Stage,
    ) -> Result<String, NodeFailure> {
        let path = file.path().display();
        match saved {
            Ok(Saved { points, former }) => {
                let mut done = format!("saved a map of {points} points to {path}");
                let is_first = self.most_points.is_none();
                if self.file.as_ref() == Some(file) {
                    self.most_points =
                        Some(self.most_points.map_or(points, |most| most.max(points)));
                }
                self.counters.note_condition(CONDITION, &done, false);
                if let Some(Former { version, points: before }) = former {
                    let before_text = before
                        .map_or("no points that could be read".to_owned(), |n| {
                            format!("{n} points")
                        });
                    done = format!(
                        "{done}; the file had {before_text}, and is kept as {}",
                        version.display()
                    );
                    if before.is_none_or(|before| points < before) {
                        tracing::warn!("{done}");
                        return Ok(done);
                    }
                }
                if is_first {
                    tracing::info!("{done}");
                } else {
                    tracing::debug!("{done}");
                }
                Ok(done)
            }
            Err(error) => {
                stage.unsaved.is_changed = true;
                self.failed(&error);
                Err(error)
            }
        }
    }

    fn failed(&self, error: &NodeFailure) {
        let error = error.to_string();
        tracing::warn!("{error}");
        self.counters.note_condition(CONDITION, &error, true);
    }
}
