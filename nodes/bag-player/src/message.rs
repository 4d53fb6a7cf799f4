//! A recorded message, and the selection of messages.

use std::collections::BTreeSet;
use std::sync::Arc;

use geometry::Stamp;
use msgs::{RosMessage, cdr};

use crate::error::BagError;

/// The only encoding that is decoded: that of ROS 2.
pub const CDR: &str = "cdr";

/// A message of a bag.
#[derive(Clone, PartialEq, Debug)]
pub struct BagMessage {
    /// The topic.
    pub topic: Arc<str>,
    /// The name of its type, such as `sensor_msgs/msg/LaserScan`; empty if the bag has none.
    pub type_name: Arc<str>,
    /// The encoding of `data`; [`CDR`] unless the selection includes other encodings.
    pub encoding: Arc<str>,
    /// When the recorder received it.
    pub log_time: Stamp,
    /// When it was published.
    pub publish_time: Stamp,
    /// The message, in CDR with the 4 bytes of its encapsulation.
    pub data: Vec<u8>,
}

impl BagMessage {
    /// Whether it is on this topic, which may be given with or without its leading slash.
    #[must_use]
    pub fn is_on(&self, topic: &str) -> bool {
        bare(&self.topic) == bare(topic)
    }

    /// The message, decoded as type `M`.
    ///
    /// # Errors
    /// When the topic carries another type or encoding, or the bytes are damaged.
    pub fn decode<M: RosMessage>(&self) -> Result<M, BagError> {
        if &*self.encoding != CDR {
            return Err(BagError::WrongEncoding {
                topic: self.topic.to_string(),
                encoding: self.encoding.to_string(),
            });
        }
        if !same_type(&self.type_name, M::TYPE_NAME) {
            return Err(BagError::WrongType {
                topic: self.topic.to_string(),
                found: self.type_name.to_string(),
                wanted: M::TYPE_NAME,
            });
        }
        cdr::decode(&self.data).map_err(|source| BagError::Decode {
            topic: self.topic.to_string(),
            log_time: self.log_time,
            source,
        })
    }
}

/// Whether two type names mean the same: `package/Type` of early recordings is `package/msg/Type`.
fn same_type(one: &str, other: &str) -> bool {
    one == other || full_type_name(one) == full_type_name(other)
}

/// A type name with its three parts.
pub(crate) fn full_type_name(name: &str) -> String {
    match name.split_once('/') {
        Some((package, rest)) if !rest.contains('/') => format!("{package}/msg/{rest}"),
        _ => name.to_owned(),
    }
}

/// Which messages of a bag to read. The default is all of them.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Selection {
    /// Only these topics, each with or without its leading slash.
    pub topics: Option<Vec<String>>,
    /// Only messages logged at least this long after the bag's first one.
    pub start_s: Option<f64>,
    /// Only messages logged less than this long after `start_s`.
    pub duration_s: Option<f64>,
    /// Messages in other encodings than CDR as well; otherwise they are skipped and counted.
    pub all_encodings: bool,
}

/// A selection with the absolute times of the bag.
#[derive(Clone, Debug)]
pub(crate) struct Filter {
    topics: Option<BTreeSet<String>>,
    start_ns: u64,
    /// Exclusive.
    end_ns: Option<u64>,
    all_encodings: bool,
}

impl Filter {
    pub(crate) fn new(selection: &Selection, bag_start_ns: u64) -> Result<Self, BagError> {
        let start_ns = bag_start_ns.saturating_add(nanos("start", selection.start_s)?.unwrap_or(0));
        let duration_ns = nanos("duration", selection.duration_s)?;
        Ok(Self {
            topics: selection
                .topics
                .as_ref()
                .map(|topics| topics.iter().map(|topic| bare(topic).to_owned()).collect()),
            start_ns,
            end_ns: duration_ns.map(|duration| start_ns.saturating_add(duration)),
            all_encodings: selection.all_encodings,
        })
    }

    /// Everything.
    pub(crate) fn all() -> Self {
        Self { topics: None, start_ns: 0, end_ns: None, all_encodings: true }
    }

    /// Its begin, inclusive, and its end, exclusive.
    pub(crate) fn times(&self) -> (u64, Option<u64>) {
        (self.start_ns, self.end_ns)
    }

    pub(crate) fn wants_topic(&self, topic: &str) -> bool {
        self.topics.as_ref().is_none_or(|topics| topics.contains(bare(topic)))
    }

    pub(crate) fn wants_time(&self, log_time_ns: u64) -> bool {
        log_time_ns >= self.start_ns && self.end_ns.is_none_or(|end| log_time_ns < end)
    }

    pub(crate) fn overlaps(&self, first_ns: u64, last_ns: u64) -> bool {
        last_ns >= self.start_ns && self.end_ns.is_none_or(|end| first_ns < end)
    }

    pub(crate) fn wants_encoding(&self, encoding: &str) -> bool {
        self.all_encodings || encoding == CDR
    }
}

/// A topic without its leading slash: recordings have it, users often leave it out.
pub(crate) fn bare(topic: &str) -> &str {
    topic.strip_prefix('/').unwrap_or(topic)
}

fn nanos(name: &'static str, value_s: Option<f64>) -> Result<Option<u64>, BagError> {
    match value_s {
        None => Ok(None),
        // The float-to-int cast saturates.
        Some(value_s) if value_s >= 0.0 => Ok(Some((value_s * 1e9).round() as u64)),
        Some(value_s) => Err(BagError::BadSelection { name, value_s }),
    }
}

/// A stamp from the unsigned nanoseconds of MCAP; saturates in the year 2262.
pub(crate) fn stamp(nanos: u64) -> Stamp {
    Stamp::from_nanos(i64::try_from(nanos).unwrap_or(i64::MAX))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn early_type_names_are_the_same_type() {
        assert!(same_type("std_msgs/String", "std_msgs/msg/String"));
        assert!(!same_type("std_msgs/msg/String", "std_msgs/msg/Header"));
        assert!(!same_type("", "std_msgs/msg/Header"));
    }

    #[test]
    fn a_selection_is_half_open() -> Result<(), BagError> {
        let selection =
            Selection { start_s: Some(1.0), duration_s: Some(2.0), ..Selection::default() };
        let filter = Filter::new(&selection, 5_000_000_000)?;
        let wanted: Vec<bool> = [5_999_999_999, 6_000_000_000, 7_999_999_999, 8_000_000_000]
            .map(|time| filter.wants_time(time))
            .to_vec();
        assert_eq!(wanted, [false, true, true, false]);
        Ok(())
    }

    #[test]
    fn times_that_are_no_times_are_refused() {
        for value_s in [-1.0, f64::NAN] {
            let selection = Selection { start_s: Some(value_s), ..Selection::default() };
            let refused = Filter::new(&selection, 0);
            assert!(
                matches!(refused, Err(BagError::BadSelection { name: "start", .. })),
                "{value_s}"
            );
        }
    }
}
