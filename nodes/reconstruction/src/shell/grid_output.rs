//! The occupancy grid on its topics and in its files.
//!
//! `map` has the whole grid, latched: for a new subscriber (within `grid_period_s`), when its border has moved, and once in `map_publish_period_s`.
//! `map_updates` has what has changed since, as a rectangle, once in `grid_period_s`; of a map so large that this would take much of the node's
//! time, less often. Nothing is made while nobody subscribes.

use std::io;
use std::path::{Path, PathBuf};
use std::time::Duration;

use geometry::{GridCell, OccupancyGrid};
use msgs::convert;
use msgs::map_msgs::OccupancyGridUpdate;
use msgs::nav_msgs;
use node_shell::{
    Node, NodeFailure, Publisher, Qos, Throttle, keep_version_with, output_file, write_whole_file,
};
use tokio::time::Instant;

use super::parameters::Settings;
use crate::{GridError, Map};

/// Updates that may wait for a subscriber.
const UPDATES_KEPT: usize = 10;

/// Making the grid takes no more than this share (1 / 20) of the node's time: of a large map it comes less often.
const MOST_SHARE: u32 = 20;

/// The periods of the grid.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct Periods {
    whole: Duration,
    updates: Duration,
}

/// Publishes the grid. See the module.
pub(super) struct GridOutput {
    grids: Publisher<nav_msgs::OccupancyGrid>,
    updates: Publisher<OccupancyGridUpdate>,
    periods: Periods,
    /// What subscribers have.
    known: Option<OccupancyGrid>,
    /// The subscribers that have it.
    known_to: usize,
    has_changed: bool,
    /// Subscribers of `map` alone do not have what was last published as an update.
    whole_is_stale: bool,
    last_whole: Option<Instant>,
    last_look: Option<Instant>,
    /// How long the last one took.
    last_took: Duration,
    failed: Throttle,
}

impl GridOutput {
    pub(super) fn new(node: &Node, settings: &Settings) -> Result<Self, NodeFailure> {
        Ok(Self {
            grids: node.publisher("map", &Qos::latched())?,
            updates: node.publisher("map_updates", &Qos::reliable(UPDATES_KEPT))?,
            periods: Self::periods(settings),
            known: None,
            known_to: 0,
            has_changed: false,
            whole_is_stale: false,
            last_whole: None,
            last_look: None,
            last_took: Duration::ZERO,
            failed: Throttle::for_warnings(),
        })
    }

    fn periods(settings: &Settings) -> Periods {
        Periods { whole: settings.periods.map, updates: settings.grid_period }
    }

    pub(super) fn change(&mut self, settings: &Settings) {
        self.periods = Self::periods(settings);
    }

    /// The map has changed.
    pub(super) fn changed(&mut self) {
        self.has_changed = true;
    }

    /// Publishes what is due.
    pub(super) fn look(&mut self, map: &mut Map, now: Instant) {
        let (of_whole, of_updates) =
            (self.grids.subscriber_count(), self.updates.subscriber_count());
        let has_new = of_whole > self.known_to;
        self.known_to = self.known_to.min(of_whole);
        let is_due = |last: Option<Instant>, period| {
            last.is_none_or(|last| now.saturating_duration_since(last) >= period)
        };
        let whole_is_due = is_due(self.last_whole, self.periods.whole);
        if of_whole + of_updates == 0
            || !(has_new || self.has_changed || self.whole_is_stale && whole_is_due)
            || !is_due(self.last_look, self.periods.updates.max(self.last_took * MOST_SHARE))
        {
            return;
        }
        self.last_look = Some(now);
        let start = Instant::now();
        let made = map.occupancy_grid();
        self.last_took = start.elapsed();
        let grid = match made {
            // Subscribers make place for a grid: its border does not shrink.
            Ok(grid) => match &self.known {
                Some(known) if known.frame_id == grid.frame_id => grid.widened_to(known),
                _ => grid,
            },
            // Nothing is mapped yet, or no more: a grid that was published is unknown now.
            Err(GridError::EmptyMap | GridError::NoScan) => {
                self.has_changed = false;
                if let Some(known) = self.known.take() {
                    let cells = vec![GridCell::Unknown; known.cells.len()];
                    let unknown = OccupancyGrid { cells, ..known };
                    self.grids.publish_or_warn(convert::message_from_grid(&unknown));
                }
                return;
            }
            Err(error) => {
                if let Some(held_back) = self.failed.pass() {
                    tracing::warn!("{error} ({held_back} more since the last warning)");
                }
                return;
            }
        };
        self.has_changed = false;
        let known = self.known.as_ref().filter(|known| known.is_same_part(&grid));
        let part = known.map(|known| grid.changed_since(known));
        let is_news = self.whole_is_stale || !matches!(part, Some(None));
        let is_whole = part.is_none() || has_new || is_news && whole_is_due;
        if is_whole && of_whole > 0 {
            if !self.grids.publish_or_warn(convert::message_from_grid(&grid)) {
                self.has_changed = true;
                return;
            }
            (self.last_whole, self.known_to) = (Some(now), of_whole);
            self.whole_is_stale = false;
        } else if let Some(Some(part)) = part {
            self.whole_is_stale = true;
            if of_updates == 0 {
                return;
            }
            if !self.updates.publish_or_warn(convert::update_of_grid(&grid, part)) {
                self.has_changed = true;
                return;
            }
        }
        self.known = Some(grid);
    }
}

/// The pair of files of `map_server`.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct GridFile {
    yaml: PathBuf,
    image: PathBuf,
    /// The image's name, which the YAML file has.
    image_name: String,
}

impl GridFile {
    /// The files at the path of `parameter`, none for an empty path. A path that cannot be written is an error now.
    pub(super) fn new(parameter: &str, path: &str) -> Result<Option<Self>, NodeFailure> {
        let Some(yaml) = output_file(parameter, path)? else { return Ok(None) };
        let shown = yaml.display();
        if yaml.extension().is_none_or(|extension| extension != "yaml") {
            return Err(format!("parameter {parameter} must end in .yaml, not {shown}").into());
        }
        let image = yaml.with_extension("pgm");
        let name = image.file_name().and_then(|name| name.to_str());
        let image_name = name
            .ok_or_else(|| format!("parameter {parameter}: the name of {shown} is no UTF-8"))?
            .to_owned();
        Ok(Some(Self { image, image_name, yaml }))
    }

    pub(super) fn path(&self) -> &Path {
        &self.yaml
    }

    /// Writes the image and then the file that names it, each under a temporary name first. With `keeps_former` what is there is kept as a
    /// numbered version of both ([`keep_version_with`]), which is returned.
    ///
    /// # Errors
    /// When the folder cannot be written or is full; what could not be written is unchanged.
    pub(super) fn write(
        &self,
        grid: &OccupancyGrid,
        keeps_former: bool,
    ) -> Result<Option<PathBuf>, NodeFailure> {
        let failed = |path: &Path, error: io::Error| {
            format!("the grid could not be saved to {}: {error}", path.display())
        };
        let former = keeps_former.then(|| keep_version_with(&self.yaml, Some(&self.image)));
        let former = former.transpose().map_err(|error| failed(&self.yaml, error))?.flatten();
        for (path, bytes) in
            [(&self.image, grid.pgm()), (&self.yaml, grid.map_yaml(&self.image_name).into())]
        {
            write_whole_file(path, &bytes).map_err(|error| failed(path, error))?;
        }
        Ok(former)
    }
}
