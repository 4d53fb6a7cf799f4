//! Playback no faster than nodes can process: a topic is held back while a node's reports on it are behind.
//!
//! Large messages are sent with best effort, and a node that is slower than the bag loses messages. On a robot that is right,
//! since the newest message matters; mapping a recording needs all of them, however slow the machine is.

use std::str::FromStr;
use std::time::{Duration, Instant};

use msgs::stillmap_msgs::StageReport;
use node_shell::{Node, Qos, ShellError, Subscription};

use crate::message::{BagMessage, bare};

/// This many messages may be in transit: enough to keep a node busy, and fewer than the queue depth of any node of the suite.
const MOST_AHEAD: u64 = 3;
/// The longest wait for a report of a node: messages that it has not reported by then count as lost.
const LONGEST_HOLD: Duration = Duration::from_secs(5);
/// The queue depth for reports.
const REPORTS_KEPT: usize = 100;

/// A topic of the bag, and the topic of a node's reports on it: `TOPIC=REPORTS`.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct PaceBy {
    /// The topic's name in the bag.
    pub topic: String,
    /// The topic of the node's reports, one or more for each message; such as `/pose/report`.
    pub reports: String,
}

/// The argument is not of the form `TOPIC=REPORTS`.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[error("accepted is TOPIC=REPORTS, as /camera/depth/image_raw=/pose/report")]
pub struct PaceByError;

impl FromStr for PaceBy {
    type Err = PaceByError;

    fn from_str(text: &str) -> Result<Self, PaceByError> {
        match text.split_once('=') {
            Some((topic, reports)) if !topic.is_empty() && !reports.is_empty() => {
                Ok(Self { topic: topic.to_owned(), reports: reports.to_owned() })
            }
            _ => Err(PaceByError),
        }
    }
}

/// Holds topics back.
pub(super) struct Pace {
    paced: Vec<Paced>,
}

struct Paced {
    topic: String,
    reports: Subscription<StageReport>,
    lead: Lead,
}

/// The number of messages that are published but not reported.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
struct Lead {
    messages: u64,
    held_since: Option<Instant>,
}

impl Pace {
    /// Subscribes to the reports.
    pub(super) fn new(node: &Node, paces: &[PaceBy]) -> Result<Self, ShellError> {
        let paced = paces.iter().map(|pace| {
            let reports = node.subscription(&pace.reports, &Qos::reliable(REPORTS_KEPT))?;
            Ok(Paced { topic: pace.topic.clone(), reports, lead: Lead::default() })
        });
        Ok(Self { paced: paced.collect::<Result<_, ShellError>>()? })
    }

    /// The topics of reports without a publisher.
    pub(super) fn unreported(&self) -> Vec<String> {
        let unreported = self.paced.iter().filter(|paced| paced.reports.publisher_count() == 0);
        unreported.map(|paced| paced.reports.topic().to_owned()).collect()
    }

    /// Notes a published message.
    pub(super) fn published(&mut self, message: &BagMessage) {
        self.of(&message.topic).for_each(|paced| paced.lead.messages += 1);
    }

    /// Whether the message must wait. After [`LONGEST_HOLD`] without a report it is published: messages that the node has not
    /// reported are counted as lost.
    pub(super) fn holds_or_drops(&mut self, message: &BagMessage, now: Instant) -> bool {
        let mut holds = false;
        for paced in self.of(&message.topic) {
            while paced.reports.try_next().is_some() {
                paced.lead.reported();
            }
            holds |= paced.lead.holds_or_drops(now);
        }
        holds
    }

    fn of<'a>(&'a mut self, topic: &'a str) -> impl Iterator<Item = &'a mut Paced> {
        self.paced.iter_mut().filter(|paced| bare(&paced.topic) == bare(topic))
    }
}

impl Lead {
    fn reported(&mut self) {
        // Some messages have two reports: one for an image without a match, and one for the unmatched partner.
        *self = Self { messages: self.messages.saturating_sub(1), held_since: None };
    }

    fn holds_or_drops(&mut self, now: Instant) -> bool {
        if self.messages < MOST_AHEAD {
            return false;
        }
        let since = *self.held_since.get_or_insert(now);
        let is_held = now.duration_since(since) < LONGEST_HOLD;
        if !is_held {
            *self = Self::default();
        }
        is_held
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_few_messages_may_be_ahead_and_each_report_lets_one_more_go() {
        let now = Instant::now();
        let mut lead = Lead::default();
        for _ in 0..MOST_AHEAD {
            assert!(!lead.holds_or_drops(now));
            lead.messages += 1;
        }
        assert!(lead.holds_or_drops(now) && lead.holds_or_drops(now + LONGEST_HOLD / 2));
        lead.reported();
        assert!(!lead.holds_or_drops(now));
    }

    #[test]
    fn a_node_that_goes_on_reporting_is_waited_for_and_one_that_does_not_is_left_behind() {
        let start = Instant::now();
        let at = |holds: f64| start + LONGEST_HOLD.mul_f64(holds);
        let mut lead = Lead { messages: 2 * MOST_AHEAD, held_since: None };
        assert!(lead.holds_or_drops(at(0.0)) && lead.holds_or_drops(at(0.9)));
        lead.reported();
        assert!(lead.holds_or_drops(at(1.1)) && lead.holds_or_drops(at(2.0)));
        assert!(!lead.holds_or_drops(at(2.2)));
        assert_eq!(lead, Lead::default(), "messages that it has not reported count as lost");
        lead.reported();
        assert_eq!(lead, Lead::default());
    }

    #[test]
    fn what_is_no_pace_is_refused_with_the_form() {
        let pace = PaceBy { topic: "/d".to_owned(), reports: "/pose/report".to_owned() };
        assert_eq!("/d=/pose/report".parse(), Ok(pace));
        for text in ["/d", "=/pose/report", "/d="] {
            assert_eq!(text.parse::<PaceBy>(), Err(PaceByError));
        }
    }
}
