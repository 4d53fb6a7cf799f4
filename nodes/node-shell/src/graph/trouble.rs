//! Peers that share a topic's name with the node but cannot talk with it, and the fix.

use msgs::diagnostic_msgs::DiagnosticStatus;
use rustdds::QosPolicies;
use rustdds::policy::{Durability, Reliability};
use rustdds::qos::QosPolicyId;

use super::Role;
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
        let (policy, offers, asks) = match offered.compliance_failure_wrt(requested) {
            Some(QosPolicyId::Reliability) => {
                ("reliability".to_owned(), reliability(offered), reliability(requested))
            }
            Some(QosPolicyId::Durability) => {
                ("durability".to_owned(), durability(offered), durability(requested))
            }
            Some(other) => (format!("{other:?}"), "less".to_owned(), "more".to_owned()),
            None => ("a policy".to_owned(), "less".to_owned(), "more".to_owned()),
        };
        let text = format!(
            "a {} there, {who}, does not fit in its quality of service: {policy} is offered as \
             {offers} and requested as {asks}, so nothing is exchanged; set the publisher's {policy} to \
             {asks}, or the subscriber's to {offers}",
            self.role.peers(),
        );
        Trouble { topic: self.topic.to_owned(), kind: TroubleKind::Incompatible, text }
    }
}

fn reliability(qos: &QosPolicies) -> String {
    match qos.reliability() {
        Some(Reliability::Reliable { .. }) => "reliable",
        None | Some(Reliability::BestEffort) => "best effort",
    }
    .to_owned()
}

fn durability(qos: &QosPolicies) -> String {
    match qos.durability() {
        None | Some(Durability::Volatile) => "volatile",
        Some(Durability::TransientLocal) => "transient local",
        Some(Durability::Transient) => "transient",
        Some(Durability::Persistent) => "persistent",
    }
    .to_owned()
}

#[cfg(test)]
mod tests {
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
            "set the publisher's reliability to reliable, or the subscriber's to best effort",
        ] {
            assert!(text.contains(part), "{text}");
        }
        let text = incompatible(Qos::reliable(1), Qos::latched());
        assert!(
            text.contains("durability is offered as volatile and requested as transient local")
        );
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
