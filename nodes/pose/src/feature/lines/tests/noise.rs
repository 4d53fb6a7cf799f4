//! The promise of the a-contrario test.

use crate::feature::lines::testing::{Picture, detect};
use crate::feature::lines::{LineConfig, LineDetector};

#[test]
fn noise_alone_has_nearly_no_segments() {
    for std_dev in [2.0, 5.0, 20.0, 60.0] {
        let images = 5;
        let found: usize = (0..images)
            .map(|seed| {
                detect(&Picture::flat(320, 240, 128.0).with_noise(std_dev, seed).image()).len()
            })
            .sum();
        // A tenth of one to an image is promised of independent pixels.
        assert!(found <= images as usize, "{found} segments in {images} images of noise {std_dev}");
    }
}

#[test]
fn without_the_promise_noise_is_full_of_them() {
    let config = LineConfig { max_false_alarms: 1e20, ..LineConfig::default() };
    let image = Picture::flat(320, 240, 128.0).with_noise(20.0, 1).image();
    let found = LineDetector::new(config).unwrap().detect(&image).len();
    assert!(found > 100, "{found}");
}

#[test]
fn a_flat_image_and_a_ramp_have_none() {
    assert_eq!(detect(&Picture::flat(200, 100, 90.0).image()), []);
    // A ramp has a gradient everywhere and an edge nowhere.
    let mut pixels = Vec::new();
    for _ in 0..100 {
        pixels.extend((0..200).map(|column| column as u8));
    }
    let ramp = crate::image::GrayImage::new(200, 100, pixels).unwrap();
    assert_eq!(detect(&ramp), []);
}
