//! Matching of lines that are known to be the same.

use std::f32::consts::{PI, TAU};

use nalgebra::Point2;
use proptest::prelude::*;

use super::direction_bins::turn_rad;
use super::{
    DirectionBins, LineMatch, LineMatchConfig, ProjectedLine, ProjectedLineConfig, match_lines,
    match_projected_lines,
};
use crate::feature::lines::{LineDescriptor, LineFeature, LineSegment};

fn segment(start_px: [f32; 2], end_px: [f32; 2]) -> LineSegment {
    LineSegment { start_px, end_px, response: 10.0 }
}

/// A look that has nothing in common with that of another number (splitmix64).
fn look(number: u64) -> LineDescriptor {
    LineDescriptor(std::array::from_fn(|word| {
        let mixed = (number * 4 + word as u64).wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }))
}

/// The same descriptor with this many bits changed.
fn changed(mut look: LineDescriptor, bits: u32) -> LineDescriptor {
    for bit in 0..bits as usize {
        let bit = bit * 11 % 256;
        look.0[bit / 64] ^= 1 << (bit % 64);
    }
    look
}

fn feature(start_px: [f32; 2], end_px: [f32; 2], descriptor: LineDescriptor) -> LineFeature {
    LineFeature { segment: segment(start_px, end_px), descriptor }
}

fn projected(feature: &LineFeature) -> ProjectedLine {
    let point = |px: [f32; 2]| Point2::from(px.map(f64::from));
    ProjectedLine {
        start_px: point(feature.segment.start_px),
        end_px: point(feature.segment.end_px),
        descriptor: feature.descriptor,
    }
}

/// Segments in all directions.
fn star(count: usize) -> Vec<LineFeature> {
    (0..count)
        .map(|index| {
            let (sine, cosine) = (index as f32 * TAU / count as f32).sin_cos();
            let at = |far: f32| [200.0 + far * cosine, 200.0 + far * sine];
            feature(at(60.0), at(150.0), look(index as u64))
        })
        .collect()
}

fn guided(lines: &[ProjectedLine], features: &[LineFeature]) -> Vec<LineMatch> {
    let bins = DirectionBins::new(features);
    match_projected_lines(lines, features, &bins, &ProjectedLineConfig::default())
}

#[test]
fn a_distance_is_the_number_of_bits_that_differ() {
    assert_eq!(look(1).distance_bits(&look(1)), 0);
    assert_eq!(look(1).distance_bits(&changed(look(1), 17)), 17);
    let all = LineDescriptor([u64::MAX; 4]);
    assert_eq!(all.distance_bits(&LineDescriptor::default()), LineDescriptor::BITS);
    assert!((90..166).contains(&look(1).distance_bits(&look(2))));
}

#[test]
fn segments_find_their_like_whatever_the_order() {
    let from = star(40);
    let to: Vec<LineFeature> = from
        .iter()
        .rev()
        .map(|one| LineFeature { descriptor: changed(one.descriptor, 20), ..*one })
        .collect();
    let expected: Vec<LineMatch> =
        (0..40).map(|from| LineMatch { from, to: 39 - from, distance_bits: 20 }).collect();
    assert_eq!(match_lines(&from, &to, &LineMatchConfig::default()), expected);
    let lines: Vec<ProjectedLine> = from.iter().map(projected).collect();
    assert_eq!(guided(&lines, &to), expected);
}

#[test]
fn what_is_too_different_too_alike_to_another_or_taken_is_no_match() {
    let config = LineMatchConfig::default();
    let ends = |row: f32| ([10.0, row], [90.0, row]);
    let at = |row: f32, look| feature(ends(row).0, ends(row).1, look);
    let one = [at(50.0, look(1))];
    assert_eq!(match_lines(&one, &[at(50.0, changed(look(1), 64))], &config).len(), 1);
    assert_eq!(match_lines(&one, &[at(50.0, changed(look(1), 65))], &config), []);
    // Two of one look, 8 px apart.
    let twins = [at(50.0, changed(look(1), 40)), at(58.0, changed(look(1), 45))];
    assert_eq!(match_lines(&one, &twins, &config), []);
    assert_eq!(guided(&[projected(&one[0])], &twins), []);
    // Pieces of one line are no rivals where the line is predicted.
    let pieces = [
        feature([10.0, 50.0], [45.0, 50.0], changed(look(1), 45)),
        feature([50.0, 50.5], [90.0, 50.5], changed(look(1), 40)),
    ];
    let found = guided(&[projected(&one[0])], &pieces);
    assert_eq!(found, [LineMatch { from: 0, to: 1, distance_bits: 40 }]);
    // Two lines that want the same segment.
    let wanted = [at(50.0, look(1))];
    let lines = [at(49.0, changed(look(1), 30)), at(51.0, changed(look(1), 20))];
    let expected = [LineMatch { from: 1, to: 0, distance_bits: 20 }];
    assert_eq!(match_lines(&lines, &wanted, &config), expected);
    assert_eq!(guided(&lines.map(|line| projected(&line)), &wanted), expected);
}

