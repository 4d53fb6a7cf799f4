//! The result of playback.

use std::collections::BTreeMap;
use std::fmt;
use std::path::PathBuf;

use serde::Serialize;

use crate::error::Loss;
use crate::messages::Skipped;

/// How playback ended.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Ending {
    /// At the end of the bag.
    Finished,
    /// By a key.
    Quit,
    /// By a signal.
    Interrupted,
}

/// The result of playback.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct PlaySummary {
    /// The bag.
    pub bag: PathBuf,
    /// How it ended.
    pub ending: Ending,
    /// The number of passes: more than one with `--loop`.
    pub passes: u64,
    /// Its duration, pauses included.
    pub duration_s: f64,
    /// A message later than this was counted as late.
    pub late_above_s: f64,
    /// The topics, by their name in the bag.
    pub topics: Vec<TopicSummary>,
    /// Parts of the bag that could not be read.
    pub losses: Vec<Loss>,
    /// Topics that were left out because their messages are not in CDR.
    pub skipped: BTreeMap<String, Skipped>,
    /// Messages that were read after one with a later stamp.
    pub out_of_order: u64,
}

/// The result for one topic.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct TopicSummary {
    /// Its name in the bag.
    pub topic: String,
    /// Its published name.
    pub published_as: String,
    /// The name of its type.
    pub type_name: String,
    /// Messages that were published.
    pub published: u64,
    /// Of these, those that were late.
    pub late: u64,
    /// The largest delay; 0 where none was late.
    pub worst_late_s: f64,
    /// Messages that could not be published.
    pub failed: u64,
    /// The largest number of subscribers at one time.
    pub most_subscribers: usize,
}

impl TopicSummary {
    pub(super) fn new(topic: &str, published_as: &str, type_name: &str) -> Self {
        Self {
            topic: topic.to_owned(),
            published_as: published_as.to_owned(),
            type_name: type_name.to_owned(),
            published: 0,
            late: 0,
            worst_late_s: 0.0,
            failed: 0,
            most_subscribers: 0,
        }
    }
}

impl PlaySummary {
    /// Messages of all topics.
    #[must_use]
    pub fn published(&self) -> u64 {
        self.topics.iter().map(|topic| topic.published).sum()
    }

    /// Messages that were published late.
    #[must_use]
    pub fn late(&self) -> u64 {
        self.topics.iter().map(|topic| topic.late).sum()
    }

    /// Messages that could not be published.
    #[must_use]
    pub fn failed(&self) -> u64 {
        self.topics.iter().map(|topic| topic.failed).sum()
    }

    /// Whether playback is complete: no message of the bag is lost and every one was sent.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        !self.losses.iter().any(Loss::costs_messages) && self.failed() == 0
    }
}

impl fmt::Display for PlaySummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let how = match self.ending {
            Ending::Finished => "played",
            Ending::Quit => "quit",
            Ending::Interrupted => "interrupted",
        };
        write!(f, "{how} {}: {} messages", self.bag.display(), self.published())?;
        if self.passes > 1 {
            write!(f, " in {} passes", self.passes)?;
        }
        writeln!(f, " in {:.1} s", self.duration_s)?;
        let name = |topic: &TopicSummary| {
            if topic.topic == topic.published_as {
                topic.topic.clone()
            } else {
                format!("{} as {}", topic.topic, topic.published_as)
            }
        };
        let width = self.topics.iter().map(|topic| name(topic).chars().count()).max().unwrap_or(0);
        for topic in &self.topics {
            write!(f, "  {:width$}  {:>7} published", name(topic), topic.published)?;
            if topic.late > 0 {
                write!(
                    f,
                    ", {} more than {:.0} ms late (worst {:.0} ms)",
                    topic.late,
                    self.late_above_s * 1e3,
                    topic.worst_late_s * 1e3
                )?;
            }
            if topic.failed > 0 {
                write!(f, ", {} not sent", topic.failed)?;
            }
            if topic.published > 0 && topic.most_subscribers == 0 {
                write!(f, ", no subscriber")?;
            }
            writeln!(f)?;
        }
        for (topic, skipped) in &self.skipped {
            writeln!(
                f,
                "  {topic}: {} messages left out, encoded as {}",
                skipped.messages, skipped.encoding
            )?;
        }
        if self.out_of_order > 0 {
            writeln!(f, "  {} messages came out of order from the bag", self.out_of_order)?;
        }
        for loss in &self.losses {
            writeln!(f, "lost: {loss}")?;
        }
        Ok(())
    }
}
