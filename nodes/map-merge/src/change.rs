//! What changed between two maps of one place.

use std::collections::HashMap;

use geometry::{BuildVoxelHasher, VoxelGrid, VoxelKey};
use nalgebra::{Isometry3, Point3, Vector3};

use crate::nearby::Nearby;
use crate::saved_map::SavedMap;
use crate::seen_space::{SeenSpace, Sight};

/// A point has its counterpart within so many edges, of the coarser map: the surface goes through voxels up to one apart, and half
/// as much again is noise.
const SAME_EDGES: f64 = 1.5;
/// ... and within this: twice the noise that two maps have at 4 m, 2.3 cm each.
const LEAST_SAME_M: f64 = 0.065;
/// Points of one thing are no farther apart than this.
const LINKED_EDGES: f64 = 2.0;
/// Points that the other map does not have belong to a thing that has gone when they are so near to it.
const GROWN_EDGES: f64 = 3.0;
/// A group of less surface is noise at an edge: 10 cm x 20 cm, the smallest thing that a depth camera shows at 4 m with its noise of
/// 2 cm a pixel of 1 cm.
const LEAST_M2: f64 = 0.02;
/// ... and so is one of fewer points, which of a coarse map are more surface.
const LEAST_POINTS: usize = 10;
/// At least this share of a group is to be seen through from its front: what is seen through from behind alone may be the back of something
/// that has a hole in the other map.
const LEAST_SURE: f64 = 0.3;

/// Points of a map that belong together.
#[derive(Clone, PartialEq, Debug)]
pub struct Group {
    /// The indices of its points in its map, ascending.
    pub points: Vec<usize>,
    /// The least and the greatest coordinates, in the first map's frame.
    pub bounds_m: [Point3<f64>; 2],
}

impl Group {
    /// The middle of its bounds.
    #[must_use]
    pub fn middle_m(&self) -> Point3<f64> {
        nalgebra::center(&self.bounds_m[0], &self.bounds_m[1])
    }

    /// Its extent along the axes of the first map.
    #[must_use]
    pub fn extent_m(&self) -> Vector3<f64> {
        self.bounds_m[1] - self.bounds_m[0]
    }
}

/// What only one of two maps has. The first map is the older one.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Changes {
    /// Of the first map, where the second one was seen to be free.
    pub gone: Vec<Group>,
    /// Of the second map, where the first one was seen to be free.
    pub added: Vec<Group>,
    /// Of the first map, where it is not known where the second one looked.
    pub only_in_a: Vec<Group>,
    /// Of the second map, where it is not known where the first one looked.
    pub only_in_b: Vec<Group>,
}

/// How near to each other the points of one surface are in two maps, of which the coarser one has this edge.
pub(crate) fn same_within_m(edge_m: f64) -> f64 {
    LEAST_SAME_M.max(SAME_EDGES * edge_m)
}

/// A map that is compared with another.
pub(crate) struct Side<'a> {
    pub(crate) map: &'a SavedMap,
    /// Takes its points to the frame of the first map.
    pub(crate) a_from_own: Isometry3<f64>,
}

impl Side<'_> {
    /// A point of it and its normal in the frame of the first map.
    pub(crate) fn placed(&self, index: usize) -> Option<(Point3<f32>, Option<Vector3<f32>>)> {
        let point_m = self.map.points.points_m.get(index)?;
        let normal = self.map.points.normals.get(index).filter(|_| self.map.has_normals());
        let turned = normal.map(|normal| (self.a_from_own.rotation * normal.cast::<f64>()).cast());
        Some(((self.a_from_own * point_m.cast::<f64>()).cast(), turned))
    }

    pub(crate) fn len(&self) -> usize {
        self.map.points.points_m.len()
    }

    /// What is near its points, in the frame of the first map, of those of which `is_used` is true.
    pub(crate) fn nearby(
        &self,
        within_m: f64,
        is_sided: bool,
        is_used: impl Fn(usize) -> bool,
    ) -> Option<Nearby> {
        let placed =
            (0..self.len()).filter(|index| is_used(*index)).filter_map(|index| self.placed(index));
        let (points_m, normals): (Vec<_>, Vec<_>) = placed.unzip();
        let normals: Vec<_> = normals.into_iter().flatten().collect();
        Nearby::new(points_m.into_iter(), &normals, within_m, is_sided)
    }
}

/// The groups of points of a map that the other does not have.
pub(crate) struct OneSided {
    /// Where the other is known to be free, or where it is not known at all where it looked.
    pub(crate) groups: Vec<Group>,
    /// Its points where the other is known to be free that are too few to be a thing: noise of either map.
    pub(crate) noise: Vec<usize>,
    /// Whether the other says where it looked.
    pub(crate) is_known: bool,
}

