//! The core with its topics: clouds and paths update the map, and the map is published when it is due.

use geometry::{Cloud, ColouredCloud, OccupancyGrid, SegmentedCycle, TriangleMesh};
use msgs::convert;
use msgs::nav_msgs::Path;
use msgs::sensor_msgs::PointCloud2;
use node_shell::{
    Arrived, Counters, Node, NodeFailure, Panicked, PipelineWatch, Publisher, Qos, StageReporter,
    StepTimer, Subscription, Throttle, ValueSubscription,
};
use tokio::time::Instant;

use super::bounds_watch::BoundsWatch;
use super::distance_output::DistanceOutput;
use super::grid_output::GridOutput;
use super::mesh_output::MeshOutput;
use super::parameters::Settings;
use super::path::{self, PathWatch};
use super::saving::Unsaved;
use super::schedule::{Following, Schedule, Subscribers};
use super::spilling::{self, SpillWatch, empty_map};
use super::until_shutdown::UntilShutdown;
use super::{PROGRAM, ReconstructionParameters};
use crate::{Addition, GridError, GridSource, Map, MapChanges, MeshError};

/// The fix for cycles that take too long.
const REMEDY: &str = "raise map_edge_m, or voxel_edge_m, of the whole pipeline";

/// The cause of a drop.
const REFUSED: &str = "static cloud refused";
/// Each path holds the whole trajectory; more than one may apply to the waiting clouds.
const PATHS_KEPT: usize = 5;
/// Updates that may wait for a subscriber: five seconds of the default period.
const UPDATES_KEPT: usize = 10;

/// The core with its topics.
pub struct Stage {
    pub(super) cycles: ValueSubscription<SegmentedCycle>,
    pub(super) paths: Subscription<Path>,
    pub(super) path_watch: PathWatch,
    pipeline: PipelineWatch,
    pub(super) map: Map,
    pub(super) schedule: Schedule,
    pub(super) unsaved: Unsaved,
    /// Whether the map of the file was loaded, or there was no file.
    pub(super) has_begun: bool,
    /// Whether a map was loaded before the frame of the poses was known.
    pub(super) loaded_awaits_frame: bool,
    taken_cycles: u32,
    maps: Publisher<PointCloud2>,
    updates: Publisher<PointCloud2>,
    removals: Publisher<PointCloud2>,
    /// Absent where no grid is asked for: another node may publish on `map`.
    grid: Option<GridOutput>,
    /// Absent where the map has no distances.
    mesh: Option<MeshOutput>,
    pub(super) distances: DistanceOutput,
    most_update_points: usize,
    map_failed: Throttle,
    spill_watch: SpillWatch,
    bounds_watch: BoundsWatch,
    executor: UntilShutdown,
    reporter: StageReporter,
    counters: Counters,
}

impl Stage {
    /// The stage of `node`.
    ///
    /// # Errors
    /// When a parameter is out of its range, or a publisher or subscription cannot be created.
    pub fn new(node: &Node, parameters: &ReconstructionParameters) -> Result<Self, NodeFailure> {
        let settings = Settings::of(parameters)?;
        let paths = node.subscription("map_path", &Qos::reliable(PATHS_KEPT))?;
        node.counters().note_optional(paths.topic());
        Ok(Self {
            paths,
            path_watch: PathWatch::new(node.counters()),
            pipeline: PipelineWatch::new(parameters.config.pipeline.clone(), node.counters()),
            map: empty_map(parameters)?,
            schedule: Schedule::new(settings.periods),
            unsaved: Unsaved::default(),
            has_begun: false,
            loaded_awaits_frame: false,
            taken_cycles: 0,
            maps: node.publisher("static_map", &Qos::latched())?,
            updates: node.publisher("static_map_updates", &Qos::reliable(UPDATES_KEPT))?,
            removals: node.publisher("static_map_removals", &Qos::reliable(UPDATES_KEPT))?,
            grid: (parameters.config.grid.grid != GridSource::None)
                .then(|| GridOutput::new(node, &settings))
                .transpose()?,
            mesh: (parameters.config.pipeline.needs_depth())
                .then(|| MeshOutput::new(node, &settings))
                .transpose()?,
            distances: DistanceOutput::new(node, parameters.config.pipeline.needs_depth())?,
            most_update_points: settings.most_update_points,
            map_failed: Throttle::for_warnings(),
            spill_watch: SpillWatch::new(node.counters()),
            bounds_watch: BoundsWatch::new(parameters.config.clone(), node.counters()),
            executor: UntilShutdown::of(node),
            reporter: StageReporter::new(node, PROGRAM.name)?,
            counters: node.counters(),
            cycles: node.value_subscription("segmented_cloud", &node.cycles_qos())?,
        })
    }

