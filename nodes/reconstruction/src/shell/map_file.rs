//! The map as a file.

use std::fs;
use std::path::{Path, PathBuf};

use geometry::{VoxelGrid, VoxelKey, pcd, ply};
use nalgebra::Point3;
use node_shell::{NodeFailure, folder_of, write_whole_file};

use crate::{StaticMap, WholeMap, octomap};

/// The edge of an octomap is the map's when they differ by no more than this share: what a decimal number of
/// six digits leaves, as octomap writes it.
const SAME_EDGE: f64 = 1e-5;

/// Where the map is saved, or loaded from, and how.
pub(super) struct MapFile {
    path: PathBuf,
    format: Format,
}

enum Format {
    Ply,
    Pcd,
    Octomap,
}

impl MapFile {
    /// The file at the path that `parameter` has, whose format is told by its extension; none for an empty path.
    /// What cannot be written is found out now, not when there is a map to lose.
    pub(super) fn new(parameter: &str, path: &str) -> Result<Option<Self>, NodeFailure> {
        if path.is_empty() {
            return Ok(None);
        }
        let path = PathBuf::from(path);
        let extension = path.extension().and_then(|extension| extension.to_str());
        let format = match extension.map(str::to_ascii_lowercase).as_deref() {
            Some("ply") => Format::Ply,
            Some("pcd") => Format::Pcd,
            Some("bt") => Format::Octomap,
            _ => {
                return Err(format!(
                    "parameter {parameter} must end in .ply, .pcd or .bt, not {}",
                    path.display()
                )
                .into());
            }
        };
        if !folder_of(&path).is_dir() {
            return Err(format!(
                "parameter {parameter}: the folder of {} does not exist",
                path.display()
            )
            .into());
        }
        Ok(Some(Self { path, format }))
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Saves the map under a temporary name first: a reader never finds half a file, and an earlier
    /// map is lost only to a whole one, also when the power fails. Fails where a tile on disk cannot be read now.
    /// Returns the number of points.
    pub(super) fn save(&self, map: &StaticMap) -> Result<usize, NodeFailure> {
        let WholeMap { points_m, unreadable } = map.whole();
        let failed = |reason: &dyn std::fmt::Display| {
            format!("the map could not be saved to {}: {reason}", self.path.display())
        };
        if let Some(error) = unreadable.iter().find(|error| !error.is_loss()) {
            return Err(failed(error).into());
        }
        // What is lost will not come back; what is left is worth saving.
        if let Some(error) = unreadable.first() {
            tracing::warn!("{} tiles are lost to the map that is saved: {error}", unreadable.len());
        }
        let bytes = match self.format {
            Format::Ply => ply::encode(&points_m),
            Format::Pcd => pcd::encode(&points_m),
            Format::Octomap => {
                let grid = map.grid();
                let voxels: Vec<VoxelKey> = points_m.iter().map(|point| grid.key(point)).collect();
                octomap::encode(grid.edge_m(), &voxels).map_err(|error| failed(&error))?
            }
        };
        write_whole_file(&self.path, &bytes).map_err(|error| failed(&error))?;
        tracing::info!("saved a map of {} points to {}", points_m.len(), self.path.display());
        Ok(points_m.len())
    }

    /// Puts the file's points, in `frame_id`, in the place of the map. Returns the number of voxels. When that
    /// fails, the map is as it was.
    pub(super) fn load(&self, map: &mut StaticMap, frame_id: &str) -> Result<usize, NodeFailure> {
        let failed = |reason: &dyn std::fmt::Display| {
            format!("the map could not be loaded from {}: {reason}", self.path.display())
        };
        let bytes = fs::read(&self.path).map_err(|error| failed(&error))?;
        let points_m = match self.format {
            Format::Ply => ply::decode(&bytes).map_err(|error| failed(&error))?,
            Format::Pcd => pcd::decode(&bytes).map_err(|error| failed(&error))?,
            Format::Octomap => {
                let octree = octomap::decode(&bytes, map.max_voxels());
                let octree = octree.map_err(|error| failed(&error))?;
                let edge_m = map.grid().edge_m();
                if (octree.edge_m - edge_m).abs() > SAME_EDGE * edge_m {
                    let reason = format!(
                        "its resolution is {} m, and voxel_edge_m is {edge_m} m",
                        octree.edge_m
                    );
                    return Err(failed(&reason).into());
                }
                octree.voxels.into_iter().map(|voxel| centre(voxel, map.grid())).collect()
            }
        };
        map.replace(&points_m, frame_id).map_err(|error| failed(&error))?;
        tracing::info!("loaded a map of {} voxels from {}", map.len(), self.path.display());
        Ok(map.len())
    }
}

/// The middle of a voxel. Within octomap's reach it lies in that voxel also as a 32-bit number.
fn centre(voxel: VoxelKey, grid: &VoxelGrid) -> Point3<f32> {
    let middle = |cell: i32| ((f64::from(cell) + 0.5) * grid.edge_m()) as f32;
    Point3::new(middle(voxel.x), middle(voxel.y), middle(voxel.z))
}
