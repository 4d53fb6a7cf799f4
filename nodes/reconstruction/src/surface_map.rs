//! The map of depth images: a surface, in voxels of an edge of its own (`map_edge_m`).
//!
//! Each cycle's depth image, without the pixels that move, is joined to signed distances ([`volume::Surface`]); the points of
//! the map are where these change their sign, one a voxel, with a normal each, and a colour where the image has colours. What goes is cleared by what is seen behind it,
//! and by directions from which nothing comes back, as the crate `volume` has it.
//!
//! It is the map of the method `free_space`. That of `rec_hv` is [`crate::StaticMap`]; both are behind [`crate::Map`].

mod changes;
mod correction;
mod distance;
mod followers;
pub(crate) mod loading;
mod mesh;
pub(crate) mod normals;
mod spill;
#[cfg(test)]
pub(crate) mod tests;
mod views;
mod whole;

use estimation::executor::{Executor, Serial};
use geometry::{Cloud, OccupancyGrid, OrientedPoints, SegmentedCycle, Stamp, VoxelGrid};
use nalgebra::Point3;
use volume::{
    ChangeFollower, DepthInput, DepthView, DistanceConfig, PlaneOccupancy, Surface, SurfaceConfig,
};

use crate::config::{AtMaxVoxels, ConfigError};
use crate::correction::Corrections;
use crate::grid::{GridError, GridObservations, GridPoints};
use crate::tiles::{TileFrame, TileStore};
use crate::{Addition, CorrectionCounts, MapError, WholeMap};
use followers::Followers;
use spill::Spill;
use views::Views;

/// Where old blocks make room, this share of all goes at a time: finding the oldest costs by all of them.
const SHARE_DROPPED: usize = 16;

/// A map of depth images. See the module.
///
/// # Memory
/// 2.1 kB a block, of which there are `max_map_blocks` at most, and 1.5 kB more of one that has colours; what one image needs
/// besides, and is kept, is bounded by the image. While changes are followed, some 600 bytes more a block, and while
/// the mesh is, some 500. While distances are asked for, some 900 bytes more a block, and up to 60 MB of them.
/// The places that the map was seen from take up to 8 MB.
///
/// With [`AtMaxVoxels::Spill`] `max_map_blocks` bounds what is in memory. Besides grow, with the way that was driven and no other
/// bound, the 30 to 60 bytes of each tile that is out of memory, and while the mesh is followed some 50 of each block there that
/// listeners were told of.
#[derive(Debug)]
pub struct SurfaceMap {
    surface: Surface,
    view: DepthView,
    drops_oldest: bool,
    /// Present where tiles are spilled.
    spill: Option<Spill>,
    followers: Followers,
    /// Followed anew, for listeners that need the whole map.
    is_followed_anew: bool,
    /// What listeners have of the mesh is of another map.
    is_mesh_anew: bool,
    distance_config: DistanceConfig,
    frame_id: Option<String>,
    /// The frame before the map was emptied: who shows the map has to be told in the frame that he knows.
    former_frame_id: Option<String>,
    stamp: Stamp,
    corrections: Corrections,
    /// Present where a grid is asked for.
    grid: Option<GridObservations>,
    views: Views,
    /// What a file has counts as what was there for so long at least: the method takes for static what has stood for it.
    stop_s: f64,
}

impl SurfaceMap {
    /// An empty map of what the view takes of the images, which spills where there are tiles.
    ///
    /// # Errors
    /// When a parameter means nothing.
    pub(crate) fn new(
        config: SurfaceConfig,
        view: DepthView,
        at_max_voxels: AtMaxVoxels,
        tiles: Option<(TileFrame, Box<dyn TileStore>)>,
    ) -> Result<Self, ConfigError> {
        Ok(Self {
            surface: Surface::new(config)?,
            view,
            drops_oldest: at_max_voxels == AtMaxVoxels::DropOldest,
            spill: tiles.map(|(frame, store)| Spill::new(frame, store)),
            followers: Followers::default(),
            is_followed_anew: false,
            is_mesh_anew: false,
            distance_config: DistanceConfig::default(),
            frame_id: None,
            former_frame_id: None,
            stamp: Stamp::default(),
            corrections: Corrections::default(),
            grid: None,
            views: Views::default(),
            stop_s: 0.0,
        })
    }

