//! The returns of a scan.

use geometry::Scan;
use nalgebra::{Isometry3, Point3, Vector3};

/// The return of a beam.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct LidarReturn {
    /// The beam's index in the scan.
    pub beam: usize,
    /// Its direction in the scanner's frame, from x towards y.
    pub azimuth_rad: f64,
    /// How far it went.
    pub range_m: f64,
    /// The beam covers all azimuths within this much of its own: the step from beam to beam.
    pub step_rad: f64,
    /// Takes a point of the rig's frame at the moment of the beam to the rig's frame at the moment of the
    /// depth image; the identity on a static platform.
    pub image_rig_from_rig: Isometry3<f64>,
}

impl LidarReturn {
    /// The point that was hit, in the scanner's frame.
    #[must_use]
    pub fn point_in_lidar_m(&self) -> Point3<f64> {
        Point3::from(self.direction_in_lidar() * self.range_m)
    }

    /// The beam's direction in the scanner's frame, of length 1.
    #[must_use]
    pub fn direction_in_lidar(&self) -> Vector3<f64> {
        Vector3::new(self.azimuth_rad.cos(), self.azimuth_rad.sin(), 0.0)
    }
}

/// The returns of a scan in the order of its beams; beams without a return are left out.
///
/// `image_rig_from_rig_at` gives how the rig moved between a beam and the depth image
/// ([`LidarReturn::image_rig_from_rig`]); a beam for which it gives nothing is left out.
#[must_use]
pub fn returns_of(
    scan: &Scan,
    mut image_rig_from_rig_at: impl FnMut(usize) -> Option<Isometry3<f64>>,
) -> Vec<LidarReturn> {
    let step_rad = f64::from(scan.angle_increment_rad).abs();
    if !step_rad.is_finite() || !scan.angle_min_rad.is_finite() {
        return Vec::new();
    }
    (0..scan.ranges_m.len())
        .filter_map(|beam| {
            let range_m = f64::from(scan.measured_range_m(beam)?);
            let image_rig_from_rig = image_rig_from_rig_at(beam)?;
            let azimuth_rad = scan.azimuth_rad(beam);
            Some(LidarReturn { beam, azimuth_rad, range_m, step_rad, image_rig_from_rig })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_real_returns_count_and_they_lie_where_the_beam_points() {
        let scan = Scan {
            angle_min_rad: 0.0,
            angle_increment_rad: std::f32::consts::FRAC_PI_2,
            range_min_m: 0.1,
            range_max_m: 8.0,
            ranges_m: vec![1.0, 2.0, f32::INFINITY, 3.0],
            ..Scan::default()
        };
        let returns = returns_of(&scan, |beam| (beam != 3).then(Isometry3::identity));
        assert_eq!(returns.iter().map(|one| one.beam).collect::<Vec<_>>(), [0, 1]);
        assert!((returns[1].point_in_lidar_m() - Point3::new(0.0, 2.0, 0.0)).norm() < 1e-6);
        let nowhere = Scan { angle_increment_rad: f32::NAN, ..scan };
        assert!(returns_of(&nowhere, |_| Some(Isometry3::identity())).is_empty());
    }
}
