//! What the bounds keep out of the map, on the log and on `/diagnostics`.

use node_shell::{Counters, Throttle};

use crate::{Addition, BoundReached, KeptOut, ReconstructionConfig};

/// The name on `/diagnostics`.
const CONDITION: &str = "bounds of the map";

/// Warns of bounds that are reached.
pub(super) struct BoundsWatch {
    config: ReconstructionConfig,
    kept_out: KeptOut,
    counters: Counters,
    warned: Throttle,
}

impl BoundsWatch {
    pub(super) fn new(config: ReconstructionConfig, counters: Counters) -> Self {
        Self { config, kept_out: KeptOut::default(), counters, warned: Throttle::for_warnings() }
    }

    /// Notes what a cycle did to the map.
    pub(super) fn note(&mut self, addition: &Addition) {
        self.kept_out.note(addition);
        let reached = self.kept_out.bounds_reached(&self.config);
        if reached.is_empty() {
            return self.counters.note_condition(CONDITION, "not reached", false);
        }
        let said = |BoundReached { what, fix }: BoundReached| format!("{what}; {fix}");
        let text = reached.into_iter().map(said).collect::<Vec<_>>().join("; ");
        self.counters.note_condition(CONDITION, &text, true);
        let is_news = addition.is_view_cut || addition.refused_points > 0;
        if is_news && let Some(held_back) = self.warned.pass() {
            tracing::warn!("{text} ({held_back} more since the last warning)");
        }
    }
}
