//! The object grown from its seeds through the cloud.

#[cfg(test)]
mod tests;

use std::collections::HashMap;
use std::ops::Range;

use geometry::{BuildVoxelHasher, VoxelKey};

/// What a point of the cycle is, by what is known of its place.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum PointClass {
    /// Background or floor, or out of reach: growth stops there.
    Background,
    /// Nothing is known of its place.
    Unknown,
    /// The camera would have seen it there before (module [`crate::recent_views`]), though its place was not observed free; or
    /// it is at the height of a floor that is not seen.
    SeenEmpty,
    /// In observed free space, with a surface in a voxel beside it: what the noise of depth and of the pose throws off a
    /// surface, or an object that is close to one.
    InFreeSpaceBesideSurface,
    /// In observed free space, with no surface beside it.
    InFreeSpace,
}

impl PointClass {
    /// Whether it is in observed free space.
    #[must_use]
    pub fn is_in_free_space(self) -> bool {
        matches!(self, Self::InFreeSpace | Self::InFreeSpaceBesideSurface)
    }

    /// Whether it was not there before, by observed free space or by what the camera would have seen.
    #[must_use]
    pub fn is_newly_occupied(self) -> bool {
        self.is_in_free_space() || self == Self::SeenEmpty
    }

    /// Whether it was not there before, and no surface is beside it that noise may have thrown it off.
    #[must_use]
    pub fn is_apart_from_surfaces(self) -> bool {
        matches!(self, Self::InFreeSpace | Self::SeenEmpty)
    }

    /// How many voxels lie between it and what it is linked to, at most, and one. The reduced cloud leaves
    /// an empty voxel here and there within a surface; only in observed free space is it certain that what is across the
    /// gap is no background.
    fn reach_voxels(self) -> i32 {
        if self == Self::InFreeSpace { 2 } else { 1 }
    }
}

/// The points that are no background, found by their voxels.
#[derive(Clone, Debug)]
pub struct Candidates<'a> {
    classes: &'a [PointClass],
    voxels: &'a [VoxelKey],
    /// Voxel and index of each candidate, sorted: by x, then y, then z.
    by_voxel: Vec<(VoxelKey, usize)>,
    /// Those of each column along z, by its voxel at z = 0.
    columns: HashMap<VoxelKey, Range<usize>, BuildVoxelHasher>,
}

/// The voxel that stands for a column along z.
fn column_of(voxel: VoxelKey) -> VoxelKey {
    VoxelKey { z: 0, ..voxel }
}

impl<'a> Candidates<'a> {
    /// The candidates among points, whose classes and voxels are given in the same order.
    #[must_use]
    pub fn new(classes: &'a [PointClass], voxels: &'a [VoxelKey]) -> Self {
        let mut by_voxel: Vec<_> = classes
            .iter()
            .zip(voxels)
            .enumerate()
            .filter(|(_, (class, _))| **class != PointClass::Background)
            .map(|(index, (_, voxel))| (*voxel, index))
            .collect();
        by_voxel.sort_unstable();
        let mut columns: HashMap<_, Range<usize>, BuildVoxelHasher> = HashMap::default();
        let is_same = |(one, _): &(VoxelKey, usize), (other, _): &(VoxelKey, usize)| {
            column_of(*one) == column_of(*other)
        };
        let mut end = 0;
        for column in by_voxel.chunk_by(is_same) {
            let start = end;
            end += column.len();
            columns.extend(column.first().map(|(voxel, _)| (column_of(*voxel), start..end)));
        }
        Self { classes, voxels, by_voxel, columns }
    }

    /// The candidates in voxels up to so many steps away along each axis, with their voxels.
    pub fn within(&self, voxel: VoxelKey, steps: i32) -> impl Iterator<Item = (VoxelKey, usize)> {
        let beside = |value: i32, by: i32| value.saturating_add(by);
        let columns = (-steps..=steps).flat_map(move |dx| (-steps..=steps).map(move |dy| (dx, dy)));
        columns.flat_map(move |(dx, dy)| {
            let (x, y) = (beside(voxel.x, dx), beside(voxel.y, dy));
            let (low, high) = (beside(voxel.z, -steps), beside(voxel.z, steps));
            let column = self.columns.get(&VoxelKey { x, y, z: 0 }).cloned().unwrap_or_default();
            let column = self.by_voxel.get(column).unwrap_or_default();
            let first = column.partition_point(|(other, _)| other.z < low);
            let stretch = column.iter().skip(first).copied();
            stretch.take_while(move |(other, _)| other.z <= high)
        })
    }

    /// The connected groups of candidates that hold a seed: each in ascending order of the points, the
    /// groups by their first seed. Growth enters only points that `may_take` accepts; seeds are taken
    /// whatever it says.
    ///
    /// Two points are linked when their voxels touch, or are one apart and both are [`PointClass::InFreeSpace`].
    #[must_use]
    pub fn grown_from(&self, seeds: &[usize], may_take: impl Fn(usize) -> bool) -> Vec<Vec<usize>> {
        let mut seen = vec![false; self.classes.len()];
        let mut is_seed = vec![false; self.classes.len()];
        for &seed in seeds {
            is_seed[seed] = true;
        }
        let mut groups = Vec::new();
        for &seed in seeds {
            if std::mem::replace(&mut seen[seed], true) {
                continue;
            }
            let mut group = vec![seed];
            let mut next = 0;
            while let Some(&from) = group.get(next) {
                next += 1;
                self.for_each_linked(from, |to| {
                    if !seen[to] && (is_seed[to] || may_take(to)) {
                        seen[to] = true;
                        group.push(to);
                    }
                });
            }
            group.sort_unstable();
            groups.push(group);
        }
        groups
    }

    fn for_each_linked(&self, from: usize, mut visit: impl FnMut(usize)) {
        let (reach, voxel) = (self.classes[from].reach_voxels(), self.voxels[from]);
        let apart = |a: i32, b: i32| a.saturating_sub(b).saturating_abs();
        // Not a loop: the columns around are nested iterators, which go on by themselves faster than from outside.
        self.within(voxel, reach).for_each(|(VoxelKey { x, y, z }, to)| {
            let apart = apart(x, voxel.x).max(apart(y, voxel.y)).max(apart(z, voxel.z));
            if apart <= self.classes[to].reach_voxels() {
                visit(to);
            }
        });
    }
}
