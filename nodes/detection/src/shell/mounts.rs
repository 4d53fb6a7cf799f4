//! The mounts of the sensors, from tf.

use geometry::{
    ExtrinsicsSource, PoseLookupError, RigConfig, RigMounts, Stamp, is_same_mount, pose_vector,
};
use nalgebra::Isometry3;
use node_shell::{Counters, TransformError, TransformTree};

use super::transform_state::TransformState;

/// The name on `/diagnostics`.
const CONDITION: &str = "transform from scanner to camera";

/// Transforms whose newest one is so much older than the data are not published any more: tf2's own buffer has ten seconds, and who
/// publishes a joint does so at 1 Hz or more.
const ENDED_AFTER_S: f64 = 2.0;

/// The poses of the sensors in the rig frame by tf: of the scanner, whose pose in the camera frame tf has, or of both.
pub(super) struct Mounts {
    /// The rig's frame, where tf has the camera's pose in it, too.
    rig_frame_id: Option<String>,
    by_parameters: RigMounts,
    in_use: Option<RigMounts>,
    /// Whether a joint has moved a sensor.
    have_moved: bool,
    state: TransformState,
}

/// Mounts that differ from those in use.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct ChangedMounts {
    pub(super) mounts: RigMounts,
    /// Whether a joint has moved a sensor; otherwise the mounts of before were others, or wrong.
    pub(super) by_joint: bool,
}

/// The frames and the stamp by which the mounts of a cycle are looked up.
#[derive(Clone, Copy, Debug)]
pub(super) struct SensorFrames<'a> {
    pub(super) lidar: &'a str,
    pub(super) camera: &'a str,
    /// Of the camera's message.
    pub(super) stamp: Stamp,
}

impl Mounts {
    /// Those of tf, if the parameters say so.
    pub(super) fn new(rig: &RigConfig, counters: Counters) -> Option<Self> {
        let rig_frame_id = match rig.extrinsics {
            ExtrinsicsSource::Parameters => return None,
            ExtrinsicsSource::Tf => None,
            ExtrinsicsSource::TfFromRig => Some(rig.rig_frame_id.clone()),
        };
        Some(Self {
            rig_frame_id,
            by_parameters: rig.mounts(),
            in_use: None,
            have_moved: false,
            state: TransformState::new(CONDITION.to_owned(), counters),
        })
    }

    /// The mounts, if they differ from those in use; then [`Mounts::set_in_use`] must be called.
    ///
    /// # Errors
    /// When tf has no transform for the stamp of the camera's message. If all of its transforms are earlier, and the latest
    /// gives the mounts in use, these have not moved and will do.
    pub(super) fn changed(
        &mut self,
        tree: &TransformTree,
        frames: SensorFrames<'_>,
    ) -> Result<Option<ChangedMounts>, TransformError> {
        let mounts = match self.lookup(tree, frames) {
            Ok(known) => known,
            Err(error) => {
                self.state.wait_for(&error);
                return Err(error);
            }
        };
        if self.are_in_use(&mounts) {
            self.report_in_use(frames);
            return Ok(None);
        }
        let by_joint = self.in_use.is_some() && self.are_jointed(tree, frames)?;
        Ok(Some(ChangedMounts { mounts, by_joint }))
    }

    /// Whether tf has the mounts.
    pub(super) fn are_known(&self, tree: &TransformTree, frames: SensorFrames<'_>) -> bool {
        self.lookup(tree, frames).is_ok()
    }

    /// Notes that these mounts are in use.
    pub(super) fn set_in_use(&mut self, changed: &ChangedMounts, frames: SensorFrames<'_>) {
        self.in_use = Some(changed.mounts);
        self.have_moved |= changed.by_joint;
        self.report_in_use(frames);
    }

    fn are_in_use(&self, mounts: &RigMounts) -> bool {
        self.in_use.is_some_and(|in_use| is_same(&in_use, mounts))
    }

