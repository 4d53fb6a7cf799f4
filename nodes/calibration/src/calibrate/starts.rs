//! From which headings the calibration starts, and which of the poses that it finds is right.
//!
//! Returns farther from a surface than [`CalibrationConfig::max_offset_m`] pull nowhere, so that a heading a few degrees off
//! may settle on what happens to be near. All surfaces are on the scan with the right mount alone.
//!
//! [`CalibrationConfig::max_offset_m`]: crate::CalibrationConfig::max_offset_m

use nalgebra::Vector6;

use super::{CalibrationError, Problem, Settled};
use crate::constraint::planes_of;

/// The headings beside the given one: in steps as large as any room lets settle, to as far as a mount by eye is off.
const HEADINGS_RAD: [f64; 4] = [-0.052, 0.052, -0.105, 0.105];
/// Another heading leads to another pose when this many times the returns agree with it: three times and more, where the given one is wrong.
const CLEARLY_MORE: f64 = 1.5;
/// This many times as many returns agree as contradict: 5 times and more with the right mount, of a tilted scanner, too; as many or fewer with a wrong one.
const LEAST_RATIO: usize = 2;
/// A return is on a surface when it is within this many of its standard deviations.
const AGREES_STD_DEVS: f64 = 3.0;

/// Whether returns are where the camera sees a surface.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Agreement {
    /// Returns that are.
    pub(super) agree: usize,
    /// Returns where the camera sees one elsewhere.
    pub(super) contradict: usize,
    /// Returns where its pixels scatter too much for a surface.
    pub(super) noisy: usize,
}

impl Agreement {
    /// Whether a mount may be right with which so many agree and contradict.
    pub(super) fn is_enough(self) -> bool {
        self.agree > LEAST_RATIO * self.contradict
    }
}

impl Problem<'_> {
    /// Of the poses that the starts lead to, the one with which the most returns agree; that of the given heading, if no other has
    /// clearly more.
    ///
    /// # Errors
    /// That of the given start, if none settles.
    pub(super) fn best_of_starts(&self) -> Result<(Settled, Agreement), CalibrationError> {
        let given = self.settled_from(Vector6::zeros());
        let mut most = given.as_ref().map_or(0, |(_, agreement)| agreement.agree);
        let mut best_beside = None;
        for yaw_rad in HEADINGS_RAD {
            let start = Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, yaw_rad);
            let Ok((settled, agreement)) = self.settled_from(start) else { continue };
            if agreement.agree as f64 > CLEARLY_MORE * most as f64 {
                most = agreement.agree;
                best_beside = Some(settled.fit.total);
            }
        }
        match best_beside {
            // Once more from there: which returns and coordinates count was decided on the way.
            Some(total) => self.settled_from(total),
            None => given,
        }
    }

    fn settled_from(&self, start: Vector6<f64>) -> Result<(Settled, Agreement), CalibrationError> {
        let settled = self.settle(start)?;
        let agreement = self.agreement(&settled.fit.total);
        Ok((settled, agreement))
    }

    pub(super) fn agreement(&self, total: &Vector6<f64>) -> Agreement {
        let mounts = self.mounts.corrected(total);
        let mut agreement = Agreement { agree: 0, contradict: 0, noisy: 0 };
        for (cycle, is_static) in self.cycles.iter().zip(&self.is_static) {
            let is_static = |place: usize| is_static.get(place).copied().unwrap_or(false);
            let planes = planes_of(
                &cycle.returns,
                is_static,
                &cycle.image,
                self.optics,
                &mounts,
                self.config,
            );
            agreement.noisy += planes.noisy;
            for plane in planes.constraints {
                let distance_m = plane.linearised(&mounts).distance_m.abs();
                if distance_m <= AGREES_STD_DEVS * plane.std_dev_m {
                    agreement.agree += 1;
                } else {
                    agreement.contradict += 1;
                }
            }
        }
        agreement
    }
}
