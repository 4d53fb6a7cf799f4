//! Listening to the live graph for a moment.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use geometry::Stamp;
use msgs::RosMessage;
use msgs::convert::stamp_from_time;
use msgs::diagnostic_msgs::{DiagnosticArray, DiagnosticStatus};
use msgs::sensor_msgs::{CameraInfo, Image, PointCloud2};
use node_shell::{
    DiscoveredEndpoint, GrantedBuffer, Node, Qos, Role, RosArguments, ShellError, Subscription,
    Transport,
};
use tokio::time::Instant;

use super::large::{CameraSize, Measured};
use super::{GraphView, SuiteTopics};
use crate::doctor::machine::KernelDrops;

/// The name that the doctor has in the graph while it listens.
const NODE: &str = "stillmap_doctor";
const DIAGNOSTICS: &str = "/diagnostics";
/// How often the doctor looks at what came.
const LOOK: Duration = Duration::from_millis(50);
/// Reports and calibrations that may wait between two looks.
const WAITING_SMALL: usize = 64;
/// Large messages that may wait between two looks: their memory is the bound.
const WAITING_LARGE: usize = 4;
/// Topics that are listened to at most, so that a graph of any size stays bounded.
const MOST_CAMERAS: usize = 64;
const MOST_MEASURED: usize = 8;
/// Nodes whose reports are kept at most.
const MOST_REPORTS: usize = 1024;

/// How to listen.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Listening {
    pub(crate) span: Duration,
    /// Whether to subscribe to images and clouds.
    pub(crate) measure: bool,
}

/// Listens to the graph; returns what was seen, and what the kernel granted meanwhile.
pub(crate) async fn listen(
    transport: Transport,
    ros: &RosArguments,
    listening: Listening,
) -> Result<(GraphView, GrantedBuffer), ShellError> {
    let suite = SuiteTopics::resolve(ros)?;
    let node = Node::start_on(transport, NODE, ros)?;
    let granted = node.granted_buffer().ok_or(ShellError::Closed);
    let seen = observe(&node, listening).await;
    let view = seen.map(|seen| GraphView {
        heard_s: seen.heard_s,
        endpoints: seen.endpoints,
        suite,
        cameras: seen.cameras,
        measured: seen.measured,
        reports: seen.reports,
        dropped: seen.dropped,
    });
    node.close().await;
    Ok((view?, granted?))
}

struct Seen {
    heard_s: f64,
    endpoints: Vec<DiscoveredEndpoint>,
    cameras: BTreeMap<String, CameraSize>,
    measured: BTreeMap<String, Measured>,
    reports: Vec<DiagnosticStatus>,
    dropped: Option<KernelDrops>,
}

async fn observe(node: &Node, listening: Listening) -> Result<Seen, ShellError> {
    let start = Instant::now();
    let shutdown = node.shutdown_signal();
    let drops_before = KernelDrops::read();
    let mut ears = Ears::open(node)?;
    loop {
        ears.open_more(node, &node.survey(), listening.measure)?;
        ears.take();
        let rest = listening.span.saturating_sub(start.elapsed());
        if rest.is_zero() {
            break;
        }
        tokio::select! {
            () = shutdown.wait() => break,
            () = tokio::time::sleep(rest.min(LOOK)) => {}
        }
    }
    let dropped = KernelDrops::read().zip(drops_before).map(|(now, before)| now.since(&before));
    Ok(Seen {
        heard_s: start.elapsed().as_secs_f64(),
        endpoints: node.survey(),
        cameras: ears.cameras.iter().filter_map(CameraEar::heard).collect(),
        measured: ears.large.iter().map(LargeEar::heard).collect(),
        reports: ears.reports.into_values().collect(),
        dropped,
    })
}

/// The doctor's subscriptions.
struct Ears {
    own_name: String,
    diagnostics: Subscription<DiagnosticArray>,
    reports: BTreeMap<String, DiagnosticStatus>,
    cameras: Vec<CameraEar>,
    large: Vec<LargeEar>,
}

impl Ears {
    fn open(node: &Node) -> Result<Self, ShellError> {
        Ok(Self {
            own_name: node.full_name(),
            // Best effort fits whoever reports.
            diagnostics: node.subscription(DIAGNOSTICS, &Qos::sensor(WAITING_SMALL))?,
            reports: BTreeMap::new(),
            cameras: Vec::new(),
            large: Vec::new(),
        })
    }

