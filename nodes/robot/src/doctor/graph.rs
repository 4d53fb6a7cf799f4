//! The live graph: who is there, who does not fit whom, and what is too large.

mod ears;
mod heard;
mod inputs;
mod large;
mod listing;
mod live;
mod pairs;
mod reports;
#[cfg(test)]
mod synthetic;
mod who;

use std::collections::BTreeMap;

use msgs::diagnostic_msgs::DiagnosticStatus;
use node_shell::{DiscoveredEndpoint, Role};

use super::checks::Check;
use super::content::TransformFacts;
use super::finding::Finding;
use super::machine::{self, KernelDrops, Machine, ReceiveBuffer};
use heard::Heard;
use inputs::SuiteTopics;
use large::{CameraSize, Measured};
pub(super) use listing::TopicListing;
pub(super) use live::{Listening, listen};

/// What was seen of the graph.
#[derive(Clone, Debug)]
pub(super) struct GraphView {
    /// How long the doctor listened.
    heard_s: f64,
    /// All publishers and subscriptions, by topic.
    endpoints: Vec<DiscoveredEndpoint>,
    /// The names that the suite's inputs have in this namespace.
    suite: SuiteTopics,
    /// What each topic of camera calibrations said.
    cameras: BTreeMap<String, CameraSize>,
    /// The large topics that were listened to.
    measured: BTreeMap<String, Measured>,
    /// What came on the topics that were listened to.
    heard: BTreeMap<String, Heard>,
    /// What tf told.
    transforms: TransformFacts,
    /// The latest report of each node.
    reports: Vec<DiagnosticStatus>,
    /// What the kernel dropped meanwhile, where it tells.
    dropped: Option<KernelDrops>,
}

impl GraphView {
    /// What is to be said of the graph, on this machine.
    pub(super) fn findings(&self, machine: &Machine, buffer: &ReceiveBuffer) -> Vec<Finding> {
        let mut findings = Vec::new();
        if self.endpoints.is_empty() {
            findings.push(self.nobody(machine));
        } else {
            findings.push(self.who());
            findings.extend(pairs::types(&self.endpoints));
            findings.extend(pairs::qualities(&self.endpoints));
            findings.extend(who::same_names(&self.endpoints));
            findings.extend(who::several_publishers(self));
            findings.extend(who::makes(&self.endpoints));
            findings.extend(who::releases(&self.endpoints));
            findings.extend(inputs::missing(self));
            findings.extend(inputs::astray(self));
            findings.extend(heard::findings(self));
            findings.extend(who::transforms(self));
            findings.extend(large::sizes(self, buffer));
            findings.extend(large::across_machines(self, machine));
        }
        if let Some(dropped) = &self.dropped {
            findings.extend(machine::dropped_meanwhile(dropped, self.heard_s, &buffer.fix()));
        }
        findings.extend(reports::repeated(&self.reports));
        findings
    }

    /// Every topic with who is at it.
    pub(super) fn listing(&self) -> Vec<TopicListing> {
        listing::of(&self.endpoints)
    }

    fn nobody(&self, machine: &Machine) -> Finding {
        Finding::warn(
            Check::Graph,
            format!(
                "nobody was heard on domain {} within {:.1} s",
                machine.domain_id, self.heard_s
            ),
            "start the drivers; where they run already, give this shell their ROS_DOMAIN_ID and \
             ROS_AUTOMATIC_DISCOVERY_RANGE, and where no multicast reaches them, export \
             ROS_STATIC_PEERS=ADDRESS",
        )
    }

    fn who(&self) -> Finding {
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
                "{topics} topics of participants: {} (heard for {:.1} s)",
                vendors.join(", "),
                self.heard_s
            ),
        )
    }

    /// The endpoints of a topic at one of its ends.
    fn at<'a>(
        &'a self,
        role: Role,
        topic: &'a str,
    ) -> impl Iterator<Item = &'a DiscoveredEndpoint> {
        self.endpoints.iter().filter(move |one| one.role == role && one.topic == topic)
    }

    /// The names of topics of a type that somebody publishes.
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

/// Who is at some ends of a topic, without repetition.
fn owners<'a>(endpoints: impl IntoIterator<Item = &'a DiscoveredEndpoint>) -> String {
    let mut owners: Vec<_> = endpoints.into_iter().map(DiscoveredEndpoint::owner).collect();
    owners.sort_unstable();
    owners.dedup();
    owners.join(", ")
}

#[cfg(test)]
mod tests;
