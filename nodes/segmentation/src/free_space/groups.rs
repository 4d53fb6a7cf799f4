//! The groups of points that move, grown from their seeds.

use nalgebra::Point3;

use super::FreeSpaceSegmenter;
use crate::cycle_points::CyclePoints;
use crate::growth::{Candidates, PointClass};
use crate::seeds::Seeds;
use crate::tracking::MovingGroup;

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
        let parts = self.parts_beside(points, classes, candidates, &seeds.points);
        candidates
            .grown_from(&seeds.points, |index| classes[index].is_in_free_space() || parts[index])
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

    /// Which points may be parts of the bodies with these seeds: all that is within a body's reach, but for surfaces in places of which
    /// nothing is known that go on beyond it. Furniture that comes into view beside a person, or the points of a wall between two layers
    /// of voxels, are none of him.
    fn parts_beside(
        &self,
        points: &CyclePoints<'_>,
        classes: &[PointClass],
        candidates: &Candidates<'_>,
        seeds: &[usize],
    ) -> Vec<bool> {
        let reach_m = self.config.max_object_width_m / 2.0;
        let within_a_body = |point: &Point3<f64>| {
            seeds.iter().any(|&seed| {
                let seed = &points.in_map[seed];
                (point.xy() - seed.xy()).norm() <= reach_m
                    && (point.z - seed.z).abs() <= self.config.max_object_height_m
            })
        };
        let is_low_enough = |point: &Point3<f64>| {
            self.floor
                .is_none_or(|floor| floor.height_above_m(point) <= self.config.max_object_height_m)
        };
        let in_reach = points.in_map.iter().zip(classes).map(|(point, class)| {
            *class != PointClass::Background && is_low_enough(point) && within_a_body(point)
        });
        let mut is_part: Vec<bool> = in_reach.collect();
        let is_unknown = |point: usize| classes[point] == PointClass::Unknown;
        let unknown: Vec<usize> =
            (0..classes.len()).filter(|&point| is_part[point] && is_unknown(point)).collect();
        for surface in candidates.grown_from(&unknown, is_unknown) {
            if surface.iter().any(|&point| !is_part[point]) {
                surface.into_iter().for_each(|point| is_part[point] = false);
            }
        }
        is_part
    }
}
