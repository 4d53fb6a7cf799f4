//! Where the table comes from, and that it is this.
//!
//! Pairs of pixels are drawn from a normal distribution about the patch's middle, as Calonder et al. 2010 found best
//! (their "G II", with a variance of a 25th of the patch's side squared). Of many, 256 are chosen as Rublee et al. 2011 do,
//! section 4.3: those whose outcome over many corners is nearest to a tossed coin's come first, and each that is
//! too much like one before it is skipped. The corners are those of pictures of discs of all sizes that lie upon
//! each other (dead leaves), which share the statistics of natural images (Lee, Mumford and Huang 2001), so that the table
//! favours no scene.

use std::collections::BTreeSet;

use super::{PATTERN, TESTS};
use crate::{
    feature::points::{
        orientation::{Direction, PATCH_RADIUS_PX, direction},
        segment_test::row_strengths,
    },
    image::blurred,
    testing::{Random, dead_leaves},
};

const SIDE_PX: usize = 256;
const PICTURES: u64 = 8;
const LEAVES: usize = 3000;
const DRAWN: usize = 3000;
const CORNERS: usize = 1024;
const WORDS: usize = CORNERS / 64;
const STRENGTH: u8 = 20;
/// The tolerated likeness at first (a correlation), and by how much it grows until there are enough pairs.
const LIKENESS: f64 = 0.1;
const LIKENESS_STEP: f64 = 0.05;

/// The pairs, all different, that turned by any angle stay within the patch.
fn draw(random: &mut Random) -> Vec<[i8; 4]> {
    let deviation = (2 * PATCH_RADIUS_PX + 1) as f64 / 5.0;
    let mut drawn = BTreeSet::new();
    let mut pairs = Vec::new();
    while pairs.len() < DRAWN {
        let pair = [(); 4].map(|()| (random.normal() * deviation).round() as i32);
        let is_inside =
            |x: i32, y: i32| x * x + y * y <= (PATCH_RADIUS_PX * PATCH_RADIUS_PX) as i32;
        if !is_inside(pair[0], pair[1]) || !is_inside(pair[2], pair[3]) || pair[..2] == pair[2..] {
            continue;
        }
        let pair = pair.map(|coordinate| coordinate as i8);
        if drawn.insert(pair) && drawn.insert([pair[2], pair[3], pair[0], pair[1]]) {
            pairs.push(pair);
        }
    }
    pairs
}

/// The outcomes of all pairs at many corners, a bit each.
fn outcomes(pairs: &[[i8; 4]], random: &mut Random) -> Vec<[u64; WORDS]> {
    let mut outcomes = vec![[0; WORDS]; pairs.len()];
    let mut corner = 0;
    for _ in 0..PICTURES {
        let picture = blurred(&dead_leaves(SIDE_PX, LEAVES, random)).unwrap();
        let smooth = blurred(&picture).unwrap();
        let mut strengths = [0; SIDE_PX];
        let mut taken = 0;
        for row in (16..SIDE_PX - 16).step_by(5) {
            row_strengths(
                std::array::from_fn(|offset| picture.row(row + offset - 3)),
                STRENGTH,
                &mut strengths,
            );
            for column in (16..SIDE_PX - 16).step_by(3) {
                if strengths[column] == 0
                    || corner == CORNERS
                    || taken == CORNERS / PICTURES as usize
                {
                    continue;
                }
                let Direction { x: cos, y: sin } = direction(&picture, column, row).unwrap();
                let at = |x: i8, y: i8| {
                    let (x, y) = (f32::from(x), f32::from(y));
                    let (right, down) = ((x * cos - y * sin).round(), (x * sin + y * cos).round());
                    smooth
                        .pixel((column as f32 + right) as usize, (row as f32 + down) as usize)
                        .unwrap()
                };
                for (outcome, pair) in outcomes.iter_mut().zip(pairs) {
                    let is_darker = at(pair[0], pair[1]) < at(pair[2], pair[3]);
                    outcome[corner / 64] |= u64::from(is_darker) << (corner % 64);
                }
                corner += 1;
                taken += 1;
            }
        }
    }
    assert_eq!(corner, CORNERS);
    outcomes
}

fn generate() -> Vec<[i8; 4]> {
    let mut random = Random::new(1);
    let pairs = draw(&mut random);
    let outcomes = outcomes(&pairs, &mut random);
    let ones = |outcome: &[u64; WORDS]| outcome.iter().map(|word| word.count_ones()).sum::<u32>();
    let mut order: Vec<usize> = (0..pairs.len()).collect();
    order.sort_by_key(|&index| ones(&outcomes[index]).abs_diff(CORNERS as u32 / 2));
    let likeness = |a: usize, b: usize| {
        let different: u32 =
            outcomes[a].iter().zip(outcomes[b]).map(|(a, b)| (a ^ b).count_ones()).sum();
        (1.0 - 2.0 * f64::from(different) / CORNERS as f64).abs()
    };
    let mut tolerated = LIKENESS;
    let mut chosen: Vec<usize> = Vec::new();
    while chosen.len() < TESTS {
        for &index in &order {
            if chosen.len() < TESTS
                && !chosen.contains(&index)
                && chosen.iter().all(|&before| likeness(index, before) < tolerated)
            {
                chosen.push(index);
            }
        }
        tolerated += LIKENESS_STEP;
    }
    chosen.into_iter().map(|index| pairs[index]).collect()
}

#[test]
fn the_table_is_what_the_generator_makes() {
    let generated = generate();
    if generated != PATTERN {
        for pair in &generated {
            println!("    {pair:?},");
        }
        panic!("the table is another: see above for what it must be");
    }
}
