//! The pose of the rig, from the source that the parameters name.

use geometry::{PoseLookupError, Stamp, StampedPose};
use msgs::convert::{self, ConvertError};
use node_shell::{Counters, TransformError, TransformTree};

use super::inputs::PoseMessage;
use super::transform_state::TransformState;
use super::{DetectionParameters, PoseInput};

/// A received pose is of no use.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
pub(super) enum UnusablePoseMessage {
    /// Its numbers are no pose.
    #[error(transparent)]
    Malformed(#[from] ConvertError),
    /// It is of another frame than the rig's, and tf does not connect the two.
    #[error("it is the pose of {child:?}, and the rig is {rig:?}: {source}")]
    OtherFrame {
        /// The frame whose pose it is.
        child: String,
        /// The rig's frame.
        rig: String,
        /// Why it cannot be carried over.
        source: Box<TransformError>,
    },
}

/// The pose of a message, of the rig. An odometry names the frame whose pose it gives: where tf has the rig's frame (`tree`,
/// `rig_frame_id`), the pose is carried over to it; otherwise it is taken as that of the rig.
pub(super) fn pose_of_message(
    message: &PoseMessage,
    rig_in_tf: Option<(&TransformTree, &str)>,
) -> Result<StampedPose, UnusablePoseMessage> {
    let odometry = match message {
        PoseMessage::Pose(message) => return Ok(convert::pose_from_message(message)?),
        PoseMessage::WithCovariance(message) => {
            return Ok(convert::pose_from_covariance_message(message)?);
        }
        PoseMessage::Odometry(message) => message,
    };
    let mut pose = convert::pose_from_odometry(odometry)?;
    if let Some((tree, rig)) = rig_in_tf
        && !odometry.child_frame_id.is_empty()
        && odometry.child_frame_id != rig
    {
        let child = &odometry.child_frame_id;
        let child_from_rig = tree.lookup_latest(child, rig).map_err(|source| {
            let (child, rig) = (child.clone(), rig.to_owned());
            UnusablePoseMessage::OtherFrame { child, rig, source: Box::new(source) }
        })?;
        pose.map_from_rig *= child_from_rig;
    }
    Ok(pose)
}

/// The pose of the rig by tf, at the stamp of a camera's message.
pub(super) struct TfPose {
    map_frame_id: String,
    rig_frame_id: String,
    state: TransformState,
}

impl TfPose {
    /// That of the parameters; none if poses are messages.
    pub(super) fn new(parameters: &DetectionParameters, counters: Counters) -> Option<Self> {
        let rig_frame_id = parameters.config.pipeline.rig.rig_frame_id.clone();
        (parameters.pose_source == PoseInput::Tf).then(|| Self {
            map_frame_id: parameters.map_frame_id.clone(),
            rig_frame_id,
            state: TransformState::new("transform from rig to map".to_owned(), counters),
        })
    }

    /// Whether tf has the pose of a moment.
    pub(super) fn is_known(&self, tree: &TransformTree, stamp: Stamp) -> bool {
        tree.lookup(&self.map_frame_id, &self.rig_frame_id, stamp).is_ok()
    }

    /// The pose of a moment.
    ///
    /// # Errors
    /// When tf does not have it, or not yet.
    pub(super) fn at(
        &mut self,
        tree: &TransformTree,
        stamp: Stamp,
    ) -> Result<StampedPose, TransformError> {
        let Self { map_frame_id, rig_frame_id, state } = self;
        match tree.lookup(map_frame_id, rig_frame_id, stamp) {
            Ok(map_from_rig) => {
                state.set_known(&format!("{rig_frame_id} in {map_frame_id} by tf"));
                Ok(StampedPose { stamp, frame_id: map_frame_id.clone(), map_from_rig })
            }
            Err(error) => {
                // A localisation is later than its sensors: it is waited for in each cycle.
                let is_late =
                    |cause: &PoseLookupError| matches!(cause, PoseLookupError::AfterNewest { .. });
                if !matches!(&error, TransformError::Time { source, .. } if is_late(source)) {
                    state.wait_for(&error);
                }
                Err(error)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use msgs::geometry_msgs::PoseWithCovarianceStamped;
    use msgs::nav_msgs::Odometry;
    use nalgebra::{Isometry3, Vector3};

    use super::*;

    fn pose(x_m: f64, yaw_rad: f64) -> Isometry3<f64> {
        Isometry3::new(Vector3::new(x_m, 0.0, 0.0), Vector3::z() * yaw_rad)
    }

    fn stamped(map_from_rig: Isometry3<f64>) -> StampedPose {
        StampedPose {
            stamp: Stamp::from_secs_nanos(3, 0),
            frame_id: "odom".to_owned(),
            map_from_rig,
        }
    }

    fn odometry(child: &str, map_from_child: Isometry3<f64>) -> PoseMessage {
        let message = convert::message_from_pose(&stamped(map_from_child));
        let mut odometry = Odometry { header: message.header, ..Odometry::default() };
        odometry.child_frame_id = child.to_owned();
        odometry.pose.pose = message.pose;
        PoseMessage::Odometry(Arc::new(odometry))
    }

    #[track_caller]
    fn assert_near(found: &StampedPose, expected: &Isometry3<f64>) {
        let apart = found.map_from_rig.inv_mul(expected);
        assert!(apart.translation.vector.norm() + apart.rotation.angle() < 1e-9, "{found:?}");
        assert_eq!((found.stamp, found.frame_id.as_str()), (Stamp::from_secs_nanos(3, 0), "odom"));
    }

    #[test]
    fn each_kind_of_message_has_the_same_pose() {
        let message = convert::message_from_pose(&stamped(pose(1.0, 0.5)));
        let mut with_covariance =
            PoseWithCovarianceStamped { header: message.header.clone(), ..Default::default() };
        with_covariance.pose.pose = message.pose;
        for message in [
            PoseMessage::Pose(Arc::new(message)),
            PoseMessage::WithCovariance(Arc::new(with_covariance)),
            odometry("base_link", pose(1.0, 0.5)),
        ] {
            assert_near(&pose_of_message(&message, None).unwrap(), &pose(1.0, 0.5));
        }
    }

    #[test]
    fn an_odometry_of_another_frame_is_carried_over_to_the_rig() {
        let mut tree = TransformTree::default();
        tree.insert_fixed("base_footprint", "base_link", &pose(0.2, 0.0)).unwrap();
        let rig = Some((&tree, "base_link"));
        let map_from_footprint = pose(1.0, 1.5);
        let found = pose_of_message(&odometry("base_footprint", map_from_footprint), rig).unwrap();
        assert_near(&found, &(map_from_footprint * pose(0.2, 0.0)));
        let found = pose_of_message(&odometry("base_link", map_from_footprint), rig).unwrap();
        assert_near(&found, &map_from_footprint);
        let found = pose_of_message(&odometry("", map_from_footprint), rig).unwrap();
        assert_near(&found, &map_from_footprint);
        let unknown = pose_of_message(&odometry("wheel", pose(0.0, 0.0)), rig).unwrap_err();
        let text = unknown.to_string();
        assert!(text.contains("\"wheel\"") && text.contains("\"base_link\""), "{text}");
    }
}
