//! The node `reconstruction`: static clouds in, the static map out.
//!
//! # Topics of the map
//! `static_map` has the whole map, latched. It is published at once for a new subscriber, then
//! every `map_publish_period_s` while clouds arrive, when the input has paused for half a second, and when
//! the service `~/publish_map` is called.
//!
//! `static_map_updates` has the points that are new or have moved; each replaces the subscriber's point of the same voxel
//! ([`StaticMap::take_changes`](crate::StaticMap::take_changes) has the rule). With the method `free_space` voxels are also
//! removed: `static_map_removals` has their last points, each of which removes the subscriber's point of its voxel. The
//! order of messages across the two topics is not guaranteed; for a voxel, the message with the later stamp is valid. A
//! whole map replaces everything up to its stamp, and so also corrects a lost update. A new subscriber may first
//! receive the whole map before the last one, since the DDS library keeps it for a while.
//!
//! Removals have their own topic, since a program such as RViz that shows `static_map_updates` as points would show a removal
//! in the same message as a point. RViz cannot remove points: it shows `static_map`, which after a removal
//! is published after a quarter of its period.
//!
//! `mesh` has the surface as triangles, a marker for each block of voxels, of the method `free_space`. Blocks that have changed
//! are published while somebody subscribes, the first ones to change first; all of them for a new subscriber. A marker takes the place of
//! the former one of its namespace and number. After a map was emptied, replaced or corrected all markers go first.
//!
//! # Corrections
//! The source of the poses may correct its map, as a SLAM that closes a loop. On `map_path` it publishes its
//! corrected trajectory: the map is corrected with it ([`Map::follow_path`](crate::Map::follow_path)), and is
//! published as a whole. The topic is optional, and may be published by any node, as long as its frame is the map's and the stamps of its poses do
//! not change: `pose` publishes it, and RTAB-Map under the name `mapPath`. The map so far is assumed to agree with the first
//! path that is received.
//!
//! # Files
//! With `map_file` the node starts with the map of that file, if it exists, saves it every `map_save_period_s` while
//! it changes (another thread writes), and when the node ends. The first save of a run, and each one after the map was emptied
//! or replaced, keeps the existing file as a numbered version ([`node_shell::keep_version`]), as does a save of less than
//! half of the points. One process writes a file at a time ([`node_shell::ClaimedFile`]). `~/save_map` and `~/load_map` go to and from the same file; they are `std_srvs/srv/Trigger`, which every
//! ROS 2 installation can call without a package of ours.
//!
//! A loaded map is in the frame `map`, whose origin is the same one after each start (REP-105). If the poses are in
//! another frame, such as `odom`, a new map is begun.

mod bounds_watch;
mod distance_output;
mod grid_output;
mod loading;
mod map_file;
mod mesh_file;
mod mesh_output;
mod parameters;
mod path;
mod saving;
mod schedule;
mod spilling;
mod stage;
#[cfg(test)]
mod tests;
mod until_shutdown;

use std::process::ExitCode;
use std::time::Duration;

use msgs::std_srvs::Trigger;
use msgs::stillmap_msgs::{GetDistanceField, GetDistances};
use node_shell::{ClaimedFile, Node, NodeFailure, Program};
use tokio::time::{Instant, MissedTickBehavior};

use crate::ReconstructionConfig;
use parameters::Settings;
use saving::Saving;
pub use spilling::empty_map;
pub use stage::Stage;

const PROGRAM: Program = Program {
    name: "reconstruction",
    about: "Builds the static map from the static clouds of the cycles.",
    topics: "in  segmented_cloud (stillmap_msgs/msg/SegmentedCloud), reliable
             in  map_path (nav_msgs/msg/Path, map frame), reliable: the way as the map has it by now; nobody need publish it
             out static_map (sensor_msgs/msg/PointCloud2, map frame), reliable and transient local: the whole map
             out static_map_updates (sensor_msgs/msg/PointCloud2, map frame), reliable: points that are new or have moved
             out static_map_removals (sensor_msgs/msg/PointCloud2, map frame), reliable: the last points of voxels that have gone
             out map (nav_msgs/msg/OccupancyGrid, map frame), reliable and transient local: the floor plan, unless grid is none
             out map_updates (map_msgs/msg/OccupancyGridUpdate, map frame), reliable: what has changed in it
             out mesh (visualization_msgs/msg/MarkerArray, map frame), reliable: the blocks' triangles that have changed; of the method free_space
             out distance_field (stillmap_msgs/msg/DistanceField, map frame), reliable: each box that ~/get_distance_field was asked for; of the method free_space
             out ~/report (stillmap_msgs/msg/StageReport), reliable
             srv ~/publish_map (std_srvs/srv/Trigger): publishes the whole map now
             srv ~/save_map (std_srvs/srv/Trigger): saves the map to the file of the parameter map_file, the grid to that of grid_file, the triangles to that of mesh_file
             srv ~/load_map (std_srvs/srv/Trigger): puts the map of map_file in the place of the map
             srv ~/get_distances (stillmap_msgs/srv/GetDistances): how far places are from the nearest obstacle
             srv ~/get_distance_field (stillmap_msgs/srv/GetDistanceField): the same for a box or a slice
             srv ~/reset (std_srvs/srv/Trigger): empties the map",
};

