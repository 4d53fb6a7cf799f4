//! The sensors of the robot that drives: what their drivers would publish, at their stamps.

use std::time::Duration;

use geometry::Stamp;
use msgs::convert;
use msgs::geometry_msgs::PoseStamped;
use msgs::sensor_msgs::{CameraInfo, Image, LaserScan};
use node_shell::{Node, NodeClock, Publisher, Qos};
use robot::Failure;
use simulator::Sample;
use tokio::sync::mpsc;

use super::super::tour::building::{LAP_S, lap};
use super::super::{SENSOR_DEPTH, shell_failure};

/// A sixteenth of a Kinect's pixels: the machine is to soak the suite, not the simulator.
const SIZE_PX: (usize, usize) = (160, 120);
/// Readings that are simulated before their time comes: about two seconds.
const READ_AHEAD: usize = 128;
/// So long after the start the first reading is due.
const LEAD_S: f64 = 2.0;
/// The depth of the topic of poses.
const POSES_DEPTH: usize = 10;

/// Publishes the readings.
pub(super) struct SimulatedRig {
    clock: NodeClock,
    scans: Publisher<LaserScan>,
    images: Publisher<Image>,
    cameras: Publisher<CameraInfo>,
    poses: Publisher<PoseStamped>,
}

impl SimulatedRig {
    /// With the topics of a suite in `namespace`.
    pub(super) fn new(node: &Node, namespace: &str) -> Result<Self, Failure> {
        let topic = |name: &str| format!("{namespace}/{name}");
        let sensor = Qos::sensor(SENSOR_DEPTH);
        Ok(Self {
            clock: node.clock(),
            scans: node.publisher(&topic("scan"), &sensor).map_err(shell_failure)?,
            images: node.publisher(&topic("depth/image"), &sensor).map_err(shell_failure)?,
            cameras: node.publisher(&topic("depth/camera_info"), &sensor).map_err(shell_failure)?,
            poses: node
                .publisher(&topic("pose"), &Qos::reliable(POSES_DEPTH))
                .map_err(shell_failure)?,
        })
    }

    /// Drives lap after lap; returns where that fails.
    pub(super) async fn drive(self) -> Failure {
        let start = self.now().plus_seconds(LEAD_S);
        let (sender, mut samples) = mpsc::channel(READ_AHEAD);
        let simulated = tokio::task::spawn_blocking(move || simulate(start, &sender));
        while let Some(sample) = samples.recv().await {
            let due_s = sample.stamp().seconds_since(self.now());
            if due_s > 0.0 {
                tokio::time::sleep(Duration::from_secs_f64(due_s)).await;
            }
            self.publish(&sample);
        }
        match simulated.await {
            Ok(failure) => failure,
            Err(error) => Failure::new(format!("the simulation failed: {error}")),
        }
    }

    fn now(&self) -> Stamp {
        convert::stamp_from_time(self.clock.now())
    }

    fn publish(&self, sample: &Sample) {
        let _is_sent = match sample {
            Sample::Pose(pose) => self.poses.publish_or_warn(convert::message_from_pose(pose)),
            Sample::Depth { image, .. } => {
                self.images.publish_or_warn(convert::message_from_depth(image))
            }
            Sample::CameraInfo { stamp, frame_id, camera } => {
                let message = convert::message_from_camera(camera, *stamp, frame_id);
                self.cameras.publish_or_warn(message)
            }
            Sample::Scan { scan, .. } => {
                self.scans.publish_or_warn(convert::message_from_scan(scan))
            }
            // The truth, and sensors that the rig does not have.
            _ => true,
        };
    }
}

/// Laps from `start` on, until nobody takes the readings.
fn simulate(start: Stamp, samples: &mpsc::Sender<Sample>) -> Failure {
    for number in 0.. {
        let scenario = lap(number, start.plus_seconds(number as f64 * LAP_S), LAP_S, SIZE_PX);
        let readings = match scenario.samples() {
            Ok(readings) => readings,
            Err(error) => return Failure::new(error.to_string()),
        };
        for sample in readings {
            if samples.blocking_send(sample).is_err() {
                return Failure::new("the run is over");
            }
        }
    }
    Failure::new("the simulation has no further laps")
}
