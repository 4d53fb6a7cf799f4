//! The node's subscriptions.

use std::sync::Arc;

use msgs::nav_msgs::Odometry;
use msgs::sensor_msgs::{CameraInfo, CompressedImage, Image, Imu};
use msgs::stillmap_msgs::Tracks;
use node_shell::{Node, Qos, ShellError, Subscription};

use super::left_out::LeftOutCounts;
use super::parameters::{DepthSource, ImageInput, PoseParameters};

/// Messages that may wait while a frame is looked at. Each bounds the memory of its topic: ten colour images of a Kinect
/// are 9 MB.
const IMAGES_KEPT: usize = 10;
const CAMERA_INFOS_KEPT: usize = 10;
const TRACKS_KEPT: usize = 10;
const MOTIONS_KEPT: usize = 200;

/// A message that arrived.
pub(super) enum Arrival {
    Color(Arc<Image>),
    CompressedColor(Arc<CompressedImage>),
    Depth(Arc<Image>),
    ColorInfo(Arc<CameraInfo>),
    DepthInfo(Arc<CameraInfo>),
    Tracks(Arc<Tracks>),
    Imu(Arc<Imu>),
    Wheels(Arc<Odometry>),
}

/// The node's subscriptions.
pub(super) struct Inputs {
    colors: Colors,
    color_infos: Subscription<CameraInfo>,
    depths: Subscription<Image>,
    depth_infos: Option<Subscription<CameraInfo>>,
    tracks: Option<Subscription<Tracks>>,
    imu: Option<Subscription<Imu>>,
    wheels: Option<Subscription<Odometry>>,
}

enum Colors {
    Raw(Subscription<Image>),
    Compressed(Subscription<CompressedImage>),
}

impl Inputs {
    pub(super) fn subscribe(node: &Node, parameters: &PoseParameters) -> Result<Self, ShellError> {
        let (images, infos) = (Qos::sensor(IMAGES_KEPT), Qos::sensor(CAMERA_INFOS_KEPT));
        let motions = Qos::sensor(MOTIONS_KEPT);
        let colors = match parameters.input {
            ImageInput::Raw => Colors::Raw(node.subscription("rgb/image", &images)?),
            ImageInput::Compressed => {
                Colors::Compressed(node.subscription("rgb/image/compressed", &images)?)
            }
        };
        let has_own_camera = parameters.depth == DepthSource::Raw;
        let depth_infos = || node.subscription("depth/camera_info", &infos);
        let tracks = || node.subscription("tracks", &Qos::reliable(TRACKS_KEPT));
        Ok(Self {
            colors,
            color_infos: node.subscription("rgb/camera_info", &infos)?,
            depths: node.subscription("depth/image", &images)?,
            depth_infos: has_own_camera.then(depth_infos).transpose()?,
            tracks: parameters.leave_out_tracks.then(tracks).transpose()?,
            imu: parameters.use_imu.then(|| node.subscription("imu", &motions)).transpose()?,
            wheels: parameters
                .use_wheels
                .then(|| node.subscription("wheels", &motions))
                .transpose()?,
        })
    }

    /// The next message; what an image needs comes before the image. May be dropped while it waits.
    pub(super) async fn next(&self) -> Arrival {
        tokio::select! {
            biased;
            received = self.color_infos.next() => Arrival::ColorInfo(received.message),
            received = next_of(&self.depth_infos) => Arrival::DepthInfo(received),
            received = next_of(&self.imu) => Arrival::Imu(received),
            received = next_of(&self.wheels) => Arrival::Wheels(received),
            received = next_of(&self.tracks) => Arrival::Tracks(received),
            received = self.depths.next() => Arrival::Depth(received.message),
            arrival = self.colors.next() => arrival,
        }
    }

    /// A message that is here already, in the same order.
    pub(super) fn try_next(&self) -> Option<Arrival> {
        let color_info = self.color_infos.try_next().map(|it| Arrival::ColorInfo(it.message));
        color_info
            .or_else(|| try_next_of(&self.depth_infos).map(Arrival::DepthInfo))
            .or_else(|| try_next_of(&self.imu).map(Arrival::Imu))
            .or_else(|| try_next_of(&self.wheels).map(Arrival::Wheels))
            .or_else(|| try_next_of(&self.tracks).map(Arrival::Tracks))
            .or_else(|| self.depths.try_next().map(|it| Arrival::Depth(it.message)))
            .or_else(|| self.colors.try_next())
    }

    pub(super) fn color_topic(&self) -> &str {
        match &self.colors {
            Colors::Raw(colors) => colors.topic(),
            Colors::Compressed(colors) => colors.topic(),
        }
    }

    pub(super) fn depth_topic(&self) -> &str {
        self.depths.topic()
    }

    pub(super) fn color_info_topic(&self) -> &str {
        self.color_infos.topic()
    }

    pub(super) fn depth_info_topic(&self) -> &str {
        self.depth_infos.as_ref().map_or("depth/camera_info", Subscription::topic)
    }

    pub(super) fn tracks_topic(&self) -> &str {
        self.tracks.as_ref().map_or("tracks", Subscription::topic)
    }

    /// How many images gave way to newer ones while they waited to be taken.
    pub(super) fn left_out(&self) -> LeftOutCounts {
        let colors = match &self.colors {
            Colors::Raw(colors) => colors.left_out_count(),
            Colors::Compressed(colors) => colors.left_out_count(),
        };
        LeftOutCounts { colors, depths: self.depths.left_out_count() }
    }

    /// How many images have come, of both kinds.
    pub(super) fn counts(&self) -> [(&'static str, u64); 2] {
        let colors = match &self.colors {
            Colors::Raw(colors) => colors.received_count(),
            Colors::Compressed(colors) => colors.received_count(),
        };
        [("received_color_images", colors), ("received_depth_images", self.depths.received_count())]
    }
}

impl Colors {
    async fn next(&self) -> Arrival {
        match self {
            Self::Raw(colors) => Arrival::Color(colors.next().await.message),
            Self::Compressed(colors) => Arrival::CompressedColor(colors.next().await.message),
        }
    }

    fn try_next(&self) -> Option<Arrival> {
        match self {
            Self::Raw(colors) => colors.try_next().map(|it| Arrival::Color(it.message)),
            Self::Compressed(colors) => {
                colors.try_next().map(|it| Arrival::CompressedColor(it.message))
            }
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
