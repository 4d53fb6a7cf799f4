//! The mount of the scanner, from tf.

use geometry::{
    ExtrinsicsSource, PoseLookupError, Stamp, is_same_mount, pose_from_vector, pose_vector,
};
use nalgebra::Isometry3;
use node_shell::{
    Counters, Node, ShellError, Throttle, TransformArrival, TransformError, TransformListener,
};

use super::DetectionParameters;

/// The cause of a drop: the transform from the scanner to the camera is not known yet.
pub const WAITING_FOR_TRANSFORM: &str = "no transform from the scanner to the camera";

/// The name on `/diagnostics`.
const CONDITION: &str = "transform from scanner to camera";

/// The pose of the scanner in the rig frame, from its pose in the camera frame by tf.
pub(super) struct Mounts {
    listener: TransformListener,
    rig_from_camera: Isometry3<f64>,
    /// The pose in use.
    rig_from_lidar: Option<Isometry3<f64>>,
    changes: StateChanges,
    counters: Counters,
}

impl Mounts {
    /// Subscribes to tf if the parameters say so.
    ///
    /// # Errors
    /// When a subscription fails.
    pub(super) fn new(
        node: &Node,
        parameters: &DetectionParameters,
    ) -> Result<Option<Self>, ShellError> {
        let rig = &parameters.config.pipeline.rig;
        if rig.extrinsics == ExtrinsicsSource::Parameters {
            return Ok(None);
        }
        let counters = node.counters();
        counters.note_condition(CONDITION, "no scan has needed it yet", false);
        Ok(Some(Self {
            listener: TransformListener::new(node)?,
            rig_from_camera: pose_from_vector(&rig.rig_from_camera),
            rig_from_lidar: None,
            changes: StateChanges::default(),
            counters,
        }))
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

    /// The pose of the scanner in the rig, if it differs from the one in use; then [`Mounts::set_in_use`] must be called.
    ///
    /// # Errors
    /// When tf has no transform for the stamp of the camera's message; if all of its transforms are earlier, the latest is
    /// used.
    pub(super) fn changed(
        &mut self,
        lidar_frame: &str,
        (camera_frame, stamp): (&str, Stamp),
    ) -> Result<Option<Isometry3<f64>>, TransformError> {
        let known = match self.listener.lookup(camera_frame, lidar_frame, stamp) {
            // A mount hardly moves, and tf may be received after the cycle is complete.
            Err(TransformError::Time { source: PoseLookupError::AfterNewest { .. }, .. }) => {
                self.listener.lookup_latest(camera_frame, lidar_frame)
            }
            known => known,
        };
        let camera_from_lidar = match known {
            Ok(camera_from_lidar) => camera_from_lidar,
            Err(error) => {
                self.report(&format!("waiting for it: {error}"), true);
                return Err(error);
            }
        };
        let rig_from_lidar = self.rig_from_camera * camera_from_lidar;
        if self.rig_from_lidar.is_some_and(|known| is_same_mount(&known, &rig_from_lidar)) {
            self.report_in_use(lidar_frame, camera_frame);
            return Ok(None);
        }
        Ok(Some(rig_from_lidar))
    }

    /// Notes that this pose of the scanner in the rig is in use.
    pub(super) fn set_in_use(
        &mut self,
        rig_from_lidar: &Isometry3<f64>,
        lidar_frame: &str,
        camera_frame: &str,
    ) {
        self.rig_from_lidar = Some(*rig_from_lidar);
        self.report_in_use(lidar_frame, camera_frame);
    }

    fn report_in_use(&mut self, lidar_frame: &str, camera_frame: &str) {
        let Some(rig_from_lidar) = &self.rig_from_lidar else { return };
        let [x_m, y_m, z_m, yaw_rad, pitch_rad, roll_rad] = pose_vector(rig_from_lidar);
        let text = format!(
            "{lidar_frame} to {camera_frame} by tf; rig_from_lidar is [{x_m:.3}, {y_m:.3}, {z_m:.3}, {yaw_rad:.4}, \
             {pitch_rad:.4}, {roll_rad:.4}]"
        );
        self.report(&text, false);
    }

    /// Reports the state on `/diagnostics`, and changes of it in the log.
    fn report(&mut self, text: &str, is_waiting: bool) {
        let Some(changes) = self.changes.of(text, is_waiting) else { return };
        self.counters.note_condition(CONDITION, text, is_waiting);
        match changes {
            Some(Line::Waits) => tracing::warn!("{CONDITION}: {text}"),
            Some(Line::IsKnown) => tracing::info!("{CONDITION}: {text}"),
            Some(Line::HasChanged { unreported }) => tracing::warn!(
                "{CONDITION}: it has changed, and earlier observations are discarded: {text} ({unreported} more changes since \
                 the last warning)"
            ),
            None => {}
        }
    }
}

/// A line of the log.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Line {
    Waits,
    IsKnown,
    HasChanged { unreported: u64 },
}

/// The last reported state, and which changes of it are logged: those of a transform that keeps changing only at intervals.
struct StateChanges {
    reported: Option<(String, bool)>,
    waits: Throttle,
    known: Throttle,
    changed: Throttle,
}

impl Default for StateChanges {
    fn default() -> Self {
        let [waits, known, changed] = [(); 3].map(|()| Throttle::for_warnings());
        Self { reported: None, waits, known, changed }
    }
}

impl StateChanges {
    /// The line to log for a state; the outer `None` if the state has not changed.
    fn of(&mut self, text: &str, is_waiting: bool) -> Option<Option<Line>> {
        let reported =
            self.reported.as_ref().map(|(text, is_waiting)| (text.as_str(), *is_waiting));
        if reported == Some((text, is_waiting)) {
            return None;
        }
        let line = match (reported, is_waiting) {
            // The text has a time difference, which changes with every scan.
            (Some((_, true)), true) => None,
            (_, true) => self.waits.pass().map(|_| Line::Waits),
            (Some((_, false)), false) => {
                self.changed.pass().map(|unreported| Line::HasChanged { unreported })
            }
            (_, false) => self.known.pass().map(|_| Line::IsKnown),
        };
        self.reported = Some((text.to_owned(), is_waiting));
        Some(line)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mount_that_keeps_changing_is_logged_at_intervals() {
        let mut changes = StateChanges::default();
        assert_eq!(changes.of("no frame", true), Some(Some(Line::Waits)));
        assert_eq!(changes.of("no moment", true), Some(None), "it waits as before");
        assert_eq!(changes.of("at 0", false), Some(Some(Line::IsKnown)));
        assert_eq!(changes.of("at 0", false), None);
        assert_eq!(changes.of("at 1", false), Some(Some(Line::HasChanged { unreported: 0 })));
        for at in ["at 0", "at 1", "at 0"] {
            assert_eq!(changes.of(at, false), Some(None), "reported on /diagnostics only");
        }
        for _ in 0..3 {
            assert_eq!(changes.of("no frame", true), Some(None));
            assert_eq!(changes.of("at 0", false), Some(None));
        }
    }
}
