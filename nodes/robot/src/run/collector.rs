//! Subscribes to the three nodes, and to what they take that is judged, and passes the messages to the recorder.

use std::collections::BTreeMap;
use std::future;
use std::sync::Arc;

use detection::shell::{CloudInput, DetectionParameters};
use geometry::{Cloud, ColouredCloud, CycleTracks, DetectedCycle, SegmentationCounts, Stamp};
use msgs::RosMessage;
use msgs::convert::{self, ConvertError};
use msgs::diagnostic_msgs::DiagnosticArray;
use msgs::nav_msgs::Path;
use msgs::sensor_msgs::{CameraInfo, LaserScan, PointCloud2};
use msgs::stillmap_msgs::StageReport;
use node_shell::{Arrived, GrantedBuffer, Node, Qos, ShellError, Subscription, ValueSubscription};

use super::recorder::{Recorder, Stage};

/// Messages that may wait for the collector: more than the nodes publish while it is delayed.
const WAITING_MESSAGES: usize = 256;
/// Paths that may wait: each holds the whole trajectory, so a newer one replaces the ones before it.
const WAITING_PATHS: usize = 4;
/// Diagnostics that may wait: each node publishes one a second.
const WAITING_DIAGNOSTICS: usize = 32;

/// The subscriptions of the collector, and what they received.
pub(super) struct Collector {
    node: Node,
    diagnostics: Subscription<DiagnosticArray>,
    scans: Subscription<LaserScan>,
    /// None where detection takes clouds, or its calibration is that of a file.
    camera_infos: Option<Subscription<CameraInfo>>,
    detected: ValueSubscription<DetectedCycle>,
    dynamic_clouds: ValueSubscription<Cloud>,
    tracks: ValueSubscription<CycleTracks>,
    static_map: Subscription<PointCloud2>,
    paths: Subscription<Path>,
    reports: [Subscription<StageReport>; Stage::ALL.len()],
    seen: CollectedState,
}

/// What was received so far.
#[derive(Default)]
pub(super) struct CollectedState {
    /// Scans that detection has decided: processed or dropped.
    pub(super) scans_decided: u64,
    /// The stamp of the latest cycle's cloud.
    pub(super) last_cloud: Option<Stamp>,
    /// The latest map and the stamp of its last cycle.
    pub(super) map: Option<(Stamp, ColouredCloud)>,
    /// Numbers of the nodes' own diagnostics, by node and key.
    diagnostics: BTreeMap<(String, String), u64>,
}

impl Collector {
    /// Subscribes as `node`, which is in the run's namespace, to what `detection` takes and the nodes publish.
    pub(super) fn on(node: Node, detection: &DetectionParameters) -> Result<Self, ShellError> {
        let takes_camera_info =
            detection.input != CloudInput::Points && detection.camera_info_file.is_empty();
        let to_camera_info =
            || node.subscription("depth/camera_info", &Qos::sensor(WAITING_MESSAGES));
        let reliable = Qos::reliable(WAITING_MESSAGES);
        let report = |stage: Stage| {
            node.subscription::<StageReport>(&format!("{}/report", stage.name()), &reliable)
        };
        Ok(Self {
            diagnostics: node.subscription("/diagnostics", &Qos::reliable(WAITING_DIAGNOSTICS))?,
            scans: node.subscription("scan", &Qos::sensor(WAITING_MESSAGES))?,
            camera_infos: takes_camera_info.then(to_camera_info).transpose()?,
            detected: node.value_subscription("reduced_cloud", &reliable)?,
            dynamic_clouds: node.value_subscription("dynamic_cloud", &reliable)?,
            tracks: node.value_subscription("tracks", &reliable)?,
            static_map: node.subscription("static_map", &Qos::latched())?,
            paths: node.subscription("map_path", &Qos::reliable(WAITING_PATHS))?,
            reports: [
                report(Stage::Detection)?,
                report(Stage::Segmentation)?,
                report(Stage::Reconstruction)?,
            ],
            node,
            seen: CollectedState::default(),
        })
    }

