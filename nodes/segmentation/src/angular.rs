//! The first stage: the points within a dynamic zone (Rec-HV 3.2.5, eq. 6).

use geometry::{DynamicZone, azimuth_rad};
use nalgebra::Point3;

/// The direction of each point in the XY plane of the rig, from x towards y, `None` on the z axis; nothing where there is no zone to
/// compare it with.
#[must_use]
pub fn azimuths_rad(points_in_rig_m: &[Point3<f32>], zones: &[DynamicZone]) -> Vec<Option<f64>> {
    if zones.is_empty() {
        return Vec::new();
    }
    points_in_rig_m.iter().map(azimuth_rad).collect()
}

/// The indices of the points within `zone`, ascending, by their directions: the thesis' PCL_ZD. The others are PCL_ze.
///
/// The direction of a point is taken in the XY plane of the rig, as the text of eq. 6 and its figure
/// have it; the printed radius is that of three dimensions, by which a point high above the scanner's
/// plane would turn towards the middle of the view.
#[must_use]
pub fn points_in_zone(azimuths_rad: &[Option<f64>], zone: &DynamicZone) -> Vec<usize> {
    let is_within = |azimuth_rad: &Option<f64>| {
        azimuth_rad.is_some_and(|azimuth_rad| zone.contains_azimuth(azimuth_rad))
    };
    (0..azimuths_rad.len()).filter(|&point| is_within(&azimuths_rad[point])).collect()
}

#[cfg(test)]
mod tests {
    use geometry::ZoneSource;

    use super::*;

    fn zone_deg(min: f64, max: f64) -> DynamicZone {
        DynamicZone {
            azimuth_min_rad: min.to_radians(),
            azimuth_max_rad: max.to_radians(),
            peak_std_dev_m: 0.6,
            source: ZoneSource::Measured,
            returns: None,
        }
    }

    fn within(points_m: &[Point3<f32>], zone: DynamicZone) -> Vec<usize> {
        points_in_zone(&azimuths_rad(points_m, &[zone]), &zone)
    }

    #[test]
    fn the_angle_of_equation_6_is_taken_in_the_plane() {
        // 2 m ahead, 1 m to the left: acos(y / sqrt(x^2 + y^2)) = 63.4 degrees from y, 26.6 from x.
        // With the printed radius, 2 m up, it would be acos(1 / 3) = 70.5 from y, 19.5 from x.
        let points_m = [Point3::new(2.0, 1.0, 0.0), Point3::new(2.0, 1.0, 2.0)];
        let alpha_rad: f64 = (1.0f64 / 5.0f64.sqrt()).acos();
        assert!((90.0 - alpha_rad.to_degrees() - 26.565).abs() < 1e-3);
        assert_eq!(within(&points_m, zone_deg(26.0, 27.0)), [0, 1]);
        assert_eq!(within(&points_m, zone_deg(19.0, 20.0)), [0; 0]);
    }

    #[test]
    fn bounds_and_sides() {
        let points_m =
            [Point3::new(1.0, 0.0, 0.0), Point3::new(1.0, 1.0, 0.0), Point3::new(1.0, -1.0, 0.0)];
        assert_eq!(within(&points_m, zone_deg(0.0, 10.0)), [0]);
        assert_eq!(within(&points_m, zone_deg(-1.0, 46.0)), [0, 1]);
        assert_eq!(within(&points_m, zone_deg(-46.0, -44.0)), [2]);
        assert_eq!(within(&[], zone_deg(-46.0, 46.0)), [0; 0]);
    }
}
