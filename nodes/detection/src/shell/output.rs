//! The node's output: reduced clouds, zones, and a report of each scan.

use std::sync::Arc;

use geometry::{DetectedCycle, Stamp};
use msgs::convert;
use msgs::std_msgs::Header;
use msgs::stillmap_msgs::{DynamicZones, StageReport};
use node_shell::{Node, NodeFailure, Publisher, Qos, StageReporter, StepTimer, ValuePublisher};

use super::PROGRAM;
use super::inputs::Inputs;
use crate::Detected;

/// Cycles that a subscriber may be behind without losing one: seven seconds of the RPLIDAR A1.
const CYCLES_KEPT: usize = 50;

/// What makes a cycle take less time.
const REMEDY: &str = "raise the pipeline's voxel_edge_m, or let the camera send smaller images";

/// Reports of views that a subscriber may be behind.
const VIEWS_KEPT: usize = 100;

/// The node's publishers.
pub(super) struct Output {
    cycles: ValuePublisher<DetectedCycle>,
    dynamic_zones: Publisher<DynamicZones>,
    reporter: StageReporter,
    views: Publisher<StageReport>,
    rig_frame_id: String,
    next_cycle: u32,
}

impl Output {
    /// # Errors
    /// When a publisher cannot be created.
    pub(super) fn new(node: &Node, rig_frame_id: &str) -> Result<Self, NodeFailure> {
        Ok(Self {
            cycles: node.value_publisher("reduced_cloud", &Qos::reliable(CYCLES_KEPT))?,
            dynamic_zones: node.publisher("dynamic_zones", &Qos::reliable(CYCLES_KEPT))?,
            reporter: StageReporter::new(node, PROGRAM.name)?,
            views: node.publisher("~/views", &Qos::reliable(VIEWS_KEPT))?,
            rig_frame_id: rig_frame_id.to_owned(),
            next_cycle: 0,
        })
    }

    /// Publishes a cycle, and reports it; so many were dropped for newer ones so far.
    pub(super) fn publish(
        &mut self,
        detected: Detected,
        inputs: &Inputs,
        timer: &mut StepTimer,
        superseded: u64,
    ) {
        let Detected { cycle, statistics } = detected;
        let cycle = Arc::new(cycle);
        self.next_cycle = cycle.index.wrapping_add(1);
        self.cycles.publish_or_warn(Arc::clone(&cycle));
        self.dynamic_zones.publish_if_awaited(|| convert::message_from_zones(&cycle));
        timer.end_of("publish");

        let count = |count: usize| count as u64;
        let mut counts = inputs.counts();
        counts.extend([
            ("points_before_reduction", count(cycle.points_before_reduction)),
            ("points_reduced", count(cycle.reduced_cloud.points_m.len())),
            ("beams", count(statistics.beams)),
            ("filled_beams", count(statistics.filled_beams)),
            ("blind_scans", count(usize::from(statistics.is_blind()))),
            ("high_variability_beams", count(statistics.high_variability_beams)),
            ("zones", count(cycle.zones.len())),
            ("pose_jumps", count(usize::from(statistics.pose_jump.is_some()))),
        ]);
        let header = self.header(cycle.reduced_cloud.stamp);
        self.reporter.processed(header, cycle.index, &counts, timer);
        self.reporter.keeps_pace(superseded, timer, REMEDY);
    }

    /// Reports a cycle that was dropped for newer ones.
    pub(super) fn superseded(&self, scan_stamp: Stamp, inputs: &Inputs) {
        self.reporter.superseded(self.header(scan_stamp), self.next_cycle, &inputs.counts());
    }

    /// Reports a dropped scan.
    pub(super) fn dropped(
        &self,
        scan_stamp: Stamp,
        (cause, reason): (&str, &str),
        inputs: &Inputs,
    ) {
        let header = self.header(scan_stamp);
        self.reporter.dropped(header, self.next_cycle, (cause, reason), &inputs.counts());
    }

    /// Reports that an image or a cloud was taken: there is room for another one.
    pub(super) fn view_taken(&self, stamp: Stamp) {
        self.views.publish_if_awaited(|| StageReport {
            header: self.header(stamp),
            stage: PROGRAM.name.to_owned(),
            cycle: self.next_cycle,
            ..StageReport::default()
        });
    }

    fn header(&self, stamp: Stamp) -> Header {
        Header { stamp: convert::time_from_stamp(stamp), frame_id: self.rig_frame_id.clone() }
    }
}
