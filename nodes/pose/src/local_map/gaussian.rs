//! A place that is known so well.

use nalgebra::{Matrix3, Point3, Vector3};

/// A step of the Kalman filter with one number: a place that is off by `off` along `slope`, measured with a variance.
/// Returns the gain: by how much the place has moved for each unit that it was off by.
pub(super) fn corrected(
    position_m: &mut Point3<f64>,
    covariance: &mut Matrix3<f64>,
    slope: &Vector3<f64>,
    off: f64,
    variance: f64,
) -> Vector3<f64> {
    let carried = *covariance * slope;
    let gain = carried / (slope.dot(&carried) + variance);
    *position_m += gain * off;
    *covariance -= gain * carried.transpose();
    gain
}
