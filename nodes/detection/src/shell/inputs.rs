//! The node's subscriptions.

use std::sync::Arc;

use geometry::Stamp;
use msgs::convert::{COMPRESSED_DEPTH_TOPIC, stamp_from_time};
use msgs::geometry_msgs::{PoseStamped, PoseWithCovarianceStamped};
use msgs::nav_msgs::{Odometry, Path};
use msgs::sensor_msgs::{CameraInfo, CompressedImage, Image, LaserScan, PointCloud2};
use msgs::std_msgs::Header;
use node_shell::{Node, Qos, ShellError, Subscription, TransformArrival};

use super::colour::{ColourInputs, ColourMessage};
use super::{CloudInput, DetectionParameters, PoseInput};
use crate::Input;

/// The depth images; the compressed ones have a name below it.
const DEPTH_TOPIC: &str = "depth/image";

/// Messages that may wait while a cycle is computed or the machine is busy. Each bounds the memory of
/// its topic: ten depth images of a Kinect are 6 MB, ten clouds 50 MB; the small ones last for seconds.
const VIEWS_KEPT: usize = 10;
const SCANS_KEPT: usize = 50;
const CAMERA_INFOS_KEPT: usize = 10;
const POSES_KEPT: usize = 200;
/// Each path holds the whole trajectory.
const PATHS_KEPT: usize = 5;

/// A depth image or cloud as received: of the thirty a second of a camera a scanner uses seven, so it
/// is converted only when it was matched with a scan.
#[derive(Clone, PartialEq, Debug)]
pub(super) enum ViewMessage {
    Depth(Arc<Image>),
    CompressedDepth(Arc<CompressedImage>),
    Points(Arc<PointCloud2>),
}

impl ViewMessage {
    fn header(&self) -> &Header {
        match self {
            Self::Depth(message) => &message.header,
            Self::CompressedDepth(message) => &message.header,
            Self::Points(message) => &message.header,
        }
    }

    pub(super) fn stamp(&self) -> Stamp {
        stamp_from_time(self.header().stamp)
    }

    /// The camera's optical frame.
    pub(super) fn frame_id(&self) -> &str {
        &self.header().frame_id
    }

    /// Whether it needs the calibration of its camera.
    pub(super) fn needs_calibration(&self) -> bool {
        match self {
            Self::Depth(_) | Self::CompressedDepth(_) => true,
            Self::Points(_) => false,
        }
    }
}

/// A pose as received.
#[derive(Clone, PartialEq, Debug)]
pub(super) enum PoseMessage {
    Pose(Arc<PoseStamped>),
    WithCovariance(Arc<PoseWithCovarianceStamped>),
    Odometry(Arc<Odometry>),
}

/// A message that arrived.
pub(super) enum Arrival {
    Scan(Arc<LaserScan>),
    View(ViewMessage),
    CameraInfo(Arc<CameraInfo>),
    Pose(PoseMessage),
    Path(Arc<Path>),
    Colour(ColourMessage),
    ColourInfo(Arc<CameraInfo>),
    Transforms(TransformArrival),
}

/// The node's subscriptions.
pub(super) struct Inputs {
    scans: Subscription<LaserScan>,
    view: ViewInputs,
    /// Present where a colour camera is used.
    colour: Option<ColourInputs>,
    poses: PoseSubscription,
    paths: Subscription<Path>,
}

enum PoseSubscription {
    Poses(Box<Subscription<PoseStamped>>),
    WithCovariance(Box<Subscription<PoseWithCovarianceStamped>>),
    Odometry(Box<Subscription<Odometry>>),
    /// Transforms are received elsewhere.
    Tf,
}

enum ViewInputs {
    Depth(Box<DepthInputs>),
    Points(Box<Subscription<PointCloud2>>),
}

struct DepthInputs {
    images: DepthImages,
    camera_infos: Subscription<CameraInfo>,
}

enum DepthImages {
    Raw(Subscription<Image>),
    Compressed(Subscription<CompressedImage>),
}

