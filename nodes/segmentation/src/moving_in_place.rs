//! Bodies that move in their place: who stands and works, and has stood there from the first image on.
//!
//! Nothing of such a body was ever seen to come, and where it stands is background. But its arms and sides come and go, which no place
//! of a static surface does ([`volume::Cell::comes_and_goes`]). What such places are part of moves as a whole, where it is a body:
//! connected, apart from all else but the floor, no larger than an object may be, and not cut by the border of the image, beyond which
//! it may be larger. Who leans on a table is not told from it.

use geometry::VoxelKey;
use nalgebra::Point3;

use crate::FreeSpaceConfig;
use crate::growth::{Candidates, PointClass};

/// What of the points of a cycle may be part of a body, and come and go.
#[derive(Clone, Copy)]
pub(crate) struct Parts<'a> {
    /// The points, in the map.
    pub(crate) in_map: &'a [Point3<f64>],
    /// The voxel of each.
    pub(crate) voxels: &'a [VoxelKey],
    /// Whether each may be part of a body: it is neither floor nor out of reach.
    pub(crate) may_be_body: &'a [bool],
    /// Whether what is in the place of each comes and goes.
    pub(crate) comes_and_goes: &'a [bool],
    /// Whether each is at the left or the right border of the image.
    pub(crate) is_at_border: &'a dyn Fn(usize) -> bool,
}

/// So many points of a body come and go.
const LEAST_MOVING: usize = 10;
/// And at least one of so many of its points: the edges of a cupboard do so when the poses drift.
const MOST_POINTS_A_MOVING: usize = 8;

impl Parts<'_> {
    /// The points of the bodies that move in their place in a cycle, ascending.
    pub(crate) fn bodies(&self, config: &FreeSpaceConfig) -> Vec<usize> {
        let Parts { in_map, voxels, may_be_body, comes_and_goes, is_at_border } = *self;
        let seeds: Vec<usize> = (0..voxels.len()).filter(|&point| comes_and_goes[point]).collect();
        let mut bodies = connected(may_be_body, voxels, &seeds);
        bodies.retain(|body| {
            let moving = body.iter().filter(|point| comes_and_goes[**point]).count();
            moving >= LEAST_MOVING.max(body.len() / MOST_POINTS_A_MOVING)
                && !body.iter().any(|&point| is_at_border(point))
                && is_of_a_body(config, in_map, body)
        });
        let mut moving = bodies.concat();
        moving.sort_unstable();
        moving
    }
}

/// What is connected to each seed: what is background is part of a body, too; only the floor parts one from another.
fn connected(may_be_body: &[bool], voxels: &[VoxelKey], seeds: &[usize]) -> Vec<Vec<usize>> {
    if seeds.is_empty() {
        return Vec::new();
    }
    let class = |&may_be: &bool| if may_be { PointClass::Unknown } else { PointClass::Background };
    let classes: Vec<PointClass> = may_be_body.iter().map(class).collect();
    Candidates::new(&classes, voxels).grown_from(seeds, |_| true)
}

/// Whether points are no farther apart than those of an object are.
pub(crate) fn is_of_a_body(
    config: &FreeSpaceConfig,
    in_map: &[Point3<f64>],
    points: &[usize],
) -> bool {
    let mut least_m = Point3::from([f64::INFINITY; 3]);
    let mut most_m = Point3::from([f64::NEG_INFINITY; 3]);
    for &point in points {
        least_m = least_m.inf(&in_map[point]);
        most_m = most_m.sup(&in_map[point]);
    }
    let extent_m = most_m - least_m;
    extent_m.x <= config.max_object_width_m
        && extent_m.y <= config.max_object_width_m
        && extent_m.z <= config.max_object_height_m
}

#[cfg(test)]
mod tests {
    use super::*;

    const EDGE_M: f64 = 0.08;

    /// The points found of a body, of a wall that may touch it, and of the floor; the first `moving` of the body, and the first
    /// `of_wall` of the wall, come and go. The border of the image is at the voxels at `border_y`.
    fn found_before(border_y: i32, moving: usize, of_wall: usize, wall_y: i32) -> usize {
        let body = (0..20).flat_map(|z| (0..6).map(move |y| [0, y, z]));
        let wall = (0..30).flat_map(|z| (0..60).map(move |x| [x - 30, wall_y, z]));
        let floor = (-30..30).flat_map(|x| (-30..30).map(move |y| [x, y, -1]));
        let (body, wall, floor): (Vec<_>, Vec<_>, Vec<_>) =
            (body.collect(), wall.collect(), floor.collect());
        let voxels: Vec<VoxelKey> = [&*body, &*wall, &*floor]
            .concat()
            .into_iter()
            .map(|[x, y, z]| VoxelKey { x, y, z })
            .collect();
        let in_map: Vec<Point3<f64>> = voxels
            .iter()
            .map(|&VoxelKey { x, y, z }| Point3::new(x, y, z).cast::<f64>() * EDGE_M)
            .collect();
        let all = 0..voxels.len();
        let of_floor = body.len() + wall.len();
        let may_be_body: Vec<bool> = all.clone().map(|point| point < of_floor).collect();
        let of_wall = body.len()..body.len() + of_wall;
        let comes_and_goes: Vec<bool> =
            all.map(|point| point < moving || of_wall.contains(&point)).collect();
        let parts = Parts {
            in_map: &in_map,
            voxels: &voxels,
            may_be_body: &may_be_body,
            comes_and_goes: &comes_and_goes,
            is_at_border: &|point: usize| voxels[point].y == border_y,
        };
        let found = parts.bodies(&FreeSpaceConfig::default());
        assert!(found.iter().all(|point| *point < body.len()), "only the body is found");
        found.len()
    }

    fn found(moving: usize, of_wall: usize, wall_y: i32) -> usize {
        found_before(-1, moving, of_wall, wall_y)
    }

    #[test]
    fn all_of_a_body_moves_when_its_sides_come_and_go() {
        assert_eq!(found(15, 0, 12), 120);
        assert_eq!(found(15, 60, 12), 120, "beside a wall with edges");
    }

    #[test]
    fn few_places_that_come_and_go_are_none() {
        assert_eq!(found(14, 0, 12), 0);
    }

    #[test]
    fn what_touches_a_wall_is_not_told_from_it() {
        assert_eq!(found(25, 0, 6), 0);
    }

    #[test]
    fn what_the_border_of_the_image_cuts_may_be_larger() {
        assert_eq!(found_before(0, 25, 0, 12), 0);
    }
}
