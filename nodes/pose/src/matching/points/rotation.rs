//! Matches that turn as most do.

use std::f32::consts::{PI, TAU};

/// The histogram's bins, 10 degrees each.
const BINS: usize = 36;
/// Fewer matches have no "most".
const MIN_MATCHES: usize = 8;

/// Which of the turns, in radians, lie within the tolerance of what most turn: of the mean of the fullest three bins
/// in a row. All of them where they are fewer than eight.
pub(super) fn consistent(turns_rad: &[f32], tolerance_rad: f32) -> Vec<bool> {
    if turns_rad.len() < MIN_MATCHES || tolerance_rad >= PI {
        return vec![true; turns_rad.len()];
    }
    let mut counts = [0_usize; BINS];
    for &turn_rad in turns_rad {
        if let Some(count) = counts.get_mut(bin(turn_rad)) {
            *count += 1;
        }
    }
    let around = |bin: usize| [bin + BINS - 1, bin, bin + 1].map(|bin| bin % BINS);
    let count = |bin: &usize| around(*bin).map(|bin| counts[bin]).iter().sum::<usize>();
    // Of equally full ones the first.
    let fullest = (0..BINS).rev().max_by_key(count).unwrap_or_default();
    let middle_rad = (fullest as f32 + 0.5) * TAU / BINS as f32;
    let (mut sum_rad, mut summed) = (0.0, 0);
    for &turn_rad in turns_rad.iter().filter(|&&turn_rad| around(fullest).contains(&bin(turn_rad)))
    {
        sum_rad += wrapped(turn_rad - middle_rad);
        summed += 1;
    }
    let mean_rad = middle_rad + sum_rad / summed.max(1) as f32;
    turns_rad.iter().map(|&turn_rad| wrapped(turn_rad - mean_rad).abs() <= tolerance_rad).collect()
}

/// The bin of a turn.
fn bin(turn_rad: f32) -> usize {
    (turn_rad.rem_euclid(TAU) / TAU * BINS as f32) as usize % BINS
}

/// The same angle in [-pi, pi).
fn wrapped(angle_rad: f32) -> f32 {
    (angle_rad + PI).rem_euclid(TAU) - PI
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_turn_of_most_is_kept_wherever_it_lies_on_the_circle() {
        for turn in 0..72 {
            let common_rad = turn as f32 * 5.0_f32.to_radians() - PI;
            let offsets_deg =
                [-12.0_f32, -8.0, -3.0, -1.0, 0.0, 2.0, 5.0, 9.0, 14.0, 95.0, 180.0, -60.0];
            let turns_rad = offsets_deg.map(|offset| wrapped(common_rad + offset.to_radians()));
            let kept = consistent(&turns_rad, 20.0_f32.to_radians());
            let expected = offsets_deg.map(|offset| offset.abs() < 20.0);
            assert_eq!(kept, expected, "{common_rad}");
        }
    }

    #[test]
    fn few_matches_and_a_tolerance_of_a_half_turn_keep_all() {
        assert_eq!(consistent(&[0.0, 2.0, -2.0], 0.1), [true; 3]);
        assert_eq!(consistent(&[0.0, 2.0, -2.0, 1.0, 3.0, 0.5, -0.5, -1.0], PI), [true; 8]);
        assert_eq!(consistent(&[], 0.1), [false; 0]);
        assert_eq!(consistent(&[f32::NAN; 8], 0.1), [false; 8]);
    }
}
