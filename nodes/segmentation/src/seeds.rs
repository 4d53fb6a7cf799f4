//! Where objects are known to be: the points that growth starts from.

use std::ops::RangeInclusive;

use geometry::{DetectedCycle, DynamicZone, ReturnSpan};
use nalgebra::{Point3, Vector3};
use volume::DepthNoise;

use crate::FreeSpaceConfig;
use crate::angular::{azimuths_rad, points_in_zone};
use crate::cycle_points::CyclePoints;
use crate::growth::{Candidates, PointClass};
use crate::tracking::{MIN_BIRTH_POINTS, Prediction};

/// Where nothing is known of the space around, points within this height above or below the scanner's plane are taken for
/// what the beam hit: a hand's breadth of the camera's rows.
const SCAN_BAND_M: f64 = 0.25;
/// Scanner and camera see the object up to half a cycle apart; it moves a cell or two meanwhile.
const RANGE_TOLERANCE_CELLS: f64 = 1.5;
/// A body is wider above or below the scanner's plane by so much at each side: the arms, the foot of a pole.
const ASIDE_M: f64 = 0.3;
/// Around the box in which an object is expected points of it are looked for within so many edges of the voxels ...
const SEEDS_WITHIN_EDGES: f64 = 1.0;
/// ... and a part of it that stands in the unknown ends within these, or it is none: limbs swing.
const PARTS_WITHIN_EDGES: f64 = 2.0;
/// What is in free space moves by no more than this from one image to the next: 2 m/s at the 7 Hz of a scanner.
const STEP_M: f64 = 0.3;
/// Two images count together where the noise of depth is no more than this, in edges of the voxels: to 2.5 m. Farther away noise and
/// the pose's errors show small groups in many images.
const NOISE_IN_EDGES: f64 = 0.125;
/// With so many newly occupied points in a zone, the others are left to the growth.
const MIN_NEWLY_OCCUPIED: usize = 3;

/// So many points in a zone that have stopped for good are no noise.
const MIN_STOPPED: usize = 3;

/// The points that growth starts from.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Seeds {
    /// All of them, ascending.
    pub points: Vec<usize>,
    /// For each point of the cycle, whether it is a seed since a zone covers it or is beside it.
    pub is_of_zone: Vec<bool>,
    /// Points of the cycle within a zone, whatever their distance.
    pub in_zone: usize,
}

/// What is known of the places of a cycle's points.
#[derive(Clone, Copy)]
pub struct KnownOfPoints<'a> {
    /// What each point is.
    pub classes: &'a [PointClass],
    /// Whether what is there has moved and stopped for good.
    pub has_stopped: &'a dyn Fn(usize) -> bool,
    /// Whether a surface that has been there for long goes on there.
    pub continues_background: &'a dyn Fn(usize) -> bool,
}

/// Where something was in free space, beside no surface: points in the map.
#[derive(Clone, Debug, Default)]
pub struct InFreeSpace {
    last_image: Vec<Point3<f64>>,
    this_image: Vec<Point3<f64>>,
}

impl InFreeSpace {
    /// An image begins: the one before is the last.
    pub fn begin_image(&mut self) {
        self.last_image = std::mem::take(&mut self.this_image);
    }

    /// Notes what this image shows.
    pub fn see(&mut self, points: &CyclePoints<'_>, classes: &[PointClass]) {
        let alone = classes.iter().zip(&points.in_map);
        let alone = alone.filter(|(class, _)| **class == PointClass::InFreeSpace);
        self.this_image = alone.map(|(_, in_map)| *in_map).collect();
    }

    /// How many points of the last image may have been of what a group of this one is of.
    fn of_group(&self, group: &[Point3<f64>]) -> usize {
        let Some(first) = group.first() else { return 0 };
        let (least, most) = group
            .iter()
            .fold((*first, *first), |(least, most), place| (least.inf(place), most.sup(place)));
        let (least, most) = (least - Vector3::repeat(STEP_M), most + Vector3::repeat(STEP_M));
        self.last_image.iter().filter(|place| **place >= least && **place <= most).count()
    }
}

