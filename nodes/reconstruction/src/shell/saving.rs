//! The map goes to its file: every so often, on request and at the end. A map that has grown out of the one in the file
//! replaces it; before another one does, the file is kept as a numbered version.

use std::time::Duration;

use msgs::std_srvs::Trigger;
use node_shell::{Counters, NodeFailure, Request};
use tokio::task::JoinHandle;
use tokio::time::Instant;

use super::Stage;
use super::map_file::{Former, MapFile, Saved, Snapshot};
use super::parameters::Settings;

/// A service has no file to work on.
pub(super) const NO_MAP_FILE: &str =
    "the parameter map_file is empty: a path that ends in .ply, .pcd or .bt";

/// The name of the file on `/diagnostics`.
const CONDITION: &str = "map file";

/// A map with less than one in so many of the points that its file has had is another map: what the rays clear within
/// one run is less, unless the poses are wrong.
const SHRUNK: usize = 2;

/// What of the map is not in its file.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(super) struct Unsaved {
    /// The map has changed since it was saved.
    pub(super) is_changed: bool,
    /// It has not grown out of the map that was saved last.
    pub(super) is_another: bool,
}

impl Unsaved {
    /// Another map has taken the map's place, an empty one or one of a file.
    pub(super) const ANOTHER_MAP: Self = Self { is_changed: true, is_another: true };
}

/// When the map is saved, and whether the file that is there is kept. One save at a time, by another thread.
pub(super) struct Saving<'a> {
    file: Option<MapFile>,
    period: Duration,
    /// When the last save began, or the node did.
    last: Instant,
    /// The most points that the file has had from this map; `None` while it has another one.
    most_points: Option<usize>,
    running: Option<Running<'a>>,
    counters: Counters,
}

struct Running<'a> {
    /// Who is answered when it is done; `None` where it was due.
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

    /// The file that the map goes to.
    pub(super) fn file(&self) -> Option<&MapFile> {
        self.file.as_ref()
    }

    /// Whether another save may begin.
    pub(super) fn is_idle(&self) -> bool {
        self.running.is_none()
    }

    /// Goes on with other settings. What is in another file is another map.
    pub(super) fn change(&mut self, settings: &Settings) {
        self.period = settings.save_period;
        if self.file != settings.file {
            self.file = settings.file.clone();
            self.most_points = None;
        }
    }

    /// Begins to save what has changed, once in a period.
    pub(super) fn look(&mut self, stage: &mut Stage, now: Instant) {
        let is_due = now.saturating_duration_since(self.last) >= self.period;
        if is_due && stage.unsaved.is_changed && self.file.is_some() && self.is_idle() {
            self.begin(stage, None);
        }
    }

    /// Begins to save the map as it is now. Who asked for it is answered when it is done.
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

    /// What came of the save that runs. May be dropped while it waits; never returns when none does.
    pub(super) async fn finish(&mut self) -> Result<Saved, NodeFailure> {
        let Some(running) = &mut self.running else { return std::future::pending().await };
        (&mut running.task).await.unwrap_or_else(|error| Err(error.into()))
    }

    /// Takes note of what [`Self::finish`] has returned.
    pub(super) fn finished(&mut self, saved: Result<Saved, NodeFailure>, stage: &mut Stage) {
        let Some(running) = self.running.take() else { return };
        let done = self.note(saved, &running.file, stage);
        if let Some(request) = running.request {
            request.answer(done);
        }
    }

    /// Saves the map before it goes: where it has changed, or there is no file yet. Returns what was done.
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

    /// The file, what goes to it, and whether what is there is kept.
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

    /// Takes note of what came of a save. Returns what was done.
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
