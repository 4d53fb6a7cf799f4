//! What a node does beside its body: it follows `/clock`, reports about itself, and tells its log.

use std::sync::Arc;

use msgs::RosMessage;
use msgs::rosgraph_msgs::Clock;

use super::Node;
use crate::services::clock::CLOCK_TOPIC;
use crate::services::diagnostics::Diagnostics;
use crate::services::lifecycle::Gate;
use crate::services::rosout::{self, NodeLines};
use crate::settings::qos::Qos;
use crate::wire::error::ShellError;

/// The topic that nodes report about themselves on.
const DIAGNOSTICS: &str = "/diagnostics";

impl Node {
    /// On no network nobody tells the time: nodes that are driven there go by the stamps of the data alone.
    pub(super) fn start_clock(&self) -> Result<(), ShellError> {
        let Some(network) = self.network.as_ref().filter(|_| self.switches.use_sim_time) else {
            return Ok(());
        };
        // As rclcpp has it.
        let name = (CLOCK_TOPIC, Clock::TYPE_NAME);
        let topic = self.subscription_behind::<Clock>(Gate::default(), name, &Qos::sensor(1))?;
        tracing::info!("the time is that of {}", topic.topic());
        let clock = self.clock.clone();
        network.spawn(|stop| clock.follow(topic, stop));
        Ok(())
    }

    /// A node on no network has nobody to report to.
    pub(super) fn start_diagnostics(&self) -> Result<(), ShellError> {
        let Some(network) = &self.network else { return Ok(()) };
        let diagnostics = Diagnostics {
            health: Arc::clone(&network.health),
            node_name: self.full_name(),
            publisher: self.own_publisher(DIAGNOSTICS, &Qos::reliable(10))?,
            life: self.life.clone(),
            graph: self.graph.clone(),
            counters: self.counters.clone(),
            clock: self.clock.clone(),
        };
        network.spawn(|stop| diagnostics.run(stop));
        Ok(())
    }

    /// Tells the node's log to the graph.
    pub(super) fn start_rosout(&self) -> Result<(), ShellError> {
        let is_told = self.arguments.outputs.rosout;
        let Some(network) = self.network.as_ref().filter(|_| is_told) else { return Ok(()) };
        let Some(lines) = NodeLines::of(self.identity.name()) else { return Ok(()) };
        // Reliable and kept, as ROS 2 has it: it fits every subscriber.
        let qos = Qos::new(true, true, rosout::LINES_KEPT);
        let publisher = self.own_publisher(rosout::TOPIC, &qos)?;
        let clock = self.clock.clone();
        network.spawn(|stop| lines.publish(publisher, clock, stop));
        Ok(())
    }
}
