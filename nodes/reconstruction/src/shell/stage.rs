//! The core with its topics: clouds and paths into the map, and the map out as it is due.

use msgs::convert;
use msgs::nav_msgs::Path;
use msgs::sensor_msgs::PointCloud2;
use msgs::stillmap_msgs::SegmentedCloud;
use node_shell::{
    Counters, Node, NodeFailure, Publisher, Qos, StageReporter, StepTimer, Subscription, Throttle,
};
use tokio::time::Instant;

use super::map_file::MapFile;
use super::parameters::Settings;
use super::path::{self, PathWatch};
use super::schedule::{Following, Schedule, Subscribers};
use super::spilling::{self, SpillWatch, empty_map};
use super::{PROGRAM, ReconstructionParameters};
use crate::{Addition, StaticMap};
/// What makes a cycle take less time.
const REMEDY: &str = "raise voxel_edge_m, here and of detection";
/// Each path tells the whole way; more than one may matter to the clouds that wait.
const PATHS_KEPT: usize = 5;
/// Updates that may wait for a subscriber: five seconds of the default period.
const UPDATES_KEPT: usize = 10;
/// A service has nothing to work on.
const NO_MAP_FILE: &str = "the parameter map_file is empty: a path that ends in .ply, .pcd or .bt";
/// The frame of a map that was loaded before the first cloud came (REP-105).
const FRAME_OF_A_LOADED_MAP: &str = "map";

/// The core with its topics.
pub struct Stage {
    pub(super) clouds: Subscription<SegmentedCloud>,
    pub(super) paths: Subscription<Path>,
    pub(super) path_watch: PathWatch,
    pub(super) map: StaticMap,
    pub(super) schedule: Schedule,
    cycles: u32,
    maps: Publisher<PointCloud2>,
    updates: Publisher<PointCloud2>,
    removals: Publisher<PointCloud2>,
    most_update_points: usize,
    map_failed: Throttle,
    spill_watch: SpillWatch,
    reporter: StageReporter,
    counters: Counters,
    max_voxels: usize,
}

impl Stage {
    /// The stage that `node` is.
    ///
    /// # Errors
    /// When a parameter is out of its range, or a topic cannot be had.
    pub fn new(node: &Node, parameters: &ReconstructionParameters) -> Result<Self, NodeFailure> {
        let settings = Settings::of(parameters)?;
        let paths = node.subscription("map_path", &Qos::reliable(PATHS_KEPT))?;
        node.counters().note_optional(paths.topic());
        Ok(Self {
            paths,
            path_watch: PathWatch::new(node.counters()),
            map: empty_map(parameters)?,
            schedule: Schedule::new(settings.periods),
            cycles: 0,
            maps: node.publisher("static_map", &Qos::latched())?,
            updates: node.publisher("static_map_updates", &Qos::reliable(UPDATES_KEPT))?,
            removals: node.publisher("static_map_removals", &Qos::reliable(UPDATES_KEPT))?,
            most_update_points: settings.most_update_points,
            map_failed: Throttle::for_warnings(),
            spill_watch: SpillWatch::new(node.counters()),
            reporter: StageReporter::new(node, PROGRAM.name)?,
            counters: node.counters(),
            max_voxels: parameters.config.max_voxels,
            clouds: node.subscription("segmented_cloud", &node.cycles_qos())?,
        })
    }

    /// Goes on with other settings.
    pub(super) fn change(&mut self, settings: &Settings) {
        self.schedule.set_periods(settings.periods);
        self.most_update_points = settings.most_update_points;
    }

    /// Takes every message that is here already.
    pub fn take_waiting(&mut self) {
        while let Some(received) = self.paths.try_next() {
            self.take_path(&received.message);
        }
        while let Some(received) = self.clouds.try_next() {
            self.take(&received.message);
        }
    }

    /// The map so far.
    #[must_use]
    pub fn map(&self) -> &StaticMap {
        &self.map
    }

