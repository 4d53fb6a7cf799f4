//! The node `reconstruction`: static clouds in, the static map out.
//!
//! # How to listen to the map
//! Who needs it now and then subscribes to `static_map`: the whole map, latched, at once for a newcomer, then
//! every `map_publish_period_s` while clouds come, when the input has paused for half a second, and when
//! the service `~/publish_map` is called.
//!
//! Who wants to see it grow subscribes to `static_map_updates` too: points that are new or have moved, each
//! in the place of the listener's point of the same voxel
//! ([`StaticMap::take_changes`](crate::StaticMap::take_changes) has the rule). With the method `stillmap` voxels go,
//! too: `static_map_removals` has their last points, each of which takes the listener's point of its voxel away. The two topics may overtake each other; of two messages that tell of the same voxel the one
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
//! its map has it by now: the map moves with it ([`StaticMap::follow_path`](crate::StaticMap::follow_path)), and is
//! published as a whole. Nobody need publish it, and whose path it is does not matter, as long as its frame is the map's and the stamps of its poses stay:
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
mod stage;
#[cfg(test)]
mod tests;
mod tile_folder;

use std::process::ExitCode;
use std::time::Duration;

use msgs::std_srvs::Trigger;
use node_shell::{Node, NodeFailure, Program};
use serde::{Deserialize, Serialize};
use tokio::time::MissedTickBehavior;

use crate::ReconstructionConfig;
use parameters::Settings;
pub use spilling::empty_map;
pub use stage::Stage;

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
    if node.takes_every_cycle() {
        stage.take_waiting();
    }
    if let Some(map_file) = settings.file_on_exit {
        map_file.save(&stage.map)?;
    }
    Ok(())
}
