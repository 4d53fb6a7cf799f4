//! Bags made for a test.

use std::path::{Path, PathBuf};

use bag_player::{BagWriter, OfferedQos};
use geometry::Stamp;
use msgs::geometry_msgs::PoseStamped;
use msgs::sensor_msgs::{LaserScan, PointCloud2, PointField};
use msgs::{RosMessage, convert};

use crate::program::succeed;

/// The bag of the small simulated room: a person crosses it.
pub(crate) fn small_room(folder: &Path) -> PathBuf {
    let bag = folder.join("small.mcap");
    succeed(["simulate", "small", "-o", bag.to_str().unwrap()]);
    bag
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

/// A cloud of `points` points on a wall two metres ahead, in the camera's optical frame.
pub(crate) fn wall(stamp: Stamp, points: u16) -> PointCloud2 {
    let points_m = (0..points)
        .map(|index| nalgebra::Point3::new(f32::from(index) * 0.01 - 0.5, 0.0, 2.0))
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
