//! What the log and `/diagnostics` say of scans whose angles differ from one to the next.

use geometry::Method;
use node_shell::{Counters, Throttle};

use crate::DetectionConfig;

/// The condition's name on `/diagnostics`.
const CONDITION: &str = "scan angles";
/// One restart is a scanner that was set up anew.
const MOST_RESTARTS: usize = 1;

/// Reports that the window of scans is restarted again and again, so that `rec_hv` finds nothing. `free_space` does without it.
pub(super) struct RestartReport {
    /// The scans after which the window is full again; `None` where the method does without.
    window_scans: Option<usize>,
    restarts: usize,
    scans_since: usize,
    is_varying: bool,
    counters: Counters,
    warned: Throttle,
}

impl RestartReport {
    pub(super) fn new(config: &DetectionConfig, counters: Counters, warned: Throttle) -> Self {
        let needs_window = config.pipeline.method == Method::RecHv;
        let window_scans = needs_window.then_some(config.window_scans);
        Self { window_scans, restarts: 0, scans_since: 0, is_varying: false, counters, warned }
    }

    /// Takes whether the scan of a cycle had other angles than the one before.
    pub(super) fn take(&mut self, topic: &str, window_restarted: bool) {
        let Some(window_scans) = self.window_scans else { return };
        if !window_restarted {
            self.scans_since = self.scans_since.saturating_add(1);
            if self.scans_since >= window_scans {
                self.restarts = 0;
                if std::mem::take(&mut self.is_varying) {
                    self.counters.note_condition(CONDITION, "the same in each scan", false);
                }
            }
            return;
        }
        (self.restarts, self.scans_since) = (self.restarts.saturating_add(1), 0);
        if self.restarts <= MOST_RESTARTS {
            return;
        }
        self.is_varying = true;
        let text = format!(
            "{topic}: the number of beams, or their angles, differ from scan to scan. rec_hv finds what moves only in {window_scans} scans \
             with the same: set the driver to a fixed number of beams, or take the method free_space"
        );
        self.counters.note_condition(CONDITION, &text, true);
        if let Some(held_back) = self.warned.pass() {
            tracing::warn!("{CONDITION}: {text} ({held_back} more since the last warning)");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whether it is reported after each scan, with whether each restarted the window.
    fn warnings(method: Method, restarted: &[bool]) -> Vec<bool> {
        let mut config = DetectionConfig { window_scans: 3, ..DetectionConfig::default() };
        config.pipeline.method = method;
        let mut report = RestartReport::new(&config, Counters::default(), Throttle::for_warnings());
        restarted
            .iter()
            .map(|restarted| {
                report.take("/scan", *restarted);
                report.is_varying
            })
            .collect()
    }

    /// Regression: with a scanner whose number of beams varies rec_hv found nothing, and nothing said so.
    #[test]
    fn scans_with_other_angles_each_time_are_reported() {
        let (t, f) = (true, false);
        let varying = [f, t, t, f, t, f, f, f];
        assert_eq!(warnings(Method::RecHv, &varying), [f, f, t, t, t, t, t, f]);
        assert_eq!(warnings(Method::FreeSpace, &varying), [f; 8]);
        let set_up_anew = [f, t, f, f, f, f, t, f];
        assert_eq!(warnings(Method::RecHv, &set_up_anew), [f; 8]);
    }
}
