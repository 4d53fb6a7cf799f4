//! Laser scans.

use geometry::{Scan, rays_without_overlap};

use super::{ConvertError, stamp_from_time, time_from_stamp};
use crate::sensor_msgs::LaserScan;
use crate::std_msgs::Header;

/// The scan of a message. `angle_max` and the intensities are not used: the angle of a ray follows
/// from the first angle and the increment. Times that are not finite or negative become 0, unknown. Some rays more than a turn
/// has are left out.
///
/// # Errors
/// When the scan says nothing: [`Scan::validate`].
pub fn scan_from_message(message: &LaserScan) -> Result<Scan, ConvertError> {
    let rays = rays_without_overlap(message.ranges.len(), message.angle_increment);
    let scan = Scan {
        stamp: stamp_from_time(message.header.stamp),
        frame_id: message.header.frame_id.clone(),
        angle_min_rad: message.angle_min,
        angle_increment_rad: message.angle_increment,
        time_increment_s: known_time_s(message.time_increment),
        scan_time_s: known_time_s(message.scan_time),
        range_min_m: message.range_min,
        range_max_m: message.range_max,
        ranges_m: message.ranges.iter().take(rays).copied().collect(),
    };
    scan.validate()?;
    Ok(scan)
}

fn known_time_s(time_s: f32) -> f32 {
    if time_s.is_finite() { time_s.max(0.0) } else { 0.0 }
}

