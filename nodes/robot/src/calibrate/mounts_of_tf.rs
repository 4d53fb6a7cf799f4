//! The mounts of the sensors by a bag's tf: the latest ones, and those of the moments of cycles, between which a joint may move a sensor.

use bag_player::{Bag, Selection};
use geometry::{ExtrinsicsSource, PoseLookupError, RigConfig, RigMounts, Stamp, is_same_mount};
use msgs::tf2_msgs::TFMessage;
use nalgebra::Isometry3;
use node_shell::{TransformError, TransformTree};

use crate::failure::Failure;
use crate::run::inputs::{TF, TF_STATIC};

/// The frames by which tf has the mounts.
pub(crate) struct MountsOfTf<'a> {
    /// Says whether tf has the camera's mount, too.
    pub(crate) rig: &'a RigConfig,
    pub(crate) camera: &'a str,
    pub(crate) scanner: &'a str,
}

impl MountsOfTf<'_> {
    /// Those of the latest transforms.
    ///
    /// # Errors
    /// When tf does not connect the frames.
    pub(crate) fn latest(&self, tree: &TransformTree) -> Result<RigMounts, TransformError> {
        self.by(|target, source| tree.lookup_latest(target, source))
    }

    /// Whether a joint may move a sensor.
    pub(crate) fn are_jointed(&self, tree: &TransformTree) -> bool {
        let is_jointed = |target, source| tree.is_jointed(target, source).unwrap_or(false);
        is_jointed(self.camera, self.scanner)
            || self.has_camera() && is_jointed(&self.rig.rig_frame_id, self.camera)
    }

    /// Those of some moments, in their order; none where tf does not have them.
    ///
    /// # Errors
    /// When the bag cannot be read.
    pub(crate) fn at(
        &self,
        bag: &Bag,
        topics: &[&str],
        stamps: &[Stamp],
    ) -> Result<Vec<Option<RigMounts>>, Failure> {
        let failed = |error: bag_player::BagError| Failure::new(error.to_string());
        let mut tree = TransformTree::default();
        let mut mounts = vec![None; stamps.len()];
        // The fixed ones hold at all times, wherever they were recorded.
        for topic in [TF_STATIC, TF].into_iter().filter(|topic| topics.contains(topic)) {
            let selection =
                Selection { topics: Some(vec![topic.to_owned()]), ..Selection::default() };
            for message in bag.messages(&selection).map_err(failed)? {
                let Ok(message) = message.map_err(failed)?.decode::<TFMessage>() else { continue };
                tree.insert_message(&message, topic == TF_STATIC, |_refused| {});
                let open = mounts.iter_mut().zip(stamps).filter(|(known, _)| known.is_none());
                for (known, stamp) in open {
                    *known = self.of_moment(&tree, *stamp).ok();
                }
            }
        }
        let open = mounts.iter_mut().zip(stamps).filter(|(known, _)| known.is_none());
        for (known, stamp) in open {
            // As in a run, the last ones hold after the end of tf.
            let has_ended = matches!(
                self.of_moment(&tree, *stamp),
                Err(TransformError::Time { source: PoseLookupError::AfterNewest { .. }, .. })
            );
            *known = has_ended.then(|| self.latest(&tree).ok()).flatten();
        }
        Ok(mounts)
    }

    fn of_moment(&self, tree: &TransformTree, stamp: Stamp) -> Result<RigMounts, TransformError> {
        self.by(|target, source| tree.lookup(target, source, stamp))
    }

    fn has_camera(&self) -> bool {
        self.rig.extrinsics == ExtrinsicsSource::TfFromRig
    }

    /// The mounts by the transforms from a source to a target that `transform` gives; that of the camera by the parameters, where these do
    /// not leave it to tf.
    fn by(
        &self,
        transform: impl Fn(&str, &str) -> Result<Isometry3<f64>, TransformError>,
    ) -> Result<RigMounts, TransformError> {
        let rig_from_camera = if self.has_camera() {
            transform(&self.rig.rig_frame_id, self.camera)?
        } else {
            self.rig.mounts().rig_from_camera
        };
        let rig_from_lidar = rig_from_camera * transform(self.camera, self.scanner)?;
        Ok(RigMounts { rig_from_camera, rig_from_lidar })
    }
}

/// Whether the scanner stays where it is relative to the camera.
pub(crate) fn is_one_mount(mounts: &[RigMounts]) -> bool {
    let camera_from_lidar = |one: &RigMounts| one.rig_from_camera.inverse() * one.rig_from_lidar;
    let mut of_moments = mounts.iter().map(camera_from_lidar);
    of_moments.next().is_none_or(|first| of_moments.all(|one| is_same_mount(&first, &one)))
}
