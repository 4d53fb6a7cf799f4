//! Loops: where the odometry's frame is in the map.

use geometry::Stamp;
use msgs::convert;
use msgs::geometry_msgs::PoseStamped;
use msgs::nav_msgs::Path;
use msgs::std_msgs::Header;
use nalgebra::{Isometry3, Point3};
use node_shell::{Counters, Node, NodeFailure, Publisher, Qos, TransformBroadcaster};

use super::parameters::LidarOdometryParameters;
use crate::loop_closing::{LoopCloser, LoopClosingConfig, LoopOutcome};

/// The condition in the diagnostics.
const LOOPS: &str = "loops";

/// Finds loops, and tells what they lead to.
pub(super) struct Loops {
    closer: LoopCloser,
    map_frame_id: String,
    odom_frame_id: String,
    base_from_lidar: Isometry3<f64>,
    transforms: Option<TransformBroadcaster>,
    paths: Publisher<Path>,
    counters: Counters,
}

impl Loops {
    /// `None` where none are to be closed.
    pub(super) fn new(
        node: &Node,
        parameters: &LidarOdometryParameters,
    ) -> Result<Option<Self>, NodeFailure> {
        if !parameters.loop_closing {
            return Ok(None);
        }
        let transforms =
            parameters.publish_tf.then(|| TransformBroadcaster::new(node)).transpose()?;
        Ok(Some(Self {
            closer: LoopCloser::new(LoopClosingConfig::default(), parameters.thread_count())?,
            map_frame_id: parameters.map_frame_id.clone(),
            odom_frame_id: parameters.odom_frame_id.clone(),
            base_from_lidar: parameters.base_from_lidar(),
            transforms,
            // Whoever comes later still needs it.
            paths: node.publisher("map_path", &Qos::latched())?,
            counters: node.counters(),
        }))
    }

    pub(super) fn forget(&mut self) {
        self.closer.forget();
    }

    pub(super) fn closer(&self) -> &LoopCloser {
        &self.closer
    }

    /// Looks for a loop where the vehicle has gone far enough, and tells where the odometry's frame is. The points are the
    /// scanner's, as if measured at once.
    pub(super) fn take(
        &mut self,
        stamp: Stamp,
        odom_from_base: &Isometry3<f64>,
        points_m: &dyn Fn() -> Vec<Point3<f32>>,
    ) {
        if self.closer.wants(odom_from_base) {
            let base_from_lidar = self.base_from_lidar.cast::<f32>();
            let points_m: Vec<Point3<f32>> =
                points_m().iter().map(|point_m| base_from_lidar * point_m).collect();
            let outcome = self.closer.take(stamp, odom_from_base, &points_m);
            self.tell(stamp, &outcome);
        }
        if let Some(transforms) = &self.transforms {
            let map_from_odom = self.closer.map_from_odom();
            transforms.send(stamp, &self.map_frame_id, &self.odom_frame_id, &map_from_odom);
        }
    }

    fn tell(&mut self, stamp: Stamp, outcome: &LoopOutcome) {
        match outcome {
            LoopOutcome::Closed(closed) => {
                let count = self.closer.closed_loops();
                let text = format!(
                    "{count} closed, the last after {:.0} m: the odometry was off by {:.2} m and {:.2} degrees",
                    closed.way_m,
                    closed.gap_m,
                    closed.gap_rad.to_degrees()
                );
                tracing::info!("loops: {text}");
                self.counters.note_condition(LOOPS, &text, false);
                self.publish_path(stamp);
            }
            LoopOutcome::Refused(reason) => tracing::debug!("no loop: {reason}"),
            LoopOutcome::Unconfirmed => tracing::debug!("a loop waits for another one"),
            LoopOutcome::TooNear | LoopOutcome::NewPlace => {}
        }
    }

    /// The keyframes in the map.
    fn publish_path(&self, stamp: Stamp) {
        let header = |stamp| Header {
            stamp: convert::time_from_stamp(stamp),
            frame_id: self.map_frame_id.clone(),
        };
        let poses = self.closer.keyframes().map(|keyframe| PoseStamped {
            header: header(keyframe.stamp),
            pose: convert::pose_from_isometry(&keyframe.map_from_vehicle),
        });
        self.paths.publish_or_warn(Path { header: header(stamp), poses: poses.collect() });
    }
}