    pub(super) fn node(&self) -> &Node {
        &self.node
    }

    /// What the kernel grants the sockets of this run.
    pub(super) fn granted_buffer(&self) -> Option<GrantedBuffer> {
        self.node.granted_buffer()
    }

    pub(super) fn seen(&self) -> &CollectedState {
        &self.seen
    }

    /// Receives one message, whichever arrives first; returns whether it is about a cycle. The future may be dropped while
    /// it waits.
    pub(super) async fn receive(&mut self, recorder: &mut Recorder) -> bool {
        let [detection, segmentation, reconstruction] = &self.reports;
        let received = tokio::select! {
            received = self.diagnostics.next() => Received::Diagnostics(received.message),
            received = self.scans.next() => Received::Scan(received.message),
            received = next_of(self.camera_infos.as_ref()) => Received::CameraInfo(received.message),
            received = self.detected.next() => Received::Detected(received.message),
            received = self.dynamic_clouds.next() => Received::DynamicCloud(received.message),
            received = self.tracks.next() => Received::Tracks(received.message),
            received = self.static_map.next() => Received::Map(received.message),
            received = self.paths.next() => Received::Path(received.message),
            received = detection.next() => Received::Report(Stage::Detection, received.message),
            received = segmentation.next() => Received::Report(Stage::Segmentation, received.message),
            received = reconstruction.next() => Received::Report(Stage::Reconstruction, received.message),
        };
        let about_a_cycle = !matches!(
            received,
            Received::Diagnostics(_)
                | Received::Path(_)
                | Received::Scan(_)
                | Received::CameraInfo(_)
        );
        self.take(received, recorder);
        about_a_cycle
    }

    /// Takes every message that has arrived already.
    pub(super) fn receive_waiting(&mut self, recorder: &mut Recorder) {
        while let Some(received) = self.try_receive() {
            self.take(received, recorder);
        }
    }

    fn try_receive(&self) -> Option<Received> {
        let reports = Stage::ALL.into_iter().zip(&self.reports).find_map(|(stage, reports)| {
            reports.try_next().map(|next| Received::Report(stage, next.message))
        });
        reports
            .or_else(|| self.scans.try_next().map(|next| Received::Scan(next.message)))
            .or_else(|| {
                let next = self.camera_infos.as_ref()?.try_next()?;
                Some(Received::CameraInfo(next.message))
            })
            .or_else(|| self.detected.try_next().map(|next| Received::Detected(next.message)))
            .or_else(|| {
                self.dynamic_clouds.try_next().map(|next| Received::DynamicCloud(next.message))
            })
            .or_else(|| self.tracks.try_next().map(|next| Received::Tracks(next.message)))
            .or_else(|| self.paths.try_next().map(|next| Received::Path(next.message)))
            .or_else(|| self.static_map.try_next().map(|next| Received::Map(next.message)))
            .or_else(|| self.diagnostics.try_next().map(|next| Received::Diagnostics(next.message)))
    }

    fn take(&mut self, received: Received, recorder: &mut Recorder) {
        if let Err(error) = self.seen.take(received, recorder) {
            recorder.dropped("collector", &error.to_string(), 1);
        }
    }

    /// Leaves the network.
    pub(super) async fn close(self) -> CollectedState {
        let Self { node, seen, .. } = self;
        node.close().await;
        seen
    }
}

/// The next message; never one without a subscription.
async fn next_of<M: RosMessage>(subscription: Option<&Subscription<M>>) -> node_shell::Received<M> {
    match subscription {
        Some(subscription) => subscription.next().await,
        None => future::pending().await,
    }
}

enum Received {
    Diagnostics(Arc<DiagnosticArray>),
    Scan(Arc<LaserScan>),
    CameraInfo(Arc<CameraInfo>),
    Detected(Arc<Arrived<DetectedCycle>>),
    DynamicCloud(Arc<Arrived<Cloud>>),
    Tracks(Arc<Arrived<CycleTracks>>),
    Map(Arc<PointCloud2>),
    Path(Arc<Path>),
    Report(Stage, Arc<StageReport>),
}

