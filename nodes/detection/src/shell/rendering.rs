//! What the log and `/diagnostics` say of organised clouds whose depth images are rendered.

use geometry::PinholeFitError;
use node_shell::{Counters, Throttle};

/// The condition's name on `/diagnostics`.
const CONDITION: &str = "depth image";

/// Reports when depth images begin or cease to be rendered. That is a warning in the log, since a depth camera whose driver sends
/// its cloud in a wrong frame loses some of its resolution by it. On `/diagnostics` it is none, since it is as it should be for a
/// LiDAR.
pub(super) struct RenderingReport {
    is_rendered: bool,
    counters: Counters,
    warned: Throttle,
}

impl RenderingReport {
    pub(super) fn new(counters: Counters, warned: Throttle) -> Self {
        Self { is_rendered: false, counters, warned }
    }

    /// Takes why the depth image of a cycle was rendered from an organised cloud on `topic`, if it was.
    pub(super) fn take(&mut self, topic: &str, not_pinhole: Option<PinholeFitError>) {
        if not_pinhole.is_some() == self.is_rendered {
            return;
        }
        self.is_rendered = not_pinhole.is_some();
        let Some(error) = not_pinhole else {
            let text = format!("the image that {topic} was computed from");
            return self.counters.note_condition(CONDITION, &text, false);
        };
        let text = format!("rendered from the points of {topic}: {error}");
        self.counters.note_condition(CONDITION, &text, false);
        if let Some(held_back) = self.warned.pass() {
            tracing::warn!("{CONDITION}: {text} ({held_back} more since the last warning)");
        }
    }
}
