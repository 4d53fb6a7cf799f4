//! The content of a topic's messages, from a bag or the live graph, and what is wrong with it.

mod calibration;
mod camera;
pub(super) mod clocks;
mod cloud;
mod frames;
mod image;
mod imu;
mod pose;
mod scan;
pub(super) mod stamps;
mod transforms;
mod typical;

use geometry::Stamp;
use msgs::RosMessage;
use msgs::convert::{self, ConvertError, stamp_from_time};
use msgs::geometry_msgs::{PoseStamped, PoseWithCovarianceStamped};
use msgs::nav_msgs::Odometry;
use msgs::sensor_msgs::{CameraInfo, CompressedImage, Image, Imu, LaserScan, PointCloud2};
use msgs::std_msgs::Header;

use super::checks::Check;
use super::finding::Finding;
pub(crate) use calibration::CalibrationFault;
pub(crate) use calibration::wrong as wrong_calibration;
pub(super) use camera::CameraFacts;
use cloud::CloudFacts;
use frames::Frames;
pub(super) use image::ImageFacts;
use imu::ImuFacts;
use pose::PoseFacts;
pub(crate) use scan::FARTHEST_M;
use scan::ScanFacts;
pub(super) use transforms::TransformFacts;
pub(super) use typical::Typical;

/// What is known of the messages of a topic.
#[derive(Clone, PartialEq, Debug, Default)]
pub(super) struct Content {
    frames: Frames,
    readings: Readings,
}

/// What is known of a sensor's readings.
#[derive(Clone, PartialEq, Debug, Default)]
pub(super) enum Readings {
    Scan(ScanFacts),
    Image(ImageFacts),
    Cloud(CloudFacts),
    Camera(CameraFacts),
    Pose(PoseFacts),
    Imu(ImuFacts),
    /// Of a type whose readings are not checked.
    #[default]
    Other,
}

/// The topic that findings are about.
#[derive(Clone, Copy, Debug)]
pub(super) struct Subject<'a> {
    /// The topic.
    pub(super) topic: &'a str,
    /// Whether the suite reads it: a finding is an error then.
    pub(super) is_read: bool,
    /// The usual time from a message to the next.
    pub(super) period_s: Option<f64>,
}

impl Subject<'_> {
    /// An error where the suite reads the topic, or else a warning.
    fn grave(&self, check: Check, what: impl Into<String>, fix: impl Into<String>) -> Finding {
        Finding::grave_if(self.is_read, check, what, fix)
    }
}

impl Content {
    /// Empty, for messages of a type.
    pub(super) fn of_type(type_name: &str) -> Self {
        let readings = match type_name {
            LaserScan::TYPE_NAME => Readings::Scan(ScanFacts::default()),
            Image::TYPE_NAME => Readings::Image(ImageFacts::default()),
            PointCloud2::TYPE_NAME => Readings::Cloud(CloudFacts::default()),
            CameraInfo::TYPE_NAME => Readings::Camera(CameraFacts::default()),
            PoseStamped::TYPE_NAME | Odometry::TYPE_NAME => Readings::Pose(PoseFacts::default()),
            Imu::TYPE_NAME => Readings::Imu(ImuFacts::default()),
            _ => Readings::Other,
        };
        Self { frames: Frames::default(), readings }
    }

    /// Adds a message; returns its stamp.
    pub(super) fn take<M: Observed>(&mut self, message: &M) -> Stamp {
        let header = message.header();
        self.frames.take(&header.frame_id);
        message.observe(&mut self.readings);
        stamp_from_time(header.stamp)
    }

    /// What is wrong with the messages.
    pub(super) fn findings(&self, subject: &Subject<'_>) -> Vec<Finding> {
        let mut findings = self.frames.findings(subject);
        findings.extend(match &self.readings {
            Readings::Scan(facts) => facts.findings(subject),
            Readings::Image(facts) => facts.findings(subject),
            Readings::Cloud(facts) => facts.findings(subject),
            Readings::Camera(facts) => facts.findings(subject),
            Readings::Pose(facts) => facts.findings(subject),
            Readings::Imu(facts) => facts.findings(subject),
            Readings::Other => Vec::new(),
        });
        findings
    }

    /// The frame of the messages, where they have one.
    pub(super) fn frame(&self) -> Option<&str> {
        self.frames.only()
    }

    /// What is known of a camera's calibration.
    pub(super) fn camera(&self) -> Option<&CameraFacts> {
        match &self.readings {
            Readings::Camera(facts) => Some(facts),
            _ => None,
        }
    }

    /// What is known of images.
    pub(super) fn image(&self) -> Option<&ImageFacts> {
        match &self.readings {
            Readings::Image(facts) => Some(facts),
            _ => None,
        }
    }
}

/// Static transforms that late subscribers do not receive. `from` names their publisher.
pub(super) fn latching(from: &str) -> Finding {
    Finding::warn(
        Check::Qos,
        format!("{from}: offered with durability volatile, and tf2 requests transient local"),
        "publish it transient local (tf2_ros::StaticTransformBroadcaster does)",
    )
}

/// A message with a header whose readings are checked.
pub(super) trait Observed: RosMessage {
    fn header(&self) -> &Header;
    /// Whether the suite could use it.
    ///
    /// # Errors
    /// When it could not.
    fn check(&self) -> Result<(), ConvertError>;
    fn observe(&self, readings: &mut Readings);
}

macro_rules! observed {
    ($($message:ident as $variant:ident by $convert:expr;)*) => {$(
        impl Observed for $message {
            fn header(&self) -> &Header {
                &self.header
            }

            fn check(&self) -> Result<(), ConvertError> {
                $convert(self).map(drop)
            }

            fn observe(&self, readings: &mut Readings) {
                if let Readings::$variant(facts) = readings {
                    facts.take(self);
                }
            }
        }
    )*};
}

observed! {
    LaserScan as Scan by convert::scan_from_message;
    Image as Image by convert::depth_from_message;
    PointCloud2 as Cloud by convert::cloud_from_message;
    CameraInfo as Camera by convert::camera_from_message;
    PoseStamped as Pose by convert::pose_from_message;
    Odometry as Pose by convert::pose_from_odometry;
    Imu as Imu by |_: &Imu| Ok::<_, ConvertError>(());
}

/// Whether they come, and in which frame.
impl Observed for PoseWithCovarianceStamped {
    fn header(&self) -> &Header {
        &self.header
    }

    fn check(&self) -> Result<(), ConvertError> {
        convert::pose_from_covariance_message(self).map(drop)
    }

    fn observe(&self, _: &mut Readings) {}
}

impl Observed for CompressedImage {
    fn header(&self) -> &Header {
        &self.header
    }

    fn check(&self) -> Result<(), ConvertError> {
        Ok(())
    }

    fn observe(&self, _: &mut Readings) {}
}

#[cfg(test)]
mod tests;
