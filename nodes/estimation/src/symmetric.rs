//! Symmetric 3 x 3 matrices, as six numbers.

use nalgebra::{Matrix3, Vector3};

/// A symmetric matrix.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Symmetric3 {
    /// Row 0, column 0.
    pub xx: f64,
    /// Row 0, column 1.
    pub xy: f64,
    /// Row 0, column 2.
    pub xz: f64,
    /// Row 1, column 1.
    pub yy: f64,
    /// Row 1, column 2.
    pub yz: f64,
    /// Row 2, column 2.
    pub zz: f64,
}

impl Symmetric3 {
    /// The identity.
    pub const IDENTITY: Self = Self { xx: 1.0, xy: 0.0, xz: 0.0, yy: 1.0, yz: 0.0, zz: 1.0 };

    /// `v v^T`.
    #[inline]
    #[must_use]
    pub fn outer(v: &Vector3<f64>) -> Self {
        let (x, y, z) = (v.x, v.y, v.z);
        Self { xx: x * x, xy: x * y, xz: x * z, yy: y * y, yz: y * z, zz: z * z }
    }

    /// This plus `scale` times the other one.
    #[inline]
    #[must_use]
    pub fn plus(self, scale: f64, other: &Self) -> Self {
        Self {
            xx: self.xx + scale * other.xx,
            xy: self.xy + scale * other.xy,
            xz: self.xz + scale * other.xz,
            yy: self.yy + scale * other.yy,
            yz: self.yz + scale * other.yz,
            zz: self.zz + scale * other.zz,
        }
    }

    /// Its product with a vector.
    #[inline]
    #[must_use]
    pub fn times(&self, v: &Vector3<f64>) -> Vector3<f64> {
        Vector3::new(
            self.xx * v.x + self.xy * v.y + self.xz * v.z,
            self.xy * v.x + self.yy * v.y + self.yz * v.z,
            self.xz * v.x + self.yz * v.y + self.zz * v.z,
        )
    }

    /// Its inverse, by the cofactors. Infinite or not a number for a matrix that has none.
    #[inline]
    #[must_use]
    pub fn inverse(&self) -> Self {
        let xx = self.yy * self.zz - self.yz * self.yz;
        let xy = self.xz * self.yz - self.xy * self.zz;
        let xz = self.xy * self.yz - self.xz * self.yy;
        let share = (self.xx * xx + self.xy * xy + self.xz * xz).recip();
        Self {
            xx: share * xx,
            xy: share * xy,
            xz: share * xz,
            yy: share * (self.xx * self.zz - self.xz * self.xz),
            yz: share * (self.xy * self.xz - self.xx * self.yz),
            zz: share * (self.xx * self.yy - self.xy * self.xy),
        }
    }

    /// All nine numbers.
    #[inline]
    #[must_use]
    pub fn matrix(&self) -> Matrix3<f64> {
        let Self { xx, xy, xz, yy, yz, zz } = *self;
        Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn the_sums_and_products_are_those_of_matrices(
            a in prop::array::uniform3(-1.0..1.0_f64), b in prop::array::uniform3(-1.0..1.0_f64),
        ) {
            let (a, b) = (Vector3::from(a), Vector3::from(b));
            let sum = Symmetric3::IDENTITY.plus(0.7, &Symmetric3::outer(&a));
            let expected = Matrix3::identity() + 0.7 * a * a.transpose();
            prop_assert!((sum.matrix() - expected).norm() < 1e-12);
            prop_assert!((sum.times(&b) - expected * b).norm() < 1e-12);
            prop_assert!((sum.inverse().matrix() * expected - Matrix3::identity()).norm() < 1e-12);
        }
    }
}