impl Inputs {
    pub(super) fn subscribe(
        node: &Node,
        parameters: &DetectionParameters,
    ) -> Result<Self, ShellError> {
        let view = match parameters.input {
            CloudInput::Depth => ViewInputs::depth(node, |qos| {
                Ok(DepthImages::Raw(node.subscription(DEPTH_TOPIC, qos)?))
            })?,
            CloudInput::CompressedDepth => ViewInputs::depth(node, |qos| {
                let topic = format!("{DEPTH_TOPIC}/{COMPRESSED_DEPTH_TOPIC}");
                Ok(DepthImages::Compressed(node.subscription(&topic, qos)?))
            })?,
            CloudInput::Points => {
                ViewInputs::Points(Box::new(node.subscription("points", &Qos::sensor(VIEWS_KEPT))?))
            }
        };
        let paths = node.subscription("map_path", &Qos::reliable(PATHS_KEPT))?;
        node.counters().note_optional(paths.topic());
        Ok(Self {
            view,
            colour: ColourInputs::subscribe(node, parameters)?,
            paths,
            poses: PoseSubscription::subscribe(node, parameters.pose_source)?,
            scans: node.subscription("scan", &Qos::sensor(SCANS_KEPT))?,
        })
    }

    /// The next message, whichever comes first. May be dropped while it waits.
    pub(super) async fn next(&self) -> Arrival {
        // Of several waiting messages, a path first: it applies to the poses after it. Then the largest: their queues are the
        // shortest; colours before the image that they belong to.
        tokio::select! {
            biased;
            received = self.paths.next() => Arrival::Path(received.message),
            arrival = next_of(&self.colour) => arrival,
            arrival = self.view.next() => arrival,
            received = self.scans.next() => Arrival::Scan(received.message),
            pose = self.poses.next() => Arrival::Pose(pose),
        }
    }

    /// The next message, if one has arrived.
    pub(super) fn try_next(&self) -> Option<Arrival> {
        let path = self.paths.try_next().map(|received| Arrival::Path(received.message));
        path.or_else(|| self.colour.as_ref().and_then(ColourInputs::try_next))
            .or_else(|| self.view.try_next())
            .or_else(|| self.scans.try_next().map(|received| Arrival::Scan(received.message)))
            .or_else(|| self.poses.try_next().map(Arrival::Pose))
    }

    /// The absolute name of an input's topic.
    pub(super) fn topic(&self, input: Input) -> &str {
        match input {
            Input::Scan => self.scans.topic(),
            Input::Cloud => self.view_topic(),
            Input::Pose => self.poses.topic(),
        }
    }

    /// The absolute name of the topic of the paths.
    pub(super) fn path_topic(&self) -> &str {
        self.paths.topic()
    }

    /// The topic of the images or clouds.
    pub(super) fn view_topic(&self) -> &str {
        match &self.view {
            ViewInputs::Depth(depth) => depth.images.topic(),
            ViewInputs::Points(clouds) => clouds.topic(),
        }
    }

    /// The topics of the colour camera's images and calibration; empty where there are none.
    pub(super) fn colour_topics(&self) -> [&str; 2] {
        self.colour.as_ref().map_or([""; 2], |colour| [colour.topic(), colour.camera_info_topic()])
    }

    /// Whether somebody publishes images or clouds.
    pub(super) fn has_view_publishers(&self) -> bool {
        let publishers = match &self.view {
            ViewInputs::Depth(depth) => depth.images.publisher_count(),
            ViewInputs::Points(clouds) => clouds.publisher_count(),
        };
        publishers > 0
    }

    /// Whether the images are raw, so that the calibration determines their size.
    pub(super) fn has_raw_images(&self) -> bool {
        matches!(&self.view, ViewInputs::Depth(depth) if matches!(depth.images, DepthImages::Raw(_)))
    }

    /// The topic of the calibration, if there is one.
    pub(super) fn camera_info_topic(&self) -> Option<&str> {
        match &self.view {
            ViewInputs::Depth(depth) => Some(depth.camera_infos.topic()),
            ViewInputs::Points(_) => None,
        }
    }

    /// What was received since the start.
    pub(super) fn counts(&self) -> Vec<(&'static str, u64)> {
        let mut counts = vec![("scans_received", self.scans.received_count())];
        match &self.view {
            ViewInputs::Depth(depth) => {
                counts.push(("images_received", depth.images.received_count()));
                counts.push(("camera_infos_received", depth.camera_infos.received_count()));
            }
            ViewInputs::Points(clouds) => {
                counts.push(("clouds_received", clouds.received_count()));
            }
        }
        counts.push(("poses_received", self.poses.received_count()));
        if let Some(colour) = &self.colour {
            counts.push(("colour_images_received", colour.received_count()));
        }
        counts
    }
}

