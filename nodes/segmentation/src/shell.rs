//! The node `segmentation`: reduced clouds with their zones in, static and dynamic clouds out.

mod filter;
#[cfg(test)]
mod tests;

use std::process::ExitCode;
use std::sync::Arc;
use std::time::Duration;

use geometry::{Cloud, CycleTracks, DetectedCycle, Method, SegmentedCycle};
use msgs::convert;
use msgs::sensor_msgs::PointCloud2;
use msgs::visualization_msgs::MarkerArray;
use node_shell::parameters::NodeParameters;
use node_shell::{
    Arrived, Counters, Node, NodeFailure, Panicked, PipelineWatch, Program, Publisher, Qos,
    StageReporter, StepTimer, Throttle, ValuePublisher, ValueSubscription,
};

use crate::filter::Verdict;
use crate::{SegmentationConfig, Segmented, Segmenter};
use filter::Filter;
pub use filter::FilterParameters;

const PROGRAM: Program = Program {
    name: "segmentation",
    about: "Cuts what moves out of each reduced cloud, and follows it.",
    topics: "in  reduced_cloud (stillmap_msgs/msg/ReducedCloud), reliable
             out segmented_cloud (stillmap_msgs/msg/SegmentedCloud), reliable
             out static_cloud (sensor_msgs/msg/PointCloud2, map frame), reliable
             out dynamic_cloud (sensor_msgs/msg/PointCloud2, rig frame), reliable
             out tracks (stillmap_msgs/msg/Tracks, map frame), reliable
             out track_markers (visualization_msgs/msg/MarkerArray, map frame), reliable, for a viewer
             in  scan, depth/image, depth/camera_info, points, rgb/image, rgb/camera_info: while something that is made of them
                 is subscribed to, of the next
             out static_scan, dynamic_scan (sensor_msgs/msg/LaserScan: scan without what moves, and that alone), reliable
             out static_depth/image, dynamic_depth/image (sensor_msgs/msg/Image: the same of depth/image), best effort,
                 each with its camera_info (sensor_msgs/msg/CameraInfo)
             out static_rgb/image, dynamic_rgb/image (sensor_msgs/msg/Image: the same of rgb/image, black; made of depth/image,
                 or points, too), best effort, each with its camera_info
             out static_points, dynamic_points (sensor_msgs/msg/PointCloud2: the same of points), best effort
             out ~/report (stillmap_msgs/msg/StageReport), reliable",
};

/// The cause of a drop.
const FAILED: &str = "segmentation failed";

/// Cycles that may wait here, or that a subscriber may be behind, without one being lost: seven
/// seconds of the RPLIDAR A1.
const CYCLES_KEPT: usize = 50;

/// How often the node looks whether somebody wants a filtered topic.
const LOOK_FOR_SUBSCRIBERS: Duration = Duration::from_millis(250);

/// A viewer needs the latest markers alone.
const MARKERS_KEPT: usize = 1;

geometry::parameters! {
    /// The parameters of the node.
    #[derive(Clone, PartialEq, Debug)]
    pub struct SegmentationParameters {
        /// The parameters of the method.
        config: SegmentationConfig as flatten;
        /// The parameters of the filtered topics.
        filter: FilterParameters as flatten;
    }
}

impl NodeParameters for SegmentationParameters {}

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
    let mut look = tokio::time::interval(LOOK_FOR_SUBSCRIBERS);
    look.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
    loop {
        tokio::select! {
            biased;
            () = shutdown.wait() => break,
            _reset = lifecycle.reset() => stage.reset()?,
            _now = look.tick() => stage.follow_subscribers(node)?,
            // It concerns the cycles after it.
            received = stage.cycles.next() => {
                stage.take(&received.message);
                node_shell::let_peers_run().await;
            }
            arrival = stage.filter.next() => stage.filter.take(arrival),
        }
    }
    if node.takes_every_cycle() {
        stage.take_waiting();
    }
    Ok(())
}

