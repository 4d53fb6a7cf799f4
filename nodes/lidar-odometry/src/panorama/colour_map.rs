//! Colours for values.

use std::f32::consts::TAU;

/// Red, green and blue.
pub type Rgb = [u8; 3];

geometry::choices! {
    /// How values of 0 .. 1 become colours.
    pub enum ColourMap {
        /// From dark violet over blue and green to light yellow, even in lightness and in hue of OKLab (Ottosson 2020).
        Even = "even",
        /// OpenCV's COLORMAP_PINK: the root of the mean of gray and "hot".
        Pink = "pink",
        /// OpenCV's COLORMAP_HSV: once round the hues, from red to red.
        Hsv = "hsv",
    }
}

impl ColourMap {
    /// The colour of a value; of one outside of 0 .. 1 that of the nearer end, of no number that of 0.
    #[must_use]
    pub fn colour(self, value: f32) -> Rgb {
        let value = if value.is_nan() { 0.0 } else { value.clamp(0.0, 1.0) };
        let shares = match self {
            Self::Even => even(value),
            Self::Pink => pink(value),
            Self::Hsv => hsv(value),
        };
        shares.map(|share| (share.clamp(0.0, 1.0) * 255.0).round() as u8)
    }
}

/// The first and the last lightness: dark, and light, but neither black nor white, which stand for nothing.
const LIGHTNESS: [f32; 2] = [0.3, 0.93];
/// The hues between which the map goes: violet and yellow.
const HUES_TURNS: [f32; 2] = [0.85, 0.28];
/// The most colourful that all of these are within what a screen shows.
const CHROMA: f32 = 0.1;

fn even(value: f32) -> [f32; 3] {
    let between = |[from, to]: [f32; 2]| from + (to - from) * value;
    let (sin, cos) = (between(HUES_TURNS) * TAU).sin_cos();
    srgb_of_oklab([between(LIGHTNESS), CHROMA * cos, CHROMA * sin])
}

/// Ottosson 2020, "A perceptual color space for image processing": OKLab to linear sRGB, and its gamma (IEC 61966-2-1).
fn srgb_of_oklab([lightness, a, b]: [f32; 3]) -> [f32; 3] {
    let l = (lightness + 0.396_337_8 * a + 0.215_803_76 * b).powi(3);
    let m = (lightness - 0.105_561_346 * a - 0.063_854_17 * b).powi(3);
    let s = (lightness - 0.089_484_18 * a - 1.291_485_5 * b).powi(3);
    let linear = [
        4.076_741_7 * l - 3.307_711_6 * m + 0.230_969_94 * s,
        -1.268_438 * l + 2.609_757_4 * m - 0.341_319_4 * s,
        -0.004_196_086_3 * l - 0.703_418_6 * m + 1.707_614_7 * s,
    ];
    linear.map(|share| {
        if share <= 0.003_130_8 { 12.92 * share } else { 1.055 * share.powf(1.0 / 2.4) - 0.055 }
    })
}

fn pink(value: f32) -> [f32; 3] {
    let hot = [8.0 / 3.0 * value, 8.0 / 3.0 * value - 1.0, 4.0 * value - 3.0];
    hot.map(|hot| ((2.0 * value + hot.clamp(0.0, 1.0)) / 3.0).sqrt())
}

fn hsv(value: f32) -> [f32; 3] {
    let sixths = 6.0 * value;
    let distance = |from: f32| {
        let off = (sixths - from).rem_euclid(6.0);
        off.min(6.0 - off)
    };
    // Red, green and blue are full within a sixth of their hue, and gone from two on.
    [0.0, 2.0, 4.0].map(|hue| (2.0 - distance(hue)).clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// OpenCV 4.12's colours for some of 0 .. 255.
    #[test]
    fn pink_and_hsv_are_those_of_opencv() {
        let check = |map: ColourMap, index: u8, expected: Rgb, off: u8| {
            let found = map.colour(f32::from(index) / 255.0);
            let near = found.iter().zip(expected).all(|(a, b)| a.abs_diff(b) <= off);
            assert!(near, "{map:?} {index}: {found:?} {expected:?}");
        };
        for (index, expected) in [
            (10, [63, 41, 41]),
            (64, [159, 104, 104]),
            (128, [208, 171, 148]),
            (200, [236, 236, 192]),
            (255, [255, 255, 255]),
        ] {
            check(ColourMap::Pink, index, expected, 1);
        }
        // OpenCV's begins darker.
        check(ColourMap::Pink, 0, [0, 0, 0], 0);
        for (index, expected) in [
            (0, [255, 0, 0]),
            (10, [255, 60, 0]),
            (64, [126, 255, 0]),
            // OpenCV goes between 64 colours by straight lines.
            (128, [0, 247, 250]),
            (200, [180, 0, 255]),
            (255, [255, 0, 0]),
        ] {
            check(ColourMap::Hsv, index, expected, 6);
        }
    }

    /// sRGB back to OKLab, with the inverses of the matrices.
    fn oklab(rgb: Rgb) -> [f64; 3] {
        let [r, g, b] = rgb.map(|share| {
            let share = f64::from(share) / 255.0;
            if share <= 0.04045 { share / 12.92 } else { ((share + 0.055) / 1.055).powf(2.4) }
        });
        let l = (0.412_221_470_8 * r + 0.536_332_536_3 * g + 0.051_445_992_9 * b).cbrt();
        let m = (0.211_903_498_2 * r + 0.680_699_545_1 * g + 0.107_396_956_6 * b).cbrt();
        let s = (0.088_302_461_9 * r + 0.281_718_837_6 * g + 0.629_978_700_5 * b).cbrt();
        [
            0.210_454_255_3 * l + 0.793_617_785_0 * m - 0.004_072_046_8 * s,
            1.977_998_495_1 * l - 2.428_592_205_0 * m + 0.450_593_709_9 * s,
            0.025_904_037_1 * l + 0.782_771_766_2 * m - 0.808_675_766_0 * s,
        ]
    }

    #[test]
    fn the_even_map_looks_alike_everywhere() {
        let colours: Vec<[f64; 3]> =
            (0..=32).map(|step| oklab(ColourMap::Even.colour(step as f32 / 32.0))).collect();
        let steps: Vec<f64> = colours
            .windows(2)
            .map(|pair| {
                let squares = pair[0].iter().zip(pair[1]).map(|(a, b)| (a - b).powi(2));
                squares.sum::<f64>().sqrt()
            })
            .collect();
        let mean = steps.iter().sum::<f64>() / steps.len() as f64;
        // Colours are rounded to bytes.
        for step in &steps {
            assert!((step / mean - 1.0).abs() < 0.12, "{step} {mean}");
        }
        assert!(colours.windows(2).all(|pair| pair[0][0] < pair[1][0]));
        assert!((colours[0][0] - 0.3).abs() < 0.01 && (colours[32][0] - 0.93).abs() < 0.01);
    }

    #[test]
    fn what_is_no_value_has_a_colour_too() {
        for map in [ColourMap::Even, ColourMap::Pink, ColourMap::Hsv] {
            assert_eq!(map.colour(f32::NAN), map.colour(0.0));
            assert_eq!(map.colour(-3.0), map.colour(0.0));
            assert_eq!(map.colour(f32::INFINITY), map.colour(1.0));
        }
    }
}
