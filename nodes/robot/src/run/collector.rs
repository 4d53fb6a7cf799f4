//! Listens to the three nodes and puts the run's record together.

use std::collections::BTreeMap;
use std::sync::Arc;

use geometry::{DetectedCycle, SegmentationCounts, Stamp};
use msgs::convert::{self, ConvertError};
use msgs::diagnostic_msgs::DiagnosticArray;
use msgs::nav_msgs::Path;
use msgs::sensor_msgs::PointCloud2;
use msgs::stillmap_msgs::{StageReport, Tracks};
use nalgebra::Point3;
use node_shell::{Arrived, GrantedBuffer, Node, Qos, ShellError, Subscription, ValueSubscription};

use super::recorder::{Recorder, Stage};

/// Messages that may wait for the collector: more than a run of minutes makes while it is held up.
const WAITING_MESSAGES: usize = 256;
/// Paths that may wait: each is of the whole way, and what the last one tells is more than the ones before it did.
const WAITING_PATHS: usize = 4;
/// Diagnostics that may wait: one a second and node.
const WAITING_DIAGNOSTICS: usize = 32;

/// The collector's ears.
pub(super) struct Collector {
    node: Node,
    diagnostics: Subscription<DiagnosticArray>,
    detected: ValueSubscription<DetectedCycle>,
    dynamic_clouds: Subscription<PointCloud2>,
    tracks: Subscription<Tracks>,
    static_map: Subscription<PointCloud2>,
    paths: Subscription<Path>,
    reports: [Subscription<StageReport>; Stage::ALL.len()],
    seen: Seen,
}

/// What has been heard so far.
#[derive(Default)]
pub(super) struct Seen {
    /// Scans that detection has decided: processed or dropped.
    pub(super) scans_decided: u64,
    /// The stamp of the latest cycle's cloud.
    pub(super) last_cloud: Option<Stamp>,
    /// The latest map and the stamp of its last cycle.
    pub(super) map: Option<(Stamp, Vec<Point3<f32>>)>,
    /// Numbers of the nodes' own diagnostics, by node and key.
    diagnostics: BTreeMap<(String, String), u64>,
}

impl Collector {
    /// Listens as `node`, which is in the run's namespace.
    pub(super) fn on(node: Node) -> Result<Self, ShellError> {
        let reliable = Qos::reliable(WAITING_MESSAGES);
        let report = |stage: Stage| {
            node.subscription::<StageReport>(&format!("{}/report", stage.name()), &reliable)
        };
        Ok(Self {
            diagnostics: node.subscription("/diagnostics", &Qos::reliable(WAITING_DIAGNOSTICS))?,
            detected: node.value_subscription("reduced_cloud", &reliable)?,
            dynamic_clouds: node.subscription("dynamic_cloud", &reliable)?,
            tracks: node.subscription("tracks", &reliable)?,
            static_map: node.subscription("static_map", &Qos::latched())?,
            paths: node.subscription("map_path", &Qos::reliable(WAITING_PATHS))?,
            reports: [
                report(Stage::Detection)?,
                report(Stage::Segmentation)?,
                report(Stage::Reconstruction)?,
            ],
            node,
            seen: Seen::default(),
        })
    }

    /// What the kernel grants the sockets of this run.
    pub(super) fn granted_buffer(&self) -> Option<GrantedBuffer> {
        self.node.granted_buffer()
    }

    pub(super) fn seen(&self) -> &Seen {
        &self.seen
    }

    /// Hears one message, whichever comes first. May be dropped while it waits.
    /// Tells whether it was about a cycle.
    pub(super) async fn hear(&mut self, recorder: &mut Recorder) -> bool {
        let [detection, segmentation, reconstruction] = &self.reports;
        let heard = tokio::select! {
            received = self.diagnostics.next() => Heard::Diagnostics(received.message),
            received = self.detected.next() => Heard::Detected(received.message),
            received = self.dynamic_clouds.next() => Heard::DynamicCloud(received.message),
            received = self.tracks.next() => Heard::Tracks(received.message),
            received = self.static_map.next() => Heard::Map(received.message),
            received = self.paths.next() => Heard::Path(received.message),
            received = detection.next() => Heard::Report(Stage::Detection, received.message),
            received = segmentation.next() => Heard::Report(Stage::Segmentation, received.message),
            received = reconstruction.next() => Heard::Report(Stage::Reconstruction, received.message),
        };
        let about_a_cycle = !matches!(heard, Heard::Diagnostics(_) | Heard::Path(_));
        self.take(heard, recorder);
        about_a_cycle
    }

