//! Loops: where the odometry's frame is in the map.

use std::sync::Arc;

use estimation::Serial;
use geometry::Stamp;
use msgs::convert;
use msgs::geometry_msgs::PoseStamped;
use msgs::nav_msgs::Path;
use msgs::std_msgs::Header;
use nalgebra::{Isometry3, Point3};
use node_shell::{Counters, Node, NodeFailure, Publisher, Qos, TransformBroadcaster};

use super::BackgroundSearch;
use super::parameters::LidarOdometryParameters;
use crate::loop_closing::{
    InlineSearch, KnownLoops, LoopCloser, LoopClosingConfig, LoopOutcome, LoopSearch, Place,
};

/// The condition in the diagnostics.
const LOOPS: &str = "loops";

/// The searcher for loops. A node may be moved between threads.
pub(super) type Search = Box<dyn LoopSearch + Send + Sync>;

/// Has loops searched for, and publishes the corrections.
pub(super) struct Loops {
    search: Search,
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
        let config = LoopClosingConfig::default();
        let search: Search = if parameters.loop_closing_in_background {
            // One thread: the others are for the scans. Their number changes no loop.
            let closer = LoopCloser::new(config, Arc::new(Serial))?;
            Box::new(BackgroundSearch::new(closer)?)
        } else {
            Box::new(InlineSearch::new(config, parameters.executor())?)
        };
        Self::with(node, parameters, search).map(Some)
    }

    /// With a searcher.
    pub(super) fn with(
        node: &Node,
        parameters: &LidarOdometryParameters,
        search: Search,
    ) -> Result<Self, NodeFailure> {
        let transforms =
            parameters.publish_tf.then(|| TransformBroadcaster::new(node)).transpose()?;
        Ok(Self {
            search,
            map_frame_id: parameters.map_frame_id.clone(),
            odom_frame_id: parameters.odom_frame_id.clone(),
            base_from_lidar: parameters.base_from_lidar(),
            transforms,
            // Late subscribers need it, too.
            paths: node.publisher("map_path", &Qos::latched())?,
            counters: node.counters(),
        })
    }

    pub(super) fn forget(&mut self) {
        self.search.forget();
    }

    /// As of the last scan.
    pub(super) fn known(&self) -> Arc<KnownLoops> {
        self.search.known()
    }

    /// Searches for the place where the vehicle has travelled far enough, and publishes the pose of the odometry's frame. The points are
    /// the scanner's, as if measured at once.
    pub(super) fn take(
        &mut self,
        stamp: Stamp,
        odom_from_base: &Isometry3<f64>,
        points_m: &dyn Fn() -> Vec<Point3<f32>>,
    ) {
        if self.search.wants(odom_from_base) {
            let base_from_lidar = self.base_from_lidar.cast::<f32>();
            let points_m = points_m().iter().map(|point_m| base_from_lidar * point_m).collect();
            let place = Place { stamp, odom_from_vehicle: *odom_from_base, points_m };
            if !self.search.take(place) {
                // The next scan is as good, unless there is never time.
                self.counters.count_drop("keyframes of loop closing: too many wait");
            }
        }
        for answer in self.search.answers() {
            self.report(stamp, &answer.outcome);
        }
        if let Some(transforms) = &self.transforms {
            let map_from_odom = self.search.known().map_from_odom;
            transforms.send(stamp, &self.map_frame_id, &self.odom_frame_id, &map_from_odom);
        }
    }

    fn report(&mut self, stamp: Stamp, outcome: &LoopOutcome) {
        match outcome {
            LoopOutcome::Closed(closed) => {
                let count = self.search.known().closed;
                let text = format!(
                    "{count} closed, the last after {:.0} m: the odometry was off by {:.2} m and {:.2} degrees",
                    closed.travelled_m,
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
        let known = self.search.known();
        let poses = known.keyframes.iter().map(|keyframe| PoseStamped {
            header: header(keyframe.stamp),
            pose: convert::pose_from_isometry(&keyframe.map_from_vehicle),
        });
        self.paths.publish_or_warn(Path { header: header(stamp), poses: poses.collect() });
    }
}