/// What one map has and the other does not.
pub(crate) fn one_sided(
    own: &Side<'_>,
    other: &Side<'_>,
    other_seen: &SeenSpace,
    other_level_from_a: &Isometry3<f64>,
) -> Option<OneSided> {
    let edge_m = own.map.edge_m.max(other.map.edge_m);
    let is_sided = own.map.is_sided() && other.map.is_sided();
    let nearby = other.nearby(same_within_m(edge_m), is_sided, |_| true)?;
    let is_known = !other_seen.is_empty();
    let sight = |point_m: &Point3<f32>, normal: Option<Vector3<f32>>| {
        if !is_known {
            return Sight::ThroughFromItsFront;
        }
        let place_m = other_level_from_a * point_m.cast::<f64>();
        let normal = normal
            .map_or_else(Vector3::zeros, |normal| other_level_from_a.rotation * normal.cast());
        other_seen.sight(&place_m, &normal, edge_m)
    };
    let (mut seeds, mut rest): (Vec<Numbered>, Vec<Numbered>) = (Vec::new(), Vec::new());
    let mut is_sure = vec![false; own.len()];
    for (index, is_sure) in is_sure.iter_mut().enumerate() {
        let Some((point_m, normal)) = own.placed(index) else { continue };
        if !nearby.has(&point_m, normal.as_ref()) {
            let sight = sight(&point_m, normal);
            *is_sure = sight == Sight::ThroughFromItsFront;
            (if sight == Sight::NotThrough { &mut rest } else { &mut seeds })
                .push((index, point_m));
        }
    }
    let least = LEAST_POINTS.max((LEAST_M2 / (own.map.edge_m * own.map.edge_m)).ceil() as usize);
    let mut groups = linked(&seeds, LINKED_EDGES * edge_m);
    groups.retain(|group| {
        let sure = group.iter().filter(|(index, _)| is_sure[*index]).count();
        sure as f64 >= LEAST_SURE * group.len() as f64
    });
    let few = groups.extract_if(.., |group| group.len() < least);
    let noise = few.flatten().map(|(index, _)| index).filter(|_| is_known).collect();
    grow(&mut groups, &rest, GROWN_EDGES * edge_m);
    let groups = groups.into_iter().map(group_of).collect();
    Some(OneSided { groups, noise, is_known })
}

type Numbered = (usize, Point3<f32>);

/// Points that are joined by steps of no more than `within_m`, each group by ascending index, in the order of their first ones.
fn linked(points: &[Numbered], within_m: f64) -> Vec<Vec<Numbered>> {
    let Ok(grid) = VoxelGrid::new(within_m) else { return Vec::new() };
    let cells = by_cell(&grid, points);
    let mut is_taken = vec![false; points.len()];
    let mut groups = Vec::new();
    for first in 0..points.len() {
        if std::mem::replace(&mut is_taken[first], true) {
            continue;
        }
        let (mut group, mut next) = (vec![points[first]], vec![first]);
        while let Some(index) = next.pop() {
            let own = &points[index].1;
            for key in grid.key(own).with_neighbours() {
                for &other in cells.get(&key).map_or(&[][..], Vec::as_slice) {
                    let is_near = f64::from((points[other].1 - own).norm()) <= within_m;
                    if is_near && !std::mem::replace(&mut is_taken[other], true) {
                        group.push(points[other]);
                        next.push(other);
                    }
                }
            }
        }
        group.sort_by_key(|(index, _)| *index);
        groups.push(group);
    }
    groups
}

/// Adds to each group the points that are near to it.
fn grow(groups: &mut [Vec<Numbered>], rest: &[Numbered], within_m: f64) {
    let Ok(grid) = VoxelGrid::new(within_m) else { return };
    let cells = by_cell(&grid, rest);
    let mut is_taken = vec![false; rest.len()];
    for group in groups {
        let mut near: Vec<usize> = Vec::new();
        for (_, own) in group.iter() {
            for key in grid.key(own).with_neighbours() {
                let others = cells.get(&key).map_or(&[][..], Vec::as_slice);
                near.extend(
                    others
                        .iter()
                        .filter(|other| f64::from((rest[**other].1 - own).norm()) <= within_m),
                );
            }
        }
        near.sort_unstable();
        near.dedup();
        for index in near {
            if !std::mem::replace(&mut is_taken[index], true) {
                group.push(rest[index]);
            }
        }
        group.sort_by_key(|(index, _)| *index);
    }
}

fn by_cell(
    grid: &VoxelGrid,
    points: &[Numbered],
) -> HashMap<VoxelKey, Vec<usize>, BuildVoxelHasher> {
    let mut cells: HashMap<VoxelKey, Vec<usize>, BuildVoxelHasher> = HashMap::default();
    for (index, (_, point_m)) in points.iter().enumerate() {
        cells.entry(grid.key(point_m)).or_default().push(index);
    }
    cells
}

fn group_of(points: Vec<Numbered>) -> Group {
    let mut bounds_m = [Point3::from([f64::INFINITY; 3]), Point3::from([f64::NEG_INFINITY; 3])];
    for (_, point_m) in &points {
        let point_m: Point3<f64> = point_m.cast();
        bounds_m = [bounds_m[0].inf(&point_m), bounds_m[1].sup(&point_m)];
    }
    Group { points: points.into_iter().map(|(index, _)| index).collect(), bounds_m }
}
