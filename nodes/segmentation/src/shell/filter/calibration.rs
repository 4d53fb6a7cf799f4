//! The calibration of a raw topic's camera, with the two topics that it is passed on to.
//!
//! Who takes images takes them with the calibration of the same stamp, and keeps few that have not met: both go out together.

#[cfg(test)]
mod tests;

use std::borrow::Cow;
use std::collections::VecDeque;
use std::sync::Arc;

use geometry::{CameraModel, Stamp};
use msgs::convert::{self, ConvertError};
use msgs::sensor_msgs::CameraInfo;
use node_shell::{Node, Publisher, Qos, ShellError};

use super::lane::Wait;
use super::raw_topic::RawTopic;

/// Those that may have come and are not taken yet.
const KEPT: usize = 10;
/// A calibration whose image has not gone out so much later than images wait has none: the period of a slow camera.
const LATEST_IMAGE_S: f64 = 0.2;

/// The calibration of a camera, subscribed to while its images or the calibrations of what is made of them are wanted.
pub(super) struct Calibration {
    pub(super) raw: RawTopic<CameraInfo>,
    statics: Publisher<CameraInfo>,
    dynamics: Publisher<CameraInfo>,
    camera: Option<CameraModel>,
    /// The name of the images' topic after remapping.
    image_topic: String,
    /// That of the images.
    wait: Wait,
    /// Whether there are images to wait for.
    has_images: bool,
    waiting: VecDeque<(Stamp, Arc<CameraInfo>)>,
    newest: Stamp,
    /// The last image that went out.
    image: Option<Stamp>,
}

impl Calibration {
    /// With the names of the images' topic, the raw topic, and of those of what is static and of what moves. Its images wait as
    /// `wait` says.
    pub(super) fn new(
        node: &Node,
        image_name: &str,
        [raw_name, statics, dynamics]: [&'static str; 3],
        qos: &Qos,
        wait: Wait,
    ) -> Result<Self, ShellError> {
        Ok(Self {
            raw: RawTopic::new(raw_name),
            statics: node.publisher(statics, qos)?,
            dynamics: node.publisher(dynamics, qos)?,
            camera: None,
            image_topic: node.resolve(image_name)?,
            wait,
            has_images: false,
            waiting: VecDeque::new(),
            newest: Stamp::default(),
            image: None,
        })
    }

    /// `has_images` says that the images are received.
    pub(super) fn follow_subscribers(
        &mut self,
        node: &Node,
        has_images: bool,
    ) -> Result<(), ShellError> {
        let is_wanted = self.statics.subscriber_count() + self.dynamics.subscriber_count() > 0;
        self.raw.follow(node, &Qos::sensor(KEPT), is_wanted || has_images)?;
        self.has_images = has_images;
        self.send_due();
        Ok(())
    }

    /// Takes a message and the camera of the images. It is passed on with its image, as the calibration of a raw one: that a
    /// rectified image is one cannot be seen from the names of the filtered topics.
    pub(super) fn take(&mut self, message: &Arc<CameraInfo>) -> Result<(), ConvertError> {
        self.newest = convert::stamp_from_time(message.header.stamp);
        let own = match convert::calibration_of_image(message, &self.image_topic) {
            Cow::Borrowed(_) => Arc::clone(message),
            Cow::Owned(own) => Arc::new(own),
        };
        let camera = convert::camera_from_message(&own);
        self.waiting.push_back((self.newest, own));
        self.send_due();
        self.camera = Some(camera?);
        Ok(())
    }

    /// The image of this stamp goes out: its calibration does, and those of earlier images.
    pub(super) fn send_with_image(&mut self, stamp: Stamp) {
        self.image = Some(stamp);
        self.send_due();
    }

    /// There is no more input: what waits goes out.
    pub(super) fn give_up_waiting(&mut self) {
        for (_, message) in std::mem::take(&mut self.waiting) {
            self.send(&message);
        }
    }

    /// Forgets what waits.
    pub(super) fn clear(&mut self) {
        self.waiting.clear();
        self.image = None;
    }

    fn send_due(&mut self) {
        for (stamp, message) in std::mem::take(&mut self.waiting) {
            if self.is_due(stamp) {
                self.send(&message);
            } else {
                self.waiting.push_back((stamp, message));
            }
        }
        while self.waiting.len() > self.wait.most
            && let Some((_, message)) = self.waiting.pop_front()
        {
            self.send(&message);
        }
    }

    fn is_due(&self, stamp: Stamp) -> bool {
        // In either direction: the time may have jumped back.
        let waited_s = self.newest.seconds_since(stamp).abs();
        !self.has_images
            || self.image.is_some_and(|image| stamp <= image)
            || waited_s > self.wait.longest_s + LATEST_IMAGE_S
    }

    fn send(&self, message: &Arc<CameraInfo>) {
        for publisher in [&self.statics, &self.dynamics] {
            if publisher.subscriber_count() > 0 {
                publisher.publish_or_warn(Arc::clone(message));
            }
        }
    }

    /// The last one that came.
    pub(super) fn camera(&self) -> Option<&CameraModel> {
        self.camera.as_ref()
    }
}