#[test]
fn a_line_is_searched_for_where_it_is_predicted() {
    let line = projected(&feature([100.0, 100.0], [200.0, 100.0], look(1)));
    let finds = |start: [f32; 2], end: [f32; 2]| {
        !guided(&[line], &[feature(start, end, look(1))]).is_empty()
    };
    assert!(finds([100.0, 100.0], [200.0, 100.0]));
    // Beside it, turned a little, longer, a piece of it.
    assert!(finds([100.0, 114.0], [200.0, 114.0]) && finds([110.0, 92.0], [190.0, 104.0]));
    assert!(finds([0.0, 101.0], [400.0, 101.0]) && finds([150.0, 99.0], [170.0, 99.0]));
    // Too far beside it, rotated too much, reversed, ahead of it.
    assert!(!finds([100.0, 116.0], [200.0, 116.0]) && !finds([130.0, 93.0], [170.0, 107.0]));
    assert!(!finds([200.0, 100.0], [100.0, 100.0]) && !finds([190.0, 100.0], [290.0, 100.0]));
    // What is nowhere is not found.
    for end in
        [Point2::new(100.0, 100.0), Point2::new(f64::NAN, 1.0), Point2::new(f64::INFINITY, 1.0)]
    {
        let line = ProjectedLine { end_px: end, ..line };
        assert_eq!(guided(&[line], &star(5)), []);
    }
}

#[test]
fn bins_of_more_segments_than_there_are_find_those_that_are() {
    let features = star(20);
    let bins = DirectionBins::new(&features);
    let lines: Vec<ProjectedLine> = features.iter().map(projected).collect();
    let config = ProjectedLineConfig::default();
    let found = match_projected_lines(&lines, &features[..7], &bins, &config);
    assert_eq!(found.len(), 7);
    assert_eq!(match_projected_lines(&lines, &[], &bins, &config), []);
}

proptest! {
    #[test]
    fn bins_give_just_those_of_about_a_direction(
        directions in proptest::collection::vec(-10.0..10.0_f32, 0..60),
        sought_rad in -10.0..10.0_f32,
        max_turn_rad in prop_oneof![0.0..PI, Just(PI), Just(0.0)],
    ) {
        let features: Vec<LineFeature> = directions
            .iter()
            .map(|direction_rad| {
                feature([0.0, 0.0], [90.0 * direction_rad.cos(), 90.0 * direction_rad.sin()], look(1))
            })
            .collect();
        let mut near: Vec<usize> =
            DirectionBins::new(&features).near(sought_rad, max_turn_rad).collect();
        near.sort_unstable();
        let plain: Vec<usize> = (0..features.len())
            .filter(|&one| {
                turn_rad(sought_rad, features[one].segment.direction_rad()) <= max_turn_rad
            })
            .collect();
        prop_assert_eq!(near, plain);
    }
}

#[test]
fn each_bad_parameter_is_named() {
    type Spoil = fn(&mut ProjectedLineConfig);
    assert_eq!(ProjectedLineConfig::default().validate(), Ok(()));
    let cases: [(&str, Spoil); 5] = [
        ("max_distance_bits", |c| c.matching.max_distance_bits = 257),
        ("max_ratio", |c| c.matching.max_ratio = 0.0),
        ("max_turn_rad", |c| c.matching.max_turn_rad = 4.0),
        ("max_offset_px", |c| c.max_offset_px = f64::NAN),
        ("min_overlap", |c| c.min_overlap = -0.1),
    ];
    for (name, spoil) in cases {
        let mut config = ProjectedLineConfig::default();
        spoil(&mut config);
        let message = config.validate().unwrap_err().to_string();
        assert!(message.contains(name), "{message}");
    }
}
