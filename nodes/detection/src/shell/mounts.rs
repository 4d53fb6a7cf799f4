//! The mounts of the sensors, from tf.

use geometry::{
    ExtrinsicsSource, PoseLookupError, RigConfig, RigMounts, Stamp, is_same_mount, pose_vector,
};
use nalgebra::Isometry3;
use node_shell::{Counters, TransformError, TransformTree};

use super::transform_state::TransformState;

/// The name on `/diagnostics`.
const CONDITION: &str = "transform from scanner to camera";

/// The poses of the sensors in the rig frame by tf: of the scanner, whose pose in the camera frame tf has, or of both.
pub(super) struct Mounts {
    /// The rig's frame, where tf has the camera's pose in it, too.
    rig_frame_id: Option<String>,
    by_parameters: RigMounts,
    in_use: Option<RigMounts>,
    state: TransformState,
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
            state: TransformState::new(CONDITION.to_owned(), counters),
        })
    }

    /// The mounts, if they differ from those in use; then [`Mounts::set_in_use`] must be called.
    ///
    /// # Errors
    /// When tf has no transform for the stamp of the camera's message; if all of its transforms are earlier, the latest is
    /// used.
    pub(super) fn changed(
        &mut self,
        tree: &TransformTree,
        frames: SensorFrames<'_>,
    ) -> Result<Option<RigMounts>, TransformError> {
        let known = match self.lookup(tree, frames) {
            Ok(known) => known,
            Err(error) => {
                self.state.wait_for(&error);
                return Err(error);
            }
        };
        if self.in_use.is_some_and(|in_use| is_same(&in_use, &known)) {
            self.report_in_use(frames);
            return Ok(None);
        }
        Ok(Some(known))
    }

    /// Whether tf has the mounts.
    pub(super) fn are_known(&self, tree: &TransformTree, frames: SensorFrames<'_>) -> bool {
        self.lookup(tree, frames).is_ok()
    }

    /// Notes that these mounts are in use.
    pub(super) fn set_in_use(&mut self, mounts: &RigMounts, frames: SensorFrames<'_>) {
        self.in_use = Some(*mounts);
        self.report_in_use(frames);
    }

    fn lookup(
        &self,
        tree: &TransformTree,
        SensorFrames { lidar, camera, stamp }: SensorFrames<'_>,
    ) -> Result<RigMounts, TransformError> {
        let mount = |target: &str, source: &str| hardly_moving(tree, target, source, stamp);
        match &self.rig_frame_id {
            Some(rig) => Ok(RigMounts {
                rig_from_camera: mount(rig, camera)?,
                rig_from_lidar: mount(rig, lidar)?,
            }),
            None => {
                let rig_from_camera = self.by_parameters.rig_from_camera;
                let rig_from_lidar = rig_from_camera * mount(camera, lidar)?;
                Ok(RigMounts { rig_from_camera, rig_from_lidar })
            }
        }
    }

    fn report_in_use(&mut self, SensorFrames { lidar, camera, .. }: SensorFrames<'_>) {
        let Some(mounts) = &self.in_use else { return };
        let of_lidar = vector_text(&mounts.rig_from_lidar);
        let of_camera = match self.rig_frame_id {
            Some(_) => format!(", rig_from_camera {}", vector_text(&mounts.rig_from_camera)),
            None => String::new(),
        };
        let text = format!("{lidar} to {camera} by tf; rig_from_lidar is {of_lidar}{of_camera}");
        self.state.set_known(&text);
    }
}

/// A mount hardly moves, and tf may be received after the cycle is complete: its latest transform will do.
fn hardly_moving(
    tree: &TransformTree,
    target: &str,
    source: &str,
    stamp: Stamp,
) -> Result<Isometry3<f64>, TransformError> {
    match tree.lookup(target, source, stamp) {
        Err(TransformError::Time { source: PoseLookupError::AfterNewest { .. }, .. }) => {
            tree.lookup_latest(target, source)
        }
        known => known,
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

    #[test]
    fn both_mounts_are_those_in_the_frame_of_the_rig() {
        let base_from_camera = Isometry3::new(Vector3::new(0.3, 0.1, 1.1), Vector3::y() * 0.5);
        let base_from_lidar = Isometry3::new(Vector3::new(0.1, 0.0, 0.4), Vector3::z() * 0.2);
        let mut tree = TransformTree::default();
        tree.insert_fixed("base_link", "mast", &Isometry3::translation(0.0, 0.0, 1.0)).unwrap();
        let mast_from_camera = Isometry3::translation(0.0, 0.0, -1.0) * base_from_camera;
        tree.insert_fixed("mast", "camera", &mast_from_camera).unwrap();
        let frames = SensorFrames { lidar: "laser", camera: "camera", stamp: Stamp::default() };
        let rig = RigConfig {
            rig_frame_id: "base_link".to_owned(),
            extrinsics: ExtrinsicsSource::TfFromRig,
            ..RigConfig::default()
        };
        let mut mounts = Mounts::new(&rig, Counters::default()).unwrap();
        assert!(mounts.changed(&tree, frames).unwrap_err().to_string().contains("\"laser\""));
        tree.insert_fixed("base_link", "laser", &base_from_lidar).unwrap();
        let known = mounts.changed(&tree, frames).unwrap().unwrap();
        let expected =
            RigMounts { rig_from_camera: base_from_camera, rig_from_lidar: base_from_lidar };
        assert!(is_same(&known, &expected), "{known:?}");
        mounts.set_in_use(&known, frames);
        assert_eq!(mounts.changed(&tree, frames), Ok(None));
        // The mast is extended.
        tree.insert_fixed("base_link", "mast", &Isometry3::translation(0.0, 0.0, 1.2)).unwrap();
        let known = mounts.changed(&tree, frames).unwrap().unwrap();
        assert!((known.rig_from_camera.translation.z - 1.3).abs() < 1e-9, "{known:?}");
        assert!(Mounts::new(&RigConfig::default(), Counters::default()).is_none());
    }
}
