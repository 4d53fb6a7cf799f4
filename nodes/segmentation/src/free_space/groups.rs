//! The groups of points that move, grown from their seeds.

use std::collections::HashMap;

use geometry::{BuildVoxelHasher, VoxelKey};
use nalgebra::Point3;

use super::FreeSpaceSegmenter;
use super::classes::Known;
use crate::FreeSpaceConfig;
use crate::cycle_points::CyclePoints;
use crate::growth::{Candidates, PointClass};
use crate::seeds::Seeds;
use crate::tracking::MovingGroup;

/// A limb is so many voxels of the thesis thick.
const LIMB_VOXELS: i32 = 2;

impl FreeSpaceSegmenter {
    /// Grows the objects from their seeds. In observed free space they grow without bound; elsewhere only by what may be a part of a body
    /// there.
    pub(super) fn groups(
        &self,
        points: &CyclePoints<'_>,
        classes: &[PointClass],
        candidates: &Candidates<'_>,
        (seeds, moving_in_place): (&Seeds, &[usize]),
    ) -> Vec<MovingGroup> {
        let is_part = self.parts_beside(points, classes, candidates, &seeds.points);
        candidates
            .grown_from(&seeds.points, |index| classes[index].is_in_free_space() || is_part[index])
            .into_iter()
            .map(|group| {
                let is_alone = |point: &&usize| classes[**point].is_apart_from_surfaces();
                let in_free_space = group.iter().filter(is_alone).count();
                MovingGroup {
                    in_zone: group.iter().any(|&point| seeds.is_of_zone[point]),
                    in_free_space: 2 * in_free_space >= group.len(),
                    is_newly_occupied: group
                        .iter()
                        .any(|&point| classes[point].is_newly_occupied()),
                    moves_in_place: group
                        .iter()
                        .any(|point| moving_in_place.binary_search(point).is_ok()),
                    has_stayed: false,
                    points: group,
                }
            })
            .collect()
    }

    /// Whether a point is of a surface other than the floor, on which feet stand, that has been there for long: it is in its voxel or
    /// beside it, and nothing that was not there before is as near as a limb. One who has been in view from the beginning is background himself
    /// until he moves, and what of him then comes to light is his.
    pub(super) fn continues_background(
        &self,
        voxel: VoxelKey,
        classes: &[PointClass],
        candidates: &Candidates<'_>,
    ) -> bool {
        let is_background = |voxel: VoxelKey| {
            self.known(self.occupancy.place(voxel)) == Known::Background
                && !self.is_on_floor(&self.grid.middle_m(voxel))
        };
        let mut near = candidates.within(voxel, LIMB_VOXELS);
        voxel.with_neighbours().any(is_background)
            && !near.any(|(_, point)| classes[point].is_newly_occupied())
    }

    /// Which points outside observed free space may be parts of the bodies with these seeds: all that is within a body's reach, but for surfaces in places of which
    /// nothing is known that go on beyond it, or into a known surface. Furniture that comes into view beside a person, what it has hidden
    /// so far, or the points of a wall between two layers of voxels, are none of him.
    fn parts_beside(
        &self,
        points: &CyclePoints<'_>,
        classes: &[PointClass],
        candidates: &Candidates<'_>,
        seeds: &[usize],
    ) -> Vec<bool> {
        let near = NearSeeds::of(points, seeds, &self.config);
        let is_low_enough = |point: &Point3<f64>| {
            self.floor
                .is_none_or(|floor| floor.height_above_m(point) <= self.config.max_object_height_m)
        };
        let is_unknown = |point: usize| classes[point] == PointClass::Unknown;
        let in_reach = points.in_map.iter().enumerate().map(|(index, point)| {
            let asks = is_unknown(index) || classes[index] == PointClass::SeenEmpty;
            asks && is_low_enough(point) && near.has(point)
        });
        let mut is_part: Vec<bool> = in_reach.collect();
        let unknown: Vec<usize> =
            (0..classes.len()).filter(|&point| is_part[point] && is_unknown(point)).collect();
        for surface in candidates.grown_from(&unknown, is_unknown) {
            if surface.iter().any(|&point| !is_part[point]) {
                surface.into_iter().for_each(|point| is_part[point] = false);
            }
        }
        for point in unknown {
            let voxel = points.voxels[point];
            is_part[point] &= !self.continues_background(voxel, classes, candidates);
        }
        is_part
    }
}

/// The seeds by where they stand: a crowd has hundreds, and each point asks for those around it.
struct NearSeeds<'a> {
    reach_m: f64,
    height_m: f64,
    /// Columns of the reach's edge, by x and y. Looked up by key alone.
    cells: HashMap<VoxelKey, Vec<&'a Point3<f64>>, BuildVoxelHasher>,
}

impl<'a> NearSeeds<'a> {
    fn of(points: &'a CyclePoints<'_>, seeds: &[usize], config: &FreeSpaceConfig) -> Self {
        let (reach_m, height_m) = (config.max_object_width_m / 2.0, config.max_object_height_m);
        let mut near = Self { reach_m, height_m, cells: HashMap::default() };
        for seed in seeds.iter().filter_map(|seed| points.in_map.get(*seed)) {
            near.cells.entry(near.cell(seed)).or_default().push(seed);
        }
        near
    }

    fn cell(&self, point: &Point3<f64>) -> VoxelKey {
        let [x, y] = [point.x, point.y].map(|along_m| (along_m / self.reach_m).floor() as i32);
        VoxelKey { x, y, z: 0 }
    }

    /// Whether a body with one of the seeds reaches a point.
    fn has(&self, point: &Point3<f64>) -> bool {
        let VoxelKey { x, y, z } = self.cell(point);
        let around = |of: i32| of.saturating_sub(1)..=of.saturating_add(1);
        around(x).flat_map(|x| around(y).map(move |y| VoxelKey { x, y, z })).any(|cell| {
            self.cells.get(&cell).is_some_and(|seeds| {
                seeds.iter().any(|seed| {
                    (point.xy() - seed.xy()).norm() <= self.reach_m
                        && (point.z - seed.z).abs() <= self.height_m
                })
            })
        })
    }
}
