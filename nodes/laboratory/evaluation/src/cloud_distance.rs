//! How far two clouds of one scene are apart: accuracy, completeness, F-score and Chamfer distance, as the
//! benchmarks of reconstruction have them (Knapitsch et al. 2017, Tanks and Temples, section 4.1).

#[cfg(test)]
mod tests;

use std::collections::HashMap;

use geometry::{VoxelEdgeError, VoxelGrid, VoxelKey, is_finite};
use nalgebra::Point3;
use report::CloudDistance;

/// Points farther from the other cloud than so many tolerances count as that far: one stray point must not
/// outweigh a room.
const FARTHEST_IN_TOLERANCES: i32 = 5;

/// There is nothing to compare.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum CloudDistanceError {
    /// A cloud has no point.
    #[error("the {which} cloud has no point with finite coordinates")]
    Empty {
        /// `reference` or `map`.
        which: &'static str,
    },
    /// The tolerance is no length.
    #[error("the tolerance of the distance: {0}")]
    Tolerance(#[from] VoxelEdgeError),
}

/// A map and its reference in one frame, both reduced to one point a voxel: how often a place was seen does not count,
/// and the time of a comparison goes with the surface, not with the points on it.
#[derive(Clone, PartialEq, Debug)]
pub struct ReducedClouds {
    /// The reference: the mean of its points in each voxel.
    pub reference_m: Vec<Point3<f32>>,
    /// The map, likewise.
    pub map_m: Vec<Point3<f32>>,
}

impl ReducedClouds {
    /// The two clouds, reduced to voxels of an edge. Points that are not finite are left out.
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

    /// The distances of the two.
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

/// A cloud, ready to be asked for what is near.
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

    /// The distances of a cloud's points; none where it has no point.
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

    /// The distance to the nearest point, or that of five tolerances where none is nearer.
    fn distance_m(&self, point: &Point3<f32>) -> f64 {
        let centre = self.grid.key(point);
        let mut nearest_m = self.grid.edge_m() * f64::from(FARTHEST_IN_TOLERANCES);
        for ring in 0..=FARTHEST_IN_TOLERANCES {
            // What lies in this ring of cells is at least so far away.
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
