//! Groups of points to objects: fragments of one body are joined, and a group in which two objects are predicted is split.

use nalgebra::Point3;

use super::observation::CycleView;

/// Groups whose footprints are nearer than this are one object: legs and trunk with a table between.
const JOIN_M: f64 = 0.2;
/// A group above another belongs to the same object across a gap of this, half the width of a body: between them are black
/// trousers, or a pole that is too thin.
const GAP_ABOVE_M: f64 = 0.4;
/// An object is expected in a group when a point of it is horizontally so near to its centre: a body's depth,
/// and what it may have swerved.
const CLAIM_M: f64 = 0.3;
/// A part with fewer points is no object of its own.
const MIN_PART_POINTS: usize = 4;

/// The points of one object, as far as the cycle shows.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct Cluster {
    /// Its points, ascending.
    pub(super) points: Vec<usize>,
    /// Whether predictions split it from others.
    pub(super) is_split: bool,
}

/// The objects that groups of points make up, where objects are expected at `expected` in the map.
pub(super) fn clusters(
    cycle: &CycleView<'_>,
    groups: &[&[usize]],
    expected: &[Point3<f64>],
) -> Vec<Cluster> {
    joined(cycle, groups).into_iter().flat_map(|points| parted(cycle, points, expected)).collect()
}

fn horizontal_m(a: &Point3<f64>, b: &Point3<f64>) -> f64 {
    (a.xy() - b.xy()).norm()
}

/// Joins groups whose footprints come near each other, and those above another across a gap.
fn joined(cycle: &CycleView<'_>, groups: &[&[usize]]) -> Vec<Vec<usize>> {
    let place = |index: usize| &cycle.points.in_map[index];
    let heights_m = |group: &[usize]| {
        group
            .iter()
            .map(|&index| place(index).z)
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), z_m| {
                (least.min(z_m), most.max(z_m))
            })
    };
    let touch = |a: &[usize], b: &[usize]| {
        let (least_a, most_a) = heights_m(a);
        let (least_b, most_b) = heights_m(b);
        let gap_m = if least_a > most_b || least_b > most_a { GAP_ABOVE_M } else { JOIN_M };
        a.iter().any(|&i| b.iter().any(|&j| horizontal_m(place(i), place(j)) <= gap_m))
    };
    let mut left: Vec<&[usize]> = groups.to_vec();
    let mut clusters = Vec::new();
    while !left.is_empty() {
        let mut members = vec![left.remove(0)];
        let mut next = 0;
        while let Some(&member) = members.get(next) {
            next += 1;
            let (near, far): (Vec<_>, Vec<_>) =
                left.into_iter().partition(|group| touch(member, group));
            members.extend(near);
            left = far;
        }
        let mut points = members.concat();
        points.sort_unstable();
        clusters.push(points);
    }
    clusters
}

/// Parts a cluster in which more than one object is expected: each point goes to the nearest.
fn parted(cycle: &CycleView<'_>, points: Vec<usize>, expected: &[Point3<f64>]) -> Vec<Cluster> {
    let place = |index: usize| &cycle.points.in_map[index];
    let claiming: Vec<&Point3<f64>> = expected
        .iter()
        .filter(|centre| points.iter().any(|&p| horizontal_m(centre, place(p)) <= CLAIM_M))
        .collect();
    if claiming.len() < 2 {
        return vec![Cluster { points, is_split: false }];
    }
    let mut parts = vec![Vec::new(); claiming.len()];
    for &point in &points {
        let nearest = (0..claiming.len()).min_by(|&a, &b| {
            let distance_m = |claim: usize| horizontal_m(claiming[claim], place(point));
            distance_m(a).total_cmp(&distance_m(b))
        });
        if let Some(nearest) = nearest {
            parts[nearest].push(point);
        }
    }
    parts.retain(|part| part.len() >= MIN_PART_POINTS);
    if parts.len() < 2 {
        return vec![Cluster { points, is_split: false }];
    }
    parts.into_iter().map(|points| Cluster { points, is_split: true }).collect()
}
