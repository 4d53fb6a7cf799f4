//! A saved map, and the parts of it that it is aligned by.

use estimation::Executor;
use geometry::{FARTHEST_POSE_M, MapView, OrientedPoints, VoxelGrid, VoxelKey, is_finite};
use nalgebra::{Isometry3, Point3, Translation3, Vector3};
use registration::{PreparationConfig, PreparedCloud, RegistrationError};

use crate::level::level_from_map;

/// Maps are aligned by voxels of this edge: finer ones add time and no accuracy, since depth at 4 m has as much noise (2.3 cm) as
/// half of it.
const FINEST_EDGE_M: f64 = 0.05;
/// A surface is upright, or level, within this angle: 15 degrees, several standard deviations of the normal of a few noisy
/// points.
const SLOPE: f64 = 0.26;
/// The first registrations take a point for each voxel of this edge: some thousand of a flat, which place it to a centimetre or two.
const COARSE_EDGE_M: f64 = 0.25;

/// A map as its file has it.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct SavedMap {
    /// Points, one a voxel, with their normals and colours where there are any. The z axis is up within a few degrees.
    pub points: OrientedPoints,
    /// The places that the map was seen from; none where that is not known.
    pub views: Vec<MapView>,
    /// The edge of the voxels, or how far apart the points are.
    pub edge_m: f64,
}

impl SavedMap {
    /// Whether each point has a normal.
    pub(crate) fn has_normals(&self) -> bool {
        self.points.normals.len() == self.points.points_m.len()
    }

    /// Whether its normals point to the side that the surface was seen from: those of our own maps, which have views, do. Other programs
    /// estimate normals without knowing that.
    pub(crate) fn is_sided(&self) -> bool {
        self.has_normals() && !self.views.is_empty()
    }
}

/// How a surface lies.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Lie {
    Level,
    Upright,
    Slanted,
}

/// A piece of a surface, as large as a voxel.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Piece {
    pub(crate) place_m: Point3<f64>,
    /// Of length 1. Its sign means something where the map is sided.
    pub(crate) normal: Vector3<f64>,
}

impl Piece {
    pub(crate) fn lie(&self) -> Lie {
        let up = self.normal.z.abs();
        if up < SLOPE {
            Lie::Upright
        } else if up > (1.0 - SLOPE * SLOPE).sqrt() {
            Lie::Level
        } else {
            Lie::Slanted
        }
    }
}

/// A map that is made ready: thinned out, with normals, and level.
#[derive(Clone, Debug)]
pub(crate) struct PreparedMap {
    /// For the registration, about the map's middle: far from its origin a shift and a turn would be nearly the same.
    pub(crate) cloud: PreparedCloud,
    /// The same of fewer points.
    pub(crate) coarse: PreparedCloud,
    /// The edge of the voxels of all that is here.
    pub(crate) edge_m: f64,
    /// Moves the map's middle to the origin.
    pub(crate) middle_from_map: Translation3<f64>,
    /// The same, and turns the map such that its floors are level.
    pub(crate) level_from_map: Isometry3<f64>,
    /// The surfaces, in the level frame.
    pub(crate) pieces: Vec<Piece>,
    /// Whether the normals say from which side a surface was seen.
    pub(crate) is_sided: bool,
}

impl PreparedMap {
    /// # Errors
    /// When there is no point.
    pub(crate) fn new(map: &SavedMap, executor: &dyn Executor) -> Result<Self, RegistrationError> {
        let edge_m = map.edge_m.max(FINEST_EDGE_M);
        let middle_from_map = middle_from_map(&map.points.points_m);
        let about_middle = |point_m: &Point3<f32>| (middle_from_map * point_m.cast::<f64>()).cast();
        let points_m: Vec<Point3<f32>> = map.points.points_m.iter().map(about_middle).collect();
        let preparation = PreparationConfig { voxel_edge_m: edge_m, ..Default::default() };
        let cloud = PreparedCloud::new(&points_m, &preparation, executor)?;
        let preparation =
            PreparationConfig { voxel_edge_m: edge_m.max(COARSE_EDGE_M), ..preparation };
        let coarse = PreparedCloud::new(&points_m, &preparation, executor)?;
        let is_sided = map.is_sided();
        let normals = if is_sided { &map.points.normals[..] } else { &[] };
        let pieces = pieces(&cloud, &normals_by_voxel(&points_m, normals, edge_m), edge_m);
        let level = level_from_map(&pieces);
        let pieces = pieces
            .into_iter()
            .map(|Piece { place_m, normal }| Piece {
                place_m: level * place_m,
                normal: level * normal,
            })
            .collect();
        let level_from_map = level * middle_from_map;
        Ok(Self { cloud, coarse, edge_m, middle_from_map, level_from_map, pieces, is_sided })
    }