/// The condition of the evidence on free space.
const EVIDENCE: &str = "evidence";

/// What makes a cycle take less time.
const REMEDY: &str = "raise the pipeline's voxel_edge_m, or lower evidence_reach_m, beyond which what moves stays in the map";

/// The core with its topics.
pub struct Stage {
    cycles: ValueSubscription<DetectedCycle>,
    partial_evidence: Throttle,
    pipeline: PipelineWatch,
    config: SegmentationConfig,
    segmenter: Segmenter,
    next_cycle: u32,
    static_clouds: Publisher<PointCloud2>,
    dynamic_clouds: ValuePublisher<Cloud>,
    segmented_cycles: ValuePublisher<SegmentedCycle>,
    tracks: ValuePublisher<CycleTracks>,
    filter: Filter,
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
        Ok(Self {
            partial_evidence: Throttle::for_warnings(),
            pipeline: PipelineWatch::new(parameters.config.pipeline.clone(), node.counters()),
            config: parameters.config.clone(),
            segmenter: Segmenter::new(parameters.config.clone())?,
            next_cycle: 0,
            static_clouds: node.publisher("static_cloud", &Qos::reliable(CYCLES_KEPT))?,
            dynamic_clouds: node.value_publisher("dynamic_cloud", &Qos::reliable(CYCLES_KEPT))?,
            segmented_cycles: node
                .value_publisher("segmented_cloud", &Qos::reliable(CYCLES_KEPT))?,
            filter: Filter::new(
                node,
                &parameters.filter,
                parameters.config.pipeline.voxel_grid()?,
            )?,
            tracks: node.value_publisher("tracks", &Qos::reliable(CYCLES_KEPT))?,
            markers: node.publisher("track_markers", &Qos::reliable(MARKERS_KEPT))?,
            reporter: StageReporter::new(node, PROGRAM.name)?,
            counters: node.counters(),
            cycles: node.value_subscription("reduced_cloud", &node.cycles_qos())?,
        })
    }

    /// Drops the evidence and the tracks.
    fn reset(&mut self) -> Result<(), NodeFailure> {
        self.segmenter = Segmenter::new(self.config.clone())?;
        self.filter.reset();
        Ok(())
    }

    /// Takes what the filtered topics are made of, where somebody wants them: for who calls it now and then.
    ///
    /// # Errors
    /// When a topic cannot be had.
    pub fn follow_subscribers(&mut self, node: &Node) -> Result<(), NodeFailure> {
        self.filter.follow_subscribers(node)
    }

    /// There is no more input: the filtered topics get what waits for a cycle.
    pub fn give_up_waiting(&mut self) {
        self.filter.give_up_waiting();
    }

    /// Takes every message that is here already.
    pub fn take_waiting(&mut self) {
        self.filter.take_waiting();
        while let Some(received) = self.cycles.try_next() {
            self.take(&received.message);
        }
    }

    fn take(&mut self, arrived: &Arrived<DetectedCycle>) {
        let (header, index) = match arrived {
            Arrived::Value(cycle) => {
                let Cloud { stamp, frame_id, .. } = &cycle.reduced_cloud;
                (convert::header_of(*stamp, frame_id), cycle.index)
            }
            Arrived::Message(message) => (message.header.clone(), message.cycle),
        };
        self.next_cycle = index.wrapping_add(1);
        let mut timer = StepTimer::start();
        match self.guarded(|stage| stage.segment(arrived, &mut timer)) {
            Ok(counts) => {
                self.reporter.processed(header, index, &counts, &timer);
                self.reporter.keeps_pace(self.cycles.lost_count(), &timer, REMEDY);
            }
            Err((cause, reason)) => {
                self.reporter.dropped(header, self.next_cycle, (cause, &reason), &[]);
            }
        }
    }

    /// What a step gives. After a panic in it nothing is known of earlier cycles: what it left half done is dropped.
    fn guarded<T>(
        &mut self,
        step: impl FnOnce(&mut Self) -> Result<T, (&'static str, String)>,
    ) -> Result<T, (&'static str, String)> {
        let panicked = match node_shell::caught(|| step(self)) {
            Ok(done) => return done,
            Err(panicked) => panicked,
        };
        let fresh = self.reset().map_err(|error| (FAILED, error.to_string()));
        fresh.and(Err((Panicked::CAUSE, panicked.to_string())))
    }

    /// Segments a cycle and publishes what comes of it; otherwise the cause of its drop and the reason.
    fn segment(
        &mut self,
        arrived: &Arrived<DetectedCycle>,
        timer: &mut StepTimer,
    ) -> Result<[(&'static str, u64); 5], (&'static str, String)> {
        let cycle = arrived.value().map_err(|error| (FAILED, error.to_string()))?;
        self.pipeline
            .check(&cycle.setup, &cycle.reduced_cloud.frame_id)
            .map_err(|mismatch| (PipelineWatch::MISMATCH, mismatch.to_string()))?;
        timer.end_of("convert");
        let has_depth = cycle.depth.is_some();
        let segmented = self
            .segmenter
            .step(&cycle, |step| timer.end_of(step.name()))
            .map_err(|error| (FAILED, error.to_string()))?;
        if self.filter.is_wanted() {
            self.filter.take_verdict(Verdict::of(&cycle, &segmented));
            timer.end_of("filter");
        }
        let Segmented { cycle, tracks, counts, .. } = segmented;
        let cycle = Arc::new(cycle);
        self.segmented_cycles.publish_or_warn(Arc::clone(&cycle));
        let map = &cycle.static_cloud;
        self.static_clouds.publish_if_awaited(|| convert::message_from_cloud(map));
        self.dynamic_clouds.publish_if_awaited(|| cycle.dynamic_cloud.clone());
        self.tracks.publish_if_awaited(|| CycleTracks {
            index: cycle.index,
            stamp: map.stamp,
            map_frame_id: map.frame_id.clone(),
            tracks: tracks.clone(),
        });
        self.markers
            .publish_if_awaited(|| convert::markers_from_tracks(map.stamp, &map.frame_id, &tracks));
        timer.end_of("publish");
        self.note_evidence(cycle.index, has_depth);
        Ok([
            ("points_reduced", counts.reduced as u64),
            ("points_in_zone", counts.in_zone as u64),
            ("points_dynamic", counts.dynamic as u64),
            ("points_static", cycle.static_cloud.points_m.len() as u64),
            ("tracks", tracks.len() as u64),
        ])
    }

    /// Reports how much evidence there is, and why there is less than a cycle should give.
    fn note_evidence(&mut self, cycle: u32, has_depth: bool) {
        if self.config.pipeline.method != Method::FreeSpace {
            return;
        }
        let free_space = &self.config.free_space;
        let most = free_space.max_evidence_blocks;
        self.counters.note_fill("evidence blocks", self.segmenter.evidence_blocks(), most);
        let lack = if !has_depth {
            Some("has no depth image: nothing is observed free".to_owned())
        } else if !self.segmenter.evidence_is_whole() {
            let of_image = free_space.max_evidence_blocks_per_image();
            // More than an image may update would not be used.
            let more = if of_image == most { "raise max_evidence_blocks or" } else { "raise" };
            Some(format!(
                "shows more than {of_image} blocks of evidence: free space is observed in a part of the view; {more} voxel_edge_m, \
                 or lower evidence_reach_m"
            ))
        } else {
            None
        };
        let text = lack.as_deref().unwrap_or("whole");
        self.counters.note_condition(EVIDENCE, text, lack.is_some());
        if let Some(lack) = &lack
            && let Some(held_back) = self.partial_evidence.pass()
        {
            tracing::warn!("cycle {cycle} {lack} ({held_back} more since the last warning)");
        }
    }
}
