//! Four numbers to correct a line by.

use nalgebra::{Matrix3, Matrix6x4, Rotation3, Vector3, Vector4};

use super::PluckerLine;

/// A line as a rotation of space and one of the plane (Bartoli and Sturm 2005, section 4.1): as many numbers to correct as
/// a line has freedoms.
///
/// The columns of the first are the directions of the moment, of the line, and of their cross product; the second gives
/// the sizes of moment and direction, `(cos, sin)`, whose ratio is the distance from the origin.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct OrthonormalLine {
    frame: Rotation3<f64>,
    moment_share: f64,
    direction_share: f64,
}

impl OrthonormalLine {
    /// The line in this form. `None` for a line through the origin, whose moment has no direction, and for what is no line.
    #[must_use]
    pub fn new(line: &PluckerLine) -> Option<Self> {
        let size = line.moment.norm().hypot(line.direction.norm());
        let first = line.moment.try_normalize(f64::EPSILON * size)?;
        // Rounding may have left the two not quite at right angles.
        let across = line.direction - first * first.dot(&line.direction);
        let second = across.try_normalize(f64::EPSILON * size)?;
        let axes = Matrix3::from_columns(&[first, second, first.cross(&second)]);
        size.is_finite().then(|| Self {
            frame: Rotation3::from_matrix_unchecked(axes),
            moment_share: line.moment.norm() / size,
            direction_share: line.direction.norm() / size,
        })
    }

    /// The Plücker coordinates, of size 1 together.
    #[must_use]
    pub fn plucker(&self) -> PluckerLine {
        PluckerLine {
            moment: self.moment_share * self.frame.matrix().column(0),
            direction: self.direction_share * self.frame.matrix().column(1),
        }
    }

    /// The line after a correction: a turn of the first rotation about its own axes, and an angle added to the second (all
    /// in radians; eq. 13 of the paper, with the exponential of all three angles at once).
    #[must_use]
    pub fn corrected(&self, correction: &Vector4<f64>) -> Self {
        let turn = Rotation3::from_scaled_axis(correction.xyz());
        let mut frame = self.frame * turn;
        frame.renormalize();
        let (sin, cos) = correction.w.sin_cos();
        Self {
            frame,
            moment_share: self.moment_share * cos - self.direction_share * sin,
            direction_share: self.direction_share * cos + self.moment_share * sin,
        }
    }

    /// How moment and direction (in this order) of [`plucker`](Self::plucker) change with a correction.
    #[must_use]
    pub fn jacobian(&self) -> Matrix6x4<f64> {
        let [first, second, third]: [Vector3<f64>; 3] =
            std::array::from_fn(|axis| self.frame.matrix().column(axis).into_owned());
        let (moment, direction) = (self.moment_share, self.direction_share);
        let mut jacobian = Matrix6x4::zeros();
        let mut set = |row: usize, column: usize, value: Vector3<f64>| {
            jacobian.fixed_view_mut::<3, 1>(row, column).copy_from(&value);
        };
        set(0, 1, -moment * third);
        set(0, 2, moment * second);
        set(0, 3, -direction * first);
        set(3, 0, direction * third);
        set(3, 2, -direction * first);
        set(3, 3, moment * second);
        jacobian
    }
}
