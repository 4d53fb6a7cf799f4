//! Rays clear what they pass: free space seen through a voxel is evidence that nothing stands there any more.
//!
//! A cycle's points are means of what was seen in cells of a voxel grid, so a ray stands for the cone from the camera
//! to such a cell. A voxel is passed when
//! - the cone's axis crosses it, and ends more than [`STOP_BEFORE_END_IN_EDGES`] behind: nearer by, the noise of the
//!   depth and the size of the cells could make a surface pass itself;
//! - the voxel's mean lies in the cone;
//! - no return of this cycle lies in the voxel;
//! - no return of this cycle in one of the 26 voxels around it lies so near beside the ray, on its way, that the ray
//!   only grazes a surface that is seen to be there, as those over a floor do, or those past the edge of a table
//!   or through what a cell's mean makes of both sides of a chair's leg.
//!
//! Returns of what moves count as returns too: what stands there now is no proof of a still thing, nor of free space.
//! A voxel that is passed loses evidence once a cycle, by however many rays. Where there are no returns at all, the
//! module `blanks` says what has gone.

#[cfg(test)]
mod tests;

use geometry::{SegmentedCycle, VoxelGrid, VoxelKey, VoxelRay};
use nalgebra::Point3;

use super::blocks::{a_voxel_of, bit_of, block_of};
use super::evidence::Evidence;
use super::{Addition, Clearing, MapError, StaticMap};

/// Where a ray stops to clear, before its own end, in edges of the map's voxels.
const STOP_BEFORE_END_IN_EDGES: f64 = 1.5;

/// The radius of a ray's cone at the ray's end, in edges: a little above the half diagonal of a cell's face, 0.71, so
/// that the cones of neighbouring cells leave no gap between them. The cells' edge is taken to be the map's.
const CONE_IN_EDGES: f64 = 0.75;

/// A return this near beside a ray, in edges, and within a voxel of the voxel in question, is on a surface that the
/// ray grazes. More than [`CONE_IN_EDGES`], so that what the cone reaches is guarded by its neighbours.
const GRAZES_IN_EDGES: f64 = 1.0;

/// Before its end a ray touches the surface on which it ends: returns there, in edges, are not beside its way.
const OWN_END_IN_EDGES: f64 = 0.5;

/// A ray clears so many voxels' edges of its way: 160 m at 8 cm, more than any depth camera reaches. It bounds what a
/// depth that is wrong by kilometres costs.
const LONGEST_WAY_IN_EDGES: f64 = 2_000.0;

/// The tables of one cycle.
#[derive(Clone, Debug, Default)]
pub(super) struct RayTables {
    returns: Returns,
    passed: Vec<VoxelKey>,
}

impl RayTables {
    pub(super) fn memory_bytes(&self) -> usize {
        self.returns.returns.capacity() * size_of::<Return>()
            + self.passed.capacity() * size_of::<VoxelKey>()
    }
}

/// A point of one cycle, in the map frame.
#[derive(Clone, Copy, Debug)]
struct Return {
    key: VoxelKey,
    point_m: Point3<f32>,
    is_static: bool,
}

/// The returns of one cycle in ascending order of their voxels' keys.
#[derive(Clone, Debug, Default)]
struct Returns {
    returns: Vec<Return>,
}

impl Returns {
    fn refill(&mut self, cycle: &SegmentedCycle, grid: &VoxelGrid, addition: &mut Addition) {
        self.returns.clear();
        let mut push = |point_m: Point3<f32>, is_static: bool| {
            let is_finite = geometry::is_finite(&point_m);
            if is_finite {
                self.returns.push(Return { key: grid.key(&point_m), point_m, is_static });
            }
            is_finite
        };
        for point in &cycle.static_cloud.points_m {
            if !push(*point, true) {
                addition.not_finite_points += 1;
            }
        }
        let dynamic_in_map = cycle.dynamic_cloud.transformed(&cycle.map_from_rig, "");
        for point in dynamic_in_map.points_m {
            push(point, false);
        }
        // Bits of the coordinates at last, so that the whole order hangs on the points alone.
        self.returns.sort_unstable_by_key(|seen| {
            let [x, y, z] = [seen.point_m.x, seen.point_m.y, seen.point_m.z].map(f32::to_bits);
            (seen.key, seen.is_static, x, y, z)
        });
    }

    fn points_m(&self) -> impl Iterator<Item = Point3<f32>> {
        self.returns.iter().map(|seen| seen.point_m)
    }

    /// The returns in the 27 voxels around and with the one of `key`.
    fn around(&self, key: VoxelKey) -> impl Iterator<Item = &Return> {
        let columns = (-1..=1).flat_map(|dx| (-1..=1).map(move |dy| (dx, dy)));
        // A step beyond the outermost voxel is none: the columns there are looked at twice.
        columns.flat_map(move |(dx, dy)| {
            let (x, y) = (key.x.saturating_add(dx), key.y.saturating_add(dy));
            let lowest = VoxelKey { x, y, z: key.z.saturating_sub(1) };
            let highest = VoxelKey { x, y, z: key.z.saturating_add(1) };
            let first = self.returns.partition_point(|seen| seen.key < lowest);
            self.returns.iter().skip(first).take_while(move |seen| seen.key <= highest)
        })
    }

