//! Bags with the topics and QoS of the usual drivers: the only module that names the topics of the bags that
//! this program writes.

use std::collections::BTreeMap;
use std::path::Path;

use bag_player::{BagSummary, BagWriter, ChannelId, OfferedQos};
use geometry::{CameraModel, Cloud, DepthImage, LabelImage, Scan, Stamp, StampedPose};
use msgs::nav_msgs::Odometry;
use msgs::sensor_msgs::{CameraInfo, CompressedImage, Image, Imu, LaserScan, PointCloud2};
use msgs::stillmap_msgs::Tracks;
use msgs::velodyne_msgs::VelodyneScan;
use msgs::{RosMessage, convert, geometry_msgs::PoseStamped, std_msgs};

use crate::failure::Failure;
use crate::unfinished::Unfinished;

/// The scan, as rplidar_ros names it.
pub const SCAN: &str = "/scan";
/// The depth image, as the Kinect and RealSense drivers name it.
pub const DEPTH: &str = "/camera/depth/image_raw";
/// The calibration of the depth camera.
pub const DEPTH_CAMERA_INFO: &str = "/camera/depth/camera_info";
/// The colour image, compressed as image_transport does it.
pub const COLOUR: &str = "/camera/rgb/image_raw/compressed";
/// The raw colour image, as the Kinect drivers name it.
pub const RAW_COLOUR: &str = "/camera/rgb/image_raw";
/// The calibration of the colour camera.
pub const COLOUR_CAMERA_INFO: &str = "/camera/rgb/camera_info";
/// The cloud of the 3D scanner, as velodyne_driver names it.
pub const VELODYNE: &str = "/velodyne_points";
/// The packets of the 3D scanner, as velodyne_driver names them.
pub const VELODYNE_PACKETS: &str = "/velodyne_packets";
/// True object ids, a number for each point of the 3D scanner.
pub const TRUE_VELODYNE_LABELS: &str = "/truth/velodyne_labels";
/// The inertial unit.
pub const IMU: &str = "/imu/data_raw";
/// The odometry of the wheels.
pub const WHEELS: &str = "/odom";
/// The true pose of the rig at every colour image, and at the start of every turn of the 3D scanner.
pub const TRUE_POSE: &str = "/truth/pose";
/// The pose of the rig.
pub const POSE: &str = "/pose";
/// True object ids, a number for each depth pixel.
pub const TRUE_LABELS: &str = "/truth/labels";
/// True object ids, a number for each beam: the scan itself, with the ids as intensities.
pub const TRUE_SCAN_LABELS: &str = "/truth/scan_labels";
/// Where the true objects are in each depth image.
pub const TRUE_OBJECTS: &str = "/truth/objects";
/// The cloud of the scene without its moving objects.
pub const TRUE_EMPTY_SCENE: &str = "/truth/empty_scene";
/// The names of the true objects: a JSON object from id to name.
pub const TRUE_OBJECT_NAMES: &str = "/truth/object_names";
/// The frame of the depth images.
pub const DEPTH_FRAME: &str = "camera_depth_optical_frame";
/// The frame of the poses.
pub const MAP_FRAME: &str = "map";

/// History depth of the sensors' publishers: that of `rmw_qos_profile_sensor_data`.
const SENSOR_DEPTH: u32 = 5;
/// History depth of other publishers: that of `rmw_qos_profile_default`.
const RELIABLE_DEPTH: u32 = 10;

/// Writes sensor data to a bag. Channels appear with their first message, so that a bag lists no
/// topic that it does not hold. Each method is an error when the file cannot be written.
pub struct SensorBag {
    writer: BagWriter,
    _unfinished: Unfinished,
    channels: Vec<(&'static str, ChannelId)>,
}

impl SensorBag {
    /// A bag to be completed with [`Self::finish`].
    ///
    /// # Errors
    /// When the file cannot be created.
    pub fn create(path: &Path) -> Result<Self, Failure> {
        let writer = BagWriter::create(path).map_err(|error| Failure::new(error.to_string()))?;
        let _unfinished = Unfinished::at(writer.temporary().to_owned());
        Ok(Self { writer, _unfinished, channels: Vec::new() })
    }

    /// A scan, on [`SCAN`].
    pub fn scan(&mut self, scan: &Scan) -> Result<(), Failure> {
        let message: LaserScan = convert::message_from_scan(scan);
        self.write(SCAN, OfferedQos::sensor(SENSOR_DEPTH), scan.stamp, &message)
    }

    /// A depth image, on [`DEPTH`].
    pub fn depth(&mut self, depth: &DepthImage) -> Result<(), Failure> {
        let message: Image = convert::message_from_depth(depth);
        self.write(DEPTH, OfferedQos::sensor(SENSOR_DEPTH), depth.stamp, &message)
    }

    /// The depth camera's calibration, on [`DEPTH_CAMERA_INFO`].
    pub fn camera(&mut self, camera: &CameraModel, stamp: Stamp) -> Result<(), Failure> {
        let message: CameraInfo = convert::message_from_camera(camera, stamp, DEPTH_FRAME);
        self.write(DEPTH_CAMERA_INFO, OfferedQos::sensor(SENSOR_DEPTH), stamp, &message)
    }

    /// A compressed colour image, on [`COLOUR`].
    pub fn colour(&mut self, stamp: Stamp, colour: &CompressedImage) -> Result<(), Failure> {
        self.write(COLOUR, OfferedQos::sensor(SENSOR_DEPTH), stamp, colour)
    }

    /// A colour image, on [`RAW_COLOUR`].
    pub fn colour_image(&mut self, stamp: Stamp, image: &Image) -> Result<(), Failure> {
        self.write(RAW_COLOUR, OfferedQos::sensor(SENSOR_DEPTH), stamp, image)
    }

