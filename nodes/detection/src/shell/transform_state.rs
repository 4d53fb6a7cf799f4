//! The state of a transform that the node needs: on `/diagnostics`, and in the log when it changes.

use node_shell::{Counters, Throttle, TransformError};

/// A transform by its name on `/diagnostics`, and its last state.
pub(super) struct TransformState {
    condition: String,
    changes: StateChanges,
    counters: Counters,
}

impl TransformState {
    /// Of a transform that nothing has needed yet.
    pub(super) fn new(condition: String, counters: Counters) -> Self {
        counters.note_condition(&condition, "no scan has needed it yet", false);
        Self { condition, changes: StateChanges::default(), counters }
    }

    /// Reports that it is missing.
    pub(super) fn wait_for(&mut self, error: &TransformError) {
        self.report(&format!("waiting for it: {error}"), true);
    }

    /// Reports that it is known, and what it is.
    pub(super) fn set_known(&mut self, text: &str) {
        self.report(text, false);
    }

    fn report(&mut self, text: &str, is_waiting: bool) {
        let Some(changes) = self.changes.of(text, is_waiting) else { return };
        let condition = &self.condition;
        self.counters.note_condition(condition, text, is_waiting);
        match changes {
            Some(Line::Waits) => tracing::warn!("{condition}: {text}"),
            Some(Line::IsKnown) => tracing::info!("{condition}: {text}"),
            Some(Line::HasChanged { unreported }) => tracing::warn!(
                "{condition}: it has changed: {text} ({unreported} more changes since the last warning)"
            ),
            None => {}
        }
    }
}

/// A line of the log.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Line {
    Waits,
    IsKnown,
    HasChanged { unreported: u64 },
}

/// The last reported state, and which changes of it are logged: those of a transform that keeps changing only at intervals.
struct StateChanges {
    reported: Option<(String, bool)>,
    waits: Throttle,
    known: Throttle,
    changed: Throttle,
}

impl Default for StateChanges {
    fn default() -> Self {
        let [waits, known, changed] = [(); 3].map(|()| Throttle::for_warnings());
        Self { reported: None, waits, known, changed }
    }
}

impl StateChanges {
    /// The line to log for a state; the outer `None` if the state has not changed.
    fn of(&mut self, text: &str, is_waiting: bool) -> Option<Option<Line>> {
        let reported =
            self.reported.as_ref().map(|(text, is_waiting)| (text.as_str(), *is_waiting));
        if reported == Some((text, is_waiting)) {
            return None;
        }
        let line = match (reported, is_waiting) {
            // The text has a time difference, which changes with every scan.
            (Some((_, true)), true) => None,
            (_, true) => self.waits.pass().map(|_| Line::Waits),
            (Some((_, false)), false) => {
                self.changed.pass().map(|unreported| Line::HasChanged { unreported })
            }
            (_, false) => self.known.pass().map(|_| Line::IsKnown),
        };
        self.reported = Some((text.to_owned(), is_waiting));
        Some(line)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mount_that_keeps_changing_is_logged_at_intervals() {
        let mut changes = StateChanges::default();
        assert_eq!(changes.of("no frame", true), Some(Some(Line::Waits)));
        assert_eq!(changes.of("no moment", true), Some(None), "it waits as before");
        assert_eq!(changes.of("at 0", false), Some(Some(Line::IsKnown)));
        assert_eq!(changes.of("at 0", false), None);
        assert_eq!(changes.of("at 1", false), Some(Some(Line::HasChanged { unreported: 0 })));
        for at in ["at 0", "at 1", "at 0"] {
            assert_eq!(changes.of(at, false), Some(None), "reported on /diagnostics only");
        }
        for _ in 0..3 {
            assert_eq!(changes.of("no frame", true), Some(None));
            assert_eq!(changes.of("at 0", false), Some(None));
        }
    }
}
