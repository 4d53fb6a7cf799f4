//! The tasks of a node beside its body: it follows `/clock`, publishes diagnostics, and publishes its log.

use std::sync::Arc;

use msgs::RosMessage;
use msgs::rosgraph_msgs::Clock;

use crate::endpoints::gate::Gate;
use crate::endpoints::network::Dds;
use crate::endpoints::subscription::Subscription;
use crate::node::Node;
use crate::node::clock::CLOCK_TOPIC;
use crate::process::log::NodeLines;
use crate::services::diagnostics::Diagnostics;
use crate::services::{library_watch, rosout};
use crate::settings::qos::Qos;
use crate::wire::error::ShellError;

/// The topic that nodes report about themselves on.
const DIAGNOSTICS: &str = "/diagnostics";

impl Node {
    /// Without a network there is no clock: nodes that are driven there use the stamps of the data alone.
    pub(crate) fn start_clock(&self) -> Result<(), ShellError> {
        let Some(network) = self.network().filter(|_| self.switches().use_sim_time) else {
            return Ok(());
        };
        let topic = self.clock_topic()?;
        tracing::info!("the time is that of {}", topic.topic());
        let clock = self.clock();
        network.spawn(|stop| clock.follow(topic, stop));
        Ok(())
    }

    /// As rclcpp has it. The newest time counts alone: a player or a simulation sends it far more often than a node looks.
    fn clock_topic(&self) -> Result<Subscription<Clock>, ShellError> {
        let name = (CLOCK_TOPIC, Clock::TYPE_NAME);
        let topic = self.subscription_behind(Gate::default(), name, &Qos::sensor(1))?;
        Ok(topic.of_newest())
    }

    /// A node on no network does not report.
    pub(crate) fn start_diagnostics(&self) -> Result<(), ShellError> {
        let Some(network) = self.network() else { return Ok(()) };
        let diagnostics = Diagnostics {
            health: network.link.dds().map(|dds| Arc::clone(&dds.health)),
            node_name: self.full_name(),
            publisher: self.own_publisher(DIAGNOSTICS, &Qos::reliable(10))?,
            life: self.life().clone(),
            graph: self.graph().clone(),
            counters: self.counters(),
            clock: self.clock(),
            networks: self.host().networks().clone(),
            started_again: self.host().is_started_again().then(|| self.shutdown_signal()),
            last: self.report_sender(),
        };
        network.spawn(|stop| diagnostics.run(stop));
        Ok(())
    }

    /// Ends the process once the DDS library no longer serves the node.
    pub(crate) fn watch_library(&self) {
        let Some(network) = self.network() else { return };
        let Some(threads) = network.link.dds().map(Dds::threads) else { return };
        let shutdown = self.shutdown_signal();
        network.spawn(|stop| library_watch::watch(threads, shutdown, stop));
    }

    /// Publishes the node's log.
    pub(crate) fn start_rosout(&self) -> Result<(), ShellError> {
        let is_published = self.log_outputs().rosout;
        let Some(network) = self.network().filter(|_| is_published) else { return Ok(()) };
        let Some(lines) = NodeLines::of(&self.logger_name()) else { return Ok(()) };
        // Reliable and kept, as ROS 2 has it: it fits every subscriber.
        let qos = Qos::new(true, true, rosout::LINES_KEPT);
        let publisher = self.own_publisher(rosout::TOPIC, &qos)?;
        let clock = self.clock();
        network.spawn(|stop| rosout::publish(lines, publisher, clock, stop));
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use msgs::builtin_interfaces::Time;

    use super::*;
    use crate::node::host::Host;
    use crate::settings::arguments::RosArguments;

    /// Regression: the times that a node skipped, 805 of a minute, were counted as messages lost.
    #[test]
    fn older_times_of_the_clock_are_no_loss() {
        let host = Host::in_process();
        let arguments = RosArguments::parse([] as [String; 0]).unwrap();
        let node = host.node("follower", &arguments).unwrap();
        let clock = node.clock_topic().unwrap();
        let times = node.publisher::<Clock>(CLOCK_TOPIC, &Qos::sensor(1)).unwrap();
        for sec in 1..=3 {
            times.publish(Clock { clock: Time { sec, nanosec: 0 } }).unwrap();
        }
        assert_eq!(clock.try_next().map(|received| received.message.clock.sec), Some(3));
        assert_eq!((clock.received_count(), clock.lost_count()), (1, 0));
    }
}
