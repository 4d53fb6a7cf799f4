//! What removal kept out of the map, and why: most of it moved nowhere, and a reader must be able to see that.

#[cfg(test)]
mod tests;

use std::collections::{HashMap, HashSet};

use geometry::{BuildVoxelHasher, VoxelGrid, VoxelKey};
use nalgebra::{Isometry3, Point3};
use serde::{Deserialize, Serialize};

use crate::{CycleView, RigCamera, RunRecord};

/// Voxels and views that are compared, at most: beyond it every n-th view is. 20 million take about half a second.
const MAX_COMPARISONS: usize = 20_000_000;
/// A depth is behind a voxel when it is farther by this, and by this share of it: more than the noise of depth cameras ...
const BEHIND_M: f32 = 0.1;
const BEHIND_SHARE: f32 = 0.04;
/// ... and by so many edges of a voxel.
const BEHIND_EDGES: f32 = 1.5;

/// Why a voxel of the map without removal has no point in the map.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum KeptOutCause {
    /// A point in it, or in a voxel beside it, was classified as moving.
    Moved,
    /// The map has a point in a voxel beside it.
    BesideSurface,
    /// In another cycle the camera saw something behind it.
    SeenThrough,
    /// The map dropped or refused parts for want of room, and no cycle saw something behind it.
    NoRoom,
    /// In other cycles nothing came back from its direction.
    NoReturn,
    /// It was seen in one cycle only.
    SeenOnce,
    /// None of these: it was seen in several cycles, and the map's evidence did not suffice.
    Uncertain,
}

impl KeptOutCause {
    /// All of them, in the order in which a page lists them.
    pub const ALL: [Self; 7] = [
        Self::Moved,
        Self::BesideSurface,
        Self::SeenThrough,
        Self::NoRoom,
        Self::NoReturn,
        Self::SeenOnce,
        Self::Uncertain,
    ];

    /// In a few words, as the end of "so many voxels: ".
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Moved => "something moved there",
            Self::BesideSurface => "beside a surface of the map",
            Self::SeenThrough => "seen through in other cycles",
            Self::NoRoom => "no room in the map",
            Self::NoReturn => "no return in other cycles",
            Self::SeenOnce => "seen in one cycle only",
            Self::Uncertain => "seen several times and not confirmed",
        }
    }

    /// In a sentence.
    #[must_use]
    pub fn meaning(self) -> &'static str {
        match self {
            Self::Moved => "A point in the voxel, or in one beside it, was classified as moving.",
            Self::BesideSurface => {
                "The map has a point in a neighbouring voxel: the noise of the depth put points on both sides of the surface."
            }
            Self::SeenThrough => {
                "In another cycle the camera saw something farther away in this direction, so the voxel is free."
            }
            Self::NoRoom => {
                "The map dropped or left out parts for want of room, and no cycle shows that this voxel is free."
            }
            Self::NoReturn => "In other cycles the depth image has no return in this direction.",
            Self::SeenOnce => {
                "It was seen in one cycle, and not looked at again: too little evidence of a surface."
            }
            Self::Uncertain => {
                "It was seen in several cycles, and the map's evidence of a surface did not suffice."
            }
        }
    }
}

/// A voxel that the map without removal holds and the map does not.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct KeptOut {
    /// Its point in the map without removal, in the map frame.
    pub point_m: Point3<f32>,
    /// Why the map does not hold it.
    pub cause: KeptOutCause,
}

/// The voxels of the map without removal that hold no point of the map, in the order of that map, with the cause of each.
pub(crate) fn kept_out(run: &RunRecord, grid: &VoxelGrid) -> Vec<KeptOut> {
    let keys = |points: &[Point3<f32>]| -> HashSet<VoxelKey, BuildVoxelHasher> {
        points.iter().map(|point| grid.key(point)).collect()
    };
    let map = keys(&run.static_map);
    let is_missing = |point: &&Point3<f32>| !map.contains(&grid.key(point));
    let missing: Vec<Point3<f32>> = run.unfiltered_map.iter().filter(is_missing).copied().collect();
    let moved = moved_keys(run, grid);
    let beside = |key: VoxelKey, keys: &HashSet<VoxelKey, BuildVoxelHasher>| {
        key.with_neighbours().any(|near| keys.contains(&near))
    };
    let evidence = Evidence::of(run, grid, &missing);
    let cause = |point_m: &Point3<f32>| {
        let key = grid.key(point_m);
        if moved.contains(&key) {
            KeptOutCause::Moved
        } else if beside(key, &map) {
            KeptOutCause::BesideSurface
        } else if beside(key, &moved) {
            KeptOutCause::Moved
        } else {
            evidence.cause(key, point_m)
        }
    };
    missing.iter().map(|point_m| KeptOut { point_m: *point_m, cause: cause(point_m) }).collect()
}

