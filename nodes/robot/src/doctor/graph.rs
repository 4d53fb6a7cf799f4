//! The live graph: its participants, endpoints that do not match, and messages that are too large.

mod inputs;
mod large;
mod listener;
mod listing;
mod live;
mod pairs;
mod participants;
mod proposal;
mod received;
mod reports;
mod results;
#[cfg(test)]
mod synthetic;

use std::collections::BTreeMap;

use msgs::diagnostic_msgs::DiagnosticStatus;
use node_shell::{DiscoveredEndpoint, Role, ZenohLinks};

use super::checks::Check;
use super::content::TransformFacts;
use super::finding::Finding;
use super::machine::{self, KernelDrops, Machine, ReceiveBuffer};
use inputs::SuiteTopics;
use large::{CameraSize, Measured};
pub(super) use listing::TopicListing;
pub(crate) use live::{Listening, listen};
pub(crate) use proposal::Proposal;
use received::ReceivedTopic;

/// What the doctor observed of the graph.
#[derive(Clone, Debug)]
pub(crate) struct GraphView {
    /// How long the doctor listened.
    listened_s: f64,
    /// Whether a signal ended it before its time.
    pub(crate) is_interrupted: bool,
    /// All publishers and subscriptions, by topic.
    endpoints: Vec<DiscoveredEndpoint>,
    /// The names that the suite's inputs have in this namespace.
    suite: SuiteTopics,
    /// The image size that each topic of camera calibrations states.
    cameras: BTreeMap<String, CameraSize>,
    /// The large topics that the doctor subscribed to.
    measured: BTreeMap<String, Measured>,
    /// What was received on the topics that the doctor subscribed to.
    received: BTreeMap<String, ReceivedTopic>,
    /// What was received on `/tf_static` and `/tf`.
    transforms: TransformFacts,
    /// The latest report of each node.
    reports: Vec<DiagnosticStatus>,
    /// What the kernel dropped meanwhile; `None` if it does not report that.
    dropped: Option<KernelDrops>,
    /// What it was connected to at the end, on Zenoh.
    links: Option<ZenohLinks>,
}

fn plural(count: usize) -> &'static str {
    if count == 1 { "" } else { "s" }
}

impl GraphView {
    /// The findings about the graph, on this machine.
    pub(super) fn findings(&self, machine: &Machine, buffer: &ReceiveBuffer) -> Vec<Finding> {
        let mut findings = Vec::new();
        if self.endpoints.is_empty() {
            findings.push(self.no_endpoints(machine));
        } else {
            findings.push(self.summary());
            findings.extend(pairs::types(&self.endpoints));
            findings.extend(pairs::qos(&self.endpoints));
            findings.extend(participants::same_names(&self.endpoints));
            findings.extend(participants::several_publishers(self));
            findings.extend(participants::vendors(&self.endpoints));
            findings.extend(participants::releases(&self.endpoints));
            findings.extend(inputs::missing(self));
            findings.extend(inputs::unmatched_names(self));
            findings.extend(received::findings(self));
            findings.extend(participants::transforms(self));
            findings.extend(large::sizes(self, buffer));
            findings.extend(large::across_machines(self, machine));
        }
        if let Some(dropped) = &self.dropped {
            findings.extend(machine::dropped_meanwhile(dropped, self.listened_s, &buffer.fix()));
        }
        findings.extend(reports::findings(&self.reports));
        findings
    }

    /// Every topic with its publishers and subscriptions.
    pub(super) fn listing(&self) -> Vec<TopicListing> {
        listing::of(&self.endpoints)
    }

    /// On Zenoh, whether it is connected at all; on DDS nothing is.
    pub(super) fn router(&self) -> Option<Finding> {
        let ZenohLinks { routers, peers } = self.links?;
        Some(if routers + peers == 0 {
            Finding::error(
                Check::Router,
                "no Zenoh router is connected, and no other node",
                "on each machine run `zenohd`, or `ros2 run rmw_zenoh_cpp rmw_zenohd`; for a router elsewhere export \
                 ZENOH_CONFIG_OVERRIDE='mode=\"client\";connect/endpoints=[\"tcp/ADDRESS:7447\"]'",
            )
        } else {
            Finding::ok(
                Check::Router,
                format!(
                    "connected to {routers} Zenoh router{} and {peers} other node{}",
                    plural(routers),
                    plural(peers)
                ),
            )
        })
    }

    fn no_endpoints(&self, machine: &Machine) -> Finding {
        Finding::warn(
            Check::Graph,
            format!(
                "no publisher or subscription was discovered on domain {} within {:.1} s",
                machine.domain_id, self.listened_s
            ),
            if self.links.is_some() {
                "start the drivers; where they run already, start them with RMW_IMPLEMENTATION=rmw_zenoh_cpp, and give this shell \
                 their ROS_DOMAIN_ID"
            } else {
                "start the drivers; where they run already, give this shell their ROS_DOMAIN_ID and \
                 ROS_AUTOMATIC_DISCOVERY_RANGE, and where no multicast reaches them, export \
                 ROS_STATIC_PEERS=ADDRESS"
            },
        )
    }

    fn summary(&self) -> Finding {
        let mut vendors: BTreeMap<&str, Vec<_>> = BTreeMap::new();
        for endpoint in &self.endpoints {
            vendors.entry(endpoint.participant.vendor()).or_default().push(endpoint.participant);
        }
        let vendors: Vec<_> = vendors
            .into_iter()
            .map(|(vendor, mut participants)| {
                participants.sort_unstable();
                participants.dedup();
                format!("{} of {vendor}", participants.len())
            })
            .collect();
        let topics = listing::of(&self.endpoints).len();
        Finding::ok(
            Check::Graph,
            format!(
                "{topics} topics; participants: {} (listened for {:.1} s)",
                vendors.join(", "),
                self.listened_s
            ),
        )
    }

    /// The publishers or the subscriptions of a topic.
    fn at<'a>(
        &'a self,
        role: Role,
        topic: &'a str,
    ) -> impl Iterator<Item = &'a DiscoveredEndpoint> {
        self.endpoints.iter().filter(move |one| one.role == role && one.topic == topic)
    }

    /// The names of the published topics of a type.
    fn published(&self, type_name: &str) -> Vec<&str> {
        let mut topics: Vec<_> = self
            .endpoints
            .iter()
            .filter(|one| one.role == Role::Publisher && one.type_name == type_name)
            .map(|one| one.topic.as_str())
            .collect();
        topics.sort_unstable();
        topics.dedup();
        topics
    }
}

/// The owners of some endpoints, without repetition.
fn owners<'a>(endpoints: impl IntoIterator<Item = &'a DiscoveredEndpoint>) -> String {
    let mut owners: Vec<_> = endpoints.into_iter().map(DiscoveredEndpoint::owner).collect();
    owners.sort_unstable();
    owners.dedup();
    owners.join(", ")
}

#[cfg(test)]
mod tests;
