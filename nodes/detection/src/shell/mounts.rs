//! Where the scanner is, by tf.

use geometry::{
    ExtrinsicsSource, PoseLookupError, Stamp, is_same_mount, pose_from_vector, pose_vector,
};
use nalgebra::Isometry3;
use node_shell::{
    Counters, Node, ShellError, Throttle, TransformArrival, TransformError, TransformListener,
};

use super::DetectionParameters;

/// The cause of a drop: where the scanner is from the camera is not known yet.
pub const WAITING_FOR_TRANSFORM: &str = "no transform from the scanner to the camera";

/// The name on `/diagnostics`.
const CONDITION: &str = "transform from scanner to camera";

/// The pose of the scanner in the rig by what tf says of it in the camera.
pub(super) struct Mounts {
    listener: TransformListener,
    rig_from_camera: Isometry3<f64>,
    /// What is in use.
    rig_from_lidar: Option<Isometry3<f64>>,
    news: News,
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
            news: News::default(),
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

    /// The pose of the scanner in the rig, where it is another than the one in use: [`Mounts::took`] is to follow.
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
        if self.rig_from_lidar.is_some_and(|known| is_same_mount(&known, &rig_from_lidar)) {
            self.tell_in_use(lidar_frame, camera_frame);
            return Ok(None);
        }
        Ok(Some(rig_from_lidar))
    }

    /// The pose of the scanner in the rig is in use from now on.
    pub(super) fn took(
        &mut self,
        rig_from_lidar: &Isometry3<f64>,
        lidar_frame: &str,
        camera_frame: &str,
    ) {
        self.rig_from_lidar = Some(*rig_from_lidar);
        self.tell_in_use(lidar_frame, camera_frame);
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

    /// Tells of how it is on `/diagnostics`, and of what is new in the log.
    fn tell(&mut self, text: &str, is_waiting: bool) {
        let Some(news) = self.news.of(text, is_waiting) else { return };
        self.counters.note_condition(CONDITION, text, is_waiting);
        match news {
            Some(Line::Waits) => tracing::warn!("{CONDITION}: {text}"),
            Some(Line::IsKnown) => tracing::info!("{CONDITION}: {text}"),
            Some(Line::HasChanged { untold }) => tracing::warn!(
                "{CONDITION}: it has changed, and what was seen so far is forgotten: {text} ({untold} more changes since \
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
    HasChanged { untold: u64 },
}

/// What was told last, and what is worth a line. A transform that comes and goes, or wavers, has one now and then.
struct News {
    told: Option<(String, bool)>,
    waits: Throttle,
    known: Throttle,
    changed: Throttle,
}

impl Default for News {
    fn default() -> Self {
        let [waits, known, changed] = [(); 3].map(|()| Throttle::for_warnings());
        Self { told: None, waits, known, changed }
    }
}

impl News {
    /// What to log of it; nothing at all where it is as it was told.
    fn of(&mut self, text: &str, is_waiting: bool) -> Option<Option<Line>> {
        let told = self.told.as_ref().map(|(text, is_waiting)| (text.as_str(), *is_waiting));
        if told == Some((text, is_waiting)) {
            return None;
        }
        let line = match (told, is_waiting) {
            // By how much a moment is missed changes with every scan.
            (Some((_, true)), true) => None,
            (_, true) => self.waits.pass().map(|_| Line::Waits),
            (Some((_, false)), false) => {
                self.changed.pass().map(|untold| Line::HasChanged { untold })
            }
            (_, false) => self.known.pass().map(|_| Line::IsKnown),
        };
        self.told = Some((text.to_owned(), is_waiting));
        Some(line)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mount_that_wavers_is_logged_now_and_then_and_not_with_each_change() {
        let mut news = News::default();
        assert_eq!(news.of("no frame", true), Some(Some(Line::Waits)));
        assert_eq!(news.of("no moment", true), Some(None), "it waits as before");
        assert_eq!(news.of("at 0", false), Some(Some(Line::IsKnown)));
        assert_eq!(news.of("at 0", false), None);
        assert_eq!(news.of("at 1", false), Some(Some(Line::HasChanged { untold: 0 })));
        for at in ["at 0", "at 1", "at 0"] {
            assert_eq!(news.of(at, false), Some(None), "told on /diagnostics alone");
        }
        for _ in 0..3 {
            assert_eq!(news.of("no frame", true), Some(None));
            assert_eq!(news.of("at 0", false), Some(None));
        }
    }
}