    pub(super) fn take(&mut self, message: &SegmentedCloud) {
        let mut timer = StepTimer::start();
        match self.add(message, &mut timer) {
            Ok((points_in, addition)) => {
                let mut counts = vec![
                    ("points_in", points_in as u64),
                    ("voxels", self.map.len() as u64),
                    ("voxels_new", addition.new_voxels as u64),
                    ("points_refused", addition.refused_points as u64),
                    ("points_not_finite", addition.not_finite_points as u64),
                    ("voxels_cleared", addition.cleared_voxels as u64),
                    ("voxels_dropped", addition.dropped_voxels as u64),
                    ("map_bytes", self.map.memory_bytes() as u64),
                ];
                counts.extend(path::reported(&self.map));
                counts.extend(spilling::reported(&self.map));
                self.counters.note_fill("voxels", self.map.len(), self.max_voxels);
                self.reporter.processed(message.header.clone(), self.cycles, &counts, &timer);
                self.reporter.keeps_pace(self.clouds.lost_count(), &timer, REMEDY);
                self.cycles = self.cycles.wrapping_add(1);
            }
            Err(error) => self.reporter.dropped(
                message.header.clone(),
                self.cycles,
                ("static cloud refused", &error.to_string()),
                &[],
            ),
        }
    }

    fn add(
        &mut self,
        message: &SegmentedCloud,
        timer: &mut StepTimer,
    ) -> Result<(usize, Addition), NodeFailure> {
        let cycle = convert::segmented_cycle_from_message(message)?;
        timer.end_of("convert");
        let addition = self.map.integrate(&cycle)?;
        timer.end_of("add");
        self.schedule.cloud_came(Instant::now());
        if addition.cleared_voxels + addition.dropped_voxels > 0 {
            self.schedule.voxels_went();
        }
        Ok((cycle.static_cloud.points_m.len(), addition))
    }

    /// The whole map is the one thing here whose cost grows with it, so nobody gets it unasked. Between two
    /// of them there are the updates, whose cost goes with what is new.
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
        self.spill_watch.look(&mut self.map, now);
    }

    /// Publishes the whole map; returns the number of its points. A map that lacks a tile that cannot be read for now is
    /// not whole, and is not published.
    fn publish_map(&mut self) -> Result<usize, NodeFailure> {
        let whole = self.map.cloud_for_listeners();
        let published = whole
            .map_err(|error| format!("the map is not whole, and was not published: {error}").into())
            .and_then(|cloud| {
                self.maps.publish(convert::message_from_cloud(&cloud))?;
                Ok(cloud.points_m.len())
            });
        self.schedule.map_tried(Instant::now(), published.is_ok());
        if published.is_err() {
            self.schedule.update_failed();
        }
        published
    }

    fn publish_update(&mut self) {
        let changes = self.map.take_changes(self.most_update_points);
        let is_told = [(&self.removals, &changes.removed), (&self.updates, &changes.updated)].map(
            |(publisher, cloud)| {
                cloud.points_m.is_empty()
                    || publisher.publish_or_warn(convert::message_from_cloud(cloud))
            },
        );
        if changes.is_incomplete || is_told.contains(&false) {
            self.schedule.update_failed();
        }
    }

    /// Publishes the whole map whether or not somebody subscribes: it is there for those who come later.
    pub(super) fn publish_on_request(&mut self) -> Result<String, NodeFailure> {
        if self.map.frame_id().is_none() {
            return Err("there is no map yet: no static cloud has come".into());
        }
        let points = self.publish_map()?;
        Ok(format!("published the map of {points} points"))
    }

    pub(super) fn save(&self, file: Option<&MapFile>) -> Result<String, NodeFailure> {
        let file = file.ok_or(NO_MAP_FILE)?;
        let points = file.save(&self.map)?;
        Ok(format!("saved a map of {points} points to {}", file.path().display()))
    }

    pub(super) fn load(&mut self, file: Option<&MapFile>) -> Result<String, NodeFailure> {
        let file = file.ok_or(NO_MAP_FILE)?;
        let frame_id = self.map.frame_id().unwrap_or(FRAME_OF_A_LOADED_MAP).to_owned();
        let loaded = file.load(&mut self.map, &frame_id);
        // Where tiles could not be spilled, the map has gone.
        if loaded.is_ok() || self.map.is_empty() {
            self.schedule.map_replaced(Instant::now());
        }
        let voxels = loaded?;
        let path = file.path().display();
        Ok(format!("loaded a map of {voxels} voxels in frame {frame_id:?} from {path}"))
    }

    pub(super) fn reset(&mut self) -> String {
        let voxels = self.map.len();
        self.map.clear();
        self.schedule.map_replaced(Instant::now());
        format!("emptied the map of {voxels} voxels")
    }
}