    fn lookup(
        &self,
        tree: &TransformTree,
        frames: SensorFrames<'_>,
    ) -> Result<RigMounts, TransformError> {
        let known = self.by(frames, |target, source| tree.lookup(target, source, frames.stamp));
        let Err(error @ TransformError::Time { source: PoseLookupError::AfterNewest { by_s }, .. }) =
            known
        else {
            return known;
        };
        // tf may be received after the cycle is complete. Who moves is waited for, as long as tf goes on.
        let latest = self.by(frames, |target, source| tree.lookup_latest(target, source))?;
        let will_do = self.in_use.is_none() || self.are_in_use(&latest) || by_s > ENDED_AFTER_S;
        if will_do { Ok(latest) } else { Err(error) }
    }

    /// The mounts by the transforms from a source to a target that `transform` gives.
    fn by(
        &self,
        SensorFrames { lidar, camera, .. }: SensorFrames<'_>,
        transform: impl Fn(&str, &str) -> Result<Isometry3<f64>, TransformError>,
    ) -> Result<RigMounts, TransformError> {
        match &self.rig_frame_id {
            Some(rig) => Ok(RigMounts {
                rig_from_camera: transform(rig, camera)?,
                rig_from_lidar: transform(rig, lidar)?,
            }),
            None => {
                let rig_from_camera = self.by_parameters.rig_from_camera;
                let rig_from_lidar = rig_from_camera * transform(camera, lidar)?;
                Ok(RigMounts { rig_from_camera, rig_from_lidar })
            }
        }
    }

    /// Whether a joint may move a sensor.
    fn are_jointed(
        &self,
        tree: &TransformTree,
        SensorFrames { lidar, camera, .. }: SensorFrames<'_>,
    ) -> Result<bool, TransformError> {
        match &self.rig_frame_id {
            Some(rig) => Ok(tree.is_jointed(rig, camera)? || tree.is_jointed(rig, lidar)?),
            None => tree.is_jointed(camera, lidar),
        }
    }

    fn report_in_use(&mut self, SensorFrames { lidar, camera, .. }: SensorFrames<'_>) {
        let Some(mounts) = &self.in_use else { return };
        if self.have_moved {
            // Numbers would be other ones in each cycle.
            self.state.set_known(&format!("{lidar} to {camera} by tf, moved by a joint"));
            return;
        }
        let of_lidar = vector_text(&mounts.rig_from_lidar);
        let of_camera = match self.rig_frame_id {
            Some(_) => format!(", rig_from_camera {}", vector_text(&mounts.rig_from_camera)),
            None => String::new(),
        };
        let text = format!("{lidar} to {camera} by tf; rig_from_lidar is {of_lidar}{of_camera}");
        self.state.set_known(&text);
    }
}

fn is_same(one: &RigMounts, other: &RigMounts) -> bool {
    is_same_mount(&one.rig_from_lidar, &other.rig_from_lidar)
        && is_same_mount(&one.rig_from_camera, &other.rig_from_camera)
}

