//! A ray through the voxel grid.

use nalgebra::{Point3, Vector3};

use super::{VoxelGrid, VoxelKey};

/// A ray is followed through this many voxels, and no farther: 370 m at an edge of 8 cm along the diagonal, far more
/// than an RGB-D camera sees. It bounds what a point without measure costs.
const MOST_CELLS: usize = 8192;

/// Cells farther from the origin than this are not walked: the numbers of cells stay in 32 bits, and a step in the
/// grid stays a step in 64-bit floats.
const FARTHEST_CELL: f64 = (1u64 << 30) as f64;

/// A straight line from a point where the camera was to a point where it saw something.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct VoxelRay {
    origin_m: Point3<f64>,
    direction: Vector3<f64>,
    length_m: f64,
}

impl VoxelRay {
    /// The ray between two points; `None` when a number is not finite, or both are the same point.
    #[must_use]
    pub fn between(origin_m: &Point3<f64>, end_m: &Point3<f64>) -> Option<Self> {
        let offset_m = end_m - origin_m;
        let length_m = offset_m.norm();
        (length_m.is_finite() && length_m > 0.0).then(|| Self {
            origin_m: *origin_m,
            direction: offset_m / length_m,
            length_m,
        })
    }

    /// From the origin to the end.
    #[must_use]
    pub fn length_m(&self) -> f64 {
        self.length_m
    }

    /// How far along the ray the foot of the point is, and the square of its distance from the ray's line.
    #[must_use]
    pub fn along_and_aside(&self, point_m: &Point3<f64>) -> (f64, f64) {
        let offset_m = point_m - self.origin_m;
        let along_m = offset_m.dot(&self.direction);
        (along_m, (offset_m - along_m * self.direction).norm_squared())
    }

    /// The cells that the ray crosses from its origin on up to `stop_m`, in their order (Amanatides & Woo, "A
    /// fast voxel traversal algorithm for ray tracing", 1987). None when it starts out of reach.
    #[must_use]
    pub fn cells(&self, grid: &VoxelGrid, stop_m: f64) -> RayCells {
        let edge_m = grid.edge_m();
        let mut cells = RayCells {
            cell: [0; 3],
            step: [0; 3],
            next_m: [f64::INFINITY; 3],
            per_cell_m: [f64::INFINITY; 3],
            stop_m,
            left: MOST_CELLS,
        };
        for axis in 0..3 {
            let (start, slope) = (self.origin_m[axis] / edge_m, self.direction[axis]);
            if start.abs() >= FARTHEST_CELL {
                cells.left = 0;
                continue;
            }
            cells.cell[axis] = start.floor() as i32;
            if slope != 0.0 {
                cells.step[axis] = if slope > 0.0 { 1 } else { -1 };
                let border = if slope > 0.0 { start.floor() + 1.0 } else { start.floor() };
                cells.next_m[axis] = (border - start) * edge_m / slope;
                cells.per_cell_m[axis] = edge_m / slope.abs();
            }
        }
        if stop_m < 0.0 {
            cells.left = 0;
        }
        cells
    }
}

/// The walk of a [`VoxelRay`].
#[derive(Clone, Debug)]
pub struct RayCells {
    cell: [i32; 3],
    step: [i32; 3],
    /// How far along the ray the next border of each axis is.
    next_m: [f64; 3],
    /// How far along the ray two borders of an axis are from each other.
    per_cell_m: [f64; 3],
    stop_m: f64,
    left: usize,
}

impl Iterator for RayCells {
    type Item = VoxelKey;

    fn next(&mut self) -> Option<VoxelKey> {
        self.left = self.left.checked_sub(1)?;
        let [x, y, z] = self.cell;
        let [next_x, next_y, next_z] = self.next_m;
        let axis = if next_x <= next_y && next_x <= next_z {
            0
        } else if next_y <= next_z {
            1
        } else {
            2
        };
        if self.next_m[axis] > self.stop_m {
            self.left = 0;
        } else {
            // No more than `MOST_CELLS` steps from `FARTHEST_CELL`: the sum stays in its type.
            self.cell[axis] += self.step[axis];
            self.next_m[axis] += self.per_cell_m[axis];
        }
        Some(VoxelKey { x, y, z })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn cells(origin: [f64; 3], end: [f64; 3], edge_m: f64) -> Vec<VoxelKey> {
        let ray = VoxelRay::between(&Point3::from(origin), &Point3::from(end)).unwrap();
        ray.cells(&VoxelGrid::new(edge_m).unwrap(), ray.length_m()).collect()
    }

    #[test]
    fn a_walk_by_hand() {
        let expected = [[0, 0, 0], [0, -1, 0], [1, -1, 0], [1, -2, 0], [2, -2, 0]];
        let expected = expected.map(|[x, y, z]| VoxelKey { x, y, z });
        assert_eq!(cells([0.25, 0.1, 0.2], [1.25, -0.75, 0.2], 0.5), expected);
        assert_eq!(cells([0.1, 0.1, 0.1], [0.2, 0.1, 0.1], 0.5), [VoxelKey::default()]);
    }

    #[test]
    fn what_has_no_measure_ends() {
        let origin = Point3::origin();
        for end in [f64::NAN, f64::INFINITY, 0.0] {
            assert_eq!(VoxelRay::between(&origin, &Point3::new(end, 0.0, 0.0)), None);
        }
        assert_eq!(cells([0.0; 3], [1e30, 1e30, -1e30], 0.08).len(), MOST_CELLS);
        assert!(cells([1e20, 0.0, 0.0], [0.0; 3], 0.08).is_empty());
        let ray = VoxelRay::between(&origin, &Point3::new(1.0, 0.0, 0.0)).unwrap();
        assert_eq!(ray.cells(&VoxelGrid::new(0.08).unwrap(), -0.1).count(), 0);
    }

    #[test]
    fn a_point_beside_a_ray() {
        let ray =
            VoxelRay::between(&Point3::new(1.0, 0.0, 0.0), &Point3::new(5.0, 0.0, 0.0)).unwrap();
        assert_eq!(ray.along_and_aside(&Point3::new(3.0, 3.0, 4.0)), (2.0, 25.0));
        assert_eq!(ray.along_and_aside(&Point3::new(0.0, 0.0, 1.0)), (-1.0, 1.0));
    }

    proptest! {
        /// Against points of the ray in small steps: each of their cells is in the walk, and neighbours in the
        /// walk share a face.
        #[test]
        fn the_walk_misses_no_cell(
            origin in prop::array::uniform3(-2.0..2.0_f64),
            end in prop::array::uniform3(-2.0..2.0_f64),
        ) {
            let edge_m = 0.08;
            let walk = cells(origin, end, edge_m);
            let (origin, end) = (Point3::from(origin), Point3::from(end));
            for step in 0..=2000 {
                let point = origin + (end - origin) * (f64::from(step) / 2000.0);
                let key = [0, 1, 2].map(|axis| point[axis] / edge_m);
                // On a border within the rounding either side is right.
                if key.iter().any(|key| (key - key.round()).abs() < 1e-9) {
                    continue;
                }
                let [x, y, z] = key.map(|key| key.floor() as i32);
                prop_assert!(walk.contains(&VoxelKey { x, y, z }), "{} {} {}", x, y, z);
            }
            for pair in walk.windows(2) {
                let way = (pair[1].x - pair[0].x).abs() + (pair[1].y - pair[0].y).abs() + (pair[1].z - pair[0].z).abs();
                prop_assert_eq!(way, 1);
            }
        }
    }
}
