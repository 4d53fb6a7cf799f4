use nalgebra::{Matrix3, Point2};

use super::*;
use crate::{
    feature::points::{Corner, Descriptor, PointConfig, PointExtractor},
    testing::{Random, dead_leaves, mapped, similarity, view},
};

const VIEW_PX: (usize, usize) = (320, 240);
const PICTURE_PX: usize = 900;

/// The corners of two views of a picture, the second turned and nearer, and what takes a pixel of the first to it.
fn two_views() -> (Vec<Corner>, Vec<Corner>, Matrix3<f64>) {
    let picture = dead_leaves(PICTURE_PX, 8000, &mut Random::new(5));
    let config = PointConfig { max_corners: 400, ..PointConfig::default() };
    let mut extractor = PointExtractor::new(config).unwrap();
    let mut of = |from_view: &Matrix3<f64>| extractor.extract(&view(&picture, from_view, VIEW_PX));
    let first = similarity(0.0, 2.0, VIEW_PX, PICTURE_PX);
    let second = similarity(0.35, 1.85, VIEW_PX, PICTURE_PX);
    (of(&first), of(&second), second.try_inverse().unwrap() * first)
}

/// Whether a match is right: within two pixels of the coarser corner's level.
fn is_right(
    pair: &PointMatch,
    first: &[Corner],
    second: &[Corner],
    second_from_first: &Matrix3<f64>,
) -> bool {
    let (sought, found) = (&first[pair.sought], &second[pair.found]);
    let there = mapped(second_from_first, sought.pixel.cast());
    let tolerance_px = 2.0 * 1.2_f64.powi(i32::from(sought.level.max(found.level)));
    (found.pixel.cast::<f64>() - there).norm() < tolerance_px
}

#[test]
fn corners_of_a_turned_view_are_matched() {
    let (first, second, second_from_first) = two_views();
    let matches = match_all(&first, &second, &MatchConfig::default());
    let right =
        matches.iter().filter(|pair| is_right(pair, &first, &second, &second_from_first)).count();
    println!("{right} of {} matches right, of {} corners", matches.len(), first.len());
    assert!(right as f64 > 0.95 * matches.len() as f64 && right > first.len() / 4);
    let without = MatchConfig { rotation_tolerance_rad: 4.0, ..MatchConfig::default() };
    assert!(match_all(&first, &second, &without).len() >= matches.len());
}

#[test]
fn a_prediction_finds_more_of_them() {
    let (first, second, second_from_first) = two_views();
    let blind = match_all(&first, &second, &MatchConfig::default()).len();
    let prediction = |corner: &Corner| PredictedCorner {
        // Three pixels wrong.
        pixel: mapped(&second_from_first, corner.pixel.cast()).cast()
            + nalgebra::Vector2::new(2.0, -2.2),
        level: corner.level,
        angle_rad: Some(corner.angle_rad),
        descriptor: corner.descriptor,
    };
    let predictions: Vec<_> = first.iter().map(prediction).collect();
    let grid = CornerGrid::new(&second);
    let config = GuidedConfig { radius_px: 5.0, ..GuidedConfig::default() };
    let matches = match_guided(&predictions, &grid, &config);
    let right =
        matches.iter().filter(|pair| is_right(pair, &first, &second, &second_from_first)).count();
    println!("{right} of {} guided matches right, {blind} blind ones", matches.len());
    assert!(right as f64 > 0.9 * matches.len() as f64 && right > blind);
    let mut found: Vec<_> = matches.iter().map(|pair| pair.found).collect();
    found.sort_unstable();
    found.dedup();
    assert_eq!(found.len(), matches.len());
    assert!(matches.is_sorted_by_key(|pair| pair.sought));
}

fn corner(descriptor: Descriptor) -> Corner {
    Corner { pixel: Point2::new(50.0, 50.0), level: 0, angle_rad: 0.0, response: 1.0, descriptor }
}