    /// Applies changed settings.
    pub(super) fn change(&mut self, settings: &Settings) {
        self.schedule.set_periods(settings.periods);
        self.most_update_points = settings.most_update_points;
        if let Some(grid) = &mut self.grid {
            grid.change(settings);
        }
        if let Some(mesh) = &mut self.mesh {
            mesh.change(settings);
        }
    }

    /// Takes every message that has arrived.
    pub fn take_waiting(&mut self) {
        while let Some(received) = self.paths.try_next() {
            self.take_path(&received.message);
        }
        while let Some(received) = self.cycles.try_next() {
            self.take(&received.message);
        }
    }

    /// Takes the next cycle, if one has arrived.
    pub(super) fn take_next_waiting(&mut self) {
        if let Some(received) = self.cycles.try_next() {
            self.take(&received.message);
        }
    }

    /// The map so far.
    #[must_use]
    pub fn map(&self) -> &Map {
        &self.map
    }

    /// The occupancy grid of the map so far.
    ///
    /// # Errors
    /// When none was asked for, or there is none.
    pub fn occupancy_grid(&mut self) -> Result<OccupancyGrid, GridError> {
        self.map.occupancy_grid()
    }

    /// The map so far as triangles.
    ///
    /// # Errors
    /// When there are none, or the map is one of means.
    pub fn mesh(&self) -> Result<TriangleMesh, MeshError> {
        self.map.mesh()
    }

    pub(super) fn take(&mut self, arrived: &Arrived<SegmentedCycle>) {
        let header = match arrived {
            Arrived::Value(cycle) => {
                let Cloud { stamp, frame_id, .. } = &cycle.static_cloud;
                convert::header_of(*stamp, frame_id)
            }
            Arrived::Message(message) => message.header.clone(),
        };
        let mut timer = StepTimer::start();
        // The map stays after a panic: most of it was not touched, and a robot without a map is worse off.
        let added = node_shell::caught(|| self.add(arrived, &mut timer))
            .unwrap_or_else(|panicked| Err((Panicked::CAUSE, panicked.to_string())));
        match added {
            Ok((points_in, addition)) => {
                let mut counts = vec![
                    ("points_in", points_in as u64),
                    ("voxels", self.map.len() as u64),
                    ("voxels_new", addition.new_voxels as u64),
                    ("points_refused", addition.refused_points as u64),
                    ("points_not_finite", addition.not_finite_points as u64),
                    ("voxels_cleared", addition.cleared_voxels as u64),
                    ("voxels_dropped", addition.dropped_voxels as u64),
                    ("views_cut", u64::from(addition.is_view_cut)),
                ];
                counts.extend(path::reported(&self.map));
                counts.extend(spilling::reported(&self.map));
                self.bounds_watch.note(&addition);
                let (what, filled, most) = self.map.fill();
                self.counters.note_fill(what, filled, most);
                if let Some((blocks, most)) = self.map.grid_fill() {
                    self.counters.note_fill("grid blocks", blocks, most);
                }
                self.reporter.processed(header, self.taken_cycles, &counts, &timer);
                self.reporter.keeps_pace(self.cycles.lost_count(), &timer, REMEDY);
                self.taken_cycles = self.taken_cycles.wrapping_add(1);
            }
            Err((cause, reason)) => {
                self.reporter.dropped(header, self.taken_cycles, (cause, &reason), &[])
            }
        }
    }

