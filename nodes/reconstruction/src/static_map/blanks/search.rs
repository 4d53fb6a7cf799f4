//! Where a cycle looks for what has gone: in the cubes of voxels with a part in an open direction.

use geometry::{CloudView, DepthByDirection, NEAREST_SEEN_M, VoxelGrid, VoxelKey};
use nalgebra::{Matrix3, Point3, Vector2, Vector3};

use super::super::blocks::{BLOCK_EDGE_VOXELS, block_of};
use super::open_directions::OpenDirections;
use super::{Blanks, reach_m};

/// Blocks are looked for in cubes of so many voxels an axis first, 64 blocks, and in eighths of those next.
const CUBE_EDGE_VOXELS: i32 = 16;
/// Half the diagonal of a cube, in halves of its edge: the square root of 3, rounded up.
const HALF_DIAGONAL_OF_CUBE: f64 = 1.733;

/// Where a cycle looks for what has gone.
pub(super) struct Search<'a> {
    pub(super) blanks: &'a Blanks,
    pub(super) sight: &'a CloudView,
    open: OpenDirections,
    reach_m: f64,
    /// From the grid's numbers to metres along the rig's axes, and from the camera to the grid's origin.
    rig_from_voxels: Matrix3<f64>,
    from_camera_to_voxels_m: Vector3<f64>,
}

impl<'a> Search<'a> {
    pub(super) fn of(blanks: &'a Blanks, sight: &'a CloudView) -> Self {
        let open = OpenDirections::of(sight.nearest(), &blanks.farthest, &blanks.view);
        let rig_from_map = sight.map_from_rig.inverse();
        Self {
            blanks,
            sight,
            open,
            reach_m: reach_m(sight).min(blanks.farthest_m + sight.same_surface_m()),
            rig_from_voxels: rig_from_map.rotation.to_rotation_matrix().into_inner() * sight.edge_m,
            from_camera_to_voxels_m: rig_from_map.translation.vector - sight.camera_in_rig_m.coords,
        }
    }

    /// The blocks with a part in an open direction, empty ones too.
    pub(super) fn blocks(&self, grid: &VoxelGrid) -> Vec<VoxelKey> {
        if self.open.is_empty() {
            return Vec::new();
        }
        let corners = self.box_in_view();
        let [first, last] = corners.map(|corner| grid.key(&corner.cast()));
        let mut edge_voxels = CUBE_EDGE_VOXELS;
        let mut cubes: Vec<VoxelKey> = cubes_between(first, last, edge_voxels)
            .filter(|cube| self.may_hold(*cube, edge_voxels))
            .collect();
        while edge_voxels > i32::from(BLOCK_EDGE_VOXELS) {
            edge_voxels /= 2;
            cubes = cubes
                .into_iter()
                .flat_map(|cube| eighths(cube, edge_voxels))
                .filter(|cube| self.may_hold(*cube, edge_voxels))
                .collect();
        }
        cubes.into_iter().map(block_of).collect()
    }

    /// The corners of the box along the map's axes around all that is in view and within reach.
    fn box_in_view(&self) -> [Point3<f64>; 2] {
        let (view, sight) = (&self.blanks.view, self.sight);
        let widest = Vector2::repeat(DepthByDirection::WIDEST_SLOPE);
        let (least, most) = (view.least.sup(&-widest), view.most.inf(&widest));
        let eye = sight.camera_in_map_m();
        let mut corners_m = [eye, eye];
        for (y, z) in [(least.x, least.y), (least.x, most.y), (most.x, least.y), (most.x, most.y)] {
            let ray_m = Vector3::new(1.0, y, z) * self.reach_m;
            let corner_m = sight.map_from_rig * (sight.camera_in_rig_m + ray_m);
            corners_m = [corners_m[0].inf(&corner_m), corners_m[1].sup(&corner_m)];
        }
        corners_m
    }

    /// Whether a cube of so many voxels an axis, of which this is the least, may have a part in an open direction.
    pub(super) fn may_hold(&self, least: VoxelKey, edge_voxels: i32) -> bool {
        let half_edge = f64::from(edge_voxels) / 2.0;
        let middle = Vector3::new(least.x.into(), least.y.into(), least.z.into());
        let from_camera_m = self.rig_from_voxels * (middle + Vector3::repeat(half_edge))
            + self.from_camera_to_voxels_m;
        let half_m = half_edge * self.sight.edge_m;
        let depths_m = NEAREST_SEEN_M..self.reach_m;
        self.open.may_show(&from_camera_m, half_m * HALF_DIAGONAL_OF_CUBE, depths_m)
    }
}

/// The least voxels of the cubes of so many voxels an axis, from the one that holds `first` to the one that holds
/// `last`.
fn cubes_between(
    first: VoxelKey,
    last: VoxelKey,
    edge_voxels: i32,
) -> impl Iterator<Item = VoxelKey> {
    let along = move |first: i32, last: i32| {
        let cubes = first.div_euclid(edge_voxels)..=last.div_euclid(edge_voxels);
        cubes.map(move |cube| cube * edge_voxels)
    };
    let columns =
        along(first.x, last.x).flat_map(move |x| along(first.y, last.y).map(move |y| (x, y)));
    columns.flat_map(move |(x, y)| along(first.z, last.z).map(move |z| VoxelKey { x, y, z }))
}

/// The least voxels of the eight cubes of so many voxels an axis that make up one of twice the edge.
fn eighths(cube: VoxelKey, edge_voxels: i32) -> impl Iterator<Item = VoxelKey> {
    (0..8).map(move |eighth| VoxelKey {
        x: cube.x + (eighth & 1) * edge_voxels,
        y: cube.y + (eighth >> 1 & 1) * edge_voxels,
        z: cube.z + (eighth >> 2) * edge_voxels,
    })
}