/// The voxels of the map's grid in which a point was classified as moving.
fn moved_keys(run: &RunRecord, grid: &VoxelGrid) -> HashSet<VoxelKey, BuildVoxelHasher> {
    let in_map = run.cycles.iter().flat_map(|cycle| {
        let map_from_rig: Isometry3<f32> = cycle.map_from_rig.cast();
        cycle.dynamic_points_m.iter().map(move |point_m| map_from_rig * point_m)
    });
    in_map.map(|point_m| grid.key(&point_m)).collect()
}

/// What the kept views say of the voxels that are missing.
struct Evidence<'a> {
    /// In how many views a voxel has a point.
    cycles_seen: HashMap<VoxelKey, u32, BuildVoxelHasher>,
    looks: Vec<Look<'a>>,
    edge_m: f32,
    lacked_room: bool,
}

/// A view with its camera.
struct Look<'a> {
    camera: RigCamera,
    camera_from_map: Isometry3<f64>,
    view: &'a CycleView,
}

impl<'a> Evidence<'a> {
    fn of(run: &'a RunRecord, grid: &VoxelGrid, missing: &[Point3<f32>]) -> Self {
        let mut cycles_seen: HashMap<_, _, _> =
            missing.iter().map(|point_m| (grid.key(point_m), 0)).collect();
        let views = || run.cycles.iter().filter_map(|cycle| Some((cycle, cycle.view.as_ref()?)));
        for (cycle, view) in views() {
            let map_from_rig: Isometry3<f32> = cycle.map_from_rig.cast();
            // The points of a cycle are one a voxel of the rig's grid: up to a few of them share a voxel of the map's.
            let seen: HashSet<VoxelKey, BuildVoxelHasher> = view
                .cloud_m()
                .map(|point_m| grid.key(&(map_from_rig * point_m)))
                .filter(|key| cycles_seen.contains_key(key))
                .collect();
            for key in seen {
                cycles_seen.entry(key).and_modify(|cycles| *cycles += 1);
            }
        }
        let looks = run.rig_camera().into_iter().flat_map(|camera| {
            views().filter(|(_, view)| view.depth.is_some()).map(move |(cycle, view)| Look {
                camera,
                camera_from_map: (cycle.map_from_rig * camera.rig_from_camera).inverse(),
                view,
            })
        });
        let looks: Vec<Look<'a>> = looks.collect();
        let every = (looks.len() * missing.len()).div_ceil(MAX_COMPARISONS).max(1);
        let looks = looks.into_iter().step_by(every).collect();
        let lacked_room = run.lacked_room;
        Self { cycles_seen, looks, edge_m: grid.edge_m() as f32, lacked_room }
    }

    fn cause(&self, key: VoxelKey, point_m: &Point3<f32>) -> KeptOutCause {
        let mut seen_through = 0;
        let mut no_return = 0;
        for look in &self.looks {
            match look.passes(point_m, self.edge_m) {
                Some(Passing::Behind) => seen_through += 1,
                Some(Passing::NoReturn) => no_return += 1,
                None => {}
            }
        }
        let seen = self.cycles_seen.get(&key).copied().unwrap_or(0);
        if seen_through > 0 && seen_through >= no_return {
            KeptOutCause::SeenThrough
        } else if self.lacked_room {
            KeptOutCause::NoRoom
        } else if no_return > 0 {
            KeptOutCause::NoReturn
        } else if seen <= 1 {
            KeptOutCause::SeenOnce
        } else {
            KeptOutCause::Uncertain
        }
    }
}

/// What a view that does not see a voxel has in its direction.
enum Passing {
    Behind,
    NoReturn,
}

impl Look<'_> {
    fn passes(&self, point_m: &Point3<f32>, edge_m: f32) -> Option<Passing> {
        let in_camera_m = self.camera_from_map * point_m.cast::<f64>();
        let pixel = self.camera.model.project(&in_camera_m)?;
        let depth_m = self.view.depth.as_ref()?.depth_at_m(pixel.x, pixel.y)?;
        let own_m = in_camera_m.z as f32;
        let behind_m = own_m + BEHIND_M.max(BEHIND_EDGES * edge_m) + BEHIND_SHARE * own_m;
        if depth_m == 0.0 {
            Some(Passing::NoReturn)
        } else {
            (depth_m > behind_m).then_some(Passing::Behind)
        }
    }
}
