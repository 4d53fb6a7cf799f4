//! The motion of the vehicle during a revolution, taken out of it.

use estimation::Twist;
use nalgebra::{Isometry3, Point3};

use geometry::{LidarReturn, Revolution, is_finite};

/// The revolution as it would have been measured from where the scanner was `reference_s` after the revolution's stamp,
/// if its velocity was constant: every point is moved by the motion between its own time and that one. The times of
/// the returns stay.
///
/// A column's motion is exact; within the 50 us of a column the velocity is taken as constant in the moment's frame,
/// which leaves less than a rounding of the coordinates.
#[must_use]
pub fn deskewed(revolution: &Revolution, twist: &Twist, reference_s: f64) -> Revolution {
    let motions: Vec<Option<ColumnMotion>> = (0..revolution.columns())
        .map(|column| {
            let first = (0..revolution.rows()).find_map(|row| revolution.at(row, column));
            first.map(|first| ColumnMotion::new(twist, f64::from(first.time_s), reference_s))
        })
        .collect();
    revolution.map(|column, found| {
        let position_m = motions.get(column)?.as_ref()?.apply(found, twist);
        // A velocity that is no number leaves no point.
        is_finite(&position_m).then_some(LidarReturn { position_m, ..*found })
    })
}

/// The motion between the time of a column and that of the reference.
struct ColumnMotion {
    time_s: f64,
    reference_from_column: Isometry3<f64>,
}

impl ColumnMotion {
    fn new(twist: &Twist, time_s: f64, reference_s: f64) -> Self {
        Self { time_s, reference_from_column: twist.displacement(time_s - reference_s) }
    }

    fn apply(&self, found: &LidarReturn, twist: &Twist) -> Point3<f32> {
        let after_s = f64::from(found.time_s) - self.time_s;
        let point_m = found.position_m.cast::<f64>();
        let velocity_m_per_s =
            twist.linear_m_per_s + twist.angular_rad_per_s.cross(&point_m.coords);
        (self.reference_from_column * (point_m + velocity_m_per_s * after_s)).cast::<f32>()
    }
}

#[cfg(test)]
mod tests;
