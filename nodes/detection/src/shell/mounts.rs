//! Where the scanner is, by tf.

use geometry::{PoseLookupError, Stamp, pose_from_vector, pose_vector};
use nalgebra::Isometry3;
use node_shell::{Counters, Node, ShellError, TransformArrival, TransformError, TransformListener};

use super::{DetectionParameters, ExtrinsicsSource};

/// The cause of a drop: where the scanner is from the camera is not known yet.
pub const WAITING_FOR_TRANSFORM: &str = "no transform from the scanner to the camera";

/// The name on `/diagnostics`.
const CONDITION: &str = "transform from scanner to camera";

/// A mount that has moved by no more than this is the same: a tenth of a scanner's noise, ...
const SAME_M: f64 = 0.001;
/// ... and as much at 1 m.
const SAME_RAD: f64 = 0.001;

/// The pose of the scanner in the rig by what tf says of it in the camera.
pub(super) struct Mounts {
    listener: TransformListener,
    rig_from_camera: Isometry3<f64>,
    /// What is in use.
    rig_from_lidar: Option<Isometry3<f64>>,
    /// What was told of last.
    told: Option<String>,
    counters: Counters,
}

impl Mounts {
    /// Listens to tf where the parameters say so.
    ///
    /// # Errors
    /// When a topic cannot be had.
    pub(super) fn new(
        node: &Node,
        parameters: &DetectionParameters,
    ) -> Result<Option<Self>, ShellError> {
        if parameters.extrinsics == ExtrinsicsSource::Parameters {
            return Ok(None);
        }
        let counters = node.counters();
        counters.note_condition(CONDITION, "no scan has needed it yet", false);
        Ok(Some(Self {
            listener: TransformListener::new(node)?,
            rig_from_camera: pose_from_vector(&parameters.config.rig_from_camera),
            rig_from_lidar: None,
            told: None,
            counters,
        }))
    }

    /// The next message of tf. May be dropped while it waits.
    pub(super) async fn next(&self) -> TransformArrival {
        self.listener.next().await
    }

    /// The next message that is here already.
    pub(super) fn try_next(&self) -> Option<TransformArrival> {
        self.listener.try_next()
    }

    pub(super) fn take(&mut self, arrival: &TransformArrival) {
        self.listener.take(arrival);
    }

    /// Forgets the transforms of moments, as after a jump of the clock.
    pub(super) fn forget_timed(&mut self) {
        self.listener.forget_timed();
    }

    /// The pose of the scanner in the rig, where it is another than before.
    ///
    /// # Errors
    /// When tf does not tell it for the moment of the camera's message; where it tells of earlier moments only, the
    /// latest counts.
    pub(super) fn changed(
        &mut self,
        lidar_frame: &str,
        (camera_frame, stamp): (&str, Stamp),
    ) -> Result<Option<Isometry3<f64>>, TransformError> {
        let known = match self.listener.lookup(camera_frame, lidar_frame, stamp) {
            // A mount hardly moves, and tf may be told later than the cycle is put together.
            Err(TransformError::Time { source: PoseLookupError::AfterNewest { .. }, .. }) => {
                self.listener.lookup_latest(camera_frame, lidar_frame)
            }
            known => known,
        };
        let camera_from_lidar = match known {
            Ok(camera_from_lidar) => camera_from_lidar,
            Err(error) => {
                self.tell(&format!("waiting for it: {error}"), true);
                return Err(error);
            }
        };
        let rig_from_lidar = self.rig_from_camera * camera_from_lidar;
        if self.rig_from_lidar.is_some_and(|known| is_same(&known, &rig_from_lidar)) {
            self.tell_in_use(lidar_frame, camera_frame);
            return Ok(None);
        }
        if self.rig_from_lidar.is_some() {
            tracing::warn!("{CONDITION}: it has changed; what was seen so far is forgotten");
        }
        self.rig_from_lidar = Some(rig_from_lidar);
        self.tell_in_use(lidar_frame, camera_frame);
        Ok(Some(rig_from_lidar))
    }

    fn tell_in_use(&mut self, lidar_frame: &str, camera_frame: &str) {
        let Some(rig_from_lidar) = &self.rig_from_lidar else { return };
        let [x_m, y_m, z_m, yaw_rad, pitch_rad, roll_rad] = pose_vector(rig_from_lidar);
        let text = format!(
            "{lidar_frame} to {camera_frame} by tf; rig_from_lidar is [{x_m:.3}, {y_m:.3}, {z_m:.3}, {yaw_rad:.4}, \
             {pitch_rad:.4}, {roll_rad:.4}]"
        );
        self.tell(&text, false);
    }

    /// Tells of what is new in the log, and of how it is on `/diagnostics`.
    fn tell(&mut self, text: &str, is_warning: bool) {
        if self.told.as_deref() == Some(text) {
            return;
        }
        self.counters.note_condition(CONDITION, text, is_warning);
        // Each new cause is told once; by how much a moment is missed changes with every scan.
        let was_waiting = self.told.as_ref().is_some_and(|told| told.starts_with("waiting"));
        if !(is_warning && was_waiting) {
            if is_warning {
                tracing::warn!("{CONDITION}: {text}");
            } else {
                tracing::info!("{CONDITION}: {text}");
            }
        }
        self.told = Some(text.to_owned());
    }
}

fn is_same(a: &Isometry3<f64>, b: &Isometry3<f64>) -> bool {
    (a.translation.vector - b.translation.vector).norm() <= SAME_M
        && a.rotation.angle_to(&b.rotation) <= SAME_RAD
}