/// How often the node checks its subscribers and what is due: a new subscriber gets the map within 0.1 s.
const LOOK_AGAIN: Duration = Duration::from_millis(50);

/// The shortest period: that of the finest clock.
const SHORTEST_S: f64 = 1e-9;
/// The longest period, some 30 years.
const LONGEST_S: f64 = 1e9;

geometry::parameters! {
    /// The parameters of the node. What the map is not made by may change, except the names of the files: whoever reaches the
    /// network may set parameters, and would choose what is written over.
    #[derive(Clone, PartialEq, Debug)]
    pub struct ReconstructionParameters {
        /// While clouds come, the whole map is published on static_map once in this time, if somebody subscribes. Besides it is
        /// published when somebody new subscribes, when no cloud has come for half a second, and when the service ~/publish_map
        /// is called. When voxels were removed (method free_space), the next one comes after a quarter of this time.
        // A map of 10^6 points is 12 MB; for those who watch it grow there are the updates.
        map_publish_period_s: f64 = 10.0, between(SHORTEST_S, LONGEST_S), changeable;
        /// Points that are new, or have moved by more than a 32nd of the voxel's edge, are published on static_map_updates once
        /// in this time, if somebody subscribes to them; the last points of removed voxels on static_map_removals.
        map_update_period_s: f64 = 0.5, between(SHORTEST_S, LONGEST_S), changeable;
        /// The most points of one update, 12 bytes each; the others come with the next one. 10,000 points arrive whole also
        /// where the kernel's receive buffer is at its default of 208 KiB.
        // 120 kB. 20,000 points a second are several times what a camera adds.
        map_update_max_points: usize = 10_000, at_least(1.0), changeable;
        /// The file of the map: a path that ends in .ply, .pcd or .bt (OctoMap's binary files, which hold the voxels but not the
        /// points in them), or "" for none. A file of any edge, with or without normals, is loaded with the method free_space. The node starts with the map of the file, where there is one, and saves it there while it changes
        /// and when the node ends. The first save of each start, and one of less than half of the points, keeps the file that is
        /// there as a numbered version beside it (map.version-1.ply); the five latest stay, and of older ones the first of each day,
        /// of five. A map is continued where the poses are in
        /// a frame map, whose origin must be the same one after each start; in another frame, as odom, each start begins an empty
        /// map.
        map_file: String = String::new();
        /// While the map changes, it is saved to map_file once in this time: a killed node loses what came since. The points are
        /// copied for it, 24 bytes each, and with at_max_voxels spill every tile is read: give a large spilled map a long period.
        map_save_period_s: f64 = 30.0, between(SHORTEST_S, LONGEST_S), changeable;
        /// While somebody subscribes to the occupancy grid, what has changed in it is published on map_updates once in this time;
        /// on map the whole grid once in map_publish_period_s, and when its border has moved. Making it costs by the whole map.
        // slam_toolbox publishes its grid every 5 s.
        grid_period_s: f64 = 2.0, between(SHORTEST_S, LONGEST_S), changeable;
        /// While somebody subscribes to the mesh, the triangles of blocks that have changed are published once in this time.
        // With the most triangles of a message 10,000 a second: a room of 100,000 takes a new subscriber 10 s.
        mesh_update_period_s: f64 = 0.1, between(SHORTEST_S, LONGEST_S), changeable;
        /// The most triangles of one message of the mesh, 120 bytes each with colours and 72 without, or those of one block; the
        /// others come with the next one. 1,000 arrive whole also where the kernel's receive buffer is at its default of 208 KiB.
        mesh_update_max_triangles: usize = 1_000, at_least(1.0), changeable;
        /// The file of the occupancy grid for map_server: a path that ends in .yaml, or "" for none. The image is beside it, with
        /// the ending .pgm. Both are saved with the map: once in map_save_period_s while it changes, by ~/save_map, and when the
        /// node ends. With grid none they are not.
        grid_file: String = String::new();
        /// The file of the surface as triangles: a path that ends in .ply, .obj or .glb (binary glTF), or "" for none. It is saved
        /// with the map: once in map_save_period_s while it changes, by ~/save_map, and when the node ends. Making it costs by the whole map.
        /// With the method free_space alone.
        mesh_file: String = String::new();
        /// The folder of the spilled tiles, made if it is not there. The node's files have a folder of their own in it, which is
        /// removed when the node ends; what a killed node has left there is removed at the next start.
        spill_folder: String = String::new(), read_with("at_max_voxels", "spill");
        /// The parameters of the method.
        config: ReconstructionConfig as flatten;
    }
}

