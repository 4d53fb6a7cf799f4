//! Listening to the live graph for a moment.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use msgs::diagnostic_msgs::DiagnosticStatus;
use node_shell::{
    DiscoveredEndpoint, GrantedBuffer, Node, RosArguments, ShellError, Transport, ZenohLinks,
};
use tokio::time::Instant;

use super::listener::GraphListener;
use super::received::{self, ReceivedTopic};
use super::{GraphView, SuiteTopics, results};
use crate::doctor::content::TransformFacts;
use crate::doctor::machine::KernelDrops;

/// The name that the doctor has in the graph while it listens.
const NODE: &str = "stillmap_doctor";
/// How often the doctor polls its subscriptions.
const POLL_PERIOD: Duration = Duration::from_millis(50);

/// How to listen.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Listening {
    pub(crate) span: Duration,
    /// Whether to subscribe to images and clouds.
    pub(crate) measure: bool,
}

/// Listens to the graph; returns what was observed, and the receive buffer that the kernel granted, which Zenoh has none of.
pub(crate) async fn listen(
    transport: Transport,
    ros: &RosArguments,
    listening: Listening,
) -> Result<(GraphView, Option<GrantedBuffer>), ShellError> {
    let suite = SuiteTopics::resolve(ros)?;
    let node = Node::start_on(transport, NODE, ros)?;
    let granted = node.granted_buffer();
    let seen = observe(&node, listening).await;
    let view = seen.map(|seen| GraphView {
        listened_s: seen.listened_s,
        is_interrupted: seen.is_interrupted,
        endpoints: seen.endpoints,
        suite,
        cameras: received::cameras(&seen.received),
        measured: received::measured(&seen.received),
        received: seen.received,
        transforms: seen.transforms,
        reports: seen.reports,
        dropped: seen.dropped,
        links: seen.links,
    });
    node.close().await;
    Ok((view?, granted))
}

struct Seen {
    listened_s: f64,
    is_interrupted: bool,
    endpoints: Vec<DiscoveredEndpoint>,
    received: BTreeMap<String, ReceivedTopic>,
    transforms: TransformFacts,
    reports: Vec<DiagnosticStatus>,
    dropped: Option<KernelDrops>,
    links: Option<ZenohLinks>,
}

async fn observe(node: &Node, listening: Listening) -> Result<Seen, ShellError> {
    let start = Instant::now();
    let shutdown = node.shutdown_signal();
    let drops_before = KernelDrops::read();
    let mut listener = GraphListener::open(node)?;
    loop {
        listener.follow(node, node.survey(), listening.measure)?;
        listener.take();
        let rest = listening.span.saturating_sub(start.elapsed());
        if rest.is_zero() {
            break;
        }
        tokio::select! {
            () = shutdown.wait() => break,
            () = tokio::time::sleep(rest.min(POLL_PERIOD)) => {}
        }
    }
    let dropped = KernelDrops::read().zip(drops_before).map(|(now, before)| now.since(&before));
    let endpoints = node.survey();
    // The nodes of some topics may have been announced after the topics.
    let results: BTreeSet<String> =
        results::of_suite(&endpoints).into_iter().map(str::to_owned).collect();
    Ok(Seen {
        listened_s: start.elapsed().as_secs_f64(),
        is_interrupted: shutdown.is_triggered(),
        endpoints,
        reports: listener.reports.values().cloned().collect(),
        transforms: listener.transforms.clone(),
        received: listener
            .into_received()
            .into_iter()
            .filter(|(topic, _)| !results.contains(topic))
            .collect(),
        dropped,
        links: node.zenoh_links(),
    })
}
