//! The calibration of a raw topic's camera, with the two topics that it is passed on to.

use std::sync::Arc;

use geometry::CameraModel;
use msgs::convert::{self, ConvertError};
use msgs::sensor_msgs::CameraInfo;
use node_shell::{Node, Publisher, Qos, ShellError, Subscription};

/// Those that may wait.
const KEPT: usize = 10;

/// The calibration of a camera, subscribed to while its images or the calibrations of what is made of them are wanted.
pub(super) struct Calibration {
    raw_name: &'static str,
    raw: Option<Subscription<CameraInfo>>,
    statics: Publisher<CameraInfo>,
    dynamics: Publisher<CameraInfo>,
    camera: Option<CameraModel>,
}

impl Calibration {
    /// With the names of the raw topic, and of those of what is static and of what moves.
    pub(super) fn new(
        node: &Node,
        [raw_name, statics, dynamics]: [&'static str; 3],
        qos: &Qos,
    ) -> Result<Self, ShellError> {
        Ok(Self {
            raw_name,
            raw: None,
            statics: node.publisher(statics, qos)?,
            dynamics: node.publisher(dynamics, qos)?,
            camera: None,
        })
    }

    /// `has_images` says that the images are received.
    pub(super) fn follow_subscribers(
        &mut self,
        node: &Node,
        has_images: bool,
    ) -> Result<(), ShellError> {
        let is_wanted = self.statics.subscriber_count() + self.dynamics.subscriber_count() > 0;
        if !(is_wanted || has_images) {
            self.raw = None;
        } else if self.raw.is_none() {
            self.raw = Some(node.subscription(self.raw_name, &Qos::sensor(KEPT))?);
        }
        Ok(())
    }

    pub(super) async fn next(&self) -> Arc<CameraInfo> {
        match &self.raw {
            Some(raw) => raw.next().await.message,
            None => std::future::pending().await,
        }
    }

    pub(super) fn try_next(&self) -> Option<Arc<CameraInfo>> {
        Some(self.raw.as_ref()?.try_next()?.message)
    }

    /// Passes a message on, and takes the camera that it describes.
    pub(super) fn take(&mut self, message: &Arc<CameraInfo>) -> Result<(), ConvertError> {
        for publisher in [&self.statics, &self.dynamics] {
            if publisher.subscriber_count() > 0 {
                publisher.publish_or_warn(Arc::clone(message));
            }
        }
        self.camera = Some(convert::camera_from_message(message)?);
        Ok(())
    }

    /// The last one that came.
    pub(super) fn camera(&self) -> Option<&CameraModel> {
        self.camera.as_ref()
    }

    pub(super) fn raw_name(&self) -> &'static str {
        self.raw_name
    }
}
