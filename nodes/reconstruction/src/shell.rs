//! The node `reconstruction`: static clouds in, the static map out.
//!
//! # How to listen to the map
//! Who needs it now and then subscribes to `static_map`: the whole map, latched, at once for a newcomer, then
//! every `map_publish_period_s` while clouds come, when the input has paused for half a second, and when
//! the service `~/publish_map` is called.
//!
//! Who wants to see it grow subscribes to `static_map_updates` too: points that are new or have moved, each
//! in the place of the listener's point of the same voxel ([`StaticMap::take_changes`] has the rule). With the method
//! `stillmap` voxels go, too: `static_map_removals` has their last points, each of which takes the listener's point
//! of its voxel away. The two topics may overtake each other; of two messages that tell of the same voxel the one
//! with the later stamp is right. A whole map takes the place of everything up to its stamp, and is the cure for an
//! update that was lost. A newcomer may get the whole map before the last one first, since the DDS library keeps it
//! for a while.
//!
//! A topic of its own, since a program such as RViz that shows `static_map_updates` as points would show a removal
//! in the same message as a point too. RViz cannot take points away: it shows `static_map`, which after a removal
//! comes after a quarter of its period.
//!
//! # Corrections
//! Who tells the poses may correct its map, as a SLAM that closes a loop. On `map_path` it tells the way of the platform as
//! its map has it by now: the map moves with it ([`StaticMap::follow_path`]), and is published as a whole. Nobody need
//! publish it, and whose path it is does not matter, as long as its frame is the map's and the stamps of its poses stay:
//! `pose` has it, and RTAB-Map by the name of `mapPath`. The first path that comes is taken for the one that the map stands
//! on.
//!
//! # Files
//! `~/save_map` and `~/load_map` go to and from `map_file`. They are `std_srvs/srv/Trigger`, which every ROS 2
//! installation can call without a package of ours. The node does nothing else meanwhile; clouds wait.

mod map_file;
mod parameters;
mod path;
mod schedule;
mod spilling;
#[cfg(test)]
mod tests;
mod tile_folder;

use std::process::ExitCode;
use std::time::Duration;

use msgs::convert;
use msgs::nav_msgs::Path;
use msgs::sensor_msgs::PointCloud2;
use msgs::std_srvs::Trigger;
use msgs::stillmap_msgs::SegmentedCloud;
use node_shell::{
    Counters, Node, NodeFailure, Program, Publisher, Qos, StageReporter, StepTimer, Subscription,
    Throttle,
};
use serde::{Deserialize, Serialize};
use tokio::time::{Instant, MissedTickBehavior};

use crate::{Addition, ReconstructionConfig, StaticMap};
use map_file::MapFile;
use parameters::Settings;
use path::PathWatch;
use schedule::{Following, Schedule, Subscribers};
use spilling::SpillWatch;
pub use spilling::empty_map;

const PROGRAM: Program = Program {
    name: "reconstruction",
    about: "Builds the static map out of the static clouds of the cycles.",
    topics: "in  segmented_cloud (stillmap_msgs/msg/SegmentedCloud), reliable
             in  map_path (nav_msgs/msg/Path, map frame), reliable: the way as the map has it by now; nobody need publish it
             out static_map (sensor_msgs/msg/PointCloud2, map frame), reliable and transient local: the whole map
             out static_map_updates (sensor_msgs/msg/PointCloud2, map frame), reliable: points that are new or have moved
             out static_map_removals (sensor_msgs/msg/PointCloud2, map frame), reliable: the last points of voxels that have gone
             out ~/report (stillmap_msgs/msg/StageReport), reliable
             srv ~/publish_map (std_srvs/srv/Trigger): publishes the whole map now
             srv ~/save_map (std_srvs/srv/Trigger): saves the map to the parameter map_file
             srv ~/load_map (std_srvs/srv/Trigger): puts the map of map_file in the place of the map
             srv ~/reset (std_srvs/srv/Trigger): empties the map",
};

/// Cycles that may wait here without one being lost: seven seconds of the RPLIDAR A1.
const CYCLES_KEPT: usize = 50;
/// Each path tells the whole way; more than one may matter to the clouds that wait.
const PATHS_KEPT: usize = 5;
/// Updates that may wait for a subscriber: five seconds of the default period.
const UPDATES_KEPT: usize = 10;
/// A service has nothing to work on.
const NO_MAP_FILE: &str = "the parameter map_file is empty: a path that ends in .ply, .pcd or .bt";
/// The frame of a map that was loaded before the first cloud came (REP-105).
const FRAME_OF_A_LOADED_MAP: &str = "map";
/// How often the node looks who subscribes and what is due: within 0.1 s a newcomer is served.
const LOOK_AGAIN: Duration = Duration::from_millis(50);

