//! The mesh of a saved map, which has points, and no distances.

use std::collections::HashSet;

use geometry::{BuildVoxelHasher, OrientedPoints, TriangleMesh, VoxelGrid};
use volume::{BlockBox, PointRules, Surface, SurfaceConfig};

use super::MeshError;
use crate::surface_map::loading::{MOST_SPACING_IN_EDGES, one_a_voxel};
use crate::surface_map::normals;

/// Edges of maps are whole multiples of this, in metres.
const EDGE_STEP_M: f64 = 0.001;
/// The edge of the voxels of a map is within these shares of how far apart its points are.
const LEAST_EDGE_IN_SPACINGS: f64 = 0.6;
const MOST_EDGE_IN_SPACINGS: f64 = 1.6;
/// Points farther apart are those of no map.
const MOST_SPACING_M: f64 = 10.0;
/// The points of another cloud than a map say where the surface is so many edges around them: it has no gaps between them.
const REACH_IN_EDGES: f64 = 2.0;

/// A mesh is made of so many blocks at most, of 3.6 kB each: some 30,000 m2 of a map at 2 cm.
const MOST_BLOCKS: usize = 2_000_000;

/// The triangles of points. Where there is one in each voxel of a grid, as of a map, they are those of the map as far as its
/// points and normals say; of another cloud the points become patches that reach some way beyond its border. Normals that are
/// missing are estimated. The voxels have the edge `edge_m`; where it is not given the edge of the map, or how far apart the points are.
///
/// # Errors
/// When there are no points, the edge means nothing, the points join to no surface, or to one of more than 2 million blocks of 8 voxels an axis.
pub fn mesh_of_points(
    points: &OrientedPoints,
    edge_m: Option<f64>,
) -> Result<TriangleMesh, MeshError> {
    mesh_of_blocks(points, edge_m, MOST_BLOCKS)
}

pub(super) fn mesh_of_blocks(
    points: &OrientedPoints,
    edge_m: Option<f64>,
    max_blocks: usize,
) -> Result<TriangleMesh, MeshError> {
    if points.points_m.is_empty() {
        return Err(MeshError::NoTriangles);
    }
    let given = points.points_m.len();
    let spacing_m = spacing_m(points);
    let map_edge_m = spacing_m.and_then(|spacing_m| edge_of_map_m(points, spacing_m));
    let edge_m = edge_m.or(map_edge_m).or(spacing_m).unwrap_or(MOST_SPACING_M);
    let config = SurfaceConfig { edge_m, max_blocks, has_colour: true, ..SurfaceConfig::default() };
    let mut surface = Surface::new(config)?;
    // Of a finer edge each voxel has one point at most, too, and most have none.
    let is_own = |map_edge_m: f64| edge_m > map_edge_m - EDGE_STEP_M / 2.0;
    let is_map = map_edge_m.is_some_and(is_own) && are_one_a_voxel(points, edge_m);
    let mut points = if is_map { points.clone() } else { one_a_voxel(points, surface.grid()) };
    if points.normals.len() != points.points_m.len() {
        // The means of voxels are as far apart as these are wide.
        let apart_m = spacing_m
            .map_or(edge_m, |spacing_m| if is_map { spacing_m } else { spacing_m.max(edge_m) });
        points.normals = normals::normals(&points.points_m, apart_m);
    }
    let reach_m =
        if is_map { edge_m } else { spacing_m.unwrap_or(edge_m).max(REACH_IN_EDGES * edge_m) };
    if reach_m > MOST_SPACING_IN_EDGES * edge_m {
        let least_m = reach_m / MOST_SPACING_IN_EDGES;
        return Err(MeshError::TooFine { edge_m, spacing_m: reach_m, least_m });
    }
    let colours = points.colours.iter().copied().chain(std::iter::repeat(geometry::NO_COLOUR));
    let put = points.points_m.iter().zip(&points.normals).zip(colours);
    let refused = surface.put_coloured_points(
        put.map(|((point_m, normal), colour)| (*point_m, *normal, colour)),
        reach_m,
        BlockBox::ALL,
    );
    if refused > 0 {
        return Err(MeshError::TooManyBlocks { edge_m, max_blocks });
    }
    let mesh = surface.mesh(PointRules::default());
    if mesh.triangles.is_empty() {
        return Err(MeshError::NoSurface { points: given, edge_m });
    }
    Ok(mesh)
}

/// The edge of the voxels of a saved map, or how far apart the points of another cloud are, in metres. `None` for fewer than a handful of
/// points, and for points that are too far apart to be a map's.
#[must_use]
pub fn edge_of_map_points_m(points: &OrientedPoints) -> Option<f64> {
    spacing_m(points).map(|spacing_m| edge_of_map_m(points, spacing_m).unwrap_or(spacing_m))
}

fn spacing_m(points: &OrientedPoints) -> Option<f64> {
    normals::spacing_m(&points.points_m, EDGE_STEP_M, MOST_SPACING_M)
}

/// The edge of the voxels of which each has one point at most, the longest: of a slightly longer one some have two.
fn edge_of_map_m(points: &OrientedPoints, spacing_m: f64) -> Option<f64> {
    let steps = |in_spacings: f64| (in_spacings * spacing_m / EDGE_STEP_M).floor() as u32;
    let candidates = steps(LEAST_EDGE_IN_SPACINGS)..=steps(MOST_EDGE_IN_SPACINGS);
    candidates
        .rev()
        .map(|steps| f64::from(steps) * EDGE_STEP_M)
        .find(|edge_m| are_one_a_voxel(points, *edge_m))
}

fn are_one_a_voxel(points: &OrientedPoints, edge_m: f64) -> bool {
    let Ok(grid) = VoxelGrid::new(edge_m) else { return false };
    let mut voxels: HashSet<_, BuildVoxelHasher> = HashSet::default();
    points.points_m.iter().all(|point_m| voxels.insert(grid.key(point_m)))
}