    /// Hears every message that is here already.
    pub(super) fn hear_waiting(&mut self, recorder: &mut Recorder) {
        while let Some(heard) = self.try_hear() {
            self.take(heard, recorder);
        }
    }

    fn try_hear(&self) -> Option<Heard> {
        let reports = Stage::ALL.into_iter().zip(&self.reports).find_map(|(stage, reports)| {
            reports.try_next().map(|received| Heard::Report(stage, received.message))
        });
        reports
            .or_else(|| self.detected.try_next().map(|next| Heard::Detected(next.message)))
            .or_else(|| {
                self.dynamic_clouds.try_next().map(|next| Heard::DynamicCloud(next.message))
            })
            .or_else(|| self.tracks.try_next().map(|next| Heard::Tracks(next.message)))
            .or_else(|| self.paths.try_next().map(|next| Heard::Path(next.message)))
            .or_else(|| self.static_map.try_next().map(|next| Heard::Map(next.message)))
            .or_else(|| self.diagnostics.try_next().map(|next| Heard::Diagnostics(next.message)))
    }

    fn take(&mut self, heard: Heard, recorder: &mut Recorder) {
        if let Err(error) = self.seen.take(heard, recorder) {
            recorder.dropped("collector", &error.to_string(), 1);
        }
    }

    /// Leaves the network.
    pub(super) async fn close(self) -> Seen {
        let Self { node, seen, .. } = self;
        node.close().await;
        seen
    }
}

enum Heard {
    Diagnostics(Arc<DiagnosticArray>),
    Detected(Arc<Arrived<DetectedCycle>>),
    DynamicCloud(Arc<PointCloud2>),
    Tracks(Arc<Tracks>),
    Map(Arc<PointCloud2>),
    Path(Arc<Path>),
    Report(Stage, Arc<StageReport>),
}

impl Seen {
    /// A number out of a node's latest diagnostics; 0 until it has said it.
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

    fn take(&mut self, heard: Heard, recorder: &mut Recorder) -> Result<(), ConvertError> {
        match heard {
            Heard::Diagnostics(diagnostics) => self.take_diagnostics(&diagnostics),
            Heard::Detected(arrived) => {
                let cycle = Arc::unwrap_or_clone(arrived.value()?);
                self.last_cloud = self.last_cloud.max(Some(cycle.reduced_cloud.stamp));
                recorder.detected(cycle);
            }
            Heard::DynamicCloud(message) => {
                let cloud = convert::cloud_from_message(&message)?;
                recorder.dynamic_cloud(cloud);
            }
            Heard::Tracks(message) => {
                recorder.tracks(message.cycle, &convert::tracks_from_message(&message)?);
            }
            Heard::Map(message) => {
                let cloud = convert::cloud_from_message(&message)?;
                self.map = Some((cloud.stamp, cloud.points_m));
            }
            // One that is none is reconstruction's to count.
            Heard::Path(message) => {
                if let Ok(path) = convert::map_path_from_message(&message) {
                    recorder.path(path);
                }
            }
            Heard::Report(stage, report) => self.take_report(stage, &report, recorder),
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
                // What follows the semicolon are this one's own numbers.
                let reason = report.drop_reason.split(';').next().unwrap_or_default();
                recorder.dropped(stage.name(), reason, 1);
            }
            (Stage::Reconstruction, true) => {
                let cloud_stamp = convert::stamp_from_time(report.header.stamp);
                recorder.reconstructed(cloud_stamp, count("voxels"), durations);
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
                recorder.durations(report.cycle, stage, durations);
            }
        }
        if stage == Stage::Detection {
            self.scans_decided += 1;
        }
    }
}
