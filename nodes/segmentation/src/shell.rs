//! The node `segmentation`: reduced clouds with their zones in, static and dynamic clouds out.

#[cfg(test)]
mod tests;

use std::process::ExitCode;

use msgs::convert;
use msgs::nav_msgs::Path;
use msgs::sensor_msgs::PointCloud2;
use msgs::stillmap_msgs::{ReducedCloud, SegmentedCloud, Tracks};
use msgs::visualization_msgs::MarkerArray;
use node_shell::parameters::{NodeParameters, Range};
use node_shell::{
    Counters, Node, NodeFailure, Program, Publisher, Qos, StageReporter, StepTimer, Subscription,
    Throttle,
};
use serde::{Deserialize, Serialize};

use crate::{SegmentationConfig, Segmented, Segmenter};

const PROGRAM: Program = Program {
    name: "segmentation",
    about: "Cuts what moves out of each reduced cloud, and follows it.",
    topics: "in  reduced_cloud (stillmap_msgs/msg/ReducedCloud), reliable
             in  map_path (nav_msgs/msg/Path: the way of the rig as the map has it by now), reliable; nobody need publish it
             out segmented_cloud (stillmap_msgs/msg/SegmentedCloud), reliable
             out static_cloud (sensor_msgs/msg/PointCloud2, map frame), reliable
             out dynamic_cloud (sensor_msgs/msg/PointCloud2, rig frame), reliable
             out tracks (stillmap_msgs/msg/Tracks, map frame), reliable
             out track_markers (visualization_msgs/msg/MarkerArray, map frame), reliable, for a viewer
             out ~/report (stillmap_msgs/msg/StageReport), reliable",
};

/// Cycles that may wait here, or that a subscriber may be behind, without one being lost: seven
/// seconds of the RPLIDAR A1.
const CYCLES_KEPT: usize = 50;

/// Each path tells the whole way.
const PATHS_KEPT: usize = 5;

/// A viewer needs the latest markers alone.
const MARKERS_KEPT: usize = 1;

/// The parameters of the node.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct SegmentationParameters {
    /// The parameters of the method.
    #[serde(flatten)]
    pub config: SegmentationConfig,
}

/// Lengths, times and counts beyond this [`SegmentationConfig::validate`] holds to be mistakes, ...
const MUCH: f64 = 1e6;
/// ... and what it divides by is not below this.
const LITTLE: f64 = 1e-3;

impl NodeParameters for SegmentationParameters {
    const FILE: &'static str = include_str!("../../../config/segmentation.yaml");
    const RANGES: &'static [(&'static str, Range)] = &[
        ("depth_cell_m", Range::POSITIVE),
        ("max_evidence_voxels", Range::whole(1_000, 100_000_000)),
        ("evidence_reach_m", Range::real(LITTLE, MUCH)),
        ("min_background_s", Range::real(0.0, MUCH)),
        ("scan_height_in_rig_m", Range::real(-MUCH, MUCH)),
        ("max_object_width_m", Range::real(LITTLE, MUCH)),
        ("max_object_height_m", Range::real(LITTLE, MUCH)),
        ("min_unzoned_points", Range::whole(1, MUCH as i64)),
        ("acceleration_m_per_s2", Range::real(LITTLE, MUCH)),
        ("min_seen_cycles", Range::whole(1, 3)),
        ("max_unseen_cycles", Range::whole(0, MUCH as i64)),
        ("max_stop_s", Range::real(0.0, MUCH)),
        ("max_tracks", Range::whole(1, 200)),
    ];

    fn validate(&self) -> Result<(), NodeFailure> {
        Ok(self.config.validate()?)
    }
}

/// Runs the node until SIGINT or SIGTERM, with the arguments behind the program's name.
pub fn run(arguments: impl IntoIterator<Item = String>) -> ExitCode {
    PROGRAM.run(arguments, serve)
}

/// The node's body: serves until the node is to end.
///
/// # Errors
/// When a parameter is out of its range, or a topic cannot be had.
pub async fn serve(node: &Node, parameters: SegmentationParameters) -> Result<(), NodeFailure> {
    let mut stage = Stage::new(node, &parameters)?;
    // None of them changes while the evidence and the tracks go on.
    node.serve_parameters(&parameters)?;
    let mut lifecycle = node.manage()?;
    let shutdown = node.shutdown_signal();
    loop {
        tokio::select! {
            biased;
            () = shutdown.wait() => break,
            _reset = lifecycle.reset() => stage.reset()?,
            // It concerns the cycles after it.
            received = stage.paths.next() => stage.take_path(&received.message),
            received = stage.cycles.next() => stage.take(&received.message),
        }
    }
    if node.takes_every_cycle() {
        stage.take_waiting();
    }
    Ok(())
}

/// What makes a cycle take less time.
const REMEDY: &str = "raise detection's voxel_edge_m, or lower evidence_reach_m";

