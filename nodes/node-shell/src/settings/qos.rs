//! Quality of service: the three profiles that the suite uses, and the resource limits that make the
//! DDS library keep to them.

use ros2_client::QosProfile;
use ros2_client::qos::{Durability, History, Reliability, WhenFull};
use rustdds::{QosPolicies, QosPolicyBuilder, policy};

/// How many samples a reliable writer holds for readers that have not acknowledged them. A reader that
/// was killed stays matched until its lease of 50 s ends; at 20 Hz that is 1000 samples. With a
/// smaller window the writer would block, and so starve its other readers, because one of them died.
const RELIABLE_WINDOW: usize = 1024;

/// The same for messages of megabytes, two seconds of a camera: with a thousand of them, a reader that was
/// killed would cost gigabytes before its lease ends. The library drops what is acknowledged every 6 s only,
/// so a window of fewer would save nothing more.
const RELIABLE_WINDOW_OF_BULK: usize = 64;

/// The types with messages of megabytes.
const BULK: [&str; 3] =
    ["sensor_msgs/msg/CompressedImage", "sensor_msgs/msg/Image", "sensor_msgs/msg/PointCloud2"];

/// Whether messages of a type, as `sensor_msgs/msg/Image`, may have megabytes.
pub(crate) fn is_bulk(type_name: &str) -> bool {
    BULK.contains(&type_name)
}

/// How a topic is delivered.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Qos {
    reliable: bool,
    transient_local: bool,
    depth: usize,
}

impl Qos {
    /// For sensors and whatever is large: best effort, the newest `depth` samples (REP-2003). As a
    /// subscription it fits every publisher. `depth` is taken as 1 when 0.
    #[must_use]
    pub const fn sensor(depth: usize) -> Self {
        Self::new(false, false, depth)
    }

    /// For small messages that must arrive: reliable. A subscription holds `depth` samples until they
    /// are read; above some 200 kB a sample that was lost is repaired too slowly to be of use.
    #[must_use]
    pub const fn reliable(depth: usize) -> Self {
        Self::new(true, false, depth)
    }

    /// For maps: reliable, and the last one is there for late subscribers (REP-2003).
    #[must_use]
    pub const fn latched() -> Self {
        Self::new(true, true, 1)
    }

    /// Any profile, as a recording states it.
    #[must_use]
    pub const fn new(reliable: bool, transient_local: bool, depth: usize) -> Self {
        Self { reliable, transient_local, depth: if depth == 0 { 1 } else { depth } }
    }

    /// Whether lost samples are sent again.
    #[must_use]
    pub const fn is_reliable(&self) -> bool {
        self.reliable
    }

    /// Whether late subscribers get the last samples.
    #[must_use]
    pub const fn is_transient_local(&self) -> bool {
        self.transient_local
    }

    /// How many samples are kept.
    #[must_use]
    pub const fn depth(&self) -> usize {
        self.depth
    }

    /// `type_name` as `sensor_msgs/msg/Image`.
    pub(crate) fn writer_policies(&self, type_name: &str) -> QosPolicies {
        // A latched writer keeps what it holds for readers that come late, without any, so its limit
        // is its depth; a volatile one trims to its depth by itself.
        let window = if self.reliable && !self.transient_local {
            let bulk = is_bulk(type_name);
            self.depth.max(if bulk { RELIABLE_WINDOW_OF_BULK } else { RELIABLE_WINDOW })
        } else {
            self.depth
        };
        self.policies(window)
    }

    pub(crate) fn reader_policies(&self) -> QosPolicies {
        // Without a limit a reader keeps 64 samples whatever its depth: 330 MB of clouds, seconds old.
        self.policies(self.depth)
    }

    fn policies(&self, max_samples: usize) -> QosPolicies {
        let max_samples = i32::try_from(max_samples).unwrap_or(i32::MAX);
        let profile = QosProfile::default()
            .reliability(if self.reliable {
                Reliability::Reliable { when_full: WhenFull::DEFAULT }
            } else {
                Reliability::BestEffort
            })
            .durability(if self.transient_local {
                Durability::TransientLocal
            } else {
                Durability::Volatile
            })
            .history(History::KeepLast { depth: self.depth });
        let limits = QosPolicyBuilder::new()
            .resource_limits(policy::ResourceLimits {
                max_samples,
                max_instances: 1,
                max_samples_per_instance: max_samples,
            })
            .build();
        QosPolicies::from(profile).modify_by(&limits)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SMALL: &str = "sensor_msgs/msg/LaserScan";

    fn limit(policies: &QosPolicies) -> i32 {
        policies.resource_limits().unwrap().max_samples
    }

    #[test]
    fn every_profile_is_bounded() {
        assert_eq!(limit(&Qos::sensor(5).reader_policies()), 5);
        assert_eq!(limit(&Qos::sensor(5).writer_policies(SMALL)), 5);
        assert_eq!(limit(&Qos::sensor(0).reader_policies()), 1);
        assert_eq!(limit(&Qos::reliable(10).reader_policies()), 10);
        assert_eq!(limit(&Qos::reliable(10).writer_policies(SMALL)), 1024);
        assert_eq!(limit(&Qos::reliable(10).writer_policies("sensor_msgs/msg/Image")), 64);
        assert_eq!(limit(&Qos::reliable(100).writer_policies("sensor_msgs/msg/Image")), 100);
        assert_eq!(limit(&Qos::latched().writer_policies("sensor_msgs/msg/PointCloud2")), 1);
        assert_eq!(limit(&Qos::latched().reader_policies()), 1);
    }

    #[test]
    fn offers_fit_requests_as_rep_2003_counts_on() {
        let fits = |offer: Qos, request: Qos| {
            offer
                .writer_policies(SMALL)
                .compliance_failure_wrt(&request.reader_policies())
                .is_none()
        };
        for offer in [Qos::sensor(5), Qos::reliable(1), Qos::latched()] {
            assert!(fits(offer, Qos::sensor(5)), "{offer:?}");
        }
        assert!(!fits(Qos::sensor(5), Qos::reliable(5)));
        assert!(!fits(Qos::reliable(1), Qos::latched()));
        assert!(fits(Qos::latched(), Qos::reliable(1)));
    }
}
