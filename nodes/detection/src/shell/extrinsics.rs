//! The running check of the mounts.

#[cfg(test)]
mod tests;

use calibration::{
    CalibrationConfig, DepthOptics, DriftConfig, DriftMonitor, Extrinsics, returns_of,
};
use geometry::{DepthImage, ParameterError, RigMounts, Scan, Stamp};
use nalgebra::Isometry3;
use node_shell::{Counters, Throttle};

use super::{CloudInput, DetectionParameters};

/// The name of the check on `/diagnostics`.
const CONDITION: &str = "extrinsics";
/// If the platform moves farther than this from a cycle to the next, the scan and the image are of different positions and
/// the cycle is left out: less than half of the limit, ...
const STILL_M: f64 = 0.02;
/// ... and less than half of it at 4 m.
const STILL_RAD: f64 = 0.005;
/// The motion is not computed from poses farther apart in time.
const MAX_CYCLE_GAP_S: f64 = 1.0;

/// Checks periodically whether the scan lies on the surfaces that the camera sees.
pub(super) struct ExtrinsicsCheck {
    monitor: DriftMonitor,
    pub(super) mounts: RigMounts,
    period_s: f64,
    /// The stamp of the last checked scan.
    looked: Option<Stamp>,
    /// The previous scan's stamp and the pose of the rig.
    before: Option<(Stamp, Isometry3<f64>)>,
    counters: Counters,
    warned: Throttle,
}

impl ExtrinsicsCheck {
    /// The check of the parameters, of the mounts that detection uses; none if it is turned off.
    ///
    /// # Errors
    /// When a parameter is out of its range.
    pub(super) fn new(
        parameters: &DetectionParameters,
        mounts: &RigMounts,
        counters: Counters,
    ) -> Result<Option<Self>, ParameterError> {
        let (period_s, limit_m) =
            (parameters.extrinsics_check_period_s, parameters.extrinsics_limit_m);
        parameters.validate()?;
        if period_s == 0.0 {
            counters.note_condition(CONDITION, "not checked: turned off", false);
            return Ok(None);
        }
        if parameters.input == CloudInput::Points {
            counters.note_condition(
                CONDITION,
                "not checked: clouds are not, depth images are",
                false,
            );
            return Ok(None);
        }
        counters.note_condition(CONDITION, "not known yet", false);
        let drift = DriftConfig { limit_m, ..DriftConfig::default() };
        Ok(Some(Self {
            monitor: DriftMonitor::new(drift, CalibrationConfig::default()),
            mounts: *mounts,
            period_s,
            looked: None,
            before: None,
            counters,
            warned: Throttle::for_warnings(),
        }))
    }

    /// Takes a cycle, and checks it if it is time and the platform is at rest.
    pub(super) fn look(
        &mut self,
        scan: &Scan,
        image: &DepthImage,
        optics: DepthOptics<'_>,
        map_from_rig: &Isometry3<f64>,
    ) -> Option<Extrinsics> {
        let before = self.before.replace((scan.stamp, *map_from_rig));
        let is_due =
            self.looked.is_none_or(|looked| scan.stamp.seconds_since(looked) >= self.period_s);
        if !is_due || !before.is_some_and(|before| is_still(before, (scan.stamp, *map_from_rig))) {
            return None;
        }
        self.looked = Some(scan.stamp);
        let returns = returns_of(scan, |_| Some(Isometry3::identity()));
        let verdict = self.monitor.observe(&returns, image, optics, &self.mounts);
        self.report(&verdict);
        Some(verdict)
    }

    /// Takes other mounts, and resets the check.
    pub(super) fn mount(&mut self, mounts: &RigMounts) {
        self.mounts = *mounts;
        self.forget();
    }

    /// Resets the check, as after a jump of the clock.
    pub(super) fn forget(&mut self) {
        self.monitor.clear();
        self.looked = None;
        self.before = None;
    }

    fn report(&self, verdict: &Extrinsics) {
        let text = verdict.to_string();
        self.counters.note_condition(CONDITION, &text, verdict.is_wrong());
        if verdict.is_wrong()
            && let Some(held_back) = self.warned.pass()
        {
            tracing::warn!("{CONDITION}: {text} ({held_back} more since the last warning)");
        }
    }
}

/// Whether the platform has hardly moved from one cycle to the next.
fn is_still(
    (before, there): (Stamp, Isometry3<f64>),
    (stamp, here): (Stamp, Isometry3<f64>),
) -> bool {
    let gap_s = stamp.seconds_since(before);
    let way_m = (here.translation.vector - there.translation.vector).norm();
    (0.0..MAX_CYCLE_GAP_S).contains(&gap_s)
        && way_m < STILL_M
        && here.rotation.angle_to(&there.rotation) < STILL_RAD
}