/// Runs the node until SIGINT or SIGTERM, with the arguments behind the program's name.
pub fn run(arguments: impl IntoIterator<Item = String>) -> ExitCode {
    PROGRAM.run(arguments, serve)
}

/// The node's body: begins with the map of `map_file`, serves until the node is to end, and saves the map.
///
/// # Errors
/// When a parameter is out of its range, a publisher or subscription cannot be created, another process has the file of the map, or the map
/// cannot be loaded or saved.
pub async fn serve(node: &Node, parameters: ReconstructionParameters) -> Result<(), NodeFailure> {
    let settings = Settings::of(&parameters)?;
    let _claimed = match &settings.file {
        Some(file) => Some(ClaimedFile::at(file.path(), &node.shutdown_signal()).await?),
        None => None,
    };
    let mut stage = Stage::new(node, &parameters)?;
    stage.begin_with(settings.file.as_ref())?;
    let mut live = node.serve_parameters(&parameters)?;
    let mut lifecycle = node.manage()?;
    let publish_map = node.service::<Trigger>("~/publish_map")?;
    let save_map = node.service::<Trigger>("~/save_map")?;
    let load_map = node.service::<Trigger>("~/load_map")?;
    let empty = node.service::<Trigger>("~/reset")?;
    let get_distances = node.service::<GetDistances>("~/get_distances")?;
    let get_distance_field = node.service::<GetDistanceField>("~/get_distance_field")?;
    let shutdown = node.shutdown_signal();
    let mut saving = Saving::new(&settings, node.counters());
    let mut look_time = tokio::time::interval(LOOK_AGAIN);
    look_time.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        tokio::select! {
            biased;
            () = shutdown.wait() => break,
            parameters = live.changed() => {
                let settings = Settings::of(&parameters)?;
                stage.change(&settings);
                saving.change(&settings);
            }
            _reset = lifecycle.reset() => {
                // A failure is logged and on /diagnostics; the map is cleaned up nevertheless.
                let _saved = saving.save_now(&mut stage).await;
                stage.clean_up();
            }
            saved = saving.finish(), if !saving.is_idle() => saving.finished(saved, &mut stage),
            request = publish_map.next() => request.answer(stage.publish_on_request()),
            request = save_map.next(), if saving.is_idle() => saving.begin(&mut stage, Some(request)),
            request = load_map.next() => request.answer(stage.load(saving.file())),
            request = empty.next() => request.answer(Ok(stage.reset())),
            _ = look_time.tick(), if lifecycle.is_active() => {
                stage.begin_with(saving.file())?;
                stage.publish_what_is_due();
                saving.look(&mut stage, Instant::now());
            }
            // However many are asked for, cycles go on.
            request = get_distances.next() => {
                stage.answer_distances(request);
                stage.take_next_waiting();
            }
            request = get_distance_field.next() => {
                stage.answer_distance_field(request);
                stage.take_next_waiting();
            }
            // It may apply to the waiting clouds.
            received = stage.paths.next() => stage.take_path(&received.message),
            received = stage.cycles.next() => stage.take(&received.message),
        }
    }
    if node.takes_every_cycle() {
        stage.take_waiting();
    }
    saving.save_now(&mut stage).await?;
    Ok(())
}
