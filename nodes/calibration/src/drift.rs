//! The running check: is the scan of the last seconds still on the surfaces that the camera sees?
//!
//! The distances themselves scatter by more than a knocked scanner moves them, so what is judged is the correction
//! that would make them small, over a window of cycles: how far it would move the returns, and how sure that is. Who
//! walks through is a share of outliers to it, and noise makes it unsure, not large.

#[cfg(test)]
mod tests;

use std::collections::VecDeque;
use std::fmt;

use geometry::DepthImage;
use nalgebra::{Matrix6, Vector6};

use crate::calibrate::RigMounts;
use crate::config::CalibrationConfig;
use crate::constraint::{Kind, constraints_of};
use crate::fit::{Fit, Observation, fit};
use crate::optics::DepthOptics;
use crate::returns::LidarReturn;

/// The offset must exceed the limit by this many standard deviations: once in 700 windows by chance, were the errors
/// normal, and twice in a row hardly ever.
const STD_DEVS: f64 = 3.0;

/// When the check speaks up.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct DriftConfig {
    /// The returns may be this far from the surfaces, as the root mean square.
    pub limit_m: f64,
    /// Cycles that are judged together.
    pub window_cycles: usize,
    /// This many windows in a row must be beyond the limit.
    pub windows_in_a_row: usize,
    /// A window with fewer returns on surfaces is not used.
    pub min_returns: usize,
}

impl Default for DriftConfig {
    fn default() -> Self {
        Self {
            // The least that the thesis' tolerance of 1 degree covers (Rec-HV 3.4.1: 2 to 6 cm), and half the depth
            // of a voxel less its noise: farther off, zones miss their objects.
            limit_m: 0.03,
            // Five seconds at one cycle a second: long against a step of somebody who passes.
            window_cycles: 5,
            windows_in_a_row: 2,
            // Half of the beams that a Kinect shares with the scanner, once in the window.
            min_returns: 30,
        }
    }
}

/// How the scanner's pose is.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Extrinsics {
    /// Too few cycles yet, or too little in them that both sensors see.
    Unknown {
        /// Returns on surfaces in the window.
        returns: usize,
    },
    /// There are enough returns, but they do not determine where the scanner is.
    Undetermined {
        /// Returns on surfaces in the window.
        returns: usize,
    },
    /// The scan may lie on the surfaces or beside them: the offset and its standard deviation exceed the limit together.
    Uncertain {
        /// By how much it seems to lie beside them.
        offset_m: f64,
        /// The standard deviation of that.
        std_dev_m: f64,
        /// By how much it may.
        limit_m: f64,
    },
    /// The scan lies on the surfaces.
    Right {
        /// By how much it seems to lie beside them.
        offset_m: f64,
        /// The standard deviation of that.
        std_dev_m: f64,
        /// By how much it may.
        limit_m: f64,
    },
    /// The scan lies beside the surfaces.
    Wrong {
        /// The offset.
        offset_m: f64,
        /// The standard deviation of that.
        std_dev_m: f64,
        /// By how much it may.
        limit_m: f64,
    },
}

impl Extrinsics {
    /// Whether the scanner must be calibrated again.
    #[must_use]
    pub fn is_wrong(&self) -> bool {
        matches!(self, Self::Wrong { .. })
    }
}

impl fmt::Display for Extrinsics {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unknown { returns } => write!(
                formatter,
                "not known: too few cycles, or too few returns on surfaces that the camera sees ({returns})"
            ),
            Self::Undetermined { returns } => write!(
                formatter,
                "not known: the {returns} returns on surfaces that the camera sees do not determine it"
            ),
            Self::Uncertain { offset_m, std_dev_m, limit_m } => write!(
                formatter,
                "not known: the scan lies {offset_m:.3} m (+- {std_dev_m:.3}) beside the surfaces that the camera sees, which is not \
                 certainly within the limit of {limit_m} m"
            ),
            Self::Right { offset_m, std_dev_m, limit_m } => write!(
                formatter,
                "ok: the scan lies {offset_m:.3} m (+- {std_dev_m:.3}) beside the surfaces that the camera sees \
                 (limit {limit_m} m)"
            ),
            Self::Wrong { offset_m, limit_m, .. } => write!(
                formatter,
                "the scan lies {offset_m:.2} m beside the surfaces that the camera sees (limit {limit_m} m): \
                 calibrate anew with stillmap calibrate"
            ),
        }
    }
}

