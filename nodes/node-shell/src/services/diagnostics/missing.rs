//! The warning that nothing publishes a topic: soon at first, then ever more seldom.

use std::time::Duration;

use tokio::time::Instant;

/// The waits before the warnings, of which the last one repeats.
const WAITS: [Duration; 4] = [
    Duration::from_secs(5),
    Duration::from_secs(15),
    Duration::from_secs(60),
    Duration::from_secs(300),
];

/// When to warn of topics without a publisher.
#[derive(Debug, Default)]
pub(super) struct MissingWarning {
    topics: Vec<String>,
    since: Option<Instant>,
    warned: usize,
}

impl MissingWarning {
    /// Whether to warn now of the topics that are missing. Topics that were not missing before start
    /// the waits again.
    pub(super) fn is_due(&mut self, missing: &[&str], now: Instant) -> bool {
        let more = missing.iter().any(|topic| !self.topics.iter().any(|known| known == topic));
        if more {
            (self.since, self.warned) = (Some(now), 0);
        }
        self.topics = missing.iter().map(|topic| (*topic).to_owned()).collect();
        let Some(since) = self.since.filter(|_| !missing.is_empty()) else { return false };
        let wait = WAITS[self.warned.min(WAITS.len() - 1)];
        let due = now.duration_since(since) >= wait;
        if due {
            self.since = Some(now);
            self.warned += 1;
        }
        due
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The seconds at which a warning comes, when `missing_at` is asked every second.
    fn warnings<'a>(seconds: u64, missing_at: impl Fn(u64) -> &'a [&'a str]) -> Vec<u64> {
        let start = Instant::now();
        let mut warning = MissingWarning::default();
        (0..=seconds)
            .filter(|second| {
                warning.is_due(missing_at(*second), start + Duration::from_secs(*second))
            })
            .collect()
    }

    #[test]
    fn the_warnings_become_seldom() {
        assert_eq!(warnings(1000, |_| &["/scan"]), [5, 20, 80, 380, 680, 980]);
        assert!(warnings(1000, |_| &[]).is_empty());
    }

    #[test]
    fn a_topic_that_comes_back_causes_another_warning() {
        let missing =
            |second| -> &[&str] { if (30..40).contains(&second) { &[] } else { &["/scan"] } };
        assert_eq!(warnings(70, missing), [5, 20, 45, 60]);
    }

    #[test]
    fn a_further_topic_is_warned_of_soon_and_one_less_changes_nothing() {
        let more =
            |second| -> &[&str] { if second < 30 { &["/scan"] } else { &["/pose", "/scan"] } };
        assert_eq!(warnings(60, more), [5, 20, 35, 50]);
        let fewer =
            |second| -> &[&str] { if second < 10 { &["/pose", "/scan"] } else { &["/scan"] } };
        assert_eq!(warnings(90, fewer), [5, 20, 80]);
    }
}
