//! What the tests of several modules share.

use nalgebra::{Isometry3, Vector3};
use proptest::prelude::*;

/// Poses with any rotation, up to 3 m off along each axis.
pub(crate) fn any_pose() -> impl Strategy<Value = Isometry3<f64>> {
    prop::array::uniform6(-3.0..3.0_f64).prop_map(|[x, y, z, a, b, c]| {
        let turn = Vector3::new(a, b, c);
        let turn = if turn.norm() > 3.0 { turn.normalize() * 3.0 } else { turn };
        Isometry3::new(Vector3::new(x, y, z), turn)
    })
}