/// Watches the scanner's pose, a cycle now and then.
#[derive(Clone, Debug)]
pub struct DriftMonitor {
    config: DriftConfig,
    calibration: CalibrationConfig,
    window: VecDeque<Vec<Observation>>,
    beyond_in_a_row: usize,
    is_wrong: bool,
}

impl DriftMonitor {
    /// A monitor that has seen nothing yet.
    #[must_use]
    pub fn new(config: DriftConfig, calibration: CalibrationConfig) -> Self {
        let window = VecDeque::new();
        Self { config, calibration, window, beyond_in_a_row: 0, is_wrong: false }
    }

    /// Forgets what it has seen.
    pub fn clear(&mut self) {
        *self = Self::new(self.config, self.calibration);
    }

    /// Takes a cycle in, and judges the window.
    pub fn observe(
        &mut self,
        returns: &[LidarReturn],
        image: &DepthImage,
        optics: DepthOptics<'_>,
        mounts: &RigMounts,
    ) -> Extrinsics {
        let constraints =
            constraints_of(returns, |_| true, image, optics, mounts, &self.calibration);
        let observations = constraints
            .iter()
            .map(|constraint| Observation {
                linearised: constraint.linearised(mounts),
                std_dev_m: constraint.std_dev_m,
                normal_std_dev_rad: constraint.surface.normal_std_dev_rad,
                // Planes and edges of a beam apart.
                group: 2 * constraint.beam + usize::from(constraint.kind == Kind::Edge),
            })
            .collect();
        self.window.push_back(observations);
        while self.window.len() > self.config.window_cycles.max(1) {
            self.window.pop_front();
        }
        self.judge()
    }

    fn judge(&mut self) -> Extrinsics {
        let observations: Vec<Observation> = self.window.iter().flatten().copied().collect();
        let returns = observations.len();
        let is_full = self.window.len() >= self.config.window_cycles;
        let nothing_applied = Vector6::zeros();
        let fit = fit(&observations, &nothing_applied, [false; 6], &self.calibration);
        let is_enough = is_full && returns >= self.config.min_returns;
        let Some(fit) = fit.filter(|_| is_enough) else {
            self.beyond_in_a_row = 0;
            self.is_wrong = false;
            return if is_enough {
                Extrinsics::Undetermined { returns }
            } else {
                Extrinsics::Unknown { returns }
            };
        };
        let (offset_m, std_dev_m) = offset_of(&fit, &observations);
        let limit_m = self.config.limit_m;
        if offset_m - STD_DEVS * std_dev_m > limit_m {
            self.beyond_in_a_row += 1;
        } else {
            self.beyond_in_a_row = 0;
        }
        // A wrong mounting counts as right again only well within the limit: no flicker at the border.
        let stays_wrong = self.is_wrong && offset_m + STD_DEVS * std_dev_m > limit_m;
        self.is_wrong = stays_wrong || self.beyond_in_a_row >= self.config.windows_in_a_row;
        if self.is_wrong {
            Extrinsics::Wrong { offset_m, std_dev_m, limit_m }
        } else if offset_m + std_dev_m > limit_m {
            Extrinsics::Uncertain { offset_m, std_dev_m, limit_m }
        } else {
            Extrinsics::Right { offset_m, std_dev_m, limit_m }
        }
    }
}

/// How far the correction moves the returns that count, as the root mean square, and its standard deviation.
fn offset_of(fit: &Fit, observations: &[Observation]) -> (f64, f64) {
    let used = observations.iter().zip(&fit.weights).filter(|(_, weight)| **weight > 0.0);
    let (sum, count) = used.fold((Matrix6::zeros(), 0.0), |(sum, count), (one, _)| {
        (sum + one.linearised.displacement_matrix(), count + 1.0)
    });
    let mean_displacement: Matrix6<f64> = sum / f64::max(count, 1.0);
    let correction = fit.total;
    let offset_m = correction.dot(&(mean_displacement * correction)).max(0.0).sqrt();
    let spread_m = (mean_displacement * fit.covariance).trace().max(0.0).sqrt();
    if offset_m <= spread_m {
        return (offset_m, spread_m);
    }
    // Along the correction itself.
    let slope = mean_displacement * correction / offset_m;
    (offset_m, slope.dot(&(fit.covariance * slope)).max(0.0).sqrt())
}
