//! Peers that share a topic's name with the node but cannot talk with it, and the fix.

use msgs::diagnostic_msgs::DiagnosticStatus;
use rustdds::QosPolicies;

use super::Role;
use super::survey::{DiscoveredQos, QosMismatch};
use crate::settings::names::ros_type_name;

/// Why a peer does not fit.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(crate) enum TroubleKind {
    /// It carries another type under the same name.
    OtherType,
    /// Its quality of service is less, or asks for more, than the node's.
    Incompatible,
}

/// A peer that does not fit, as in the node's diagnostics.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Trouble {
    /// The topic, by its absolute name.
    pub(crate) topic: String,
    pub(crate) kind: TroubleKind,
    /// The problem, the peer, and the fix.
    pub(crate) text: String,
}

impl Trouble {
    /// How grave it is, as a level of diagnostics.
    pub(crate) fn level(&self) -> u8 {
        match self.kind {
            TroubleKind::OtherType => DiagnosticStatus::ERROR,
            TroubleKind::Incompatible => DiagnosticStatus::WARN,
        }
    }

    /// The same in a few words.
    pub(crate) fn short(&self) -> &'static str {
        match self.kind {
            TroubleKind::OtherType => "a peer has another type",
            TroubleKind::Incompatible => "a peer has an incompatible quality of service",
        }
    }
}

/// The node's end of a topic, in trouble.
#[derive(Clone, Copy, Debug)]
pub(super) struct End<'a> {
    pub(super) role: Role,
    pub(super) topic: &'a str,
    pub(super) dds_type: &'a str,
}

impl End<'_> {
    /// A peer of another type.
    pub(super) fn other_type(&self, who: &str, peers_dds_type: &str) -> Trouble {
        let Self { role, topic, dds_type } = self;
        let text = format!(
            "a {} there, {who}, has the type {}, this node's {role} has {}; they do not talk to each \
             other: give one of them another name, as with --ros-args -r {topic}:={topic}_{}",
            role.peers(),
            ros_type_name(peers_dds_type),
            ros_type_name(dds_type),
            match role {
                Role::Publisher => "out",
                Role::Subscription => "in",
            }
        );
        Trouble { topic: (*topic).to_owned(), kind: TroubleKind::OtherType, text }
    }

    /// `is_known`: whether the peer says which definition its type has.
    #[cfg(feature = "zenoh")]
    pub(super) fn other_definition(&self, who: &str, is_known: bool) -> Trouble {
        let peer = self.role.peers();
        let kind = ros_type_name(self.dds_type);
        let text = if is_known {
            format!(
                "a {peer} there, {who}, has another definition of {kind} than this node's {}; they do not talk to each other: let both \
                 have the messages of one release",
                self.role
            )
        } else {
            format!(
                "a {peer} there, {who}, does not say which definition of {kind} it has, and is not heard: it is of ROS 2 Humble, whose \
                 rmw_zenoh and newer ones do not talk to each other, or plays what it has no definition of"
            )
        };
        Trouble { topic: self.topic.to_owned(), kind: TroubleKind::OtherType, text }
    }

    /// A peer whose quality of service does not fit.
    pub(super) fn incompatible(
        &self,
        who: &str,
        offered: &QosPolicies,
        requested: &QosPolicies,
    ) -> Trouble {
        let peer = self.role.peers();
        let is_misfit = format!("a {peer} there, {who}, does not fit in its quality of service");
        let mismatch =
            DiscoveredQos::offered(offered).mismatch(&DiscoveredQos::requested(requested));
        let text = match mismatch {
            Some(QosMismatch { policy, offered, requested }) => {
                // A node of the suite cannot be told another one.
                let own = match self.role {
                    Role::Publisher => &offered,
                    Role::Subscription => &requested,
                };
                format!(
                    "{is_misfit}: {policy} is offered as {offered} and requested as {requested}, so nothing is exchanged; set the \
                     {peer}'s {policy} to {own}"
                )
            }
            None => format!("{is_misfit}, so nothing is exchanged"),
        };
        Trouble { topic: self.topic.to_owned(), kind: TroubleKind::Incompatible, text }
    }
}

#[cfg(test)]
mod tests {
    use rustdds::policy::{Deadline, Liveliness};
    use rustdds::{Duration, QosPolicyBuilder};

    use super::*;
    use crate::Qos;

    const END: End<'_> = End {
        role: Role::Subscription,
        topic: "/scan",
        dds_type: "sensor_msgs::msg::dds_::LaserScan_",
    };

    fn incompatible(offer: Qos, request: Qos) -> String {
        END.incompatible(
            "node /driver",
            &offer.writer_policies("a/msg/Scan"),
            &request.reader_policies(),
        )
        .text
    }

    #[test]
    fn an_offer_that_does_not_fit_is_named_with_its_fix() {
        let text = incompatible(Qos::sensor(5), Qos::reliable(5));
        for part in [
            "a publisher there, node /driver",
            "reliability is offered as best effort and requested as reliable",
            "set the publisher's reliability to reliable",
        ] {
            assert!(text.contains(part), "{text}");
        }
        let text = incompatible(Qos::reliable(1), Qos::latched());
        assert!(
            text.contains("durability is offered as volatile and requested as transient local")
        );
    }

    /// Regression: a deadline was offered as less and requested as more, and the publisher's, which is the node's, was to be set to
    /// more.
    #[test]
    fn each_policy_is_named_with_both_values_and_what_the_peer_can_set() {
        let end = End { role: Role::Publisher, ..END };
        let offered = QosPolicyBuilder::new().reliable(Duration::from_secs(1));
        let text = |requested: QosPolicyBuilder| {
            end.incompatible("node /viewer", &offered.clone().build(), &requested.build()).text
        };
        let requested = offered.clone().deadline(Deadline(Duration::from_millis(100)));
        let of_deadline = text(requested);
        for part in [
            "a subscriber there, node /viewer",
            "deadline is offered as none and requested as 0.100 s",
            "set the subscriber's deadline to none",
        ] {
            assert!(of_deadline.contains(part), "{of_deadline}");
        }
        let lease_duration = Duration::from_secs(2);
        let of_liveliness =
            text(offered.clone().liveliness(Liveliness::ManualByTopic { lease_duration }));
        for part in [
            "liveliness is offered as automatic without a lease and requested as manual by topic with a lease of 2.000 s",
            "set the subscriber's liveliness to automatic without a lease",
        ] {
            assert!(of_liveliness.contains(part), "{of_liveliness}");
        }
    }

    #[test]
    fn another_type_is_named_with_its_fix() {
        let trouble = END.other_type("node /driver", "sensor_msgs::msg::dds_::Image_");
        for part in [
            "a publisher there, node /driver, has the type sensor_msgs/msg/Image",
            "this node's subscription has sensor_msgs/msg/LaserScan",
            "--ros-args -r /scan:=/scan_in",
        ] {
            assert!(trouble.text.contains(part), "{}", trouble.text);
        }
        assert_eq!(trouble.level(), DiagnosticStatus::ERROR);
    }
}