/// The seeds of a cycle: by its zones, by the objects expected in it, and by the number of points that
/// are connected in observed free space, in this image and the last one.
#[must_use]
pub fn seeds_of(
    config: &FreeSpaceConfig,
    points: &CyclePoints<'_>,
    known: KnownOfPoints<'_>,
    candidates: &Candidates<'_>,
    expected: &[Prediction],
    in_free_space: &InFreeSpace,
) -> Seeds {
    let (cycle, classes) = (points.cycle, known.classes);
    let azimuths_rad = azimuths_rad(&cycle.reduced_cloud.points_m, &cycle.zones);
    let mut is_seed = vec![false; classes.len()];
    let mut is_of_zone = vec![false; classes.len()];
    let mut is_in_zone = vec![false; classes.len()];
    for zone in &cycle.zones {
        let in_zone = points_in_zone(&azimuths_rad, zone);
        for &point in &in_zone {
            is_in_zone[point] = true;
        }
        if is_of_what_has_stopped(cycle, zone, &in_zone, known.has_stopped) {
            continue;
        }
        let beside = points_beside(&azimuths_rad, zone, &in_zone, classes);
        for point in zone_seeds(cycle, zone, &[in_zone, beside].concat(), classes) {
            is_seed[point] = true;
            is_of_zone[point] = true;
        }
    }
    let edge_m = cycle.setup.voxel_edge_m;
    for expected in expected {
        for point in seeds_of_object(expected, (&points.in_map, known), candidates, edge_m) {
            is_seed[point] = true;
        }
    }
    for group in groups_in_free_space(classes, candidates) {
        let alone = group.iter().filter(|&&point| classes[point] == PointClass::InFreeSpace);
        let alone: Vec<Point3<f64>> = alone.map(|&point| points.in_map[point]).collect();
        let farthest_m = group.iter().map(|&point| points.distances_m[point]).fold(0.0, f64::max);
        let noise_m = f64::from(DepthNoise::default().sigma_m(farthest_m as f32));
        let is_noise = alone.len() < MIN_BIRTH_POINTS || noise_m > NOISE_IN_EDGES * edge_m;
        let before = if is_noise { 0 } else { in_free_space.of_group(&alone) };
        if alone.len() + before >= config.min_unzoned_points {
            group.iter().for_each(|&point| is_seed[point] = true);
        }
    }
    let points = (0..is_seed.len()).filter(|&point| is_seed[point]).collect();
    let in_zone = is_in_zone.iter().filter(|is_in| **is_in).count();
    Seeds { points, is_of_zone, in_zone }
}

