//! What was received on each topic, and the findings about it.

use std::collections::BTreeMap;

use geometry::Stamp;
use msgs::RosMessage;
use msgs::convert::ConvertError;
use msgs::sensor_msgs::{CameraInfo, Image, PointCloud2};
use node_shell::Role;

use super::large::{CameraSize, Measured};
use super::{Check, Finding, GraphView};
use crate::doctor::content::clocks::{self, Clock};
use crate::doctor::content::{Content, ImageFacts, Observed, Subject, Typical, stamps};

/// Types whose messages are large.
const LARGE_TYPES: [&str; 2] = [Image::TYPE_NAME, PointCloud2::TYPE_NAME];
/// Stamps that are kept at most: an hour of an inertial unit.
const MOST_STAMPS: usize = 1 << 20;
/// With fewer messages a clock is not judged.
const LEAST_MESSAGES: usize = 5;

/// What was received on a topic.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct ReceivedTopic {
    type_name: &'static str,
    stamps: Vec<Stamp>,
    largest_bytes: usize,
    /// From the stamp to the arrival here, by this machine's clock.
    delay_s: Typical,
    content: Content,
    unusable: u64,
    first_reason: Option<String>,
}

impl ReceivedTopic {
    pub(super) fn of_type(type_name: &'static str) -> Self {
        Self {
            type_name,
            stamps: Vec::new(),
            largest_bytes: 0,
            delay_s: Typical::default(),
            content: Content::of_type(type_name),
            unusable: 0,
            first_reason: None,
        }
    }

    pub(super) fn take<M: Observed>(&mut self, message: &M, bytes: usize, now: Stamp) {
        let stamp = self.content.take(message);
        self.largest_bytes = self.largest_bytes.max(bytes);
        self.delay_s.add(now.seconds_since(stamp));
        if self.stamps.len() < MOST_STAMPS {
            self.stamps.push(stamp);
        }
        let check: Result<(), ConvertError> = message.check();
        if let Err(error) = check {
            self.unusable += 1;
            self.first_reason.get_or_insert_with(|| error.to_string());
        }
    }

    /// The rate of the messages, by their stamps.
    pub(super) fn rate_hz(&self) -> Option<f64> {
        let (first, last) = (self.stamps.iter().min()?, self.stamps.iter().max()?);
        let span_s = last.seconds_since(*first);
        let steps = self.stamps.len().saturating_sub(1);
        (span_s > 0.0).then(|| steps as f64 / span_s)
    }

    /// The image size that a camera's calibration states.
    fn camera_size(&self) -> Option<CameraSize> {
        let (width_px, height_px) = self.content.camera()?.sizes_px.last().copied()?;
        Some(CameraSize { width_px, height_px, rate_hz: self.rate_hz() })
    }

    /// The sizes of the messages of a large topic.
    fn measured(&self) -> Measured {
        Measured {
            messages: self.stamps.len() as u64,
            largest_bytes: self.largest_bytes,
            rate_hz: self.rate_hz(),
        }
    }

    /// Whether its messages are depth images.
    pub(super) fn has_depths(&self) -> bool {
        self.content.image().is_some_and(ImageFacts::has_depths)
    }

    /// The frame of its messages, where they have one.
    pub(super) fn frame(&self) -> Option<&str> {
        self.content.frame()
    }

    fn findings(&self, topic: &str, is_read: bool) -> Vec<Finding> {
        let mut findings = Vec::new();
        if self.unusable > 0 && is_read {
            let reason = self.first_reason.as_deref().unwrap_or("damaged");
            let count = self.stamps.len();
            findings.push(Finding::grave_if(
                self.unusable == count as u64,
                Check::Messages,
                format!(
                    "{topic}: {} of {count} messages cannot be used; the first: {reason}",
                    self.unusable
                ),
                "fix the driver as the reason says",
            ));
        }
        let mut sorted = self.stamps.clone();
        sorted.sort_unstable();
        let subject = Subject { topic, is_read, period_s: stamps::period_s(&sorted) };
        findings.extend(self.content.findings(&subject));
        findings.extend(stamps::findings(topic, is_read, &self.stamps));
        findings
    }
}

/// The findings about the messages of all topics.
pub(super) fn findings(view: &GraphView) -> Vec<Finding> {
    let is_read = |topic: &str| view.suite.contains(topic);
    let mut findings: Vec<Finding> = view
        .received
        .iter()
        .filter(|(_, received)| !received.stamps.is_empty())
        .flat_map(|(topic, received)| received.findings(topic, is_read(topic)))
        .collect();
    let clocks: Vec<Clock<'_>> = view
        .received
        .iter()
        .filter(|(_, received)| {
            received.stamps.len() >= LEAST_MESSAGES
                && received.type_name != CameraInfo::TYPE_NAME
                && !received.stamps.iter().any(stamps::is_zero)
        })
        .filter_map(|(topic, received)| {
            let offset_s = -received.delay_s.median()?;
            Some(Clock { topic, is_read: is_read(topic), offset_s })
        })
        .collect();
    findings.extend(clocks::findings(&clocks, "by their times of arrival here"));
    findings
}

/// The image sizes that the topics of camera calibrations state.
pub(super) fn cameras(received: &BTreeMap<String, ReceivedTopic>) -> BTreeMap<String, CameraSize> {
    received
        .iter()
        .filter_map(|(topic, received)| Some((topic.clone(), received.camera_size()?)))
        .collect()
}

/// The sizes of the messages of large topics.
pub(super) fn measured(received: &BTreeMap<String, ReceivedTopic>) -> BTreeMap<String, Measured> {
    let is_large = |received: &ReceivedTopic| LARGE_TYPES.contains(&received.type_name);
    let large = received.iter().filter(|(_, received)| is_large(received));
    large.map(|(topic, received)| (topic.clone(), received.measured())).collect()
}

/// The topics of sensors that the suite reads, with the frames that their messages name.
pub(super) fn sensors(view: &GraphView) -> Vec<(&str, &str)> {
    view.received
        .iter()
        .filter(|(topic, _)| {
            view.suite.is_placed(topic) && view.at(Role::Publisher, topic).next().is_some()
        })
        .filter_map(|(topic, received)| Some((topic.as_str(), received.frame()?)))
        .collect()
}

#[cfg(test)]
mod tests {
    use msgs::convert::time_from_stamp;
    use msgs::sensor_msgs::LaserScan;

    use super::*;

    #[test]
    fn rates_come_from_stamps() {
        let mut received = ReceivedTopic::of_type(LaserScan::TYPE_NAME);
        assert_eq!(received.rate_hz(), None);
        let take = |received: &mut ReceivedTopic, nanos| {
            let stamp = Stamp::from_nanos(nanos);
            let mut scan = LaserScan::default();
            scan.header.stamp = time_from_stamp(stamp);
            received.take(&scan, 0, stamp);
        };
        for nanos in [5, 100_000_005, 200_000_005] {
            take(&mut received, nanos);
        }
        assert!((received.rate_hz().unwrap() - 10.0).abs() < 1e-9);
        let mut constant = ReceivedTopic::of_type(LaserScan::TYPE_NAME);
        take(&mut constant, 5);
        take(&mut constant, 5);
        assert_eq!(constant.rate_hz(), None);
    }
}
