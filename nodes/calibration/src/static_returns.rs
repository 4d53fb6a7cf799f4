//! Which returns are of static surfaces: those that other cycles, seen from the same place, have too.

use std::collections::BTreeMap;

use nalgebra::Isometry3;

use crate::calibrate::Cycle;
use crate::config::CalibrationConfig;

/// Cycles whose poses differ by less were seen from the same place: less than the noise of a range ...
const SAME_PLACE_M: f64 = 0.02;
/// ... and half of a beam's step.
const SAME_HEADING_RAD: f64 = 0.5 * std::f64::consts::PI / 180.0;
/// Fewer cycles from one place cannot separate static from moving surfaces.
const MIN_CYCLES: usize = 8;
/// A static surface is hit in at least this share of the cycles, by the beam itself or by one beside it. A person who
/// walks across at 1 m/s is hit by a beam for half a second.
const MIN_SHARE: f64 = 0.15;
/// Two ranges are the same within this many standard deviations.
const SAME_RANGE_STD_DEVS: f64 = 5.0;

/// For each cycle the number of its view: cycles of one view were seen from the same place. Cycles without a pose
/// are of one view: there is no other sign of a motion.
#[must_use]
pub fn views_of(cycles: &[Cycle]) -> Vec<usize> {
    let mut places: Vec<Option<Isometry3<f64>>> = Vec::new();
    cycles
        .iter()
        .map(|cycle| {
            let pose = cycle.map_from_rig;
            let known = places.iter().position(|place| is_same(place.as_ref(), pose.as_ref()));
            known.unwrap_or_else(|| {
                places.push(pose);
                places.len() - 1
            })
        })
        .collect()
}

fn is_same(place: Option<&Isometry3<f64>>, pose: Option<&Isometry3<f64>>) -> bool {
    match (place, pose) {
        (None, None) => true,
        (Some(place), Some(pose)) => {
            let moved_m = (place.translation.vector - pose.translation.vector).norm();
            moved_m < SAME_PLACE_M && place.rotation.angle_to(&pose.rotation) < SAME_HEADING_RAD
        }
        _ => false,
    }
}

/// For each return of each cycle whether it is of a static surface, as far as can be decided: on a platform that moves
/// all the time every return may be.
#[must_use]
pub fn static_returns(
    cycles: &[Cycle],
    views: &[usize],
    config: &CalibrationConfig,
) -> Vec<Vec<bool>> {
    let ranges = ranges_by_beam(cycles, views);
    let mut cycles_of_view: BTreeMap<usize, usize> = BTreeMap::new();
    for view in views {
        *cycles_of_view.entry(*view).or_default() += 1;
    }
    cycles
        .iter()
        .zip(views)
        .map(|(cycle, view)| {
            let cycles_in_view = cycles_of_view.get(view).copied().unwrap_or(0);
            let is_static = |beam: usize, range_m: f64| {
                let gate_m = SAME_RANGE_STD_DEVS * config.range_std_dev_m(range_m);
                let hit = |beam: usize| {
                    let hit = ranges.get(&(*view, beam)).map_or(&[][..], Vec::as_slice);
                    let below = |bound_m: f64| hit.partition_point(|other_m| *other_m < bound_m);
                    below(range_m + gate_m) - below(range_m - gate_m)
                };
                let beside = [beam.checked_sub(1), Some(beam), beam.checked_add(1)];
                let most = beside.into_iter().flatten().map(hit).max().unwrap_or(0);
                most as f64 >= MIN_SHARE * cycles_in_view as f64
            };
            let can_tell = cycles_in_view >= MIN_CYCLES;
            cycle.returns.iter().map(|one| !can_tell || is_static(one.beam, one.range_m)).collect()
        })
        .collect()
}

/// The ranges of each beam from each place, sorted.
fn ranges_by_beam(cycles: &[Cycle], views: &[usize]) -> BTreeMap<(usize, usize), Vec<f64>> {
    let mut ranges: BTreeMap<(usize, usize), Vec<f64>> = BTreeMap::new();
    for (cycle, view) in cycles.iter().zip(views) {
        for one in &cycle.returns {
            ranges.entry((*view, one.beam)).or_default().push(one.range_m);
        }
    }
    for hit in ranges.values_mut() {
        hit.sort_unstable_by(f64::total_cmp);
    }
    ranges
}

#[cfg(test)]
mod tests {
    use geometry::{DepthImage, DepthPixels, Stamp};

    use super::*;
    use crate::LidarReturn;

    fn cycle(ranges_m: &[f64], pose: Isometry3<f64>) -> Cycle {
        let pixels = DepthPixels::Millimetres(Vec::new());
        let image = DepthImage::new(Stamp::default(), String::new(), (0, 0), pixels).unwrap();
        let returns = ranges_m
            .iter()
            .enumerate()
            .map(|(beam, range_m)| LidarReturn {
                beam,
                azimuth_rad: 0.0,
                range_m: *range_m,
                step_rad: 0.017,
                image_rig_from_rig: Isometry3::identity(),
            })
            .collect();
        Cycle { returns, image, map_from_rig: Some(pose) }
    }

    #[test]
    fn a_person_who_walks_across_is_separated_from_the_wall_and_a_flickering_edge_is_kept() {
        let here = Isometry3::identity();
        // Beam 0 sees the wall; beam 1 an edge that it hits in a fifth of the cycles; somebody passes
        // both in one cycle.
        let cycles: Vec<Cycle> = (0..20)
            .map(|index| match index {
                7 => cycle(&[2.0, 2.0], here),
                _ if index % 5 == 0 => cycle(&[4.0, 3.0], here),
                _ => cycle(&[4.0, 4.0], here),
            })
            .collect();
        let still = static_returns(&cycles, &views_of(&cycles), &CalibrationConfig::default());
        assert_eq!(still[7], [false, false]);
        assert_eq!(still[5], [true, true]);
        assert!(still.iter().enumerate().all(|(index, row)| index == 7 || row == &[true, true]));
    }

    #[test]
    fn places_are_kept_apart_and_a_few_cycles_decide_nothing() {
        let cycles: Vec<Cycle> = (0..9)
            .map(|index| {
                cycle(
                    &[f64::from(index)],
                    Isometry3::translation(0.3 * f64::from(index / 3), 0.0, 0.0),
                )
            })
            .collect();
        let views = views_of(&cycles);
        assert_eq!(views, [0, 0, 0, 1, 1, 1, 2, 2, 2]);
        let still = static_returns(&cycles, &views, &CalibrationConfig::default());
        assert!(still.iter().all(|row| row == &[true]));
    }
}
