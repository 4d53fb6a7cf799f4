use geometry::Stamp;
use nalgebra::Point3;

use super::*;

/// Two rows of eight columns that see 2, 4, 8, ... m in turn, the lower ones a hole ahead.
fn revolution() -> Revolution {
    let azimuth_rad = |column: usize| PI - (column as f32 + 0.5) * TAU / 8.0;
    let mut returns = Vec::new();
    for row in 0..2 {
        for column in 0..8 {
            let (sin, cos) = azimuth_rad(column).sin_cos();
            let range_m = 2.0_f32.powi(column as i32 + 1);
            let found = LidarReturn {
                position_m: Point3::new(range_m * cos, range_m * sin, 0.0),
                intensity: 36.0 * column as f32,
                time_s: 0.0,
            };
            returns.push((row == 0 || column != 3).then_some(found));
        }
    }
    let azimuths_rad = (0..8).map(azimuth_rad).collect();
    Revolution::new(Stamp::default(), String::new(), vec![0.1, 0.0], azimuths_rad, returns).unwrap()
}

fn pixel(picture: &Panorama, x: usize, y: usize) -> Rgb {
    let first = 3 * (y * picture.width_px + x);
    picture.rgb[first..first + 3].try_into().unwrap()
}

#[test]
fn rows_are_from_the_highest_and_columns_from_behind_over_the_left() {
    let config = PanoramaConfig { width_px: 8, row_height_px: 3, ..PanoramaConfig::intensities() };
    let picture = config.draw(&revolution()).unwrap();
    assert_eq!((picture.width_px, picture.height_px, picture.rgb.len()), (8, 6, 8 * 6 * 3));
    for x in 0..8 {
        let expected = config.colour_map.colour(36.0 * x as f32 / 255.0);
        for y in 0..3 {
            assert_eq!(pixel(&picture, x, y), expected, "{x} {y}");
        }
        let expected = if x == 3 { config.nothing } else { expected };
        assert_eq!(pixel(&picture, x, 4), expected, "{x}");
    }
}

#[test]
fn near_ranges_have_as_many_colours_as_far_ones() {
    let limits = [2.0, 256.0];
    let even =
        PanoramaConfig { limits, width_px: 8, row_height_px: 1, ..PanoramaConfig::default() };
    let picture = even.draw(&revolution()).unwrap();
    for x in 0..8 {
        assert_eq!(pixel(&picture, x, 0), even.colour_map.colour(x as f32 / 7.0), "{x}");
    }
    // Evenly scaled, the first four share what is a sixteenth of the colours.
    let linear = PanoramaConfig { quantity: Quantity::LinearRange, ..even };
    let picture = linear.draw(&revolution()).unwrap();
    assert_eq!(pixel(&picture, 3, 0), even.colour_map.colour(14.0 / 254.0));
}

#[test]
fn a_wide_picture_has_no_gaps_where_the_scanner_has_none() {
    let config = PanoramaConfig { width_px: 80, row_height_px: 1, ..PanoramaConfig::intensities() };
    let picture = config.draw(&revolution()).unwrap();
    let black = (0..80).filter(|x| pixel(&picture, *x, 0) == config.nothing).count();
    assert_eq!(black, 0);
    let black = (0..80).filter(|x| pixel(&picture, *x, 1) == config.nothing).count();
    assert_eq!(black, 9);
}

#[test]
fn a_configuration_that_does_not_hold_is_refused() {
    let error = |config: PanoramaConfig| config.draw(&revolution()).unwrap_err().to_string();
    let defaults = PanoramaConfig::default;
    assert!(error(PanoramaConfig { limits: [0.0, 9.0], ..defaults() }).contains("above 0"));
    assert!(error(PanoramaConfig { limits: [9.0, 9.0], ..defaults() }).contains("must rise"));
    assert!(error(PanoramaConfig { limits: [1.0, f32::NAN], ..defaults() }).contains("NaN"));
    assert!(error(PanoramaConfig { width_px: 0, ..defaults() }).contains("width_px is 0"));
    assert!(error(PanoramaConfig { row_height_px: 65, ..defaults() }).contains("1 .. 64"));
    for good in [PanoramaConfig::pink_intensities(), PanoramaConfig::hsv_ranges(), defaults()] {
        good.validate().unwrap();
    }
}
