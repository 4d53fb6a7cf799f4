//! The distance between two clouds of one scene: accuracy, completeness, F-score and Chamfer distance, as defined by
//! reconstruction benchmarks (Knapitsch et al. 2017, Tanks and Temples, section 4.1).

#[cfg(test)]
mod tests;

use std::collections::HashMap;

use geometry::{VoxelEdgeError, VoxelGrid, VoxelKey, is_finite};
use nalgebra::Point3;
use report::CloudDistance;

/// Distances are clamped to this many tolerances, so that a single outlier does not dominate the mean.
const FARTHEST_IN_TOLERANCES: i32 = 5;

/// The clouds cannot be compared.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum CloudDistanceError {
    /// A cloud has no points.
    #[error("the {which} cloud has no point with finite coordinates")]
    Empty {
        /// `reference` or `map`.
        which: &'static str,
    },
    /// The tolerance is not a length.
    #[error("the tolerance of the distance: {0}")]
    Tolerance(#[from] VoxelEdgeError),
}

/// A map and its reference in one frame, both reduced to one point per voxel: how often a place was observed does not
/// count, and the time of a comparison depends on the surface area, not on the number of points.
#[derive(Clone, PartialEq, Debug)]
pub struct ReducedClouds {
    /// The reference: the mean of its points in each voxel.
    pub reference_m: Vec<Point3<f32>>,
    /// The map, likewise.
    pub map_m: Vec<Point3<f32>>,
}

impl ReducedClouds {
    /// The two clouds, reduced to voxels of this edge. Non-finite points are left out.
    ///
    /// # Errors
    /// When the edge is not a positive number.
    pub fn of(
        reference_m: &[Point3<f32>],
        map_m: &[Point3<f32>],
        edge_m: f64,
    ) -> Result<Self, VoxelEdgeError> {
        let grid = VoxelGrid::new(edge_m)?;
        Ok(Self { reference_m: grid.reduce(reference_m), map_m: grid.reduce(map_m) })
    }

    /// The distances between the two.
    ///
    /// # Errors
    /// When a cloud is empty, or the tolerance is not a positive number.
    pub fn distance(&self, tolerance_m: f64) -> Result<CloudDistance, CloudDistanceError> {
        cloud_distance(&self.reference_m, &self.map_m, tolerance_m)
    }
}

fn cloud_distance(
    reference_m: &[Point3<f32>],
    map_m: &[Point3<f32>],
    tolerance_m: f64,
) -> Result<CloudDistance, CloudDistanceError> {
    let reference = Neighbours::of(reference_m, tolerance_m)?;
    let map = Neighbours::of(map_m, tolerance_m)?;
    let to_reference =
        reference.distances_of(map_m).ok_or(CloudDistanceError::Empty { which: "map" })?;
    let to_map =
        map.distances_of(reference_m).ok_or(CloudDistanceError::Empty { which: "reference" })?;
    let (precision, recall) = (to_reference.share_within, to_map.share_within);
    let both = precision + recall;
    Ok(CloudDistance {
        tolerance_m,
        accuracy_m: to_reference.mean_m,
        completeness_m: to_map.mean_m,
        chamfer_m: f64::midpoint(to_reference.mean_m, to_map.mean_m),
        precision,
        recall,
        f_score: if both > 0.0 { 2.0 * precision * recall / both } else { 0.0 },
    })
}

/// A cloud with an index for nearest-neighbour queries.
struct Neighbours {
    /// Cells of one tolerance. Looked up by key alone; the order of hashing reaches no result.
    cells: HashMap<VoxelKey, Vec<Point3<f32>>>,
    grid: VoxelGrid,
}

struct Distances {
    mean_m: f64,
    share_within: f64,
}

impl Neighbours {
    fn of(cloud_m: &[Point3<f32>], tolerance_m: f64) -> Result<Self, VoxelEdgeError> {
        let grid = VoxelGrid::new(tolerance_m)?;
        let mut cells: HashMap<_, Vec<_>> = HashMap::new();
        for point in cloud_m.iter().filter(|point| is_finite(point)) {
            cells.entry(grid.key(point)).or_default().push(*point);
        }
        Ok(Self { cells, grid })
    }

    /// The distances of a cloud's points; `None` when it has none.
    fn distances_of(&self, cloud_m: &[Point3<f32>]) -> Option<Distances> {
        let (mut points, mut within, mut sum_m) = (0_u64, 0_u64, 0.0);
        for point in cloud_m.iter().filter(|point| is_finite(point)) {
            let distance_m = self.distance_m(point);
            points += 1;
            within += u64::from(distance_m <= self.grid.edge_m());
            sum_m += distance_m;
        }
        (points > 0).then(|| Distances {
            mean_m: sum_m / points as f64,
            share_within: within as f64 / points as f64,
        })
    }

    /// The distance to the nearest point, at most five tolerances.
    fn distance_m(&self, point: &Point3<f32>) -> f64 {
        let centre = self.grid.key(point);
        let mut nearest_m = self.grid.edge_m() * f64::from(FARTHEST_IN_TOLERANCES);
        for ring in 0..=FARTHEST_IN_TOLERANCES {
            // The points in this ring of cells are at least this far away.
            if f64::from(ring - 1) * self.grid.edge_m() >= nearest_m {
                break;
            }
            for key in ring_of(centre, ring) {
                for other in self.cells.get(&key).into_iter().flatten() {
                    let apart_m = (other.cast::<f64>() - point.cast::<f64>()).norm();
                    nearest_m = nearest_m.min(apart_m);
                }
            }
        }
        nearest_m
    }
}

/// The cells of which one coordinate differs from the centre's by `ring`, and none by more.
fn ring_of(centre: VoxelKey, ring: i32) -> impl Iterator<Item = VoxelKey> {
    let span = move || -ring..=ring;
    span().flat_map(move |x| span().map(move |y| (x, y))).flat_map(move |(x, y)| {
        let is_side = x.abs() == ring || y.abs() == ring;
        let step = if is_side || ring == 0 { 1 } else { 2 * ring };
        (-ring..=ring).step_by(step as usize).map(move |z| VoxelKey {
            x: centre.x.saturating_add(x),
            y: centre.y.saturating_add(y),
            z: centre.z.saturating_add(z),
        })
    })
}