/// The message of a scan, without intensities.
#[must_use]
pub fn message_from_scan(scan: &Scan) -> LaserScan {
    LaserScan {
        header: Header { stamp: time_from_stamp(scan.stamp), frame_id: scan.frame_id.clone() },
        angle_min: scan.angle_min_rad,
        angle_max: scan.azimuth_rad(scan.ranges_m.len().saturating_sub(1)) as f32,
        angle_increment: scan.angle_increment_rad,
        time_increment: scan.time_increment_s,
        scan_time: scan.scan_time_s,
        range_min: scan.range_min_m,
        range_max: scan.range_max_m,
        ranges: scan.ranges_m.clone(),
        intensities: Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use std::f32::consts::{PI, TAU};

    use geometry::Stamp;
    use proptest::prelude::*;

    use geometry::ScanError;

    use super::*;

    /// A turn as an RPLIDAR A1 sends it.
    fn turn(rays: usize) -> LaserScan {
        LaserScan {
            angle_min: -PI,
            angle_max: PI,
            angle_increment: TAU / rays as f32,
            range_min: 0.15,
            range_max: 12.0,
            ranges: (0..rays).map(|ray| 1.0 + ray as f32 * 0.01).collect(),
            intensities: vec![47.0; rays],
            ..LaserScan::default()
        }
    }

    #[test]
    fn a_turn_is_read() {
        let mut message = turn(360);
        message.header.frame_id = "laser".to_owned();
        message.header.stamp.sec = 5;
        message.ranges[3] = f32::INFINITY;
        let scan = scan_from_message(&message).unwrap();
        assert_eq!(scan.stamp, Stamp::from_nanos(5_000_000_000));
        assert_eq!(scan.frame_id, "laser");
        assert_eq!(scan.ranges_m, message.ranges);
        assert_eq!((scan.range_min_m, scan.range_max_m), (0.15, 12.0));
        assert!((scan.azimuth_rad(180)).abs() < 1e-6);
    }

    #[test]
    fn drivers_may_repeat_the_first_ray_and_turn_in_the_other_direction() {
        for rays in [360, 720, 1440] {
            let mut message = turn(rays);
            message.angle_increment = TAU / (rays - 1) as f32;
            assert!(scan_from_message(&message).is_ok());
            message.angle_increment = -message.angle_increment;
            assert!(scan_from_message(&message).is_ok());
        }
    }

    #[test]
    fn a_scan_without_return_is_a_scan() {
        let message = LaserScan { ranges: vec![f32::INFINITY; 90], ..turn(360) };
        assert_eq!(scan_from_message(&message).unwrap().ranges_m.len(), 90);
    }

    #[test]
    fn scans_that_cannot_be_used_are_named() {
        let no_rays = LaserScan { ranges: Vec::new(), ..turn(360) };
        assert_eq!(scan_from_message(&no_rays), Err(ConvertError::Scan(ScanError::NoRays)));

        for increment in [0.0, -0.0, f32::NAN, f32::INFINITY] {
            let message = LaserScan { angle_increment: increment, ..turn(360) };
            let error = scan_from_message(&message).unwrap_err();
            assert!(
                matches!(error, ConvertError::Scan(ScanError::Angles { .. })),
                "{increment}: {error}"
            );
        }
        let message = LaserScan { angle_min: f32::NAN, ..turn(360) };
        assert!(matches!(
            scan_from_message(&message),
            Err(ConvertError::Scan(ScanError::Angles { .. }))
        ));

        for (least, most) in [(3.0, 2.0), (f32::NAN, 2.0), (0.1, f32::NAN), (0.0, 0.0), (-1.0, 2.0)]
        {
            let message = LaserScan { range_min: least, range_max: most, ..turn(360) };
            let error = scan_from_message(&message).unwrap_err();
            assert!(
                matches!(error, ConvertError::Scan(ScanError::Limits { .. })),
                "{least} {most}: {error}"
            );
        }
    }

    #[test]
    fn some_rays_more_than_a_turn_has_are_left_out() {
        for (rays, read) in [(456, 456), (458, 458), (460, 456), (501, 456)] {
            let increment = TAU / 456.0;
            for angle_increment in [increment, -increment] {
                let message = LaserScan { angle_increment, ..turn(rays) };
                let scan = scan_from_message(&message).unwrap();
                assert_eq!(scan.ranges_m, message.ranges[..read], "{rays} rays");
            }
        }
        let message = LaserScan { angle_increment: TAU / 456.0, ..turn(502) };
        assert!(scan_from_message(&message).is_err());
        // A turn of more rays than can be counted.
        let message = LaserScan { angle_increment: f32::MIN_POSITIVE, ..turn(360) };
        assert_eq!(scan_from_message(&message).unwrap().ranges_m.len(), 360);
    }

    #[test]
    fn rays_beyond_a_turn_are_refused_with_their_numbers() {
        let message = LaserScan { ranges: vec![1.0; 400], ..turn(360) };
        let error = scan_from_message(&message).unwrap_err();
        assert!(error.to_string().starts_with("LaserScan: 400 rays of 0.017453292 rad span 6.96"));
        let just_within = LaserScan { ranges: vec![1.0; 362], ..turn(360) };
        assert!(scan_from_message(&just_within).is_ok());
    }

    #[test]
    fn unknown_times_are_zero() {
        let message = LaserScan { time_increment: f32::NAN, scan_time: -1.0, ..turn(360) };
        let scan = scan_from_message(&message).unwrap();
        assert_eq!((scan.time_increment_s, scan.scan_time_s), (0.0, 0.0));
    }

    proptest! {
        #[test]
        fn a_scan_comes_back(
            nanos in 0..i64::from(i32::MAX),
            rays in 1..400_usize,
            time_increment_s in 0.0..0.01_f32,
        ) {
            let scan = Scan {
                stamp: Stamp::from_nanos(nanos),
                frame_id: "laser".to_owned(),
                angle_min_rad: -1.0,
                angle_increment_rad: 0.0157,
                time_increment_s,
                scan_time_s: 0.14,
                range_min_m: 0.15,
                range_max_m: 8.0,
                ranges_m: (0..rays).map(|ray| 0.1 * ray as f32).collect(),
            };
            let message = message_from_scan(&scan);
            let last_rad = f64::from(message.angle_min)
                + (rays - 1) as f64 * f64::from(message.angle_increment);
            prop_assert!((f64::from(message.angle_max) - last_rad).abs() < 1e-6);
            prop_assert_eq!(scan_from_message(&message), Ok(scan));
        }
    }
}
