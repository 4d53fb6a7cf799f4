//! Sensors that send without an end, so that a graph runs while something is done to it.

use std::time::{Duration, SystemTime, UNIX_EPOCH};

use geometry::{CameraModel, Distortion, Stamp};
use msgs::convert;
use msgs::geometry_msgs::PoseStamped;
use msgs::sensor_msgs::{CameraInfo, Image, LaserScan, PointCloud2};
use msgs::std_msgs::Header;
use node_shell::{Node, Publisher, Qos, Shutdown};
use tokio::task::JoinHandle;

use crate::bags::{pose, scan, wall};

/// How often the rig's pose is told; all else comes half as often.
const POSE_PERIOD: Duration = Duration::from_millis(50);
/// The images of the camera: small ones, since what is on them plays no part.
const WIDTH_PX: u32 = 160;
const HEIGHT_PX: u32 = 120;

/// A scanner, a depth camera with its cloud and its colour images, and the rig's pose: a wall ahead, and nothing moves.
pub(crate) struct Sensors {
    stop: Shutdown,
    sending: JoinHandle<()>,
}

struct Topics {
    poses: Publisher<PoseStamped>,
    scans: Publisher<LaserScan>,
    clouds: Publisher<PointCloud2>,
    depths: Publisher<Image>,
    colors: Publisher<Image>,
    infos: Publisher<CameraInfo>,
}

impl Sensors {
    /// The sensors that `node` is, from now on.
    pub(crate) fn start(node: Node) -> Self {
        let qos = Qos::sensor(5);
        let topics = Topics {
            poses: node.publisher("pose", &qos).unwrap(),
            scans: node.publisher("scan", &qos).unwrap(),
            clouds: node.publisher("points", &qos).unwrap(),
            depths: node.publisher("depth/image", &qos).unwrap(),
            colors: node.publisher("rgb/image", &qos).unwrap(),
            infos: node.publisher("rgb/camera_info", &qos).unwrap(),
        };
        let stop = Shutdown::new();
        let stopped = stop.clone();
        let sending = tokio::spawn(async move {
            let send = async {
                let mut time = tokio::time::interval(POSE_PERIOD);
                for count in 0_u64.. {
                    time.tick().await;
                    topics.send(count.is_multiple_of(2));
                }
            };
            tokio::select! {
                () = stopped.wait() => {}
                () = send => {}
            }
            drop(topics);
            node.close().await;
        });
        Self { stop, sending }
    }

    pub(crate) async fn end(self) {
        self.stop.trigger();
        self.sending.await.unwrap();
    }
}

impl Topics {
    fn send(&self, whole: bool) {
        let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap();
        let stamp = Stamp::from_nanos(i64::try_from(now.as_nanos()).unwrap());
        self.poses.publish_or_warn(pose(stamp));
        if !whole {
            return;
        }
        let header = Header {
            stamp: convert::time_from_stamp(stamp),
            frame_id: "camera_depth_optical_frame".to_owned(),
        };
        let image = |encoding: &str, bytes_each: u32, value: u8| Image {
            header: header.clone(),
            height: HEIGHT_PX,
            width: WIDTH_PX,
            encoding: encoding.to_owned(),
            step: WIDTH_PX * bytes_each,
            data: vec![value; (WIDTH_PX * HEIGHT_PX * bytes_each) as usize],
            ..Image::default()
        };
        self.infos.publish_or_warn(convert::message_from_camera(
            &camera(),
            stamp,
            "camera_depth_optical_frame",
        ));
        self.colors.publish_or_warn(image("mono8", 1, 128));
        // Two metres, nearly: 8 * 257 mm.
        self.depths.publish_or_warn(image("16UC1", 2, 8));
        self.clouds.publish_or_warn(wall(stamp, 100));
        self.scans.publish_or_warn(scan(stamp, 3.0));
    }
}

fn camera() -> CameraModel {
    CameraModel {
        width_px: WIDTH_PX as usize,
        height_px: HEIGHT_PX as usize,
        fx_px: 140.0,
        fy_px: 140.0,
        cx_px: 80.0,
        cy_px: 60.0,
        distortion: Distortion::None,
    }
}
