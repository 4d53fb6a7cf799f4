//! Topics for viewers: published only while there are subscribers.

use geometry::{Cloud, LidarCloud, Revolution, Stamp};
use msgs::convert;
use msgs::sensor_msgs::{Image, PointCloud2};
use msgs::std_msgs::Header;
use nalgebra::{Isometry3, Point2, Point3};
use node_shell::{Node, NodeFailure, Publisher, Qos};

use super::output::Frames;
use super::parameters::LidarOdometryParameters;
use crate::drawing::{DrawnTrajectory, DrawnView, drawn};
use crate::odometry::Follower;
use crate::panorama::PanoramaConfig;
use crate::recorded::revolution_from_cloud;

/// A viewer needs the latest alone.
const KEPT: usize = 1;
/// The local map is sent no more often.
const MAP_PERIOD_S: f64 = 1.0;
/// Bytes of a pixel of `rgb8`.
const CHANNELS: usize = 3;

/// The publishers for viewers.
pub(super) struct Pictures {
    panoramas: [(PanoramaConfig, Publisher<Image>); 2],
    about_vehicle: Publisher<Image>,
    whole_drive: Publisher<Image>,
    local_map: Publisher<PointCloud2>,
    scans: Publisher<PointCloud2>,
    local_map_sent: Option<Stamp>,
    edge_px: usize,
    radius_m: f64,
    trajectory: Vec<Isometry3<f64>>,
    most_poses: usize,
}

/// The scan, and its pose.
pub(super) struct Seen<'a> {
    pub(super) cloud: &'a LidarCloud,
    /// The same, where the packets have it.
    pub(super) revolution: Option<&'a Revolution>,
    /// The points as if measured at once, at the pose.
    pub(super) points_m: &'a dyn Fn() -> Vec<Point3<f32>>,
    pub(super) stamp: Stamp,
    pub(super) odom_from_base: Isometry3<f64>,
}

impl Pictures {
    pub(super) fn new(
        node: &Node,
        parameters: &LidarOdometryParameters,
    ) -> Result<Self, NodeFailure> {
        let image = |topic: &str| node.publisher(topic, &Qos::sensor(KEPT));
        let [intensity, range] = parameters.panoramas();
        Ok(Self {
            panoramas: [
                (intensity, image("intensity_panorama")?),
                (range, image("range_panorama")?),
            ],
            about_vehicle: image("drive_from_above")?,
            whole_drive: image("whole_drive")?,
            local_map: node.publisher("local_map", &Qos::reliable(KEPT))?,
            scans: node.publisher("lidar_scan", &Qos::sensor(KEPT))?,
            local_map_sent: None,
            edge_px: parameters.drawing_px,
            radius_m: parameters.drawing_radius_m,
            trajectory: Vec::new(),
            most_poses: parameters.path_poses,
        })
    }

    /// Everything begins anew.
    pub(super) fn forget(&mut self) {
        self.trajectory.clear();
        self.local_map_sent = None;
    }

    /// Publishes what somebody wants; gives whether a panorama was wanted of a cloud without rings.
    pub(super) fn publish(
        &mut self,
        seen: &Seen<'_>,
        follower: &Follower,
        frames: &Frames,
    ) -> bool {
        self.trajectory.push(seen.odom_from_base);
        if self.trajectory.len() > self.most_poses {
            // By a tenth at a time: each pose is moved ten times at most.
            self.trajectory.drain(..self.most_poses.div_ceil(10));
        }
        let lacks_rings = self.publish_panoramas(seen);
        self.publish_drawings(seen, follower, frames);
        self.publish_local_map(seen, follower, frames);
        if self.scans.subscriber_count() > 0 {
            let cloud = Cloud {
                stamp: seen.stamp,
                frame_id: frames.base_frame_id.clone(),
                points_m: moved(&(seen.points_m)(), &frames.base_from_lidar),
            };
            self.scans.publish_or_warn(convert::message_from_cloud(&cloud));
        }
        lacks_rings
    }

    fn publish_panoramas(&self, seen: &Seen<'_>) -> bool {
        if self.panoramas.iter().all(|(_, publisher)| publisher.subscriber_count() == 0) {
            return false;
        }
        let organised;
        let revolution = match seen.revolution {
            Some(revolution) => revolution,
            None => match revolution_from_cloud(seen.cloud) {
                Some(revolution) => {
                    organised = revolution;
                    &organised
                }
                None => return true,
            },
        };
        let header = Header {
            stamp: convert::time_from_stamp(seen.cloud.stamp),
            frame_id: seen.cloud.frame_id.clone(),
        };
        for (config, publisher) in &self.panoramas {
            // The configuration has been checked.
            if publisher.subscriber_count() > 0
                && let Ok(picture) = config.draw(revolution)
            {
                let size_px = (picture.width_px, picture.height_px);
                publisher.publish_or_warn(image(header.clone(), size_px, picture.rgb));
            }
        }
        false
    }

    fn publish_drawings(&self, seen: &Seen<'_>, follower: &Follower, frames: &Frames) {
        for (view, publisher) in [
            (DrawnView::AboutVehicle { radius_m: self.radius_m }, &self.about_vehicle),
            (DrawnView::Whole, &self.whole_drive),
        ] {
            if publisher.subscriber_count() == 0 {
                continue;
            }
            let surroundings_m: Vec<Point2<f32>> = match view {
                DrawnView::AboutVehicle { .. } => {
                    let map = moved(&follower.local_map(), &frames.odom_from_first);
                    map.iter().map(Point3::xy).collect()
                }
                DrawnView::Whole => Vec::new(),
            };
            let trajectory = DrawnTrajectory {
                map_from_vehicle: &self.trajectory,
                truth: None,
                surroundings_m: &surroundings_m,
            };
            let picture = drawn(&trajectory, view, self.edge_px).picture;
            let size_px = (picture.edge_px, picture.edge_px);
            publisher.publish_or_warn(image(frames.header(seen.stamp), size_px, picture.rgb));
        }
    }

    fn publish_local_map(&mut self, seen: &Seen<'_>, follower: &Follower, frames: &Frames) {
        let since_s = |sent: Stamp| seen.stamp.seconds_since(sent);
        let is_due =
            self.local_map_sent.is_none_or(|sent| !(0.0..MAP_PERIOD_S).contains(&since_s(sent)));
        if !is_due || self.local_map.subscriber_count() == 0 {
            return;
        }
        self.local_map_sent = Some(seen.stamp);
        let cloud = Cloud {
            stamp: seen.stamp,
            frame_id: frames.odom_frame_id.clone(),
            points_m: moved(&follower.local_map(), &frames.odom_from_first),
        };
        self.local_map.publish_or_warn(convert::message_from_cloud(&cloud));
    }
}

fn moved(points_m: &[Point3<f32>], target_from_points: &Isometry3<f64>) -> Vec<Point3<f32>> {
    let single: Isometry3<f32> = nalgebra::convert(*target_from_points);
    points_m.iter().map(|point_m| single * point_m).collect()
}

fn image(header: Header, (width, height): (usize, usize), rgb: Vec<u8>) -> Image {
    Image {
        header,
        height: u32::try_from(height).unwrap_or(u32::MAX),
        width: u32::try_from(width).unwrap_or(u32::MAX),
        encoding: "rgb8".to_owned(),
        is_bigendian: 0,
        step: u32::try_from(width * CHANNELS).unwrap_or(u32::MAX),
        data: rgb,
    }
}