    /// Takes in the depth image of a cycle.
    ///
    /// # Errors
    /// When the cycle has none, is in another frame than the map, or its pose is none; the map is then as it was.
    pub fn integrate(&mut self, cycle: &SegmentedCycle) -> Result<Addition, MapError> {
        self.integrate_on(cycle, &Serial)
    }

    /// The same on the threads of an executor, with the same result. Blocks whose tasks it leaves out, at the end of a node, stay as
    /// they were.
    ///
    /// # Errors
    /// As of [`SurfaceMap::integrate`].
    pub fn integrate_on(
        &mut self,
        cycle: &SegmentedCycle,
        executor: &dyn Executor,
    ) -> Result<Addition, MapError> {
        let Cloud { stamp, frame_id, .. } = &cycle.static_cloud;
        if let Some(map) = &self.frame_id
            && map != frame_id
        {
            let (map, cloud) = (map.clone(), frame_id.clone());
            return Err(MapError::AnotherFrame { map, cloud });
        }
        let depth = cycle.depth.as_ref().ok_or(MapError::NoDepthImage)?;
        let told = cycle.map_from_rig * cycle.setup.mounts.rig_from_camera;
        let missed = self.corrections.missed_at(*stamp);
        let map_from_rig = missed.map_or(cycle.map_from_rig, |missed| missed * cycle.map_from_rig);
        let map_from_camera = missed.map_or(told, |missed| missed * told);
        self.view.fill(&DepthInput::masked(depth, &map_from_camera))?;
        if self.frame_id.is_none() {
            self.frame_id = Some(frame_id.clone());
            self.corrections.forget_path_of_another_frame(frame_id);
        }
        self.stamp = *stamp;
        if let Some(grid) = &mut self.grid {
            grid.observe(cycle, &map_from_rig);
        }
        self.begin_round();
        self.bring_back_view();
        let dropped_voxels = self.drop_oldest();
        // What is in the store and could not come back: a tile is in memory as a whole or not at all.
        let spill = self.spill.as_ref();
        let may_be_new =
            |key| spill.is_none_or(|spill| !spill.tiles.is_in_store(spill.tile_of(key)));
        let update = self.surface.integrate_where(&self.view, executor, &may_be_new);
        // Whoever has seen the image before shares what was computed of it, and uses that memory again.
        self.view.clear();
        let added = self.add_refused();
        if !update.is_incomplete && update.refused_blocks == added {
            self.views.add(*stamp, map_from_camera, depth.frame());
        }
        let in_map = missed.unwrap_or_default().cast::<f32>();
        let retracted_m: Vec<Point3<f32>> =
            cycle.retracted_m.iter().map(|point_m| in_map * point_m).collect();
        let retracted = self.surface.forget_around(&retracted_m, cycle.setup.voxel_edge_m);
        self.note_changed();
        self.followers.follow(&self.surface);
        Ok(Addition {
            refused_points: update.refused_blocks - added,
            new_voxels: update.new_blocks + added,
            changed_voxels: self.surface.changed().len(),
            cleared_voxels: update.cleared_blocks + retracted,
            dropped_voxels,
            is_view_cut: update.is_incomplete,
            ..Addition::default()
        })
    }

    /// Where old blocks make room, those seen longest ago go. Returns how many.
    fn drop_oldest(&mut self) -> usize {
        let most = self.surface.config().max_blocks;
        let room = most.div_ceil(SHARE_DROPPED);
        if !self.drops_oldest || self.surface.blocks() + room <= most {
            return 0;
        }
        let oldest = self.surface.oldest_blocks(room);
        self.views.forget_those_of(&oldest, &self.surface);
        for key in &oldest {
            self.surface.remove_block(*key);
            self.followers.follow_block(*key);
        }
        oldest.len()
    }

    fn cloud_of(&self, points_m: Vec<Point3<f32>>) -> Cloud {
        let frame_id = self.frame_id.as_ref().or(self.former_frame_id.as_ref());
        Cloud { stamp: self.stamp, frame_id: frame_id.cloned().unwrap_or_default(), points_m }
    }

