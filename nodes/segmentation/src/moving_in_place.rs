//! Bodies that move in their place: who stands and works, and has stood there from the first image on.
//!
//! Nothing of such a body was ever seen to come, and where it stands is background. But its arms and sides are in places that were
//! hit in some cycles and free in others, which no place of a static surface is: all of a voxel is free only where everything that
//! is seen there lies an edge behind it, more than noise moves a surface by. What such places are part of moves as a whole, where it
//! is a body: connected, apart from all else but the floor, no larger than an object may be, and not cut by the border of the image,
//! beyond which it may be larger. Who leans on a table is not told from it.
//!
//! Where poses are off, the edges of everything come and go, in one cycle more than in another. So nothing is concluded while much
//! of what does so, or did of late, is of no such body.

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
    /// Whether the place of each was hit in some cycles and free in others.
    pub(crate) is_intermittent: &'a [bool],
    /// Whether each is at the left or the right border of the image.
    pub(crate) is_at_border: &'a dyn Fn(usize) -> bool,
}

/// What comes and goes elsewhere may be so many times less than what does so of bodies.
const LESS_ELSEWHERE: usize = 4;
/// What came and went elsewhere counts by so much less in each later cycle: a tenth is left after two and a half seconds of the
/// RPLIDAR A1.
const FORGOTTEN_A_CYCLE: usize = 8;

/// Finds the bodies that move in their place.
#[derive(Clone, Debug, Default)]
pub(crate) struct MovingInPlace {
    /// How many points of no such body came and went, at most, in this cycle and, less and less, in earlier ones.
    elsewhere: usize,
}

impl MovingInPlace {
    /// The points of the bodies that move in their place in a cycle, ascending.
    pub(crate) fn bodies(&mut self, config: &FreeSpaceConfig, parts: Parts<'_>) -> Vec<usize> {
        let Parts { in_map, voxels, may_be_body, is_intermittent, is_at_border } = parts;
        let seeds: Vec<usize> = (0..voxels.len()).filter(|&point| is_intermittent[point]).collect();
        let mut bodies = connected(may_be_body, voxels, &seeds);
        let moving = |body: &[usize]| body.iter().filter(|point| is_intermittent[**point]).count();
        bodies.retain(|body| {
            !body.iter().any(|&point| is_at_border(point)) && is_of_a_body(config, in_map, body)
        });
        let of_bodies: usize = bodies.iter().map(|body| moving(body)).sum();
        let elsewhere = self.elsewhere - self.elsewhere.div_ceil(FORGOTTEN_A_CYCLE);
        self.elsewhere = elsewhere.max(seeds.len() - of_bodies);
        bodies.retain(|body| {
            moving(body) >= config.min_unzoned_points.max(LESS_ELSEWHERE * self.elsewhere)
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

    /// The points of a body, of a wall that may touch it, and of the floor; the first `moving` of the body, and the first
    /// `of_wall` of the wall, come and go, after a cycle in which the first `before` of the wall did. The border of the image is at
    /// the voxels at `border_y`.
    fn found_of(before: usize, moving: usize, of_wall: usize, wall_y: i32, border_y: i32) -> usize {
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
        let is_intermittent: Vec<bool> =
            all.map(|point| point < moving || of_wall.contains(&point)).collect();
        let is_at_border = |point: usize| voxels[point].y == border_y;
        let parts = Parts {
            in_map: &in_map,
            voxels: &voxels,
            may_be_body: &may_be_body,
            is_intermittent: &is_intermittent,
            is_at_border: &is_at_border,
        };
        let mut moving_in_place = MovingInPlace::default();
        if before > 0 {
            let only_wall: Vec<bool> = (0..voxels.len())
                .map(|point| (body.len()..body.len() + before).contains(&point))
                .collect();
            let parts = Parts { is_intermittent: &only_wall, ..parts };
            assert!(moving_in_place.bodies(&FreeSpaceConfig::default(), parts).is_empty());
        }
        let found = moving_in_place.bodies(&FreeSpaceConfig::default(), parts);
        assert!(found.iter().all(|point| *point < body.len()), "only the body is found");
        found.len()
    }

    fn found(moving: usize, of_wall: usize, wall_y: i32) -> usize {
        found_after(0, moving, of_wall, wall_y)
    }

    fn found_after(before: usize, moving: usize, of_wall: usize, wall_y: i32) -> usize {
        found_of(before, moving, of_wall, wall_y, -1)
    }

    #[test]
    fn all_of_a_body_moves_when_its_sides_come_and_go() {
        assert_eq!(found(25, 0, 12), 120);
        assert_eq!(found(25, 6, 12), 120, "noise on the wall");
    }

    #[test]
    fn few_places_that_come_and_go_are_none() {
        assert_eq!(found(19, 0, 12), 0);
    }

    #[test]
    fn what_touches_a_wall_is_not_told_from_it() {
        assert_eq!(found(25, 0, 6), 0);
    }

    #[test]
    fn what_the_border_of_the_image_cuts_may_be_larger() {
        assert_eq!(found_of(0, 25, 0, 12, 0), 0);
    }

    #[test]
    fn nothing_is_concluded_where_edges_come_and_go_everywhere() {
        assert_eq!(found(25, 7, 12), 0);
        assert_eq!(found_after(8, 25, 0, 12), 0, "a cycle ago");
        assert_eq!(found_after(6, 25, 0, 12), 120);
    }
}
