//! The map of depth images: a surface, in voxels of an edge of its own (`map_edge_m`).
//!
//! Each cycle's depth image, without the pixels that move, is joined to signed distances ([`volume::Surface`]); the points of
//! the map are where these change their sign, one a voxel, with a normal each. What goes is cleared by what is seen behind it,
//! and by directions from which nothing comes back, as the crate `volume` has it.
//!
//! The map of the reduced clouds, [`crate::StaticMap`], is made of the means of voxels of the edge in which what moves is
//! looked for. Both are behind [`crate::Map`].

mod changes;
mod correction;
#[cfg(test)]
mod tests;

use estimation::executor::Serial;
use geometry::{Cloud, SegmentedCycle, Stamp, VoxelGrid};
use nalgebra::{Point3, Vector3};
use volume::{
    ChangeFollower, DepthInput, DepthNoise, DepthRange, DepthView, PointRules, Surface,
    SurfaceConfig,
};

use crate::config::{AtMaxVoxels, ConfigError};
use crate::static_map::{Corrections, WholeMap};
use crate::{Addition, CorrectionCounts, LoadError, MapError};

/// Where old blocks make room, this share of all goes at a time: finding the oldest costs by all of them.
const SHARE_DROPPED: usize = 16;

/// A map of depth images. See the module.
#[derive(Debug)]
pub struct SurfaceMap {
    surface: Surface,
    view: DepthView,
    drops_oldest: bool,
    /// Present while somebody follows the changes.
    follower: Option<ChangeFollower>,
    frame_id: Option<String>,
    stamp: Stamp,
    corrections: Corrections,
}

impl SurfaceMap {
    /// An empty map.
    ///
    /// # Errors
    /// When a parameter means nothing.
    pub(crate) fn new(
        config: SurfaceConfig,
        at_max_voxels: AtMaxVoxels,
    ) -> Result<Self, ConfigError> {
        Ok(Self {
            surface: Surface::new(config)?,
            view: DepthView::new(DepthRange::default(), DepthNoise::default())?,
            drops_oldest: at_max_voxels == AtMaxVoxels::DropOldest,
            follower: None,
            frame_id: None,
            stamp: Stamp::default(),
            corrections: Corrections::default(),
        })
    }

    /// Takes in the depth image of a cycle.
    ///
    /// # Errors
    /// When the cycle has none, is in another frame than the map, or its image, camera or pose is none; the map is then as it
    /// was.
    pub fn integrate(&mut self, cycle: &SegmentedCycle) -> Result<Addition, MapError> {
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
        self.view.fill(&DepthInput {
            image: depth.frame.image(),
            is_moving: Some(&depth.is_moving),
            colour: None,
            camera: depth.frame.camera(),
            map_from_camera: &missed.map_or(told, |missed| missed * told),
        })?;
        if self.frame_id.is_none() {
            self.frame_id = Some(frame_id.clone());
            self.corrections.forget_path_of_another_frame(frame_id);
        }
        self.stamp = *stamp;
        let dropped_voxels = self.make_room();
        let update = self.surface.integrate(&self.view, &Serial);
        if let Some(follower) = &mut self.follower {
            follower.follow(&self.surface);
        }
        Ok(Addition {
            refused_points: update.refused_blocks,
            new_voxels: update.new_blocks,
            changed_voxels: self.surface.changed().len(),
            cleared_voxels: update.cleared_blocks,
            dropped_voxels,
            ..Addition::default()
        })
    }

    /// Where old blocks make room, those seen longest ago go. Returns how many.
    fn make_room(&mut self) -> usize {
        let most = self.surface.config().max_blocks;
        let room = most.div_ceil(SHARE_DROPPED);
        if !self.drops_oldest || self.surface.blocks() + room <= most {
            return 0;
        }
        let oldest = self.surface.oldest_blocks(room);
        for key in &oldest {
            self.surface.remove_block(*key);
            if let Some(follower) = &mut self.follower {
                follower.follow_block(*key);
            }
        }
        oldest.len()
    }

    /// All points, with their normals.
    #[must_use]
    pub fn whole(&self) -> WholeMap {
        let points = self.surface.points(PointRules::default());
        WholeMap {
            points_m: points.iter().map(|point| point.position_m).collect(),
            normals: points.iter().map(|point| point.normal).collect(),
            unreadable: Vec::new(),
        }
    }

    /// Puts points with their normals, in `frame_id`, in the place of the whole map. The stamp stays. Who follows the changes has
    /// to start with a new map.
    ///
    /// # Errors
    /// When there are points and no normals, or no room; the map is then as it was.
    pub fn replace(
        &mut self,
        points_m: &[Point3<f32>],
        normals: &[Vector3<f32>],
        frame_id: &str,
    ) -> Result<Addition, LoadError> {
        if points_m.len() != normals.len() {
            return Err(LoadError::NoNormals);
        }
        let mut surface = self.surface.emptied();
        if surface.put_points(points_m.iter().copied().zip(normals.iter().copied())) > 0 {
            let max_map_blocks = surface.config().max_blocks;
            return Err(LoadError::TooManyBlocks { max_map_blocks });
        }
        let stamp = self.stamp;
        self.clear();
        (self.surface, self.stamp) = (surface, stamp);
        self.rename_frame(frame_id);
        Ok(Addition { new_voxels: self.surface.blocks(), ..Addition::default() })
    }

    /// Gives the frame of the map another name. The points stay.
    pub fn rename_frame(&mut self, frame_id: &str) {
        self.frame_id = Some(frame_id.to_owned());
    }

    fn cloud_of(&self, points_m: Vec<Point3<f32>>) -> Cloud {
        let frame_id = self.frame_id.clone().unwrap_or_default();
        Cloud { stamp: self.stamp, frame_id, points_m }
    }

    /// Empties the map, its frame included. Who follows the changes has to start with a new map.
    pub fn clear(&mut self) {
        self.surface.clear();
        if let Some(follower) = &mut self.follower {
            *follower = ChangeFollower::default();
        }
        self.frame_id = None;
        self.stamp = Stamp::default();
        self.corrections.clear();
    }

    /// The surface itself.
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
        self.surface.near_nodes()
    }

    /// Whether nothing is in the map.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.surface.blocks() == 0
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
        let follower = self.follower.as_ref().map_or(0, ChangeFollower::memory_bytes);
        self.surface.memory_bytes() + self.view.memory_bytes() + follower
    }
}
