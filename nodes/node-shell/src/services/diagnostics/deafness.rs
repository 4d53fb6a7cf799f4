//! Whether a node hears nothing because the network has changed since it joined.
//!
//! The DDS library does not take another network. A node that goes on without it has its work: it stays. One that waits has nothing to
//! lose by a new start, and hears again after it.

use std::time::Duration;

use tokio::time::Instant;

use super::findings::Findings;

/// How long an input may be away before the changed network counts as the cause: as long as before the first warning of it.
const PATIENCE: Duration = Duration::from_secs(5);

/// Since when a node hears nothing on a network that it has not joined.
#[derive(Debug, Default)]
pub(super) struct Deafness {
    since: Option<Instant>,
}

impl Deafness {
    /// Why the process is to be started again: there is a network that the node has not joined, in place of one that it has or before
    /// its first cycle, and an input has been away for long.
    pub(super) fn is_lasting(
        &mut self,
        findings: &Findings<'_>,
        cycles: u64,
        now: Instant,
    ) -> Option<String> {
        let network = &findings.network;
        let may_help = network.has_new() && (network.has_gone() || cycles == 0);
        let missing = findings.missing.iter().copied();
        let away: Vec<&str> = missing.chain(findings.silent.iter().map(|one| one.topic)).collect();
        if !may_help || away.is_empty() {
            self.since = None;
            return None;
        }
        let since = *self.since.get_or_insert(now);
        (now.saturating_duration_since(since) >= PATIENCE).then(|| {
            format!(
                "{network}; nothing comes on {}: the process ends, to be started again",
                away.join(", ")
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::transport::NetworkChange;

    fn findings(network: NetworkChange, missing: Vec<&'static str>) -> Findings<'static> {
        Findings {
            idle: None,
            missing,
            silent: Vec::new(),
            troubles: Vec::new(),
            loss: None,
            datagrams_dropped: None,
            warnings: Vec::new(),
            network,
        }
    }

    /// Whether the process is to be started again when the finding lasts.
    fn ends(network: (&[&str], &[&str]), missing: &[&'static str], cycles: u64) -> bool {
        let (mut deafness, start) = (Deafness::default(), Instant::now());
        let found = findings(NetworkChange::of(network.0, network.1), missing.to_vec());
        assert_eq!(deafness.is_lasting(&found, cycles, start), None, "not at once");
        deafness.is_lasting(&found, cycles, start + PATIENCE).is_some()
    }

    /// Regression: a node stayed deaf for ever on a network that got another address, or came after the start.
    #[test]
    fn a_node_that_hears_nothing_since_the_network_changed_is_started_again() {
        let (old, new) = (&["10.0.0.1"][..], &["10.0.0.2"][..]);
        assert!(ends((old, new), &["/scan"], 7));
        assert!(ends((&[], new), &["/scan"], 0), "it has done nothing yet");
        assert!(!ends((&[], new), &["/scan"], 7), "its own networks are still there");
        assert!(!ends((old, &[]), &["/scan"], 7), "there is nothing to start for");
        assert!(!ends((old, new), &[], 7), "it hears what it needs");
        assert!(!ends((&[], &[]), &["/scan"], 0));
    }

    #[test]
    fn an_input_that_comes_again_in_time_is_none_that_is_away() {
        let network = || NetworkChange::of(&["10.0.0.1"], &["10.0.0.2"]);
        let (mut deafness, start) = (Deafness::default(), Instant::now());
        let half = start + PATIENCE / 2;
        let away = || findings(network(), vec!["/scan"]);
        assert_eq!(deafness.is_lasting(&away(), 7, start), None);
        assert_eq!(deafness.is_lasting(&findings(network(), Vec::new()), 7, half), None);
        assert_eq!(deafness.is_lasting(&away(), 7, start + PATIENCE), None);
        let reason = deafness.is_lasting(&away(), 7, start + 2 * PATIENCE).unwrap();
        assert!(reason.contains("10.0.0.2") && reason.contains("/scan"), "{reason}");
    }
}
