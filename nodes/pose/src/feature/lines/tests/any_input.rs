//! Whatever is given.

use proptest::prelude::*;

use crate::feature::lines::testing::detect;
use crate::feature::lines::{LineConfig, LineDetector};
use crate::image::GrayImage;

#[test]
fn images_too_small_for_a_gradient_have_no_segments() {
    for (width_px, height_px) in [(0, 0), (0, 5), (5, 0), (1, 1), (2, 2), (1, 9), (9, 2), (3, 3)] {
        let image = GrayImage::new(width_px, height_px, vec![7; width_px * height_px]).unwrap();
        assert_eq!(detect(&image), []);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    #[test]
    fn segments_are_in_the_image_and_as_long_as_the_promise_wants(
        (width_px, height_px, pixels) in (1..60_usize, 1..60_usize).prop_flat_map(|(width, height)| {
            let level = prop_oneof![Just(0_u8), Just(255), any::<u8>()];
            (Just(width), Just(height), proptest::collection::vec(level, width * height))
        }),
        count in 1..5_usize,
        scan_interval_px in 1..4_usize,
        max_false_alarms in 0.1..1e9,
    ) {
        let config =
            LineConfig { scan_interval_px, max_false_alarms, ..LineConfig::default() };
        let executor = std::sync::Arc::new(crate::testing::threads(count));
        let mut detector = LineDetector::new(config).unwrap().with_executor(executor);
        let image = GrayImage::new(width_px, height_px, pixels).unwrap();
        let segments = detector.detect(&image);
        for segment in &segments {
            // The points of an edge are in the image; their line passes them by a pixel, and by a second where it is joined
            // to another.
            for [x, y] in [segment.start_px, segment.end_px] {
                prop_assert!((-2.0..=width_px as f32 + 1.0).contains(&x), "{segment:?}");
                prop_assert!((-2.0..=height_px as f32 + 1.0).contains(&y), "{segment:?}");
            }
            prop_assert!(f64::from(segment.response) >= -max_false_alarms.log10() - 1e-3);
        }
        prop_assert_eq!(detector.describe(&segments).len(), segments.len());
    }
}

#[test]
fn each_bad_parameter_is_named() {
    type Spoil = fn(&mut LineConfig);
    assert_eq!(LineConfig::default().validate(), Ok(()));
    let cases: [(&str, Spoil); 10] = [
        ("anchor_gradient", |c| c.anchor_gradient = 0.0),
        ("edge_gradient", |c| c.edge_gradient = 2000.0),
        ("scan_interval_px", |c| c.scan_interval_px = 0),
        ("seed_px", |c| c.seed_px = 2),
        ("max_rms_px", |c| c.max_rms_px = f64::NAN),
        ("max_deviation_px", |c| c.max_deviation_px = -1.0),
        ("max_outliers_px", |c| c.max_outliers_px = usize::MAX),
        ("max_false_alarms", |c| c.max_false_alarms = 0.0),
        ("max_gap_px", |c| c.max_gap_px = -1.0),
        ("max_turn_rad", |c| c.max_turn_rad = 2.0),
    ];
    for (name, spoil) in cases {
        let mut config = LineConfig::default();
        spoil(&mut config);
        let message = LineDetector::new(config).unwrap_err().to_string();
        assert!(message.contains(name), "{message}");
    }
}
