//! Whether tracks keep their objects: identity switches as CLEAR MOT counts them (Bernardin and Stiefelhagen
//! 2008, section 2.1).

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Point3;
use report::{IDENTITY_GATE_M, IdentityScore};

/// The true objects and the tracks of a cycle. Positions in the map frame.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct IdentityCycle {
    /// The objects in view, by their labels.
    pub objects: BTreeMap<u16, Point3<f64>>,
    /// The tracks, by their numbers.
    pub tracks: BTreeMap<u32, Point3<f64>>,
}

/// Follows the objects by their tracks through the cycles of a run, in their order.
///
/// In each cycle an object keeps its track while that is within the gate; the remaining tracks are assigned to the other
/// objects, nearest pair first.
#[must_use]
pub fn score_identities(cycles: impl IntoIterator<Item = IdentityCycle>) -> IdentityScore {
    let mut last: BTreeMap<u16, u32> = BTreeMap::new();
    let mut score = IdentityScore::default();
    for cycle in cycles {
        score.sightings += cycle.objects.len();
        for (object, track) in matches(&cycle, &last) {
            score.followed += 1;
            if last.insert(object, track).is_some_and(|before| before != track) {
                score.switches += 1;
            }
        }
    }
    score
}

fn matches(cycle: &IdentityCycle, last: &BTreeMap<u16, u32>) -> BTreeMap<u16, u32> {
    let distance_m = |object: &Point3<f64>, track: &Point3<f64>| (object - track).xy().norm();
    let mut pairs = BTreeMap::new();
    for (&object, position) in &cycle.objects {
        let kept = last.get(&object).and_then(|track| Some((*track, cycle.tracks.get(track)?)));
        if let Some((track, at)) = kept
            && distance_m(position, at) <= IDENTITY_GATE_M
        {
            pairs.insert(object, track);
        }
    }
    let taken: BTreeSet<u32> = pairs.values().copied().collect();
    let mut candidates: Vec<(f64, u16, u32)> = cycle
        .objects
        .iter()
        .filter(|(object, _)| !pairs.contains_key(object))
        .flat_map(|(&object, position)| {
            let free = cycle.tracks.iter().filter(|(track, _)| !taken.contains(track));
            free.map(move |(&track, at)| (distance_m(position, at), object, track))
        })
        .filter(|(apart_m, ..)| *apart_m <= IDENTITY_GATE_M)
        .collect();
    candidates.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    let mut taken = taken;
    for (_, object, track) in candidates {
        if !pairs.contains_key(&object) && taken.insert(track) {
            pairs.insert(object, track);
        }
    }
    pairs
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cycle(objects: &[(u16, f64)], tracks: &[(u32, f64)]) -> IdentityCycle {
        let at = |y: f64| Point3::new(2.0, y, 0.0);
        IdentityCycle {
            objects: objects.iter().map(|(id, y)| (*id, at(*y))).collect(),
            tracks: tracks.iter().map(|(id, y)| (*id, at(*y))).collect(),
        }
    }

    fn switches(cycles: impl IntoIterator<Item = IdentityCycle>) -> usize {
        score_identities(cycles).switches
    }

    /// Two objects that walk through each other, with track numbers as `number` gives them.
    fn crossing(number: impl Fn(usize, u16) -> u32) -> usize {
        switches((0..=20).map(|step| {
            let y = step as f64 * 0.1 - 1.0;
            cycle(&[(1, y), (2, -y)], &[(number(step, 1), y), (number(step, 2), -y)])
        }))
    }

    #[test]
    fn tracks_that_keep_their_objects_are_no_switch() {
        assert_eq!(crossing(|_, object| u32::from(object)), 0);
    }

    #[test]
    fn two_that_change_places_are_two_switches() {
        // Within the gate an object keeps its old track, so the switch is counted once they are apart again.
        let swapped =
            |step: usize, object: u16| u32::from(if step > 10 { 3 - object } else { object });
        assert_eq!(crossing(swapped), 2);
    }

    #[test]
    fn a_new_number_for_the_same_object_is_a_switch_and_a_gap_is_none() {
        let lost = [
            cycle(&[(1, 0.0)], &[(7, 0.0)]),
            cycle(&[(1, 0.1)], &[]),
            cycle(&[(1, 0.2)], &[(7, 0.2)]),
        ];
        let score = score_identities(lost.clone());
        assert_eq!(score, IdentityScore { sightings: 3, followed: 2, switches: 0 });
        let renumbered = [lost[0].clone(), lost[1].clone(), cycle(&[(1, 0.2)], &[(8, 0.2)])];
        assert_eq!(switches(renumbered), 1);
    }

    #[test]
    fn a_track_far_away_belongs_to_nobody() {
        let cycles = [cycle(&[(1, 0.0)], &[(7, 0.0)]), cycle(&[(1, 0.1)], &[(8, 0.9)])];
        assert_eq!(switches(cycles), 0);
    }
}
