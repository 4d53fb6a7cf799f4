//! Which surfaces both sensors show in nearly every cycle from one place. One that shows now and then does so by chance, with a
//! bias: an edge that is missed whenever the beam beside it hits something else seems to be where it is not.

use std::collections::BTreeMap;

use crate::constraint::{Constraint, Kind};

/// From fewer cycles of one place nothing is concluded.
const MIN_CYCLES: usize = 8;
/// A plane recurs in this share of them: of a beam that may miss its return, or a patch with holes, at least half are left.
const PLANE_SHARE: f64 = 0.5;
/// An edge recurs in this share: what the others would have said moves it by a tenth of a beam's step at most.
const EDGE_SHARE: f64 = 0.9;
/// Edges are the same within this share of a beam's step, as the camera sees them.
const SAME_EDGE_STEPS: f64 = 0.5;

/// A constraint, the cycle it is of, and what it shares errors with.
#[derive(Clone, Copy, Debug)]
pub(crate) struct InCycle {
    pub(crate) cycle: usize,
    pub(crate) constraint: Constraint,
    /// Constraints of one group are of one beam on a plane, or of one edge, from one place.
    pub(crate) group: usize,
}

/// Which constraint it is: its cycle, its beam, its kind.
pub(crate) type Key = (usize, usize, Kind);

impl InCycle {
    pub(crate) fn key(&self) -> Key {
        (self.cycle, self.constraint.beam, self.constraint.kind)
    }
}

/// The constraints of surfaces that recur, in the order in which they came; `views` has for each cycle from
/// which place it was seen.
pub(crate) fn repeated(constraints: Vec<(usize, Constraint)>, views: &[usize]) -> Vec<InCycle> {
    let view_of = |cycle: usize| views.get(cycle).copied().unwrap_or(0);
    let mut cycles_of_view: BTreeMap<usize, usize> = BTreeMap::new();
    for view in views {
        *cycles_of_view.entry(*view).or_default() += 1;
    }
    let edges = edges_by_place(&constraints, view_of);
    let mut groups: BTreeMap<(usize, Kind, usize), usize> = BTreeMap::new();
    let grouped: Vec<InCycle> = constraints
        .into_iter()
        .enumerate()
        .map(|(index, (cycle, constraint))| {
            let which = edges.get(&index).copied().unwrap_or(constraint.beam);
            let next = groups.len();
            let group = *groups.entry((view_of(cycle), constraint.kind, which)).or_insert(next);
            InCycle { cycle, constraint, group }
        })
        .collect();
    let mut sizes = vec![0_usize; groups.len()];
    for one in &grouped {
        if let Some(size) = sizes.get_mut(one.group) {
            *size += 1;
        }
    }
    grouped
        .into_iter()
        .filter(|one| {
            let cycles = cycles_of_view.get(&view_of(one.cycle)).copied().unwrap_or(0);
            let size = sizes.get(one.group).copied().unwrap_or(0);
            let share = match one.constraint.kind {
                Kind::Plane => PLANE_SHARE,
                Kind::Edge => EDGE_SHARE,
            };
            cycles < MIN_CYCLES || size as f64 >= share * cycles as f64
        })
        .collect()
}

/// For each constraint that is an edge, by its index, the number of the edge among those of its view: neighbours in
/// the image are one.
fn edges_by_place(
    constraints: &[(usize, Constraint)],
    view_of: impl Fn(usize) -> usize,
) -> BTreeMap<usize, usize> {
    let mut sorted: Vec<(usize, f64, f64, usize)> = constraints
        .iter()
        .enumerate()
        .filter(|(_, (_, constraint))| constraint.kind == Kind::Edge)
        .map(|(index, (cycle, constraint))| {
            // The plane through the camera and an upright edge faces aside.
            let normal = constraint.surface.normal;
            let azimuth_rad = (-normal.z / normal.x).atan();
            (view_of(*cycle), azimuth_rad, constraint.step_rad, index)
        })
        .collect();
    sorted.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.3.cmp(&b.3)));
    let mut numbers = BTreeMap::new();
    let mut number = 0;
    let mut before: Option<(usize, f64)> = None;
    for (view, azimuth_rad, step_rad, index) in sorted {
        let is_same = before.is_some_and(|(other, at_rad)| {
            other == view && azimuth_rad - at_rad < SAME_EDGE_STEPS * step_rad
        });
        if !is_same {
            number += 1;
        }
        before = Some((view, azimuth_rad));
        numbers.insert(index, number);
    }
    numbers
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Point3, Vector3};

    use super::*;
    use crate::optics::Surface;

    fn constraint(beam: usize, kind: Kind, azimuth_rad: f64) -> Constraint {
        Constraint {
            beam,
            kind,
            step_rad: 0.0175,
            point_in_lidar_m: Point3::origin(),
            image_rig_from_rig: Isometry3::identity(),
            surface: Surface {
                normal: Vector3::new(azimuth_rad.cos(), 0.0, -azimuth_rad.sin()),
                offset_m: 0.0,
                std_dev_m: 0.01,
                normal_std_dev_rad: 0.01,
            },
            std_dev_m: 0.02,
        }
    }

    #[test]
    fn only_repeated_constraints_count_and_an_edge_is_one_whichever_beam_hits_it() {
        let mut constraints = Vec::new();
        for cycle in 0..20 {
            constraints.push((cycle, constraint(5, Kind::Plane, 0.0)));
            if cycle % 6 == 0 {
                constraints.push((cycle, constraint(6, Kind::Plane, 0.0)));
            }
            // One edge between two beams, and one that is seen in half of the cycles only.
            let jitter_rad = 0.001 * f64::from(cycle as i32 % 3);
            constraints.push((cycle, constraint(10 + cycle % 2, Kind::Edge, 0.2 + jitter_rad)));
            if cycle % 2 == 0 {
                constraints.push((cycle, constraint(13, Kind::Edge, 0.25)));
            }
        }
        let kept = repeated(constraints.clone(), &[0; 20]);
        assert_eq!(kept.len(), 40);
        let edges: Vec<&InCycle> =
            kept.iter().filter(|one| one.constraint.kind == Kind::Edge).collect();
        assert!(edges.iter().all(|one| one.constraint.beam < 13 && one.group == edges[0].group));
        assert!(kept.iter().all(|one| one.constraint.beam != 6));
        // From each place a few cycles only: nothing is concluded, and edges of two places are two.
        let views: Vec<usize> = (0..20).map(|cycle| cycle / 4).collect();
        let all = repeated(constraints.clone(), &views);
        assert_eq!(all.len(), constraints.len());
        assert_ne!(all[0].group, all[all.len() - 2].group);
    }
}