/// The parameters of the node.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default)]
pub struct ReconstructionParameters {
    /// While clouds come, the whole map is published once in this time if somebody subscribes; and besides
    /// when somebody new subscribes, when the input pauses, and on request.
    pub map_publish_period_s: f64,
    /// Points that are new or have moved are published once in this time if somebody subscribes to them.
    pub map_update_period_s: f64,
    /// Points of one update, at most; the others come with the next one.
    pub map_update_max_points: usize,
    /// Where the map is saved when the node ends: a path that ends in .ply, .pcd or .bt, or nothing.
    pub save_map_on_exit: String,
    /// Where `~/save_map` saves the map, and `~/load_map` loads it from: such a path, or nothing.
    pub map_file: String,
    /// With `at_max_voxels` spill: the folder below which the node's tiles have one of their own, which goes when the
    /// node ends.
    pub spill_folder: String,
    /// The parameters of the method.
    #[serde(flatten)]
    pub config: ReconstructionConfig,
}

impl Default for ReconstructionParameters {
    fn default() -> Self {
        Self {
            // A map of 10^6 points is 12 MB; for those who watch it grow there are the updates.
            map_publish_period_s: 10.0,
            map_update_period_s: 0.5,
            // 120 kB: such a message arrives whole where the kernel grants a socket only the 208 KiB that
            // it does by default. 20,000 points a second are several times what a camera adds.
            map_update_max_points: 10_000,
            save_map_on_exit: String::new(),
            map_file: String::new(),
            spill_folder: String::new(),
            config: ReconstructionConfig::default(),
        }
    }
}

/// Runs the node until SIGINT or SIGTERM, with the arguments behind the program's name.
pub fn run(arguments: impl IntoIterator<Item = String>) -> ExitCode {
    PROGRAM.run(arguments, serve)
}

/// The node's body: serves until the node is to end, and then saves the map where that was asked for.
///
/// # Errors
/// When a parameter is out of its range, a topic cannot be had, or the map cannot be saved.
pub async fn serve(node: &Node, parameters: ReconstructionParameters) -> Result<(), NodeFailure> {
    let mut settings = Settings::of(&parameters)?;
    let mut stage = Stage::new(node, &parameters)?;
    let mut live = node.serve_parameters(&parameters)?;
    let mut lifecycle = node.manage()?;
    let publish_map = node.service::<Trigger>("~/publish_map")?;
    let save_map = node.service::<Trigger>("~/save_map")?;
    let load_map = node.service::<Trigger>("~/load_map")?;
    let empty = node.service::<Trigger>("~/reset")?;
    let shutdown = node.shutdown_signal();
    let mut look_time = tokio::time::interval(LOOK_AGAIN);
    look_time.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        tokio::select! {
            biased;
            () = shutdown.wait() => break,
            parameters = live.changed() => {
                settings = Settings::of(&parameters)?;
                stage.change(&settings);
            }
            _reset = lifecycle.reset() => drop(stage.reset()),
            request = publish_map.next() => request.answer(stage.publish_on_request()),
            request = save_map.next() => request.answer(stage.save(settings.file.as_ref())),
            request = load_map.next() => request.answer(stage.load(settings.file.as_ref())),
            request = empty.next() => request.answer(Ok(stage.reset())),
            _ = look_time.tick(), if lifecycle.is_active() => stage.publish_what_is_due(),
            // It may concern the clouds that wait.
            received = stage.paths.next() => stage.take_path(&received.message),
            received = stage.clouds.next() => stage.take(&received.message),
        }
    }
    stage.take_waiting();
    if let Some(map_file) = settings.file_on_exit {
        map_file.save(&stage.map)?;
    }
    Ok(())
}

/// The core with its topics.
pub struct Stage {
    clouds: Subscription<SegmentedCloud>,
    paths: Subscription<Path>,
    path_watch: PathWatch,
    map: StaticMap,
    schedule: Schedule,
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
            clouds: node.subscription("segmented_cloud", &Qos::reliable(CYCLES_KEPT))?,
        })
    }

    /// Goes on with other settings.
    fn change(&mut self, settings: &Settings) {
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

    fn take(&mut self, message: &SegmentedCloud) {
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
    fn publish_what_is_due(&mut self) {
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
    fn publish_on_request(&mut self) -> Result<String, NodeFailure> {
        if self.map.frame_id().is_none() {
            return Err("there is no map yet: no static cloud has come".into());
        }
        let points = self.publish_map()?;
        Ok(format!("published the map of {points} points"))
    }

    fn save(&self, file: Option<&MapFile>) -> Result<String, NodeFailure> {
        let file = file.ok_or(NO_MAP_FILE)?;
        let points = file.save(&self.map)?;
        Ok(format!("saved a map of {points} points to {}", file.path().display()))
    }

    fn load(&mut self, file: Option<&MapFile>) -> Result<String, NodeFailure> {
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

    fn reset(&mut self) -> String {
        let voxels = self.map.len();
        self.map.clear();
        self.schedule.map_replaced(Instant::now());
        format!("emptied the map of {voxels} voxels")
    }
}
