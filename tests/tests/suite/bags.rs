//! Bags made for a test.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use bag_player::{Bag, BagMessage, BagWriter, OfferedQos, Selection};
use geometry::{CameraModel, Cloud, DepthImage, Stamp};
use msgs::geometry_msgs::PoseStamped;
use msgs::sensor_msgs::{CameraInfo, Image, LaserScan, PointCloud2, PointField};
use msgs::{RosMessage, convert};
use nalgebra::{Point2, Point3};

use crate::program::succeed;

/// The bag of the small simulated room: a person crosses it.
pub(crate) fn small_room(folder: &Path) -> PathBuf {
    static BAG: OnceLock<Vec<u8>> = OnceLock::new();
    made_once(&BAG, folder.join("small.mcap"), &["simulate", "small"])
}

/// A bag that this command writes: the program runs for the first test that wants it, and the others get a copy.
pub(crate) fn made_once(bytes: &OnceLock<Vec<u8>>, bag: PathBuf, command: &[&str]) -> PathBuf {
    let bytes = bytes.get_or_init(|| {
        succeed(command.iter().chain(&["-o", bag.to_str().unwrap()]));
        std::fs::read(&bag).unwrap()
    });
    std::fs::write(&bag, bytes).unwrap();
    bag
}

/// The same recording, with a cloud in the rows and columns of the image in place of each depth image.
pub(crate) fn with_organised_clouds(folder: &Path, bag: &Path) -> PathBuf {
    let infos = messages_of::<CameraInfo>(bag, "/camera/depth/camera_info");
    let camera = convert::camera_from_message(&infos[0].1).unwrap();
    let clouds = messages_of::<Image>(bag, "/camera/depth/image_raw").into_iter();
    let clouds = clouds.map(|(stamp, image)| {
        (stamp, organised(&convert::depth_from_message(&image).unwrap(), &camera))
    });
    bag_of(folder, "organised.mcap", |topics| {
        topics.messages("/scan", messages_of::<LaserScan>(bag, "/scan"));
        topics.messages("/pose", messages_of::<PoseStamped>(bag, "/pose"));
        topics.messages("/camera/depth/points", clouds);
    })
}

/// The messages of a topic, each with its time.
pub(crate) fn messages_of<M: RosMessage>(bag: &Path, topic: &str) -> Vec<(Stamp, M)> {
    let selection = Selection { topics: Some(vec![topic.to_owned()]), ..Selection::default() };
    let messages = Bag::open(bag).unwrap().messages(&selection).unwrap();
    let decoded = |message: BagMessage| (message.log_time, message.decode().unwrap());
    messages.map(|message| decoded(message.unwrap())).collect()
}

/// The cloud of an image as a driver makes it: NaN where there is no depth.
pub(crate) fn organised(image: &DepthImage, camera: &CameraModel) -> PointCloud2 {
    let (width, height) = (image.width_px(), image.height_px());
    let point_of = |index: usize| {
        let (column, row) = (index % width, index / width);
        let ray = camera.ray(&Point2::new(column as f64, row as f64)).unwrap().cast::<f32>();
        let depth_m = image.depth_m(column, row).unwrap_or(f32::NAN);
        Point3::new(ray.x * depth_m, ray.y * depth_m, depth_m)
    };
    let points_m = (0..width * height).map(point_of).collect();
    let cloud = Cloud { stamp: image.stamp, frame_id: image.frame_id.clone(), points_m };
    let message = convert::message_from_cloud(&cloud);
    let (width, height) = (u32::try_from(width).unwrap(), u32::try_from(height).unwrap());
    let row_step = width * message.point_step;
    PointCloud2 { width, height, row_step, is_dense: false, ..message }
}

/// A bag with what `fill` writes.
pub(crate) fn bag_of(folder: &Path, name: &str, fill: impl FnOnce(&mut Topics)) -> PathBuf {
    let path = folder.join(name);
    let mut topics = Topics { writer: BagWriter::create(&path).unwrap() };
    fill(&mut topics);
    topics.writer.finish().unwrap();
    path
}

/// Writes messages to topics.
pub(crate) struct Topics {
    writer: BagWriter,
}

impl Topics {
    pub(crate) fn messages<M: RosMessage>(
        &mut self,
        topic: &str,
        messages: impl IntoIterator<Item = (Stamp, M)>,
    ) {
        let channel = self.writer.channel::<M>(topic, OfferedQos::reliable(10)).unwrap();
        for (stamp, message) in messages {
            self.writer.write(channel, stamp, &message).unwrap();
        }
    }

    /// Messages that cannot be decoded.
    pub(crate) fn cut_off<M: RosMessage>(
        &mut self,
        topic: &str,
        stamps: impl IntoIterator<Item = Stamp>,
    ) {
        let channel = self.writer.channel::<M>(topic, OfferedQos::reliable(10)).unwrap();
        for stamp in stamps {
            self.writer.write_raw(channel, stamp, stamp, &CUT_OFF).unwrap();
        }
    }
}

/// The beginning of an encoded message, and no more.
const CUT_OFF: [u8; 6] = [0, 1, 0, 0, 9, 0];

/// The moments of ten cycles.
pub(crate) fn ten_stamps() -> impl Iterator<Item = Stamp> {
    (0..10).map(|index| Stamp::from_secs_nanos(100, index * 100_000_000))
}

/// A scan of 90 beams over the forward quarter, all of one range.
pub(crate) fn scan(stamp: Stamp, range_m: f32) -> LaserScan {
    convert::message_from_scan(&geometry::Scan {
        stamp,
        frame_id: "laser".to_owned(),
        angle_min_rad: -std::f32::consts::FRAC_PI_4,
        angle_increment_rad: 1f32.to_radians(),
        time_increment_s: 0.0,
        scan_time_s: 0.1,
        range_min_m: 0.15,
        range_max_m: 8.0,
        ranges_m: vec![range_m; 90],
    })
}

/// The rig at the origin.
pub(crate) fn pose(stamp: Stamp) -> PoseStamped {
    convert::message_from_pose(&geometry::StampedPose {
        stamp,
        frame_id: "map".to_owned(),
        map_from_rig: nalgebra::Isometry3::identity(),
    })
}

/// A cloud of `points` points, in rows, on a wall two metres ahead, in the camera's optical frame.
pub(crate) fn wall(stamp: Stamp, points: u16) -> PointCloud2 {
    const COLUMNS: u16 = 20;
    const STEP_M: f32 = 0.02;
    let points_m = (0..points)
        .map(|index| [index % COLUMNS, index / COLUMNS].map(|place| f32::from(place) * STEP_M))
        .map(|[x_m, y_m]| Point3::new(x_m - 0.2, y_m, 2.0))
        .collect();
    let mut cloud = convert::message_from_cloud(&geometry::Cloud {
        stamp,
        frame_id: "camera_depth_optical_frame".to_owned(),
        points_m,
    });
    // As drivers have it, also where there is no point.
    assert!(cloud.fields.iter().map(|field: &PointField| field.name.as_str()).eq(["x", "y", "z"]));
    cloud.is_dense = true;
    cloud
}
