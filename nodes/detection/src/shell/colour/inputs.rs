//! The subscriptions to the colour camera.

use std::sync::Arc;

use geometry::{ColourImage, Stamp};
use msgs::convert::{self, ConvertError};
use msgs::sensor_msgs::{CameraInfo, CompressedImage, Image};
use node_shell::{Node, Qos, ShellError, Subscription};

use super::super::inputs::Arrival;
use super::super::{ColourInput, DetectionParameters};

/// Images that may wait while a cycle is computed: those of a Kinect are 9 MB.
const IMAGES_KEPT: usize = 10;
const CAMERA_INFOS_KEPT: usize = 10;

/// A colour image as received: it is converted only when a cycle takes it.
#[derive(Clone, PartialEq, Debug)]
pub(crate) enum ColourMessage {
    Raw(Arc<Image>),
    Compressed(Arc<CompressedImage>),
}

impl ColourMessage {
    pub(super) fn stamp(&self) -> Stamp {
        convert::stamp_from_time(match self {
            Self::Raw(message) => message.header.stamp,
            Self::Compressed(message) => message.header.stamp,
        })
    }

    /// # Errors
    /// When it is no colour image.
    pub(super) fn image(&self) -> Result<ColourImage, ConvertError> {
        match self {
            Self::Raw(message) => convert::colour_image_from_message(message),
            Self::Compressed(message) => convert::colour_image_from_message(
                &convert::image_from_compressed_message(message)?,
            ),
        }
    }
}

/// The subscriptions to the colour camera.
pub(crate) struct ColourInputs {
    images: Images,
    camera_infos: Subscription<CameraInfo>,
}

enum Images {
    Raw(Subscription<Image>),
    Compressed(Subscription<CompressedImage>),
}

impl ColourInputs {
    /// Subscribes; `None` where no colour camera is used.
    ///
    /// # Errors
    /// When a subscription fails.
    pub(crate) fn subscribe(
        node: &Node,
        parameters: &DetectionParameters,
    ) -> Result<Option<Self>, ShellError> {
        let qos = Qos::sensor(IMAGES_KEPT);
        let images = match parameters.colour_source() {
            Some(ColourInput::Raw) => Images::Raw(node.subscription("rgb/image", &qos)?),
            Some(ColourInput::Compressed) => {
                Images::Compressed(node.subscription("rgb/image/compressed", &qos)?)
            }
            Some(ColourInput::Cloud | ColourInput::None) | None => return Ok(None),
        };
        let infos = Qos::sensor(CAMERA_INFOS_KEPT);
        let camera_infos = node.subscription("rgb/camera_info", &infos)?;
        Ok(Some(Self { images, camera_infos }))
    }

    /// The next message. May be dropped while it waits.
    pub(crate) async fn next(&self) -> Arrival {
        tokio::select! {
            biased;
            received = self.camera_infos.next() => Arrival::ColourInfo(received.message),
            message = self.images.next() => Arrival::Colour(message),
        }
    }

    /// The next message, if one has arrived.
    pub(crate) fn try_next(&self) -> Option<Arrival> {
        match self.camera_infos.try_next() {
            Some(received) => Some(Arrival::ColourInfo(received.message)),
            None => self.images.try_next().map(Arrival::Colour),
        }
    }

    /// The topic of the images.
    pub(crate) fn topic(&self) -> &str {
        match &self.images {
            Images::Raw(images) => images.topic(),
            Images::Compressed(images) => images.topic(),
        }
    }

    /// The topic of the calibration.
    pub(crate) fn camera_info_topic(&self) -> &str {
        self.camera_infos.topic()
    }

    /// How many images were received.
    pub(crate) fn received_count(&self) -> u64 {
        match &self.images {
            Images::Raw(images) => images.received_count(),
            Images::Compressed(images) => images.received_count(),
        }
    }
}

impl Images {
    async fn next(&self) -> ColourMessage {
        match self {
            Self::Raw(images) => ColourMessage::Raw(images.next().await.message),
            Self::Compressed(images) => ColourMessage::Compressed(images.next().await.message),
        }
    }

    fn try_next(&self) -> Option<ColourMessage> {
        match self {
            Self::Raw(images) => images.try_next().map(|it| ColourMessage::Raw(it.message)),
            Self::Compressed(images) => {
                images.try_next().map(|it| ColourMessage::Compressed(it.message))
            }
        }
    }
}