    /// Empties the map, its frame included. Who follows the changes has to start with a new map.
    pub fn clear(&mut self) {
        self.surface.clear();
        if let Some(spill) = &mut self.spill {
            spill.tiles.clear();
        }
        if let Some(follower) = &mut self.followers.changes {
            *follower = ChangeFollower::default();
        }
        self.is_followed_anew = false;
        self.follow_mesh_anew();
        self.followers.distances = None;
        self.former_frame_id = self.frame_id.take().or(self.former_frame_id.take());
        self.corrections.clear();
        if let Some(grid) = &mut self.grid {
            grid.clear();
        }
        self.views.clear();
    }

    /// With a grid of what the cycles see from now on.
    pub(crate) fn with_grid(mut self, grid: Option<GridObservations>) -> Self {
        self.grid = grid;
        self
    }

    /// With distances by these parameters, where they are asked for.
    pub(crate) fn with_distances(mut self, config: DistanceConfig) -> Self {
        self.distance_config = config;
        self
    }

    /// With the time after which what has stopped counts as static, `max_stop_s`.
    pub(crate) fn with_stop(mut self, stop_s: f64) -> Self {
        self.stop_s = stop_s;
        self
    }

    /// The occupancy grid: [`crate::grid`]. Costs by the whole map where it is of a band of heights.
    ///
    /// # Errors
    /// When none was asked for, or there is none.
    pub fn occupancy_grid(&mut self) -> Result<OccupancyGrid, GridError> {
        let needs_points = self.grid.as_ref().ok_or(GridError::Off)?.needs_points();
        let whole = if needs_points { self.whole() } else { WholeMap::default() };
        let WholeMap { points: OrientedPoints { points_m, normals, .. }, unreadable, .. } = whole;
        if let Some(error) = unreadable.into_iter().find(|error| !error.is_loss()) {
            return Err(error.into());
        }
        let grid = self.grid.as_ref().ok_or(GridError::Off)?;
        let made = grid.grid(GridPoints { points_m: &points_m, normals: &normals });
        let frame_id = self.frame_id.clone().unwrap_or_default();
        made.map(|grid| OccupancyGrid { stamp: self.stamp, frame_id, ..grid })
    }

    /// Whether the grid is of the scans that were seen, and not of the points of the map.
    pub(crate) fn has_grid_of_scans(&self) -> bool {
        self.grid.as_ref().is_some_and(GridObservations::is_of_scans)
    }

    /// The evidence on the cells of the grid, where one is asked for.
    pub(crate) fn grid_plane(&self) -> Option<&PlaneOccupancy> {
        self.grid.as_ref().map(GridObservations::plane)
    }

    /// The surface itself, as far as it is in memory.
    #[must_use]
    pub fn surface(&self) -> &Surface {
        &self.surface
    }

    /// The grid of the map's voxels.
    #[must_use]
    pub fn grid(&self) -> &VoxelGrid {
        self.surface.grid()
    }

    /// About how many points the map has: nodes within half an edge of the surface. [`SurfaceMap::whole`] counts them.
    #[must_use]
    pub fn len(&self) -> usize {
        let spilled = self.spill.as_ref().map_or(0, |spill| spill.tiles.points_in_store());
        self.surface.near_nodes() + spilled
    }

    /// Whether nothing is in the map.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        let spilled = self.spill_counts().map_or(0, |counts| counts.tiles_in_store);
        self.surface.blocks() + spilled == 0
    }

    /// The frame of the map, which the first cycle sets.
    #[must_use]
    pub fn frame_id(&self) -> Option<&str> {
        self.frame_id.as_deref()
    }

    /// What the corrections did since the map was empty.
    #[must_use]
    pub fn correction_counts(&self) -> CorrectionCounts {
        self.corrections.counts()
    }

    /// About how many bytes the map takes now.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        let spill = self.spill.as_ref().map_or(0, |spill| spill.tiles.memory_bytes());
        let grid = self.grid_plane().map_or(0, PlaneOccupancy::memory_bytes);
        let surface = self.surface.memory_bytes() + self.view.memory_bytes();
        surface + self.followers.memory_bytes() + spill + grid
    }
}
