//! The node's subscriptions, and its socket for packets.

use std::sync::Arc;

use msgs::nav_msgs::Odometry;
use msgs::sensor_msgs::{Imu, PointCloud2};
use msgs::velodyne_msgs::VelodyneScan;
use node_shell::{Node, NodeFailure, Qos, Subscription};

use super::network::{Network, Turn};
use super::parameters::{LidarInput, LidarOdometryParameters};

/// Scans that may wait while one is worked at: half a second. Each bounds the memory of its topic.
const SCANS_KEPT: usize = 5;
const MOTIONS_KEPT: usize = 200;

/// A message that arrived.
pub(super) enum Arrival {
    Cloud(Arc<PointCloud2>),
    Packets(Arc<VelodyneScan>),
    Turn(Box<Turn>),
    Imu(Arc<Imu>),
    Wheels(Arc<Odometry>),
}

/// The node's subscriptions.
pub(super) struct Inputs {
    scans: Scans,
    imu: Option<Subscription<Imu>>,
    wheels: Option<Subscription<Odometry>>,
}

enum Scans {
    Clouds(Subscription<PointCloud2>),
    Packets(Subscription<VelodyneScan>),
    Network(Network),
}

impl Inputs {
    pub(super) fn subscribe(
        node: &Node,
        parameters: &LidarOdometryParameters,
    ) -> Result<Self, NodeFailure> {
        let (scans, motions) = (Qos::sensor(SCANS_KEPT), Qos::sensor(MOTIONS_KEPT));
        let scans = match parameters.input {
            LidarInput::Points => Scans::Clouds(node.subscription("points", &scans)?),
            LidarInput::VelodynePackets => {
                Scans::Packets(node.subscription("velodyne_packets", &scans)?)
            }
            LidarInput::Udp => Scans::Network(Network::open(node.counters(), parameters)?),
        };
        let (imu, wheels) = (parameters.use_imu, parameters.use_wheels);
        Ok(Self {
            scans,
            imu: imu.then(|| node.subscription("imu", &motions)).transpose()?,
            wheels: wheels.then(|| node.subscription("wheels", &motions)).transpose()?,
        })
    }

    /// The next message; motions come before scans. May be dropped while it waits.
    pub(super) async fn next(&mut self) -> Arrival {
        tokio::select! {
            biased;
            received = next_of(&self.imu) => Arrival::Imu(received),
            received = next_of(&self.wheels) => Arrival::Wheels(received),
            arrival = self.scans.next() => arrival,
        }
    }

    /// A message that is here already, in the same order.
    pub(super) fn try_next(&mut self) -> Option<Arrival> {
        let imu = try_next_of(&self.imu).map(Arrival::Imu);
        imu.or_else(|| try_next_of(&self.wheels).map(Arrival::Wheels))
            .or_else(|| self.scans.try_next())
    }

    /// Where scans come from.
    pub(super) fn source(&self) -> String {
        match &self.scans {
            Scans::Clouds(clouds) => clouds.topic().to_owned(),
            Scans::Packets(packets) => packets.topic().to_owned(),
            Scans::Network(network) => format!("UDP {}", network.address()),
        }
    }

    /// How many scans have come.
    pub(super) fn received(&self) -> u64 {
        match &self.scans {
            Scans::Clouds(clouds) => clouds.received_count(),
            Scans::Packets(packets) => packets.received_count(),
            Scans::Network(network) => network.turns(),
        }
    }

    /// How many gave way to newer ones while they waited to be taken.
    pub(super) fn left_out(&self) -> u64 {
        match &self.scans {
            Scans::Clouds(clouds) => clouds.left_out_count(),
            Scans::Packets(packets) => packets.left_out_count(),
            Scans::Network(network) => network.left_out(),
        }
    }

    #[cfg(test)]
    pub(super) fn network(&self) -> Option<&Network> {
        match &self.scans {
            Scans::Network(network) => Some(network),
            _ => None,
        }
    }
}

impl Scans {
    async fn next(&mut self) -> Arrival {
        match self {
            Self::Clouds(clouds) => Arrival::Cloud(clouds.next().await.message),
            Self::Packets(packets) => Arrival::Packets(packets.next().await.message),
            Self::Network(network) => Arrival::Turn(Box::new(network.next().await)),
        }
    }

    fn try_next(&mut self) -> Option<Arrival> {
        match self {
            Self::Clouds(clouds) => clouds.try_next().map(|it| Arrival::Cloud(it.message)),
            Self::Packets(packets) => packets.try_next().map(|it| Arrival::Packets(it.message)),
            Self::Network(network) => network.try_next().map(|turn| Arrival::Turn(Box::new(turn))),
        }
    }
}

/// The next message of a topic; never where it is not subscribed to.
async fn next_of<M: msgs::RosMessage>(topic: &Option<Subscription<M>>) -> Arc<M> {
    match topic {
        Some(topic) => topic.next().await.message,
        None => std::future::pending().await,
    }
}

fn try_next_of<M: msgs::RosMessage>(topic: &Option<Subscription<M>>) -> Option<Arc<M>> {
    Some(topic.as_ref()?.try_next()?.message)
}
