//! The result of a recording.

use std::fmt;

use serde::Serialize;

use crate::writer::BagSummary;

/// The result of a recording.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct RecordSummary {
    /// The bag.
    pub bag: BagSummary,
    /// The duration of the recording by the wall clock.
    pub duration_s: f64,
    /// The recorded topics, by name.
    pub topics: Vec<RecordedTopic>,
    /// Requested topics without a publisher, or that could not be recorded, with the reason in the log.
    pub not_recorded: Vec<String>,
}

/// The result for one topic.
#[derive(Clone, PartialEq, Eq, Debug, Serialize)]
pub struct RecordedTopic {
    /// Its name.
    pub topic: String,
    /// The name of its type.
    pub type_name: String,
    /// Whether the bag has the definition of its type.
    pub is_defined: bool,
    /// Messages in the bag.
    pub recorded: u64,
    /// Messages lost between those.
    pub lost: u64,
    /// Messages before the first tick of `/clock`, which were left out.
    pub before_clock: u64,
}

impl RecordedTopic {
    pub(super) fn new(topic: &str, type_name: &str, is_defined: bool) -> Self {
        Self {
            topic: topic.to_owned(),
            type_name: type_name.to_owned(),
            is_defined,
            recorded: 0,
            lost: 0,
            before_clock: 0,
        }
    }
}

impl RecordSummary {
    pub(super) fn new(
        bag: BagSummary,
        topics: Vec<RecordedTopic>,
        not_recorded: Vec<String>,
        duration_s: f64,
    ) -> Self {
        Self { bag, duration_s, topics, not_recorded }
    }

    /// Whether the recording is complete.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        self.not_recorded.is_empty() && self.topics.iter().all(|topic| topic.lost == 0)
    }
}

impl fmt::Display for RecordSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { bag, duration_s, topics, not_recorded } = self;
        let (messages, megabytes) = (bag.message_count, bag.size_bytes as f64 * 1e-6);
        let path = bag.path.display();
        writeln!(
            f,
            "recorded {path}: {messages} messages in {duration_s:.1} s, {megabytes:.1} MB"
        )?;
        let width = topics.iter().map(|topic| topic.topic.chars().count()).max().unwrap_or(0);
        for topic in topics {
            write!(f, "  {:width$}  {:>7} recorded", topic.topic, topic.recorded)?;
            if topic.lost > 0 {
                write!(f, ", {} lost in transit", topic.lost)?;
            }
            if topic.before_clock > 0 {
                write!(f, ", {} before the first tick of /clock", topic.before_clock)?;
            }
            writeln!(f)?;
        }
        for topic in not_recorded {
            writeln!(f, "  {topic} was not recorded: it had no publisher, or the log says why")?;
        }
        if messages == 0 {
            writeln!(f, "nothing was recorded; `stillmap doctor` shows what is on the graph")?;
        }
        Ok(())
    }
}