/// The core with its topics.
pub struct Stage {
    cycles: Subscription<ReducedCloud>,
    paths: Subscription<Path>,
    bad_paths: Throttle,
    config: SegmentationConfig,
    segmenter: Segmenter,
    next_cycle: u32,
    static_clouds: Publisher<PointCloud2>,
    dynamic_clouds: Publisher<PointCloud2>,
    segmented_clouds: Publisher<SegmentedCloud>,
    tracks: Publisher<Tracks>,
    markers: Publisher<MarkerArray>,
    reporter: StageReporter,
    counters: Counters,
}

impl Stage {
    /// The stage that `node` is.
    ///
    /// # Errors
    /// When a parameter is out of its range, or a topic cannot be had.
    pub fn new(node: &Node, parameters: &SegmentationParameters) -> Result<Self, NodeFailure> {
        let paths = node.subscription("map_path", &Qos::reliable(PATHS_KEPT))?;
        node.counters().note_optional(paths.topic());
        Ok(Self {
            paths,
            bad_paths: Throttle::for_warnings(),
            config: parameters.config,
            segmenter: Segmenter::new(parameters.config)?,
            next_cycle: 0,
            static_clouds: node.publisher("static_cloud", &Qos::reliable(CYCLES_KEPT))?,
            dynamic_clouds: node.publisher("dynamic_cloud", &Qos::reliable(CYCLES_KEPT))?,
            segmented_clouds: node.publisher("segmented_cloud", &Qos::reliable(CYCLES_KEPT))?,
            tracks: node.publisher("tracks", &Qos::reliable(CYCLES_KEPT))?,
            markers: node.publisher("track_markers", &Qos::reliable(MARKERS_KEPT))?,
            reporter: StageReporter::new(node, PROGRAM.name)?,
            counters: node.counters(),
            cycles: node.subscription("reduced_cloud", &node.cycles_qos())?,
        })
    }

    /// Drops the evidence and the tracks.
    fn reset(&mut self) -> Result<(), NodeFailure> {
        self.segmenter = Segmenter::new(self.config)?;
        Ok(())
    }

    /// Takes every message that is here already.
    pub fn take_waiting(&mut self) {
        while let Some(received) = self.paths.try_next() {
            self.take_path(&received.message);
        }
        while let Some(received) = self.cycles.try_next() {
            self.take(&received.message);
        }
    }

    fn take_path(&mut self, message: &Path) {
        match convert::map_path_from_message(message) {
            Ok(path) => self.segmenter.follow_path(path),
            Err(error) => {
                self.counters.count_drop("path refused");
                if let Some(held_back) = self.bad_paths.pass() {
                    let topic = self.paths.topic();
                    tracing::warn!("{topic}: {error} ({held_back} more since the last warning)");
                }
            }
        }
    }

    fn take(&mut self, message: &ReducedCloud) {
        self.next_cycle = message.cycle.wrapping_add(1);
        let mut timer = StepTimer::start();
        match self.segment(message, &mut timer) {
            Ok(counts) => {
                self.reporter.processed(message.header.clone(), message.cycle, &counts, &timer);
                self.reporter.keeps_pace(self.cycles.lost_count(), &timer, REMEDY);
            }
            Err(error) => self.reporter.dropped(
                message.header.clone(),
                self.next_cycle,
                ("segmentation failed", &error.to_string()),
                &[],
            ),
        }
    }

    fn segment(
        &mut self,
        message: &ReducedCloud,
        timer: &mut StepTimer,
    ) -> Result<[(&'static str, u64); 5], NodeFailure> {
        let cycle = convert::detected_cycle_from_message(message)?;
        timer.end_of("convert");
        let Segmented { cycle, tracks, counts } =
            self.segmenter.step(&cycle, |step| timer.end_of(step.name()))?;
        self.segmented_clouds.publish_or_warn(convert::message_from_segmented_cycle(&cycle));
        self.static_clouds.publish_or_warn(convert::message_from_cloud(&cycle.static_cloud));
        self.dynamic_clouds.publish_or_warn(convert::message_from_cloud(&cycle.dynamic_cloud));
        self.tracks.publish_or_warn(convert::message_from_tracks(&cycle, &tracks));
        if self.markers.subscriber_count() > 0 {
            let map = &cycle.static_cloud;
            let markers = convert::markers_from_tracks(map.stamp, &map.frame_id, &tracks);
            self.markers.publish_or_warn(markers);
        }
        timer.end_of("publish");
        let evidence = self.segmenter.evidence_voxels();
        self.counters.note_fill("evidence voxels", evidence, self.config.max_evidence_voxels);
        Ok([
            ("points_reduced", counts.reduced as u64),
            ("points_in_zone", counts.in_zone as u64),
            ("points_dynamic", counts.dynamic as u64),
            ("points_static", cycle.static_cloud.points_m.len() as u64),
            ("tracks", tracks.len() as u64),
        ])
    }
}