    /// Adds a cycle to the map; an error has the cause of its drop and the reason.
    fn add(
        &mut self,
        arrived: &Arrived<SegmentedCycle>,
        timer: &mut StepTimer,
    ) -> Result<(usize, Addition), (&'static str, String)> {
        let cycle = arrived.value().map_err(|error| (REFUSED, error.to_string()))?;
        self.pipeline
            .check(&cycle.setup, &cycle.dynamic_cloud.frame_id)
            .map_err(|mismatch| (PipelineWatch::MISMATCH, mismatch.to_string()))?;
        timer.end_of("convert");
        self.settle_frame(&cycle.static_cloud.frame_id);
        let added = self.map.integrate_on(&cycle, &self.executor);
        let addition = added.map_err(|error| (REFUSED, error.to_string()))?;
        timer.end_of("add");
        self.schedule.cloud_added(Instant::now());
        let voxels_gone = addition.cleared_voxels + addition.dropped_voxels;
        if voxels_gone > 0 {
            self.schedule.voxels_removed();
        }
        if let Some(grid) = &mut self.grid {
            grid.changed();
        }
        self.unsaved.is_changed |= addition.changed_voxels + voxels_gone > 0;
        Ok((cycle.static_cloud.points_m.len(), addition))
    }

    /// Publishes the whole map or an update, if it is due. Only the whole map costs more as the map grows, so it is published
    /// only if somebody subscribes. The cost of updates depends on the number of changes.
    pub(super) fn publish_what_is_due(&mut self) {
        let subscribers = Subscribers {
            map: self.maps.subscriber_count(),
            updates: self.updates.subscriber_count() + self.removals.subscriber_count(),
        };
        let now = Instant::now();
        let due = self.schedule.look(now, subscribers);
        match due.following {
            Some(Following::Starts) => self.map.follow_changes(),
            Some(Following::Ends) => self.map.unfollow_changes(),
            None => {}
        }
        if due.map
            && let Err(error) = self.publish_map()
            && let Some(held_back) = self.map_failed.pass()
        {
            tracing::warn!("{error} ({held_back} more since the last warning)");
        }
        if due.update {
            self.publish_update();
        }
        if let Some(grid) = &mut self.grid {
            grid.look(&mut self.map, now);
        }
        if let Some(mesh) = &mut self.mesh {
            mesh.look(&mut self.map, now);
        }
        self.distances.look(&mut self.map, now);
        self.spill_watch.look(&mut self.map, now);
    }

    /// Publishes the whole map; returns the number of its points. A map with a tile that cannot be read at present is
    /// incomplete, and is not published.
    fn publish_map(&mut self) -> Result<usize, NodeFailure> {
        let whole = self.map.cloud_for_listeners();
        let published = whole
            .map_err(|error| {
                format!("the map is incomplete, and was not published: {error}").into()
            })
            .and_then(|map| {
                self.maps.publish(convert::message_from_coloured_cloud(&map))?;
                Ok(map.cloud.points_m.len())
            });
        self.schedule.map_tried(Instant::now(), published.is_ok());
        if published.is_err() {
            self.schedule.update_failed();
        }
        published
    }

    fn publish_update(&mut self) {
        let changes = self.map.take_changes(self.most_update_points);
        let MapChanges { updated, updated_colours, removed, is_incomplete } = changes;
        let removed = ColouredCloud { cloud: removed, colours: Vec::new() };
        let updated = ColouredCloud { cloud: updated, colours: updated_colours };
        let is_told =
            [(&self.removals, removed), (&self.updates, updated)].map(|(publisher, cloud)| {
                cloud.cloud.points_m.is_empty()
                    || publisher.publish_or_warn(convert::message_from_coloured_cloud(&cloud))
            });
        if is_incomplete || is_told.contains(&false) {
            self.schedule.update_failed();
        }
    }

    /// Publishes the whole map even without subscribers: it is latched for later ones.
    pub(super) fn publish_on_request(&mut self) -> Result<String, NodeFailure> {
        if self.map.frame_id().is_none() {
            return Err("there is no map yet: no static cloud was received".into());
        }
        let points = self.publish_map()?;
        Ok(format!("published the map of {points} points"))
    }

    /// Another map has taken the place of this one, or it was corrected.
    pub(super) fn map_replaced(&mut self) {
        self.schedule.map_replaced(Instant::now());
        if let Some(grid) = &mut self.grid {
            grid.changed();
        }
    }

    pub(super) fn reset(&mut self) -> String {
        let voxels = self.map.len();
        self.map.clear();
        self.loaded_awaits_frame = false;
        self.unsaved = Unsaved::ANOTHER_MAP;
        self.map_replaced();
        format!("emptied the map of {voxels} voxels")
    }
}