/// The rules of blind matching, said plainly.
#[test]
fn blind_matching_is_what_looking_at_all_pairs_gives() {
    let mut random = Random::new(6);
    let base: Vec<Descriptor> =
        (0..60).map(|_| Descriptor([(); 4].map(|()| random.bits()))).collect();
    let mut noisy = |share: f64| {
        let flip = |descriptor: &Descriptor, random: &mut Random| {
            let mut bits = descriptor.0;
            for bit in 0..256 {
                if random.uniform() < share {
                    bits[bit / 64] ^= 1 << (bit % 64);
                }
            }
            corner(Descriptor(bits))
        };
        base.iter().map(|descriptor| flip(descriptor, &mut random)).collect::<Vec<_>>()
    };
    let (mut first, second) = (noisy(0.05), [noisy(0.1), noisy(0.3)].concat());
    first.extend_from_within(..5);
    let config = MatchConfig { max_distance: 80, ..MatchConfig::default() };
    let nearest = |from: &Corner, among: &[Corner]| {
        let mut order: Vec<_> = among
            .iter()
            .enumerate()
            .map(|(index, other)| (from.descriptor.distance(&other.descriptor), index))
            .collect();
        order.sort_unstable();
        order
    };
    let mut expected = Vec::new();
    for (sought, from) in first.iter().enumerate() {
        let order = nearest(from, &second);
        let (distance, found) = order[0];
        let is_mutual = nearest(&second[found], &first)[0].1 == sought;
        if is_mutual && distance <= 80 && (distance as f32) < 0.8 * order[1].0 as f32 {
            expected.push(PointMatch { sought, found, distance });
        }
    }
    assert!(expected.len() > 40, "{}", expected.len());
    assert_eq!(match_all(&first, &second, &config), expected);
}

#[test]
fn nothing_matches_nothing() {
    let one = [corner(Descriptor::default())];
    let config = MatchConfig::default();
    assert_eq!(match_all(&[], &one, &config), []);
    assert_eq!(match_all(&one, &[], &config), []);
    let only = PointMatch { sought: 0, found: 0, distance: 0 };
    assert_eq!(match_all(&one, &one, &config), [only]);
    let prediction = PredictedCorner {
        pixel: Point2::new(55.0, 50.0),
        level: 0,
        angle_rad: None,
        descriptor: Descriptor::default(),
    };
    let grid = CornerGrid::new(&one);
    let guided = |prediction| match_guided(&[prediction], &grid, &GuidedConfig::default());
    assert_eq!(guided(prediction), [only]);
    assert_eq!(guided(PredictedCorner { level: 2, ..prediction }), []);
    assert_eq!(guided(PredictedCorner { pixel: Point2::new(66.0, 50.0), ..prediction }), []);
    assert_eq!(guided(PredictedCorner { descriptor: Descriptor([u64::MAX; 4]), ..prediction }), []);
    assert_eq!(guided(PredictedCorner { pixel: Point2::new(f32::NAN, 50.0), ..prediction }), []);
    let mut invalid = GuidedConfig::default();
    assert_eq!(invalid.validate(), Ok(()));
    invalid.radius_px = 0.0;
    assert!(invalid.validate().unwrap_err().to_string().contains("radius_px"));
}

/// A descriptor with this many bits set.
fn bits(count: u32) -> Descriptor {
    Descriptor([u64::MAX.checked_shr(64 - count).unwrap_or(0), 0, 0, 0])
}

fn prediction(descriptor: Descriptor) -> PredictedCorner {
    PredictedCorner { pixel: Point2::new(50.0, 50.0), level: 0, angle_rad: None, descriptor }
}

#[test]
fn two_corners_alike_are_distinguished_only_on_different_levels() {
    let sought = [prediction(bits(0))];
    let (near, rival) = (corner(bits(20)), corner(bits(21)));
    let matched = |corners: &[Corner]| {
        match_guided(&sought, &CornerGrid::new(corners), &GuidedConfig::default())
    };
    let first = PointMatch { sought: 0, found: 0, distance: 20 };
    assert_eq!(matched(&[near, rival]), []);
    assert_eq!(matched(&[near, Corner { level: 1, ..rival }]), [first]);
    assert_eq!(matched(&[near, corner(bits(40))]), [first]);
    assert_eq!(matched(&[corner(bits(40)), near]), [PointMatch { found: 1, ..first }]);
}

#[test]
fn of_two_predictions_the_nearer_has_the_corner() {
    let corners = [corner(bits(10))];
    let grid = CornerGrid::new(&corners);
    let matched = |counts: [u32; 3]| {
        match_guided(&counts.map(|count| prediction(bits(count))), &grid, &GuidedConfig::default())
    };
    let has_it = |sought, distance| [PointMatch { sought, found: 0, distance }];
    assert_eq!(matched([0, 12, 20]), has_it(1, 2));
    assert_eq!(matched([9, 0, 20]), has_it(0, 1));
    assert_eq!(matched([12, 8, 0]), has_it(0, 2));
}
