//! The QoS of the recorder's subscriptions, by the QoS that the publishers offer.

use node_shell::{DiscoveredEndpoint, Qos};

use crate::qos::{Durability, OfferedQos, Reliability};
use crate::shell::offers::LARGE_TYPES;

/// The queue depth for small messages: two seconds of an IMU.
pub(super) const WAITING_SMALL: usize = 500;
/// The queue depth for large messages, bounded by memory: 80 MB of the largest clouds.
const WAITING_LARGE: usize = 8;
/// The queue depths that are recorded for publishers, since these do not announce theirs: the default of ROS 2, that of sensors,
/// and that of latched topics.
const DEPTH: u32 = 10;
const SENSOR_DEPTH: u32 = 5;
const LATCHED_DEPTH: u32 = 1;

/// The QoS of a subscription, and the recorded QoS of its publishers.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Quality {
    pub(super) asked: Qos,
    pub(super) offered: OfferedQos,
}

impl Quality {
    /// For the publishers of a topic: the policies that all of them offer, so that all match.
    pub(super) fn of<'a>(
        type_name: &str,
        publishers: impl Iterator<Item = &'a DiscoveredEndpoint> + Clone,
    ) -> Self {
        let is_reliable = publishers.clone().all(|one| one.qos.is_reliable());
        let is_latched = is_reliable && publishers.clone().all(|one| one.qos.is_transient_local());
        Self::with(type_name, is_reliable, is_latched)
    }

    fn with(type_name: &str, is_reliable: bool, is_latched: bool) -> Self {
        let is_large = LARGE_TYPES.contains(&type_name);
        let depth = if is_large { WAITING_LARGE } else { WAITING_SMALL };
        // Large messages are resent too slowly for reliable delivery, except those that are published once.
        let asks_again = is_reliable && (is_latched || !is_large);
        Self {
            asked: Qos::new(asks_again, is_latched, depth),
            offered: OfferedQos {
                reliability: if is_reliable {
                    Reliability::Reliable
                } else {
                    Reliability::BestEffort
                },
                durability: if is_latched {
                    Durability::TransientLocal
                } else {
                    Durability::Volatile
                },
                depth: Some(match (is_latched, is_reliable) {
                    (true, _) => LATCHED_DEPTH,
                    (false, true) => DEPTH,
                    (false, false) => SENSOR_DEPTH,
                }),
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_messages_are_best_effort_unless_they_are_kept() {
        let asked = |type_name, is_latched| Quality::with(type_name, true, is_latched).asked;
        let cloud = "sensor_msgs/msg/PointCloud2";
        assert_eq!(asked(cloud, false), Qos::sensor(WAITING_LARGE));
        assert_eq!(asked(cloud, true), Qos::new(true, true, WAITING_LARGE));
        assert_eq!(asked("sensor_msgs/msg/LaserScan", false), Qos::reliable(WAITING_SMALL));
    }

    #[test]
    fn the_bag_says_what_was_offered() {
        let offered = |is_reliable, is_latched| {
            Quality::with("sensor_msgs/msg/Image", is_reliable, is_latched).offered
        };
        assert_eq!(offered(true, false), OfferedQos::reliable(10));
        assert_eq!(offered(true, true), OfferedQos::latched());
        assert_eq!(offered(false, false), OfferedQos::sensor(5));
    }
}
