//! Descriptors.

use crate::feature::lines::testing::{Picture, Rectangle, busy_picture};
use crate::feature::lines::{LineConfig, LineDescriptor, LineDetector, LineFeature};
use crate::image::GrayImage;

/// Descriptors that have nothing in common differ by a half of the bits, the same one by few.
const SAME_BITS: u32 = 40;

fn features(image: &GrayImage) -> Vec<LineFeature> {
    let mut detector = LineDetector::new(LineConfig::default()).unwrap();
    let segments = detector.detect(image);
    detector.describe(&segments)
}

/// The features of one image with those of another at the same place, as `moved` says.
fn pairs(
    one: &[LineFeature],
    other: &[LineFeature],
    moved: impl Fn([f32; 2]) -> [f32; 2],
) -> Vec<(LineFeature, LineFeature)> {
    let near = |a: [f32; 2], b: [f32; 2]| (a[0] - b[0]).hypot(a[1] - b[1]) < 3.0;
    let partner = |one: &LineFeature| {
        let [start, end] = [one.segment.start_px, one.segment.end_px].map(&moved);
        let is_partner = |other: &&LineFeature| {
            near(other.segment.start_px, start) && near(other.segment.end_px, end)
        };
        other.iter().find(is_partner).map(|other| (*one, *other))
    };
    one.iter().filter_map(partner).collect()
}

/// The median distance of pairs.
fn usual_bits(pairs: &[(LineFeature, LineFeature)]) -> u32 {
    let distance =
        |(one, other): &(LineFeature, LineFeature)| one.descriptor.distance_bits(&other.descriptor);
    let mut distances: Vec<u32> = pairs.iter().map(distance).collect();
    distances.sort_unstable();
    distances[distances.len() / 2]
}

/// A picture of rectangles around a middle, turned about it and moved.
fn scene(turn_rad: f64, shift_px: [f64; 2], seed: u64) -> Picture {
    let turn = nalgebra::Rotation2::new(turn_rad);
    let rectangles = [
        ([-50.0, -30.0], [30.0, 20.0], 0.2, 200.0),
        ([30.0, -35.0], [25.0, 28.0], 0.9, 60.0),
        ([-35.0, 45.0], [40.0, 12.0], -0.3, 30.0),
        ([45.0, 40.0], [22.0, 22.0], 0.5, 230.0),
        ([45.0, 40.0], [10.0, 15.0], 0.1, 120.0),
        ([-50.0, -28.0], [12.0, 9.0], 0.6, 90.0),
    ];
    let mut picture = Picture::flat(260, 260, 120.0);
    for (middle, half, own_rad, level) in rectangles {
        let middle = turn * nalgebra::Vector2::from(middle);
        let middle = [130.0 + middle.x + shift_px[0], 130.0 + middle.y + shift_px[1]];
        let rectangle = Rectangle::new(middle, half, turn_rad + own_rad);
        picture = picture.with_rectangle(level, &rectangle);
    }
    picture.with_noise(2.0, seed)
}

#[test]
fn a_look_stays_when_the_image_is_moved_and_noise_is_another() {
    let there = features(&scene(0.0, [0.0, 0.0], 1).image());
    let moved = features(&scene(0.0, [7.4, -5.7], 2).image());
    let pairs = pairs(&there, &moved, |[x, y]| [x + 7.4, y - 5.7]);
    assert!(pairs.len() > 15, "{}", pairs.len());
    let bits = usual_bits(&pairs);
    assert!(bits <= SAME_BITS, "{bits}");
}

#[test]
fn a_look_stays_when_the_image_is_turned() {
    let there = features(&scene(0.0, [0.0, 0.0], 1).image());
    for turn_rad in [0.35_f32, 1.2, 3.0] {
        let turned = features(&scene(f64::from(turn_rad), [0.0, 0.0], 2).image());
        let (sine, cosine) = turn_rad.sin_cos();
        let pairs = pairs(&there, &turned, |[x, y]| {
            let (x, y) = (x - 130.0, y - 130.0);
            [130.0 + cosine * x - sine * y, 130.0 + sine * x + cosine * y]
        });
        assert!(pairs.len() > 15, "{turn_rad}: {}", pairs.len());
        let bits = usual_bits(&pairs);
        assert!(bits <= SAME_BITS, "{turn_rad}: {bits}");
    }
}

#[test]
fn a_look_stays_when_the_light_is_another() {
    let there = features(&scene(0.0, [0.0, 0.0], 1).image());
    let darker = scene(0.0, [0.0, 0.0], 2).map(|level| 25.0 + 0.6 * level);
    let pairs = pairs(&there, &features(&darker.image()), |place| place);
    assert!(pairs.len() > 15, "{}", pairs.len());
    let bits = usual_bits(&pairs);
    assert!(bits <= SAME_BITS, "{bits}");
}

#[test]
fn different_places_look_different() {
    let all = features(&busy_picture(240, 180, 3).image());
    let mut distances = Vec::new();
    for (index, one) in all.iter().enumerate() {
        distances.extend(
            all[..index].iter().map(|other| one.descriptor.distance_bits(&other.descriptor)),
        );
    }
    distances.sort_unstable();
    let (median, low) = (distances[distances.len() / 2], distances[distances.len() / 20]);
    assert!(median > 70 && low > SAME_BITS, "median {median}, of twenty the lowest {low}");
}

#[test]
fn a_segment_without_length_or_image_has_a_descriptor_all_the_same() {
    let mut detector = LineDetector::new(LineConfig::default()).unwrap();
    let nowhere = crate::feature::lines::LineSegment {
        start_px: [f32::NAN, 1e30],
        end_px: [f32::INFINITY, -3.0],
        response: 0.0,
    };
    assert_eq!(detector.describe(&[nowhere])[0].descriptor, LineDescriptor::default());
    detector.detect(&Picture::flat(40, 40, 50.0).image());
    let far =
        crate::feature::lines::LineSegment { start_px: [-1e9, 5.0], end_px: [1e9, 5.0], ..nowhere };
    let point =
        crate::feature::lines::LineSegment { start_px: [5.0, 5.0], end_px: [5.0, 5.0], ..nowhere };
    for feature in detector.describe(&[nowhere, far, point]) {
        assert_eq!(feature.descriptor, LineDescriptor::default());
    }
}
