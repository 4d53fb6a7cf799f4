use std::f64::consts::FRAC_PI_4;

use proptest::prelude::*;

use super::*;

fn zone(azimuth_min_rad: f64, azimuth_max_rad: f64) -> DynamicZone {
    let source = ZoneSource::Measured;
    DynamicZone { azimuth_min_rad, azimuth_max_rad, peak_std_dev_m: 0.5, source, returns: None }
}

/// Eq. 6 as the thesis means it: the angle from the y axis in the XY plane.
fn alpha_rad(point: &Point3<f32>) -> f64 {
    let (x, y) = (f64::from(point.x), f64::from(point.y));
    (y / x.hypot(y)).acos()
}

proptest! {
    #[test]
    fn before_the_rig_a_zone_is_what_eq_6_says(
        bounds in (-FRAC_PI_2..FRAC_PI_2, -FRAC_PI_2..FRAC_PI_2),
        x_m in 1e-3..8.0_f32, y_m in -8.0..8.0_f32, z_m in -2.0..2.0_f32,
    ) {
        let zone = zone(bounds.0.min(bounds.1), bounds.0.max(bounds.1));
        let point = Point3::new(x_m, y_m, z_m);
        let (alpha_1, alpha_2) = zone.alphas_rad();
        prop_assert!(alpha_1 <= alpha_2);
        let alpha = alpha_rad(&point);
        // acos loses digits near 0 and pi.
        prop_assume!((alpha - alpha_1).abs() > 1e-7 && (alpha - alpha_2).abs() > 1e-7);
        prop_assert_eq!(zone.contains(&point), alpha_1 <= alpha && alpha <= alpha_2);
    }

    #[test]
    fn a_zone_turned_with_its_point_still_contains_it(
        middle_rad in -PI..PI, width_rad in 0.0..3.0_f64, offset_rad in -PI..PI,
    ) {
        prop_assume!((offset_rad.abs() - width_rad / 2.0).abs() > 1e-9);
        let mut min_rad = middle_rad - width_rad / 2.0;
        if min_rad < -PI {
            min_rad += 2.0 * PI;
        }
        let zone = zone(min_rad, min_rad + width_rad);
        let (sin, cos) = (middle_rad + offset_rad).sin_cos();
        prop_assert_eq!(zone.contains_azimuth(sin.atan2(cos)), offset_rad.abs() < width_rad / 2.0);
        prop_assert!((zone.width_rad() - width_rad).abs() < 1e-12);
        prop_assert!((zone.middle_rad() - middle_rad).rem_euclid(2.0 * PI).sin().abs() < 1e-9);
    }
}

#[test]
fn the_bounds_belong_to_the_zone() {
    let quarter = zone(-FRAC_PI_4, FRAC_PI_4);
    for (point, inside) in [
        (Point3::new(1.0, 1.0, 0.0), true),
        (Point3::new(1.0, -1.0, 5.0), true),
        (Point3::new(1.0, 1.001, 0.0), false),
        (Point3::new(-1.0, 0.0, 0.0), false),
        (Point3::new(0.0, 0.0, 1.0), false),
        (Point3::new(f32::NAN, 0.0, 1.0), false),
    ] {
        assert_eq!(quarter.contains(&point), inside, "{point}");
    }
}

#[test]
fn the_rear_is_one_direction() {
    let behind = [PI, -PI];
    for across in [zone(PI - 0.1, PI + 0.1), zone(PI - 0.1, PI), zone(-PI, -PI + 0.1)] {
        for azimuth_rad in behind {
            assert!(across.contains_azimuth(azimuth_rad), "{azimuth_rad} in {across:?}");
        }
    }
    let across = zone(PI - 0.1, PI + 0.1);
    assert!(across.contains_azimuth(-PI + 0.09) && !across.contains_azimuth(-PI + 0.11));
    assert!(across.contains_azimuth(PI - 0.09) && !across.contains_azimuth(PI - 0.11));
    assert!(
        across.contains(&Point3::new(-1.0, -0.0, 0.0))
            && across.contains(&Point3::new(-1.0, 0.0, 0.0))
    );
    assert!(!across.contains_azimuth(0.0));
    assert!(zone(-PI, PI).contains_azimuth(1.0));
}

#[test]
fn the_thesis_angles_are_measured_from_the_y_axis() {
    // A zone to the left of the middle: near the y axis, so its angles from there are small.
    let (alpha_1, alpha_2) = zone(0.5, 0.7).alphas_rad();
    assert!(
        (alpha_1 - (FRAC_PI_2 - 0.7)).abs() < 1e-15 && (alpha_2 - (FRAC_PI_2 - 0.5)).abs() < 1e-15
    );
}