    /// The colour camera's calibration, on [`COLOUR_CAMERA_INFO`].
    pub fn colour_camera(
        &mut self,
        camera: &CameraModel,
        stamp: Stamp,
        frame_id: &str,
    ) -> Result<(), Failure> {
        let message: CameraInfo = convert::message_from_camera(camera, stamp, frame_id);
        self.write(COLOUR_CAMERA_INFO, OfferedQos::sensor(SENSOR_DEPTH), stamp, &message)
    }

    /// A turn of a 3D scanner, on [`VELODYNE`].
    pub fn velodyne(&mut self, stamp: Stamp, cloud: &PointCloud2) -> Result<(), Failure> {
        self.write(VELODYNE, OfferedQos::sensor(SENSOR_DEPTH), stamp, cloud)
    }

    /// The packets of a 3D scanner's turn, on [`VELODYNE_PACKETS`].
    pub fn velodyne_packets(&mut self, stamp: Stamp, scan: &VelodyneScan) -> Result<(), Failure> {
        self.write(VELODYNE_PACKETS, OfferedQos::sensor(SENSOR_DEPTH), stamp, scan)
    }

    /// The labels of a turn's points, on [`TRUE_VELODYNE_LABELS`].
    pub fn velodyne_labels(&mut self, labels: &LabelImage) -> Result<(), Failure> {
        let message: Image = convert::message_from_labels(labels);
        let qos = OfferedQos::reliable(RELIABLE_DEPTH);
        self.write(TRUE_VELODYNE_LABELS, qos, labels.stamp, &message)
    }

    /// A reading of the inertial unit, on [`IMU`].
    pub fn imu(&mut self, stamp: Stamp, reading: &Imu) -> Result<(), Failure> {
        self.write(IMU, OfferedQos::sensor(SENSOR_DEPTH), stamp, reading)
    }

    /// The wheels' odometry, on [`WHEELS`].
    pub fn wheels(&mut self, stamp: Stamp, odometry: &Odometry) -> Result<(), Failure> {
        self.write(WHEELS, OfferedQos::reliable(RELIABLE_DEPTH), stamp, odometry)
    }

    /// A true pose, on [`TRUE_POSE`].
    pub fn true_pose(&mut self, pose: &StampedPose) -> Result<(), Failure> {
        let message: PoseStamped = convert::message_from_pose(pose);
        self.write(TRUE_POSE, OfferedQos::reliable(RELIABLE_DEPTH), pose.stamp, &message)
    }

    /// A pose of the rig, on [`POSE`].
    pub fn pose(&mut self, pose: &StampedPose) -> Result<(), Failure> {
        let message: PoseStamped = convert::message_from_pose(pose);
        self.write(POSE, OfferedQos::reliable(RELIABLE_DEPTH), pose.stamp, &message)
    }

    /// The labels of a depth image's pixels, on [`TRUE_LABELS`].
    pub fn labels(&mut self, labels: &LabelImage) -> Result<(), Failure> {
        let message: Image = convert::message_from_labels(labels);
        self.write(TRUE_LABELS, OfferedQos::reliable(RELIABLE_DEPTH), labels.stamp, &message)
    }

    /// The labels of a scan's beams, one for each; to be written after the scan.
    pub fn scan_labels(&mut self, scan: &Scan, labels: &[u16]) -> Result<(), Failure> {
        let intensities = labels.iter().map(|&label| f32::from(label)).collect();
        let message = LaserScan { intensities, ..convert::message_from_scan(scan) };
        self.write(TRUE_SCAN_LABELS, OfferedQos::reliable(RELIABLE_DEPTH), scan.stamp, &message)
    }

    /// The true positions of the objects, on [`TRUE_OBJECTS`].
    pub fn objects(&mut self, stamp: Stamp, objects: &Tracks) -> Result<(), Failure> {
        self.write(TRUE_OBJECTS, OfferedQos::reliable(RELIABLE_DEPTH), stamp, objects)
    }

    /// The surface of the scene without anything that moves, on [`TRUE_EMPTY_SCENE`].
    pub fn empty_scene(&mut self, cloud: &Cloud) -> Result<(), Failure> {
        let message: PointCloud2 = convert::message_from_cloud(cloud);
        self.write(TRUE_EMPTY_SCENE, OfferedQos::latched(), cloud.stamp, &message)
    }

    /// The names of the labels, on [`TRUE_OBJECT_NAMES`].
    pub fn object_names(
        &mut self,
        stamp: Stamp,
        names: &BTreeMap<u16, String>,
    ) -> Result<(), Failure> {
        let data = serde_json::to_string(names)
            .map_err(|error| Failure::new(format!("cannot write the object names: {error}")))?;
        self.write(TRUE_OBJECT_NAMES, OfferedQos::latched(), stamp, &std_msgs::String { data })
    }

    /// Completes the bag; until then it has a temporary name.
    pub fn finish(self) -> Result<BagSummary, Failure> {
        self.writer.finish().map_err(|error| Failure::new(error.to_string()))
    }

    fn write<M: RosMessage>(
        &mut self,
        topic: &'static str,
        qos: OfferedQos,
        stamp: Stamp,
        message: &M,
    ) -> Result<(), Failure> {
        let known = self.channels.iter().find(|(name, _)| *name == topic).map(|(_, id)| *id);
        let channel = match known {
            Some(channel) => channel,
            None => {
                let channel = self
                    .writer
                    .channel::<M>(topic, qos)
                    .map_err(|error| Failure::new(error.to_string()))?;
                self.channels.push((topic, channel));
                channel
            }
        };
        self.writer.write(channel, stamp, message).map_err(|error| Failure::new(error.to_string()))
    }
}