    /// Subscribes to what has come up of use since.
    fn open_more(
        &mut self,
        node: &Node,
        survey: &[DiscoveredEndpoint],
        measure: bool,
    ) -> Result<(), ShellError> {
        let known: BTreeSet<String> = self
            .cameras
            .iter()
            .map(|ear| ear.subscription.topic().to_owned())
            .chain(self.large.iter().map(|ear| ear.topic().to_owned()))
            .collect();
        let mut new: Vec<_> = survey
            .iter()
            .filter(|one| one.role == Role::Publisher && !known.contains(&one.topic))
            .map(|one| (one.topic.as_str(), one.type_name.as_str()))
            .collect();
        new.dedup();
        for (topic, type_name) in new {
            // A peer may have a name that ROS 2 does not allow; such a topic is only listed.
            if node.resolve(topic).as_deref().ok() != Some(topic) {
                continue;
            }
            if type_name == CameraInfo::TYPE_NAME && self.cameras.len() < MOST_CAMERAS {
                let subscription = node.subscription(topic, &Qos::sensor(WAITING_SMALL))?;
                self.cameras.push(CameraEar { subscription, size: None, times: Times::default() });
            } else if measure && self.large.len() < MOST_MEASURED {
                self.large.extend(LargeEar::open(node, topic, type_name)?);
            }
        }
        Ok(())
    }

    fn take(&mut self) {
        while let Some(received) = self.diagnostics.try_next() {
            for status in &received.message.status {
                let is_known = self.reports.contains_key(&status.name);
                if status.name != self.own_name && (is_known || self.reports.len() < MOST_REPORTS) {
                    self.reports.insert(status.name.clone(), status.clone());
                }
            }
        }
        for ear in &mut self.cameras {
            while let Some(received) = ear.subscription.try_next() {
                let info = &received.message;
                ear.size = Some((info.width, info.height));
                ear.times.add(stamp_from_time(info.header.stamp));
            }
        }
        for ear in &mut self.large {
            ear.take();
        }
    }
}

/// When the messages of a topic were measured.
#[derive(Clone, Copy, Debug, Default)]
struct Times {
    count: u64,
    span: Option<(Stamp, Stamp)>,
}

impl Times {
    fn add(&mut self, stamp: Stamp) {
        self.count += 1;
        let (first, last) = self.span.unwrap_or((stamp, stamp));
        self.span = Some((first.min(stamp), last.max(stamp)));
    }

    fn rate_hz(&self) -> Option<f64> {
        let (first, last) = self.span?;
        let span_s = last.seconds_since(first);
        (self.count > 1 && span_s > 0.0).then(|| (self.count - 1) as f64 / span_s)
    }
}

struct CameraEar {
    subscription: Subscription<CameraInfo>,
    size: Option<(u32, u32)>,
    times: Times,
}

impl CameraEar {
    fn heard(&self) -> Option<(String, CameraSize)> {
        let (width_px, height_px) = self.size?;
        let size = CameraSize { width_px, height_px, rate_hz: self.times.rate_hz() };
        Some((self.subscription.topic().to_owned(), size))
    }
}

/// A large topic that is listened to.
struct LargeEar {
    subscription: LargeSubscription,
    largest_bytes: usize,
    times: Times,
}

enum LargeSubscription {
    Image(Subscription<Image>),
    Points(Subscription<PointCloud2>),
}

impl LargeEar {
    fn open(node: &Node, topic: &str, type_name: &str) -> Result<Option<Self>, ShellError> {
        let qos = Qos::sensor(WAITING_LARGE);
        let subscription = match type_name {
            Image::TYPE_NAME => LargeSubscription::Image(node.subscription(topic, &qos)?),
            PointCloud2::TYPE_NAME => LargeSubscription::Points(node.subscription(topic, &qos)?),
            _ => return Ok(None),
        };
        Ok(Some(Self { subscription, largest_bytes: 0, times: Times::default() }))
    }

    fn topic(&self) -> &str {
        match &self.subscription {
            LargeSubscription::Image(subscription) => subscription.topic(),
            LargeSubscription::Points(subscription) => subscription.topic(),
        }
    }

    fn take(&mut self) {
        loop {
            let next = match &self.subscription {
                LargeSubscription::Image(subscription) => subscription
                    .try_next()
                    .map(|received| (received.message.header.stamp, received.message.data.len())),
                LargeSubscription::Points(subscription) => subscription
                    .try_next()
                    .map(|received| (received.message.header.stamp, received.message.data.len())),
            };
            let Some((stamp, bytes)) = next else { return };
            self.largest_bytes = self.largest_bytes.max(bytes);
            self.times.add(stamp_from_time(stamp));
        }
    }

    fn heard(&self) -> (String, Measured) {
        let measured = Measured {
            messages: self.times.count,
            largest_bytes: self.largest_bytes,
            rate_hz: self.times.rate_hz(),
        };
        (self.topic().to_owned(), measured)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_come_from_stamps() {
        let mut times = Times::default();
        assert_eq!(times.rate_hz(), None);
        for nanos in [0, 100_000_000, 200_000_000] {
            times.add(Stamp::from_nanos(nanos));
        }
        assert!((times.rate_hz().unwrap() - 10.0).abs() < 1e-9);
        let mut still = Times::default();
        still.add(Stamp::from_nanos(5));
        still.add(Stamp::from_nanos(5));
        assert_eq!(still.rate_hz(), None);
    }
}
