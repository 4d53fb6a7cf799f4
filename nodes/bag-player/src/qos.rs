//! The QoS of recorded publishers, in the YAML that rosbag2 stores with each channel.

use std::fmt;

use serde::{Deserialize, Serialize};

/// Depth where the recording has none.
const DEFAULT_DEPTH: u32 = 10;

/// Whether lost samples are sent again.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Reliability {
    /// Reliable: they are.
    Reliable,
    /// Best effort: they are not.
    BestEffort,
}

/// Whether a late subscriber is sent the last samples.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Durability {
    /// Volatile: it is not.
    Volatile,
    /// Transient local: it is; the topic is latched.
    TransientLocal,
}

/// The policies of a publisher's QoS that decide whether a subscription matches.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct OfferedQos {
    /// Whether lost samples are sent again.
    pub reliability: Reliability,
    /// Whether a late subscriber is sent the last samples.
    pub durability: Durability,
    /// The number of samples that are kept; `None` for all.
    pub depth: Option<u32>,
}

impl OfferedQos {
    /// Best effort and volatile: sensor data.
    #[must_use]
    pub const fn sensor(depth: u32) -> Self {
        Self {
            reliability: Reliability::BestEffort,
            durability: Durability::Volatile,
            depth: Some(depth),
        }
    }

    /// Reliable and volatile.
    #[must_use]
    pub const fn reliable(depth: u32) -> Self {
        Self {
            reliability: Reliability::Reliable,
            durability: Durability::Volatile,
            depth: Some(depth),
        }
    }

    /// Reliable and transient local, depth 1: maps and static transforms.
    #[must_use]
    pub const fn latched() -> Self {
        Self {
            reliability: Reliability::Reliable,
            durability: Durability::TransientLocal,
            depth: Some(1),
        }
    }

    /// The profile in rosbag2's YAML: a list of one, policies as the numbers of `rmw/types.h`, which
    /// every rosbag2 reads (the later ones where the metadata says version 8 or less).
    #[must_use]
    pub fn to_yaml(&self) -> String {
        let (history, depth) = self.depth.map_or((2, 0), |depth| (1, depth));
        let reliability = match self.reliability {
            Reliability::Reliable => 1,
            Reliability::BestEffort => 2,
        };
        let durability = match self.durability {
            Durability::TransientLocal => 1,
            Durability::Volatile => 2,
        };
        // RMW_DURATION_INFINITE.
        let infinite = "    sec: 9223372036\n    nsec: 854775807\n";
        format!(
            "- history: {history}\n  depth: {depth}\n  reliability: {reliability}\n  durability: {durability}\n  \
             deadline:\n{infinite}  lifespan:\n{infinite}  liveliness: 1\n  liveliness_lease_duration:\n{infinite}  \
             avoid_ros_namespace_conventions: false"
        )
    }

    /// Reads rosbag2's YAML, in the numbers of earlier versions or the words of later ones. The profiles
    /// of several publishers are merged into one that matches the subscribers of all: reliable
    /// if one was, latched if all were, the greatest depth. `None` if there is no profile.
    #[must_use]
    pub fn from_yaml(text: &str) -> Option<Self> {
        let profiles: Vec<Profile> = serde_saphyr::from_str(text).ok()?;
        Self::from_profiles(&profiles)
    }

    pub(crate) fn from_profiles(profiles: &[Profile]) -> Option<Self> {
        profiles.iter().map(Profile::offered).reduce(|one, other| Self {
            reliability: if one.reliability == Reliability::Reliable {
                Reliability::Reliable
            } else {
                other.reliability
            },
            durability: if one.durability == Durability::Volatile {
                Durability::Volatile
            } else {
                other.durability
            },
            depth: one.depth.zip(other.depth).map(|(one, other)| one.max(other)),
        })
    }
}

