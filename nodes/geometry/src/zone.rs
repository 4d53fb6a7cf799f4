//! The wedge of directions in which something moves.

#[cfg(test)]
mod tests;

use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::Point3;
use serde::{Deserialize, Serialize};

/// Where a zone comes from.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ZoneSource {
    /// The variability of this cycle bounds it.
    Measured,
    /// Nothing was found this cycle: an earlier zone, perhaps widened.
    Held {
        /// Cycles since it was last measured, 1 or more.
        cycles: u32,
    },
}

/// A wedge of directions around the rig's z axis in which something moves: the thesis' dynamic zone
/// (Rec-HV 3.2.2), bounded by its detection angles.
///
/// Azimuths are REP-103 (from x, the forward axis, towards y, left). The thesis measures its angles
/// alpha from the y axis: `alpha = pi/2 - azimuth`.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct DynamicZone {
    /// The right-hand bound, in `[-pi, pi]`.
    pub azimuth_min_rad: f64,
    /// The left-hand bound, at least `azimuth_min_rad`; above pi where the wedge crosses the rear.
    pub azimuth_max_rad: f64,
    /// The largest range deviation within the zone when it was last measured.
    pub peak_std_dev_m: f32,
    /// Where it comes from.
    pub source: ZoneSource,
    /// Distance of the moving object, where the method knows it: Rec-HV as published does not.
    pub returns: Option<ReturnSpan>,
}

/// The distances of the returns that moved, from the rig's z axis, in the XY plane.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct ReturnSpan {
    /// The nearest return's distance.
    pub nearest_m: f32,
    /// The farthest return's distance, at least `nearest_m`.
    pub farthest_m: f32,
}

/// The direction of a point of the rig in the XY plane, from x towards y, in `[-pi, pi]`; `None` on the z axis.
#[must_use]
pub fn azimuth_rad(point_in_rig: &Point3<f32>) -> Option<f64> {
    let Point3 { coords } = point_in_rig;
    let has_direction = coords.x != 0.0 || coords.y != 0.0;
    has_direction.then(|| f64::from(coords.y).atan2(f64::from(coords.x)))
}

impl DynamicZone {
    /// Whether the direction of `point_in_rig`, seen in the XY plane, lies within the zone, bounds
    /// included (Rec-HV eq. 6 with the radius in the XY plane, as the text and the figure say). A
    /// point on the z axis has no direction and lies in no zone.
    #[must_use]
    pub fn contains(&self, point_in_rig: &Point3<f32>) -> bool {
        azimuth_rad(point_in_rig).is_some_and(|azimuth_rad| self.contains_azimuth(azimuth_rad))
    }

    /// Whether `azimuth_rad`, in `[-pi, pi]`, lies within the zone, bounds included.
    #[must_use]
    pub fn contains_azimuth(&self, azimuth_rad: f64) -> bool {
        let inside =
            |azimuth: f64| azimuth >= self.azimuth_min_rad && azimuth <= self.azimuth_max_rad;
        // Pi and -pi are one direction, and a bound may be written as either.
        [0.0, 2.0 * PI, -2.0 * PI].iter().any(|turn_rad| inside(azimuth_rad + turn_rad))
    }

    /// The thesis' two angles from the y axis, `(alpha1, alpha2)`, smaller first (eq. 5).
    #[must_use]
    pub fn alphas_rad(&self) -> (f64, f64) {
        (FRAC_PI_2 - self.azimuth_max_rad, FRAC_PI_2 - self.azimuth_min_rad)
    }

    /// How wide the zone is.
    #[must_use]
    pub fn width_rad(&self) -> f64 {
        self.azimuth_max_rad - self.azimuth_min_rad
    }

    /// The direction of its middle; above pi where that lies beyond the rear.
    #[must_use]
    pub fn middle_rad(&self) -> f64 {
        f64::midpoint(self.azimuth_min_rad, self.azimuth_max_rad)
    }
}