impl CollectedState {
    /// A number out of a node's latest diagnostics; 0 until it was received.
    pub(super) fn diagnostic(&self, node: &str, key: &str) -> u64 {
        self.diagnostics.get(&(node.to_owned(), key.to_owned())).copied().unwrap_or(0)
    }

    /// What a node has dropped, by cause.
    pub(super) fn drops_of(&self, node: &str) -> impl Iterator<Item = (&str, u64)> {
        self.diagnostics
            .iter()
            .filter(move |((name, _), _)| name == node)
            .filter_map(|((_, key), count)| Some((key.strip_prefix("dropped: ")?, *count)))
    }

    fn take(&mut self, received: Received, recorder: &mut Recorder) -> Result<(), ConvertError> {
        match received {
            Received::Diagnostics(diagnostics) => self.take_diagnostics(&diagnostics),
            // Detection reports one that cannot be read.
            Received::Scan(message) => {
                if let Ok(scan) = convert::scan_from_message(&message) {
                    recorder.scan(&scan);
                }
            }
            Received::CameraInfo(info) => recorder.calibration(&info),
            Received::Detected(arrived) => {
                let cycle = arrived.value()?;
                self.last_cloud = self.last_cloud.max(Some(cycle.reduced_cloud.stamp));
                recorder.detected(&cycle);
            }
            Received::DynamicCloud(arrived) => recorder.dynamic_cloud(arrived.value()?),
            Received::Tracks(arrived) => {
                let tracks = arrived.value()?;
                recorder.tracks(&tracks);
            }
            Received::Map(message) => {
                let map = convert::coloured_cloud_from_message(&message)?;
                self.map = Some((map.cloud.stamp, map));
            }
            // Reconstruction counts invalid paths.
            Received::Path(message) => {
                if let Ok(path) = convert::map_path_from_message(&message) {
                    recorder.path(path);
                }
            }
            Received::Report(stage, report) => self.take_report(stage, &report, recorder),
        }
        Ok(())
    }

    fn take_diagnostics(&mut self, diagnostics: &DiagnosticArray) {
        for status in &diagnostics.status {
            for pair in &status.values {
                if let Ok(number) = pair.value.parse::<u64>() {
                    self.diagnostics.insert((status.name.clone(), pair.key.clone()), number);
                }
            }
        }
    }

    fn take_report(&mut self, stage: Stage, report: &StageReport, recorder: &mut Recorder) {
        let counts: BTreeMap<&str, u64> = report
            .count_names
            .iter()
            .map(String::as_str)
            .zip(report.counts.iter().copied())
            .collect();
        let count = |name: &str| counts.get(name).copied().unwrap_or(0) as usize;
        let names = report.step_names.iter().map(String::as_str);
        let durations = names.zip(report.step_durations_s.iter().copied());
        match (stage, report.processed) {
            (_, false) => {
                // After the semicolon are numbers of this scan alone.
                let reason = report.drop_reason.split(';').next().unwrap_or_default();
                recorder.dropped(stage.name(), reason, 1);
            }
            (Stage::Reconstruction, true) => {
                let cloud_stamp = convert::stamp_from_time(report.header.stamp);
                recorder.reconstructed(cloud_stamp, count("voxels"), durations);
                let (refused, dropped) = (count("points_refused"), count("voxels_dropped"));
                recorder.kept_out(count("views_cut") > 0, refused, dropped);
            }
            (Stage::Segmentation, true) => {
                let counts = SegmentationCounts {
                    reduced: count("points_reduced"),
                    in_zone: count("points_in_zone"),
                    dynamic: count("points_dynamic"),
                };
                recorder.counts(report.cycle, counts);
                recorder.durations(report.cycle, stage, durations);
            }
            (Stage::Detection, true) => {
                if count("blind_scans") > 0 {
                    recorder.blind_scan();
                }
                if count("pose_jumps") > 0 {
                    recorder.pose_jump();
                }
                recorder.durations(report.cycle, stage, durations);
            }
        }
        if stage == Stage::Detection {
            self.scans_decided += 1;
        }
    }
}