impl PoseSubscription {
    fn subscribe(node: &Node, source: PoseInput) -> Result<Self, ShellError> {
        let qos = Qos::sensor(POSES_KEPT);
        Ok(match source {
            PoseInput::Pose => Self::Poses(Box::new(node.subscription("pose", &qos)?)),
            PoseInput::PoseWithCovariance => {
                Self::WithCovariance(Box::new(node.subscription("pose_with_covariance", &qos)?))
            }
            PoseInput::Odometry => Self::Odometry(Box::new(node.subscription("odom", &qos)?)),
            PoseInput::Tf => Self::Tf,
        })
    }

    async fn next(&self) -> PoseMessage {
        match self {
            Self::Poses(poses) => PoseMessage::Pose(poses.next().await.message),
            Self::WithCovariance(poses) => PoseMessage::WithCovariance(poses.next().await.message),
            Self::Odometry(odometry) => PoseMessage::Odometry(odometry.next().await.message),
            Self::Tf => std::future::pending().await,
        }
    }

    fn try_next(&self) -> Option<PoseMessage> {
        Some(match self {
            Self::Poses(poses) => PoseMessage::Pose(poses.try_next()?.message),
            Self::WithCovariance(poses) => PoseMessage::WithCovariance(poses.try_next()?.message),
            Self::Odometry(odometry) => PoseMessage::Odometry(odometry.try_next()?.message),
            Self::Tf => return None,
        })
    }

    fn topic(&self) -> &str {
        match self {
            Self::Poses(poses) => poses.topic(),
            Self::WithCovariance(poses) => poses.topic(),
            Self::Odometry(odometry) => odometry.topic(),
            Self::Tf => "/tf",
        }
    }

    fn received_count(&self) -> u64 {
        match self {
            Self::Poses(poses) => poses.received_count(),
            Self::WithCovariance(poses) => poses.received_count(),
            Self::Odometry(odometry) => odometry.received_count(),
            Self::Tf => 0,
        }
    }
}

/// The next message of the colour camera; never where there is none.
async fn next_of(colour: &Option<ColourInputs>) -> Arrival {
    match colour {
        Some(colour) => colour.next().await,
        None => std::future::pending().await,
    }
}

impl ViewInputs {
    fn depth(
        node: &Node,
        subscribe: impl FnOnce(&Qos) -> Result<DepthImages, ShellError>,
    ) -> Result<Self, ShellError> {
        let camera_infos =
            node.subscription("depth/camera_info", &Qos::sensor(CAMERA_INFOS_KEPT))?;
        let images = subscribe(&Qos::sensor(VIEWS_KEPT))?;
        Ok(Self::Depth(Box::new(DepthInputs { images, camera_infos })))
    }

    async fn next(&self) -> Arrival {
        match self {
            Self::Depth(depth) => tokio::select! {
                biased;
                received = depth.camera_infos.next() => Arrival::CameraInfo(received.message),
                message = depth.images.next() => Arrival::View(message),
            },
            Self::Points(clouds) => Arrival::View(ViewMessage::Points(clouds.next().await.message)),
        }
    }

    fn try_next(&self) -> Option<Arrival> {
        match self {
            Self::Depth(depth) => match depth.camera_infos.try_next() {
                Some(received) => Some(Arrival::CameraInfo(received.message)),
                None => depth.images.try_next().map(Arrival::View),
            },
            Self::Points(clouds) => {
                let received = clouds.try_next()?;
                Some(Arrival::View(ViewMessage::Points(received.message)))
            }
        }
    }
}

impl DepthImages {
    async fn next(&self) -> ViewMessage {
        match self {
            Self::Raw(images) => ViewMessage::Depth(images.next().await.message),
            Self::Compressed(images) => ViewMessage::CompressedDepth(images.next().await.message),
        }
    }

    fn try_next(&self) -> Option<ViewMessage> {
        match self {
            Self::Raw(images) => {
                images.try_next().map(|received| ViewMessage::Depth(received.message))
            }
            Self::Compressed(images) => {
                images.try_next().map(|received| ViewMessage::CompressedDepth(received.message))
            }
        }
    }

    fn topic(&self) -> &str {
        match self {
            Self::Raw(images) => images.topic(),
            Self::Compressed(images) => images.topic(),
        }
    }

    fn publisher_count(&self) -> usize {
        match self {
            Self::Raw(images) => images.publisher_count(),
            Self::Compressed(images) => images.publisher_count(),
        }
    }

    fn received_count(&self) -> u64 {
        match self {
            Self::Raw(images) => images.received_count(),
            Self::Compressed(images) => images.received_count(),
        }
    }
}
