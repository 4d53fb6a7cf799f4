//! Which way is up: floors, ceilings and tables are level, and by far the most of a building's surfaces that face up or down.

use estimation::Symmetric3;
use nalgebra::{UnitQuaternion, Vector3};

use crate::saved_map::Piece;

/// The half angles within which surfaces count as level, from step to step: from what the z axis of a map is off by at most to what
/// normals scatter by. As cosines: 20, 10 and 6 degrees.
const WITHIN: [f64; 3] = [0.94, 0.985, 0.9945];
/// Fewer pieces say nothing: 0.25 m2 at 5 cm.
const LEAST_PIECES: usize = 100;

/// The rotation that makes the level surfaces of a map level: none where it has hardly any.
pub(crate) fn level_from_map(pieces: &[Piece]) -> UnitQuaternion<f64> {
    let mut up = Vector3::z();
    for least_cosine in WITHIN {
        let level = || pieces.iter().filter(|piece| piece.normal.dot(&up).abs() > least_cosine);
        if level().count() < LEAST_PIECES {
            break;
        }
        let scatter = level().fold(Symmetric3::default(), |sum, piece| {
            sum.plus(1.0, &Symmetric3::outer(&piece.normal))
        });
        let eigen = scatter.matrix().symmetric_eigen();
        let found: Vector3<f64> = eigen.eigenvectors.column(eigen.eigenvalues.imax()).into();
        up = if found.z < 0.0 { -found } else { found };
    }
    UnitQuaternion::rotation_between(&up, &Vector3::z()).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::*;

    #[test]
    fn a_floor_that_slants_is_level_afterwards_and_a_ramp_does_not_matter() {
        let tilt = UnitQuaternion::from_euler_angles(0.05, -0.08, 0.0);
        let piece =
            |normal: Vector3<f64>| Piece { place_m: Point3::origin(), normal: tilt * normal };
        let mut pieces = vec![piece(Vector3::z()); 500];
        pieces.extend(vec![piece(-Vector3::z()); 300]);
        pieces.extend(vec![piece(Vector3::x()); 900]);
        pieces.extend(vec![piece(Vector3::new(0.3, 0.0, 0.95).normalize()); 100]);
        let up = level_from_map(&pieces) * (tilt * Vector3::z());
        assert!(up.angle(&Vector3::z()) < 1e-6, "{up}");
        assert_eq!(level_from_map(&pieces[..50]), UnitQuaternion::identity());
    }
}