    /// The pieces that lie so.
    pub(crate) fn lying(&self, lie: Lie) -> impl Iterator<Item = &Piece> + Clone {
        self.pieces.iter().filter(move |piece| piece.lie() == lie)
    }

    /// The area of its upright surfaces.
    pub(crate) fn upright_m2(&self) -> f64 {
        self.lying(Lie::Upright).count() as f64 * self.edge_m * self.edge_m
    }
}

fn middle_from_map(points_m: &[Point3<f32>]) -> Translation3<f64> {
    // A stray point far away would take the middle, and with it the digits of all others.
    let usable = || points_m.iter().filter(|point_m| is_in_reach(point_m));
    let sum = usable().fold(Vector3::zeros(), |sum, point_m| sum + point_m.coords.cast::<f64>());
    Translation3::from(-sum / (usable().count().max(1) as f64))
}

/// Whether a point is finite, and no farther than a pose may be.
fn is_in_reach(point_m: &Point3<f32>) -> bool {
    point_m.iter().all(|along_m| f64::from(along_m.abs()) < FARTHEST_POSE_M)
}

/// The points of the cloud that have a normal: that of the file in its voxel, where the file has some.
fn pieces(cloud: &PreparedCloud, of_file: &[(VoxelKey, Vector3<f64>)], edge_m: f64) -> Vec<Piece> {
    let grid = VoxelGrid::new(edge_m).ok();
    let mean = |point_m: &Point3<f32>| {
        let key = grid.as_ref()?.key(point_m);
        let place = of_file.binary_search_by_key(&key, |(key, _)| *key).ok()?;
        of_file.get(place).map(|(_, normal)| *normal)
    };
    cloud
        .points_m()
        .filter(|(point_m, _)| is_in_reach(point_m))
        .filter_map(|(point_m, estimated)| {
            let estimated = estimated.map(|normal| normal.cast());
            let normal = if of_file.is_empty() { estimated } else { mean(&point_m) };
            Some(Piece { place_m: point_m.cast(), normal: normal?.try_normalize(1e-3)? })
        })
        .collect()
}

/// The sum of the normals of each voxel, by ascending key.
fn normals_by_voxel(
    points_m: &[Point3<f32>],
    normals: &[Vector3<f32>],
    edge_m: f64,
) -> Vec<(VoxelKey, Vector3<f64>)> {
    let Ok(grid) = VoxelGrid::new(edge_m) else { return Vec::new() };
    let is_usable = |(point_m, normal): &(&Point3<f32>, &Vector3<f32>)| {
        is_finite(point_m) && normal.iter().all(|along| along.is_finite())
    };
    let mut keyed: Vec<(VoxelKey, Vector3<f64>)> = points_m
        .iter()
        .zip(normals)
        .filter(is_usable)
        .map(|(point_m, normal)| (grid.key(point_m), normal.cast()))
        .collect();
    keyed.sort_by_key(|(key, _)| *key);
    keyed
        .chunk_by(|a, b| a.0 == b.0)
        .map(|same| (same[0].0, same.iter().map(|(_, normal)| normal).sum()))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Regression: one return at 1e9 m took the middle of the map, and with it the digits of all other points.
    #[test]
    fn a_stray_point_does_not_take_the_middle() {
        let points_m = [1.0, 3.0, 1e9, f32::NAN, f32::INFINITY].map(|x| Point3::new(x, 0.0, 0.0));
        assert_eq!(middle_from_map(&points_m), Translation3::new(-2.0, 0.0, 0.0));
        assert_eq!(middle_from_map(&[]), Translation3::identity());
    }
}