/// The points of an object where it is expected: what was not there before, but for single points beside surfaces, whose noise is all around
/// a large object; and, if it was seen in the last cycle, what stands as a
/// whole in places of which nothing is known: a leg at the border of the image, whose body is hidden, has nothing to grow from, and
/// stayed in the map, since a camera that turns away does not see behind it. A surface that goes on beyond the object is none of its
/// parts: a wall that comes into view beside it; nor is what continues a known surface, which furniture has hidden. What else an object
/// uncovers is taken with it, until it goes on, or is found to stand there alone ([`crate::tracking`]).
fn seeds_of_object(
    expected: &Prediction,
    (points_in_map, known): (&[Point3<f64>], KnownOfPoints<'_>),
    candidates: &Candidates<'_>,
    voxel_edge_m: f64,
) -> Vec<usize> {
    let classes = known.classes;
    let is_within = |point: usize, margin_in_edges: f64| {
        let half_m = expected.half_extent_m + Vector3::repeat(margin_in_edges * voxel_edge_m);
        (points_in_map[point] - expected.centre_m).abs() <= half_m
    };
    let is_unknown = |point: usize| classes[point] == PointClass::Unknown;
    let (mut newly_occupied, mut unknown) = (Vec::new(), Vec::new());
    for point in (0..classes.len()).filter(|point| is_within(*point, SEEDS_WITHIN_EDGES)) {
        if classes[point].is_newly_occupied() {
            newly_occupied.push(point);
        } else if expected.was_seen && is_unknown(point) {
            unknown.push(point);
        }
    }
    let mut new_groups =
        candidates.grown_from(&newly_occupied, |point| classes[point].is_in_free_space());
    new_groups.retain(|group| {
        group.len() >= MIN_BIRTH_POINTS
            || group.iter().any(|&point| classes[point].is_apart_from_surfaces())
    });
    let mut seeds = new_groups.concat();
    // As far as it takes to see that a group goes on: points of voxels that touch are less than two edges apart.
    let far_edges = PARTS_WITHIN_EDGES + 2.0;
    let groups =
        candidates.grown_from(&unknown, |point| is_unknown(point) && is_within(point, far_edges));
    let ends_there =
        |group: &Vec<usize>| group.iter().all(|point| is_within(*point, PARTS_WITHIN_EDGES));
    let parts = groups.into_iter().filter(ends_there).flatten();
    seeds.extend(parts.filter(|&point| !(known.continues_background)(point)));
    seeds
}

/// Whether some of what is where the scanner's returns of a zone are, at any height, has stopped for good. The scanner alone does not tell a thing that was put down
/// from a person who stands, so that detection has a zone on it for longer; what else of it comes into view would be an object.
fn is_of_what_has_stopped(
    cycle: &DetectedCycle,
    zone: &DynamicZone,
    in_zone: &[usize],
    has_stopped: &dyn Fn(usize) -> bool,
) -> bool {
    let Some(span) = span_m(cycle, zone) else { return false };
    let is_hit = |&&index: &&usize| {
        let point = &cycle.reduced_cloud.points_m[index];
        span.contains(&f64::from(point.x.hypot(point.y)))
    };
    in_zone.iter().filter(is_hit).filter(|&&index| has_stopped(index)).count() >= MIN_STOPPED
}

/// The distances of what the scanner's returns of a zone may have hit.
fn span_m(cycle: &DetectedCycle, zone: &DynamicZone) -> Option<RangeInclusive<f64>> {
    let tolerance_m = RANGE_TOLERANCE_CELLS * cycle.setup.voxel_edge_m;
    let ReturnSpan { nearest_m, farthest_m } = zone.returns?;
    Some(f64::from(nearest_m) - tolerance_m..=f64::from(farthest_m) + tolerance_m)
}

/// The points of a zone that the moving returns are of.
fn zone_seeds(
    cycle: &DetectedCycle,
    zone: &DynamicZone,
    in_zone: &[usize],
    classes: &[PointClass],
) -> Vec<usize> {
    let point = |index: usize| &cycle.reduced_cloud.points_m[index];
    let span = span_m(cycle, zone);
    let is_at_range = |index: usize| match &span {
        Some(span) => span.contains(&f64::from(point(index).x.hypot(point(index).y))),
        // Another detection may report no ranges: then by itself the zone does not tell an object from what is behind it.
        None => classes[index].is_newly_occupied(),
    };
    let at_range: Vec<usize> = in_zone
        .iter()
        .copied()
        .filter(|&index| classes[index] != PointClass::Background && is_at_range(index))
        .collect();
    let newly_occupied: Vec<usize> =
        at_range.iter().copied().filter(|&index| classes[index].is_newly_occupied()).collect();
    if newly_occupied.len() >= MIN_NEWLY_OCCUPIED {
        return newly_occupied;
    }
    // Nothing was known to be free here: what the beam hit, at the beam's own height.
    at_range
        .into_iter()
        .filter(|&index| {
            cycle.setup.mounts.height_above_scan_m(&point(index).cast()).abs() <= SCAN_BAND_M
        })
        .collect()
}

/// The newly occupied points beside a zone, away from any surface.
fn points_beside(
    azimuths_rad: &[Option<f64>],
    zone: &DynamicZone,
    in_zone: &[usize],
    classes: &[PointClass],
) -> Vec<usize> {
    let Some(ReturnSpan { nearest_m, .. }) = zone.returns else { return Vec::new() };
    let aside_rad = ASIDE_M.atan2(f64::from(nearest_m));
    let widened = DynamicZone {
        azimuth_min_rad: zone.azimuth_min_rad - aside_rad,
        azimuth_max_rad: zone.azimuth_max_rad + aside_rad,
        ..*zone
    };
    points_in_zone(azimuths_rad, &widened)
        .into_iter()
        .filter(|point| classes[*point].is_apart_from_surfaces())
        .filter(|point| in_zone.binary_search(point).is_err())
        .collect()
}

/// The connected groups of points in observed free space.
fn groups_in_free_space(classes: &[PointClass], candidates: &Candidates<'_>) -> Vec<Vec<usize>> {
    let alone: Vec<usize> =
        (0..classes.len()).filter(|&point| classes[point] == PointClass::InFreeSpace).collect();
    candidates.grown_from(&alone, |point| classes[point].is_in_free_space())
}

#[cfg(test)]
mod tests {
    use geometry::VoxelGrid;

    use super::*;

    const EDGE_M: f64 = 0.08;

    /// The seeds of an object that is expected around (3.0, 0.0, 0.9), 0.4 m by 0.6 m by 1.8 m.
    fn seeds_among(
        points_in_map: &[Point3<f64>],
        classes: &[PointClass],
        was_seen: bool,
    ) -> Vec<usize> {
        seeds_beside_background(points_in_map, classes, was_seen, &[])
    }

    /// The same, where some points continue a known surface.
    fn seeds_beside_background(
        points_in_map: &[Point3<f64>],
        classes: &[PointClass],
        was_seen: bool,
        continuing: &[usize],
    ) -> Vec<usize> {
        let expected = Prediction {
            centre_m: Point3::new(3.0, 0.0, 0.9),
            half_extent_m: Vector3::new(0.2, 0.3, 0.9),
            was_seen,
        };
        let grid = VoxelGrid::new(EDGE_M).unwrap();
        let voxels: Vec<_> = points_in_map.iter().map(|point| grid.key(point)).collect();
        let candidates = Candidates::new(classes, &voxels);
        let known = KnownOfPoints {
            classes,
            has_stopped: &|_| false,
            continues_background: &|point| continuing.contains(&point),
        };
        seeds_of_object(&expected, (points_in_map, known), &candidates, EDGE_M)
    }

    /// Regression: with poses that drift, a wall that came into view beside a person who was followed was taken for him, more of it in
    /// each image: a sixth of a corridor's points.
    #[test]
    fn a_wall_that_comes_into_view_beside_an_object_is_none_of_it() {
        use PointClass::{InFreeSpace, Unknown};
        // The object in the middle, and a wall 0.16 m beside it that goes on from there.
        let beside = |column: u32| Point3::new(2.9 + EDGE_M * f64::from(column), 0.16, 0.9);
        let of_length = |columns: u32| {
            let wall = (0..columns).map(beside);
            let points: Vec<_> = [Point3::new(3.0, 0.0, 0.9)].into_iter().chain(wall).collect();
            let mut classes = vec![Unknown; points.len()];
            classes[0] = InFreeSpace;
            seeds_among(&points, &classes, true)
        };
        // A part of the object ends with the sixth column.
        assert_eq!(of_length(20), [0]);
        assert_eq!(of_length(7), [0]);
        assert_eq!(of_length(6), [0, 1, 2, 3, 4, 5, 6]);
    }

    /// Regression: beside somebody who worked in a kitchen, patches of what furniture had hidden were taken for parts of him. While they
    /// were, nothing was learned of them: they grew, to a tenth of the image. And single points of a shelf's noise were parts of a forklift before it.
    #[test]
    fn what_continues_a_known_surface_is_none_of_an_object() {
        use PointClass::{InFreeSpace, InFreeSpaceBesideSurface, Unknown};
        let points_in_map = [[3.0, 0.0, 0.9], [3.0, 0.2, 0.3], [3.0, 0.2, 0.38], [3.1, -0.2, 1.4]]
            .map(Point3::from);
        let classes = [InFreeSpace, Unknown, Unknown, InFreeSpaceBesideSurface];
        let seeds =
            |continuing| seeds_beside_background(&points_in_map, &classes, true, continuing);
        assert_eq!(seeds(&[]), [0, 1, 2]);
        assert_eq!(seeds(&[2]), [0, 1]);
    }

    /// Regression: a leg at the border of the image, apart from the body, stayed in the map.
    #[test]
    fn what_stands_in_the_unknown_where_one_is_seen_is_his() {
        use PointClass::{Background, InFreeSpace, Unknown};
        // A leg, the body above it, a wall behind, and a piece 2 m beside.
        let points_in_map =
            [[3.0, 0.0, 0.3], [3.0, 0.0, 1.2], [3.4, 0.0, 1.0], [3.0, 2.0, 0.3]].map(Point3::from);
        let seeds = |body: PointClass, was_seen: bool| {
            let classes = [Unknown, body, Background, Unknown];
            let mut seeds = seeds_among(&points_in_map, &classes, was_seen);
            seeds.sort_unstable();
            seeds
        };
        assert_eq!(seeds(InFreeSpace, true), [0, 1]);
        assert_eq!(seeds(Unknown, true), [0, 1]);
        assert_eq!(seeds(InFreeSpace, false), [1]);
        assert!(seeds(Unknown, false).is_empty());
    }
}
