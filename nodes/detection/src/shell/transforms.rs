//! What tf gives of a cycle: the mounts of the sensors, the pose of the rig, or both.

use geometry::{ExtrinsicsSource, Stamp, StampedPose};
use node_shell::{Node, ShellError, TransformArrival, TransformError, TransformListener};

use super::inputs::PoseMessage;
use super::mounts::{ChangedMounts, Mounts, SensorFrames};
use super::rig_pose::{TfPose, UnusablePoseMessage, pose_of_message};
use super::{DetectionParameters, PoseInput};

/// The cause of a drop: tf does not have what a cycle needs of it.
pub const WAITING_FOR_TRANSFORM: &str = "a transform is missing";

/// The transforms of the graph, and what the node needs of them.
pub(super) struct Transforms {
    listener: TransformListener,
    mounts: Option<Mounts>,
    pose: Option<TfPose>,
    /// The rig's frame, where it is one of tf.
    rig_frame_id: Option<String>,
}

impl Transforms {
    /// Subscribes to tf if the parameters need it.
    ///
    /// # Errors
    /// When a subscription fails.
    pub(super) fn new(
        node: &Node,
        parameters: &DetectionParameters,
    ) -> Result<Option<Self>, ShellError> {
        if !parameters.needs_tf() {
            return Ok(None);
        }
        let rig = &parameters.config.pipeline.rig;
        let mounts = Mounts::new(rig, node.counters());
        let pose = TfPose::new(parameters, node.counters());
        let is_rig_in_tf = parameters.pose_source == PoseInput::Tf
            || rig.extrinsics == ExtrinsicsSource::TfFromRig;
        let rig_frame_id = is_rig_in_tf.then(|| rig.rig_frame_id.clone());
        let listener = TransformListener::new(node)?;
        Ok(Some(Self { listener, mounts, pose, rig_frame_id }))
    }

    /// The next message of tf. May be dropped while it waits.
    pub(super) async fn next(&self) -> TransformArrival {
        self.listener.next().await
    }

    /// The next message, if one has arrived.
    pub(super) fn try_next(&self) -> Option<TransformArrival> {
        self.listener.try_next()
    }

    pub(super) fn take(&mut self, arrival: &TransformArrival) {
        self.listener.take(arrival);
    }

    /// Forgets the timed transforms, as after a jump of the clock.
    pub(super) fn forget_timed(&mut self) {
        self.listener.forget_timed();
    }

    /// Whether tf has all that is needed of it for a cycle.
    pub(super) fn has_all(&self, frames: SensorFrames<'_>) -> bool {
        let tree = self.listener.tree();
        self.mounts.as_ref().is_none_or(|mounts| mounts.are_known(tree, frames))
            && self.pose.as_ref().is_none_or(|pose| pose.is_known(tree, frames.stamp))
    }

    /// [`Mounts::changed`].
    ///
    /// # Errors
    /// When tf does not have them.
    pub(super) fn changed_mounts(
        &mut self,
        frames: SensorFrames<'_>,
    ) -> Result<Option<ChangedMounts>, TransformError> {
        let mounts = self.mounts.as_mut();
        mounts.map_or(Ok(None), |mounts| mounts.changed(self.listener.tree(), frames))
    }

    /// [`Mounts::set_in_use`].
    pub(super) fn set_in_use(&mut self, changed: &ChangedMounts, frames: SensorFrames<'_>) {
        if let Some(known) = &mut self.mounts {
            known.set_in_use(changed, frames);
        }
    }

    /// The pose of the rig; `None` if poses are messages.
    ///
    /// # Errors
    /// When tf does not have it for this moment, or not yet.
    pub(super) fn pose_at(&mut self, stamp: Stamp) -> Result<Option<StampedPose>, TransformError> {
        self.pose.as_mut().map(|pose| pose.at(self.listener.tree(), stamp)).transpose()
    }

    /// [`pose_of_message`] with these transforms.
    ///
    /// # Errors
    /// As there.
    pub(super) fn pose_of_message(
        &self,
        message: &PoseMessage,
    ) -> Result<StampedPose, UnusablePoseMessage> {
        let rig = self.rig_frame_id.as_deref();
        pose_of_message(message, rig.map(|rig| (self.listener.tree(), rig)))
    }
}
