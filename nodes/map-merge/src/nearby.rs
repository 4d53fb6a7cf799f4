//! Whether a map has the same surface near a place.

use std::collections::HashMap;

use geometry::{BuildVoxelHasher, VoxelGrid, VoxelKey, is_finite};
use nalgebra::{Point3, Vector3};

/// Surfaces are the same when their normals are within 60 degrees: at the edges of things normals are means over both sides.
const SAME_COSINE: f32 = 0.5;

/// Points in cells, so that those near a place are found.
#[derive(Clone, Debug)]
pub(crate) struct Nearby {
    grid: VoxelGrid,
    within_m: f32,
    points: Vec<(Point3<f32>, Vector3<f32>)>,
    /// The points of each cell follow each other.
    cells: HashMap<VoxelKey, (u32, u32), BuildVoxelHasher>,
    has_normals: bool,
    is_sided: bool,
}

impl Nearby {
    /// Points with normals, or none; searched within a positive distance. Normals that are not sided may point to either side.
    pub(crate) fn new(
        points_m: impl Iterator<Item = Point3<f32>>,
        normals: &[Vector3<f32>],
        within_m: f64,
        is_sided: bool,
    ) -> Option<Self> {
        let grid = VoxelGrid::new(within_m).ok()?;
        let mut keyed: Vec<(VoxelKey, Point3<f32>, Vector3<f32>)> = points_m
            .enumerate()
            .filter(|(_, point_m)| is_finite(point_m))
            .map(|(index, point_m)| {
                (grid.key(&point_m), point_m, normals.get(index).copied().unwrap_or_default())
            })
            .collect();
        keyed.sort_by_key(|(key, ..)| *key);
        let mut cells: HashMap<VoxelKey, (u32, u32), BuildVoxelHasher> = HashMap::default();
        for (index, (key, ..)) in (0_u32..).zip(&keyed) {
            cells.entry(*key).or_insert((index, index)).1 = index + 1;
        }
        let points = keyed.into_iter().map(|(_, point_m, normal)| (point_m, normal)).collect();
        let has_normals = !normals.is_empty();
        Some(Self { grid, within_m: within_m as f32, points, cells, has_normals, is_sided })
    }

    /// Whether a point of the same surface is near a place; of any surface, where normals are not known.
    pub(crate) fn has(&self, place_m: &Point3<f32>, normal: Option<&Vector3<f32>>) -> bool {
        let normal = normal.filter(|_| self.has_normals);
        let mut near =
            self.grid.key(place_m).with_neighbours().filter_map(|key| self.cells.get(&key));
        near.any(|(from, until)| {
            self.points[*from as usize..*until as usize].iter().any(|(point_m, other)| {
                let is_near = (point_m - place_m).norm_squared() < self.within_m * self.within_m;
                is_near && normal.is_none_or(|normal| self.is_same(normal, other))
            })
        })
    }

    fn is_same(&self, one: &Vector3<f32>, other: &Vector3<f32>) -> bool {
        // No normal, as of a point with too few others around it, is of any surface.
        let is_none =
            |normal: &Vector3<f32>| *normal == Vector3::zeros() || !normal.norm().is_finite();
        if is_none(one) || is_none(other) {
            return true;
        }
        let cosine = one.dot(other);
        (if self.is_sided { cosine } else { cosine.abs() }) > SAME_COSINE
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Regression: a normal that is no number, as PCL writes them, was that of no surface, and the merged map had its point twice.
    #[test]
    fn a_point_without_a_normal_is_of_any_surface() {
        let place = Point3::new(1.0, 2.0, 3.0);
        for none in [Vector3::zeros(), Vector3::repeat(f32::NAN), Vector3::repeat(f32::INFINITY)] {
            let nearby = Nearby::new([place].into_iter(), &[none], 0.1, true).unwrap();
            assert!(nearby.has(&place, Some(&Vector3::x())), "{none}");
            let nearby = Nearby::new([place].into_iter(), &[Vector3::x()], 0.1, true).unwrap();
            assert!(nearby.has(&place, Some(&none)), "{none}");
            assert!(!nearby.has(&place, Some(&Vector3::y())));
        }
    }

    proptest! {
        #[test]
        fn what_is_near_is_what_a_search_of_all_points_finds(
            points in prop::collection::vec(prop::array::uniform3(-1.0..1.0_f32), 1..60),
            place in prop::array::uniform3(-1.2..1.2_f32),
            within_m in 0.01..0.5_f64,
            is_sided: bool,
        ) {
            let points: Vec<Point3<f32>> = points.into_iter().map(Point3::from).collect();
            let normals: Vec<Vector3<f32>> =
                points.iter().map(|point| point.coords.normalize()).collect();
            let (place, normal) = (Point3::from(place), Vector3::x());
            let nearby =
                Nearby::new(points.iter().copied(), &normals, within_m, is_sided).unwrap();
            let square_m2 = (within_m as f32).powi(2);
            let is_near = |point: &&Point3<f32>| (*point - place).norm_squared() < square_m2;
            prop_assert_eq!(nearby.has(&place, None), points.iter().any(|point| is_near(&point)));
            let same = points.iter().filter(is_near).any(|point| {
                let cosine = point.coords.normalize().x;
                (if is_sided { cosine } else { cosine.abs() }) > SAME_COSINE
            });
            prop_assert_eq!(nearby.has(&place, Some(&normal)), same);
        }
    }
}
