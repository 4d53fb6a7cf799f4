//! Which scans of a bag are used: those in which the platform moves least, from as many places as there are.

use std::collections::BTreeMap;

use nalgebra::Isometry3;

/// A scan in which the returns move by less than this is as good as one of a static platform: half of a range's noise.
const SLOW_M: f64 = 0.01;
/// If fewer scans are so slow, the slowest of all are used, up to this number.
const LEAST_SCANS: usize = 20;
/// Places are distinguished by the tile that they lie in ...
const TILE_M: f64 = 0.25;
/// ... and by their heading.
const SECTOR_RAD: f64 = 15.0 * std::f64::consts::PI / 180.0;

/// A scan that could be used.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Candidate {
    /// Its number in the bag.
    pub(super) scan: usize,
    /// How far the returns move within it, without correction.
    pub(super) motion_m: f64,
    /// Where the rig was.
    pub(super) map_from_rig: Isometry3<f64>,
}

/// The chosen scans.
#[derive(Clone, PartialEq, Debug, Default)]
pub(super) struct Chosen {
    /// Their numbers in the bag, in order.
    pub(super) scans: Vec<usize>,
    /// How far the returns move in the fastest of them.
    pub(super) most_motion_m: f64,
}

/// Chooses at most `most` scans: the same number from each place that has enough, spread over the time.
pub(super) fn choose(candidates: &[Candidate], most: usize) -> Chosen {
    let mut by_motion = candidates.to_vec();
    by_motion.sort_by(|a, b| a.motion_m.total_cmp(&b.motion_m).then(a.scan.cmp(&b.scan)));
    let slow = by_motion.partition_point(|candidate| candidate.motion_m <= SLOW_M);
    by_motion.truncate(slow.max(LEAST_SCANS));

    let mut places: BTreeMap<[i64; 4], Vec<Candidate>> = BTreeMap::new();
    for candidate in by_motion {
        places.entry(place_of(&candidate.map_from_rig)).or_default().push(candidate);
    }
    let mut places: Vec<Vec<Candidate>> = places.into_values().collect();
    // Places with few scans first: the rest of their share goes to the others.
    places.sort_by_key(Vec::len);
    let mut chosen: Vec<Candidate> = Vec::new();
    let count = places.len();
    for (index, mut place) in places.into_iter().enumerate() {
        place.sort_by_key(|candidate| candidate.scan);
        let left = most.saturating_sub(chosen.len());
        let share = left.div_ceil(count - index);
        chosen.extend(spread(&place, share.min(left)));
    }
    let most_motion_m = chosen.iter().map(|candidate| candidate.motion_m).fold(0.0, f64::max);
    let mut scans: Vec<usize> = chosen.iter().map(|candidate| candidate.scan).collect();
    scans.sort_unstable();
    Chosen { scans, most_motion_m }
}

fn place_of(pose: &Isometry3<f64>) -> [i64; 4] {
    let tile = |value_m: f64| (value_m / TILE_M).floor() as i64;
    let (_, _, yaw_rad) = pose.rotation.euler_angles();
    let shift = pose.translation.vector;
    [tile(shift.x), tile(shift.y), tile(shift.z), (yaw_rad / SECTOR_RAD).floor() as i64]
}

/// `count` of them, evenly spread.
fn spread(candidates: &[Candidate], count: usize) -> Vec<Candidate> {
    let all = candidates.len();
    if all <= count {
        return candidates.to_vec();
    }
    (0..count).filter_map(|index| candidates.get(index * all / count).copied()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn candidate(scan: usize, motion_m: f64, x_m: f64) -> Candidate {
        Candidate { scan, motion_m, map_from_rig: Isometry3::translation(x_m, 0.0, 0.0) }
    }

    #[test]
    fn the_scans_of_one_place_are_spread_over_the_time() {
        let candidates: Vec<Candidate> = (0..1000).map(|scan| candidate(scan, 0.0, 0.1)).collect();
        let chosen = choose(&candidates, 10);
        assert_eq!(chosen.scans, [0, 100, 200, 300, 400, 500, 600, 700, 800, 900]);
        assert_eq!(choose(&candidates[..4], 10).scans, [0, 1, 2, 3]);
        assert_eq!(choose(&[], 10), Chosen::default());
    }

    #[test]
    fn each_place_has_its_share_and_fast_scans_are_left_out() {
        // Long at one place, briefly at another, fast in between.
        let candidates: Vec<Candidate> = (0..90)
            .map(|scan| candidate(scan, 0.001, 0.1))
            .chain((90..100).map(|scan| candidate(scan, 0.2, 0.5)))
            .chain((100..110).map(|scan| candidate(scan, 0.002, 1.1)))
            .collect();
        let chosen = choose(&candidates, 40);
        assert_eq!(chosen.scans.len(), 40);
        assert_eq!(chosen.scans.iter().filter(|scan| **scan >= 100).count(), 10);
        assert!(!chosen.scans.iter().any(|scan| (90..100).contains(scan)));
        assert!((chosen.most_motion_m - 0.002).abs() < 1e-12);
    }

    #[test]
    fn the_slowest_scans_are_chosen_if_the_platform_never_stops() {
        let candidates: Vec<Candidate> =
            (0..100).map(|scan| candidate(scan, 0.05 + 0.001 * scan as f64, 0.1)).collect();
        let chosen = choose(&candidates, 50);
        assert_eq!(chosen.scans, (0..20).collect::<Vec<_>>());
        assert!(chosen.most_motion_m > 0.05);
    }
}