fn vector_text(pose: &Isometry3<f64>) -> String {
    let [x_m, y_m, z_m, yaw_rad, pitch_rad, roll_rad] = pose_vector(pose);
    format!("[{x_m:.3}, {y_m:.3}, {z_m:.3}, {yaw_rad:.4}, {pitch_rad:.4}, {roll_rad:.4}]")
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;

    fn frames_at(milliseconds: i64) -> SensorFrames<'static> {
        let stamp = Stamp::from_nanos(1_000_000 * milliseconds);
        SensorFrames { lidar: "laser", camera: "camera", stamp }
    }

    fn in_rig(rig_frame_id: &str) -> Mounts {
        let rig = RigConfig {
            rig_frame_id: rig_frame_id.to_owned(),
            extrinsics: ExtrinsicsSource::TfFromRig,
            ..RigConfig::default()
        };
        Mounts::new(&rig, Counters::default()).unwrap()
    }

    #[test]
    fn both_mounts_are_those_in_the_frame_of_the_rig() {
        let base_from_camera = Isometry3::new(Vector3::new(0.3, 0.1, 1.1), Vector3::y() * 0.5);
        let base_from_lidar = Isometry3::new(Vector3::new(0.1, 0.0, 0.4), Vector3::z() * 0.2);
        let mut tree = TransformTree::default();
        tree.insert_fixed("base_link", "mast", &Isometry3::translation(0.0, 0.0, 1.0)).unwrap();
        let mast_from_camera = Isometry3::translation(0.0, 0.0, -1.0) * base_from_camera;
        tree.insert_fixed("mast", "camera", &mast_from_camera).unwrap();
        let (frames, mut mounts) = (frames_at(0), in_rig("base_link"));
        assert!(mounts.changed(&tree, frames).unwrap_err().to_string().contains("\"laser\""));
        tree.insert_fixed("base_link", "laser", &base_from_lidar).unwrap();
        let known = mounts.changed(&tree, frames).unwrap().unwrap();
        let expected =
            RigMounts { rig_from_camera: base_from_camera, rig_from_lidar: base_from_lidar };
        assert!(is_same(&known.mounts, &expected) && !known.by_joint, "{known:?}");
        mounts.set_in_use(&known, frames);
        assert_eq!(mounts.changed(&tree, frames), Ok(None));
        // The mast is extended.
        tree.insert_fixed("base_link", "mast", &Isometry3::translation(0.0, 0.0, 1.2)).unwrap();
        let known = mounts.changed(&tree, frames).unwrap().unwrap();
        assert!((known.mounts.rig_from_camera.translation.z - 1.3).abs() < 1e-9, "{known:?}");
        assert!(!known.by_joint);
        assert!(Mounts::new(&RigConfig::default(), Counters::default()).is_none());
    }
    /// Regression: what was seen was forgotten whenever a joint had moved a sensor, and a moment that tf did not have yet was taken
    /// by the newest transform, which is another one while the joint moves.
    #[test]
    fn a_joint_that_moves_is_waited_for_and_one_at_rest_is_not() {
        let mut tree = TransformTree::default();
        let turn = |tree: &mut TransformTree, milliseconds: i64, yaw_rad: f64| {
            let base_from_head = Isometry3::new(Vector3::zeros(), Vector3::z() * yaw_rad);
            let stamp = frames_at(milliseconds).stamp;
            tree.insert_timed(stamp, "base_link", "head", &base_from_head).unwrap();
        };
        tree.insert_fixed("head", "camera", &Isometry3::identity()).unwrap();
        tree.insert_fixed("base_link", "laser", &Isometry3::identity()).unwrap();
        turn(&mut tree, 0, 0.0);
        let mut mounts = in_rig("base_link");
        let mut take = |tree: &TransformTree, milliseconds: i64| {
            let frames = frames_at(milliseconds);
            let changed = mounts.changed(tree, frames)?;
            if let Some(changed) = &changed {
                mounts.set_in_use(changed, frames);
            }
            Ok::<_, TransformError>(changed.map(|changed| {
                let (.., yaw_rad) = changed.mounts.rig_from_camera.rotation.euler_angles();
                ((yaw_rad * 1e6).round() / 1e6, changed.by_joint)
            }))
        };
        assert_eq!(take(&tree, 30), Ok(Some((0.0, false))), "the first mounts");
        assert_eq!(take(&tree, 130), Ok(None), "at rest");
        turn(&mut tree, 200, 0.1);
        assert!(take(&tree, 230).is_err(), "it moves");
        turn(&mut tree, 300, 0.2);
        assert_eq!(take(&tree, 230), Ok(Some((0.13, true))));
        assert_eq!(take(&tree, 300), Ok(Some((0.2, true))));
        assert_eq!(take(&tree, 330), Ok(None), "it may have come to rest");
        turn(&mut tree, 400, 0.3);
        assert_eq!(take(&tree, 3_000), Ok(Some((0.3, true))), "tf has ended");
    }
}