impl fmt::Display for OfferedQos {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self.reliability {
            Reliability::Reliable => "reliable",
            Reliability::BestEffort => "best effort",
        })?;
        if self.durability == Durability::TransientLocal {
            f.write_str(", latched")?;
        }
        match self.depth {
            Some(depth) => write!(f, ", depth {depth}"),
            None => f.write_str(", keep all"),
        }
    }
}

/// A profile in the YAML.
#[derive(Clone, PartialEq, Debug, Default, Deserialize)]
#[serde(default)]
pub(crate) struct Profile {
    history: Policy,
    depth: u64,
    reliability: Policy,
    durability: Policy,
}

/// A policy: a number up to version 8 of the metadata, a word from 9 on.
#[derive(Clone, PartialEq, Debug, Deserialize)]
#[serde(untagged)]
enum Policy {
    Number(i64),
    Word(String),
}

impl Default for Policy {
    fn default() -> Self {
        Self::Number(0)
    }
}

impl Policy {
    fn is(&self, number: i64, word: &str) -> bool {
        match self {
            Self::Number(own) => *own == number,
            Self::Word(own) => own == word,
        }
    }
}

impl Profile {
    /// A policy that is unknown or the system's default is read as the default of ROS 2: reliable, volatile.
    fn offered(&self) -> OfferedQos {
        OfferedQos {
            reliability: if self.reliability.is(2, "best_effort") {
                Reliability::BestEffort
            } else {
                Reliability::Reliable
            },
            durability: if self.durability.is(1, "transient_local") {
                Durability::TransientLocal
            } else {
                Durability::Volatile
            },
            depth: if self.history.is(2, "keep_all") {
                None
            } else if self.history.is(1, "keep_last") && self.depth > 0 {
                Some(u32::try_from(self.depth).unwrap_or(u32::MAX))
            } else {
                Some(DEFAULT_DEPTH)
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_back() {
        let profiles = [
            OfferedQos::sensor(5),
            OfferedQos::reliable(10),
            OfferedQos::latched(),
            OfferedQos { depth: None, ..OfferedQos::reliable(1) },
        ];
        for profile in profiles {
            assert_eq!(OfferedQos::from_yaml(&profile.to_yaml()), Some(profile));
        }
    }

    #[test]
    fn the_words_of_later_versions_are_read() {
        let text = "- history: keep_last\n  depth: 7\n  reliability: best_effort\n  durability: transient_local\n  \
                    deadline:\n    sec: 9223372036\n    nsec: 854775807\n  liveliness: automatic\n";
        let expected =
            OfferedQos { durability: Durability::TransientLocal, ..OfferedQos::sensor(7) };
        assert_eq!(OfferedQos::from_yaml(text), Some(expected));
    }

    #[test]
    fn unknown_history_becomes_the_default_depth() {
        // As Foxy recorded it: history 3 (unknown), depth 0.
        let text = "- history: 3\n  depth: 0\n  reliability: 1\n  durability: 2\n";
        assert_eq!(OfferedQos::from_yaml(text), Some(OfferedQos::reliable(10)));
    }

    #[test]
    fn several_publishers_are_joined_for_their_subscribers() {
        let both = |one: OfferedQos, other: OfferedQos| {
            OfferedQos::from_yaml(&format!("{}\n{}", one.to_yaml(), other.to_yaml()))
        };
        assert_eq!(
            both(OfferedQos::sensor(5), OfferedQos::reliable(2)),
            Some(OfferedQos::reliable(5))
        );
        assert_eq!(
            both(OfferedQos::latched(), OfferedQos::reliable(1)),
            Some(OfferedQos::reliable(1))
        );
        assert_eq!(both(OfferedQos::latched(), OfferedQos::latched()), Some(OfferedQos::latched()));
    }

    #[test]
    fn no_profile_is_none() {
        for text in ["", "[]", "nonsense", "- [", "history: 1"] {
            assert_eq!(OfferedQos::from_yaml(text), None, "{text:?}");
        }
    }
}
