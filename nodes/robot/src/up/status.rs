//! The status line of `up`: what the suite hears and does, by what its nodes report on `/diagnostics`.

use std::fmt;
use std::sync::Arc;
use std::time::Duration;

use detection::shell::{IMAGE_WITHOUT_CALIBRATION, UNUSABLE_MESSAGE_ON};
use msgs::diagnostic_msgs::DiagnosticStatus;
use node_shell::{Node, ShellError, Shutdown, StatusLine};
use tokio::sync::watch;

/// The nodes report once a second.
const PERIOD: Duration = Duration::from_secs(1);
/// Where stderr is no terminal the line is logged once, when the map has so many cycles: then the rates are those of whole seconds.
const CYCLES_BEFORE_LOG: u64 = 20;

/// The stage that hears the sensors.
const HEARS: &str = "detection";

/// What it hears, each by the relative names of the topics that it may come on.
const HEARD: [(&str, &[&str]); 3] = [
    ("scan", &["scan"]),
    ("depth", &["depth/image", "depth/image/compressedDepth", "points"]),
    ("pose", &["pose", "pose_with_covariance", "odom", "/tf"]),
];

type Reports = watch::Receiver<Option<Arc<DiagnosticStatus>>>;

/// The reports of the three stages, in the order in which data flows.
pub(super) struct Status {
    stages: [(&'static str, Reports); 3],
    heard: Vec<(&'static str, Vec<String>)>,
}

impl Status {
    /// Of the nodes of the three stages, with their names.
    ///
    /// # Errors
    /// When a topic has no valid name.
    pub(super) fn of(stages: [(&'static str, &Node); 3]) -> Result<Self, ShellError> {
        let [(_, detection), ..] = stages;
        let absolute = |(what, names): (&'static str, &[&str])| {
            let names: Result<_, ShellError> =
                names.iter().map(|name| detection.resolve(name)).collect();
            Ok((what, names?))
        };
        let heard: Result<_, ShellError> = HEARD.into_iter().map(absolute).collect();
        Ok(Self { heard: heard?, stages: stages.map(|(name, node)| (name, node.reports())) })
    }

    /// Shows the line at the foot of a terminal, anew once a second, until the process is to end; elsewhere it is logged once.
    pub(super) async fn show(self, shutdown: Shutdown) {
        let terminal = StatusLine::on_terminal();
        let mut is_logged = false;
        loop {
            tokio::select! {
                () = shutdown.wait() => return,
                () = tokio::time::sleep(PERIOD) => {}
            }
            let Some(figures) = self.figures() else { continue };
            match &terminal {
                Some(terminal) => terminal.show(&figures.to_string()),
                None if !is_logged && figures.cycles >= CYCLES_BEFORE_LOG => {
                    is_logged = true;
                    tracing::info!("{figures}");
                }
                None => {}
            }
        }
    }

    /// None before all have reported.
    fn figures(&self) -> Option<Figures> {
        let mut reports = Vec::new();
        for (name, stage) in &self.stages {
            reports.push((*name, stage.borrow().clone()?));
        }
        Some(Figures::of(&reports, &self.heard))
    }
}

/// What the line says.
#[derive(Clone, PartialEq, Debug, Default)]
struct Figures {
    /// Rates of what is heard, in Hz.
    heard: Vec<(&'static str, f64)>,
    /// Cycles in the map.
    cycles: u64,
    /// Cycles that were dropped, by whichever stage.
    dropped: u64,
    objects: u64,
    map_voxels: u64,
    /// What the nodes lack or warn of.
    troubles: Vec<String>,
}

impl Figures {
    fn of(
        reports: &[(&'static str, Arc<DiagnosticStatus>)],
        heard: &[(&'static str, Vec<String>)],
    ) -> Self {
        let mut figures = Self::default();
        for (name, report) in reports {
            for pair in &report.values {
                let count = || pair.value.parse().unwrap_or(0);
                match pair.key.as_str() {
                    // Of the last stage in the end.
                    "cycles" => figures.cycles = count(),
                    "tracks" => figures.objects = count(),
                    "voxels" => figures.map_voxels = count(),
                    key if is_dropped_cycle(key) => figures.dropped += count(),
                    // Others hear the same for what they filter of it.
                    key if *name == HEARS => {
                        figures.heard.extend(rate_of(key, &pair.value, heard));
                    }
                    _ => {}
                }
            }
            if report.level != DiagnosticStatus::OK {
                figures.troubles.push(format!("{name}: {}", report.message));
            }
        }
        figures.heard.sort_by_key(|(what, _)| HEARD.iter().position(|(known, _)| known == what));
        figures
    }
}

/// Whether a figure counts scans that became no cycle, or cycles that a stage dropped, or did not get since newer ones came.
fn is_dropped_cycle(key: &str) -> bool {
    let is_cycle =
        |topic: &str| ["reduced_cloud", "segmented_cloud"].iter().any(|name| topic.ends_with(name));
    let is_message =
        |cause: &str| cause.starts_with(UNUSABLE_MESSAGE_ON) || cause == IMAGE_WITHOUT_CALIBRATION;
    key.strip_prefix("lost ").is_some_and(is_cycle)
        || key.strip_prefix("dropped: ").is_some_and(|cause| !is_message(cause))
}

/// The rate of one of the topics that are heard, if the figure is that.
fn rate_of(
    key: &str,
    value: &str,
    heard: &[(&'static str, Vec<String>)],
) -> Option<(&'static str, f64)> {
    let topic = key.strip_prefix("received per second ")?;
    let (what, _) = heard.iter().find(|(_, names)| names.iter().any(|name| name == topic))?;
    Some((what, value.parse().ok()?))
}

/// `scan 7.0 Hz, depth 30.0 Hz, pose 50.0 Hz, 412 cycles, 3 dropped, 1 object, 271034 voxels in the map`
impl fmt::Display for Figures {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (what, rate_hz) in &self.heard {
            write!(f, "{what} {rate_hz:.1} Hz, ")?;
        }
        let Self { cycles, dropped, objects, map_voxels, .. } = self;
        let plural = |count: u64| if count == 1 { "" } else { "s" };
        write!(f, "{cycles} cycle{}, {dropped} dropped, ", plural(*cycles))?;
        write!(f, "{objects} object{}, ", plural(*objects))?;
        write!(f, "{map_voxels} voxels in the map")?;
        self.troubles.iter().try_for_each(|trouble| write!(f, " | {trouble}"))
    }
}

#[cfg(test)]
mod tests {
    use msgs::diagnostic_msgs::KeyValue;

    use super::*;

    fn report(level: u8, message: &str, values: &[(&str, &str)]) -> Arc<DiagnosticStatus> {
        let pair = |(key, value): &(&str, &str)| KeyValue {
            key: (*key).to_owned(),
            value: (*value).to_owned(),
        };
        let values = values.iter().map(pair).collect();
        Arc::new(DiagnosticStatus {
            level,
            message: message.to_owned(),
            values,
            ..Default::default()
        })
    }

    #[test]
    fn the_line_says_what_is_heard_done_and_missing() {
        let detection = [
            ("cycles", "50"),
            ("dropped: newer cycles wait", "2"),
            ("dropped: missing /robot/pose", "1"),
            ("lost /robot/scan", "9"),
            ("dropped: unusable message on /robot/depth/image", "5"),
            ("received per second /robot/pose", "0.00"),
            ("received per second /robot/depth/image", "30.01"),
            ("received per second /robot/depth/camera_info", "30.01"),
            ("received per second /robot/scan", "7.02"),
        ];
        let reports = [
            ("detection", report(DiagnosticStatus::WARN, "waiting for /robot/pose", &detection)),
            (
                "segmentation",
                report(
                    0,
                    "running",
                    &[
                        ("cycles", "48"),
                        ("tracks", "1"),
                        ("received per second /robot/scan", "7.00"),
                    ],
                ),
            ),
            (
                "reconstruction",
                report(
                    0,
                    "running",
                    &[("cycles", "41"), ("lost /robot/segmented_cloud", "7"), ("voxels", "2710")],
                ),
            ),
        ];
        let heard = HEARD.map(|(what, names)| {
            (what, names.iter().map(|name| format!("/robot/{name}")).collect())
        });
        let line = Figures::of(&reports, &heard).to_string();
        assert_eq!(
            line,
            "scan 7.0 Hz, depth 30.0 Hz, pose 0.0 Hz, 41 cycles, 10 dropped, 1 object, 2710 voxels in the map \
             | detection: waiting for /robot/pose"
        );
    }
}