    /// Whether a return says that the ray does not pass the voxel of `key` through free space.
    fn contradict(&self, ray: &VoxelRay, key: VoxelKey, grid: &VoxelGrid) -> bool {
        let own_end_m = ray.length_m() - OWN_END_IN_EDGES * grid.edge_m();
        let grazes_m = GRAZES_IN_EDGES * grid.edge_m();
        self.around(key).any(|seen| {
            let (along_m, aside_squared) = ray.along_and_aside(&seen.point_m.cast());
            seen.key == key || (along_m < own_end_m && aside_squared <= grazes_m * grazes_m)
        })
    }
}

impl StaticMap {
    /// Adds the static points in the order of their voxels' keys, and clears what the rays to all points pass.
    ///
    /// # Errors
    /// When the static cloud is in another frame; the map is then as it was.
    pub(super) fn add_and_clear(
        &mut self,
        cycle: &SegmentedCycle,
        Clearing { rays: tables, blanks }: &mut Clearing,
    ) -> Result<Addition, MapError> {
        self.begin_cycle(&cycle.static_cloud)?;
        let cycle = &*self.cycle_brought_over(cycle);
        let mut addition = Addition::default();
        tables.returns.refill(cycle, &self.grid, &mut addition);
        for seen in tables.returns.returns.iter().filter(|seen| seen.is_static) {
            self.add_point(&seen.point_m, &mut addition);
        }
        self.end_adding(&mut addition);

        let camera_in_map_m = cycle.map_from_rig * cycle.setup.mounts.camera_in_rig_m();
        tables.passed.clear();
        for seen in &tables.returns.returns {
            if let Some(ray) = VoxelRay::between(&camera_in_map_m, &seen.point_m.cast()) {
                self.find_passed(&ray, &tables.returns, &mut tables.passed);
            }
        }
        tables.passed.sort_unstable();
        tables.passed.dedup();
        for key in &tables.passed {
            addition.cleared_voxels += usize::from(self.weaken(*key, Evidence::miss));
        }
        let mut blank = self.find_blank(blanks, cycle, tables.returns.points_m());
        blank.retain(|key| tables.passed.binary_search(key).is_err());
        for key in blank {
            addition.cleared_voxels += usize::from(self.weaken(key, Evidence::blank));
        }
        Ok(addition)
    }

    /// Takes evidence from a voxel, by a rule that says whether it is still there. Returns whether it has gone.
    fn weaken(&mut self, key: VoxelKey, take: fn(&mut Evidence) -> bool) -> bool {
        // It was there when it was looked at; its tile may have made room for another since.
        let is_gone = self.fetch(key)
            && self.voxels.get_mut(&key).is_some_and(|voxel| !take(&mut voxel.evidence));
        if is_gone {
            self.remove(key);
        }
        is_gone
    }

    /// Appends the voxels that the ray passes.
    fn find_passed(&mut self, ray: &VoxelRay, returns: &Returns, passed: &mut Vec<VoxelKey>) {
        let grid = self.grid;
        let stop_m = (ray.length_m() - STOP_BEFORE_END_IN_EDGES * grid.edge_m())
            .min(LONGEST_WAY_IN_EDGES * grid.edge_m());
        let cone_slope = CONE_IN_EDGES * grid.edge_m() / ray.length_m();
        // Looked up once for all steps within a block.
        let mut block = None;
        let mut bits = 0;
        for key in ray.cells(&grid, stop_m) {
            let block_here = block_of(key);
            if block != Some(block_here) {
                block = Some(block_here);
                bits = self.bits_of_block(block_here);
            }
            if bits & bit_of(key) == 0 {
                continue;
            }
            let Some(voxel) = self.voxels.get(&key) else { continue };
            // The usual case on a surface; the returns would say the same.
            if voxel.last_cycle == self.cycles {
                continue;
            }
            let (along_m, aside_squared) = ray.along_and_aside(&voxel.mean().cast());
            let is_in_cone = (0.0..=stop_m).contains(&along_m)
                && aside_squared <= (cone_slope * along_m).powi(2);
            if is_in_cone && !returns.contradict(ray, key, &grid) {
                passed.push(key);
            }
        }
    }

    /// The occupied voxels of a block, which may have to be fetched; none where they cannot be.
    pub(super) fn bits_of_block(&mut self, block: VoxelKey) -> u64 {
        if !self.fetch(a_voxel_of(block)) {
            return 0;
        }
        self.occupied.as_ref().map_or(0, |occupied| occupied.bits(block))
    }
}
