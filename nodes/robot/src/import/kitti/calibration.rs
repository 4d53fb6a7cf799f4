//! Transforms in KITTI's files: twelve numbers, the upper three rows of a 4 x 4 matrix.

use std::path::Path;

use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion};

use crate::failure::Failure;

/// The line `Tr:` of a calibration.
pub(super) fn camera_from_velodyne(path: &Path) -> Result<Isometry3<f64>, Failure> {
    let text = read(path)?;
    let line = text.lines().find_map(|line| line.strip_prefix("Tr:"));
    let line = line.ok_or_else(|| {
        Failure::new(format!("{} has no line 'Tr:'", path.display()))
            .fix("give the calibration of the sequence that has it: --calib FILE")
    })?;
    transform(line).ok_or_else(|| {
        Failure::new(format!("{}: the line 'Tr:' is not a transform of 12 numbers", path.display()))
    })
}

/// The transforms of a file with one line per frame.
pub(super) fn read_poses(path: &Path) -> Result<Vec<Isometry3<f64>>, Failure> {
    let text = read(path)?;
    let lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
    let poses = lines.map(|(index, line)| {
        transform(line).ok_or_else(|| {
            Failure::new(format!(
                "{} line {}: this is not a transform of 12 numbers",
                path.display(),
                index + 1
            ))
        })
    });
    poses.collect()
}

fn read(path: &Path) -> Result<String, Failure> {
    std::fs::read_to_string(path)
        .map_err(|error| Failure::new(format!("cannot read {}: {error}", path.display())))
}

/// The tolerance for a rotation matrix: published rotations are rounded to seven digits.
const NOT_ROTATED: f64 = 1e-3;

fn transform(line: &str) -> Option<Isometry3<f64>> {
    let numbers: Vec<f64> =
        line.split_whitespace().map(|number| number.parse().ok()).collect::<Option<_>>()?;
    let rows: [f64; 12] = numbers.try_into().ok()?;
    let [a, b, c, x, d, e, f, y, g, h, i, z] = rows;
    let matrix = Matrix3::new(a, b, c, d, e, f, g, h, i);
    let off = (matrix * matrix.transpose() - Matrix3::identity()).norm();
    let is_rotation = off < NOT_ROTATED && matrix.determinant() > 0.0;
    if !is_rotation || [x, y, z].iter().any(|shift_m| !shift_m.is_finite()) {
        return None;
    }
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix(&matrix));
    Some(Isometry3::from_parts(Translation3::new(x, y, z), rotation))
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;

    #[test]
    fn twelve_numbers_are_a_transform() {
        let found = transform("0 -1 0 5 1 0 0 6 0 0 1 7").unwrap();
        assert_eq!(found.translation.vector, Vector3::new(5.0, 6.0, 7.0));
        assert!((found.rotation * Vector3::x() - Vector3::y()).norm() < 1e-9);
        for line in [
            "1 0 0 0 0 1 0 0 0 0 1",
            "2 0 0 0 0 1 0 0 0 0 1 0",
            "1 0 0 0 0 1 0 0 0 0 -1 0",
            "1 0 0 nan 0 1 0 0 0 0 1 0",
            "",
        ] {
            assert_eq!(transform(line), None, "{line}");
        }
    }
}
