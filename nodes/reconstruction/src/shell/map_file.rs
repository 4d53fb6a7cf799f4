//! The file of the map.

use std::fs;
use std::path::{Path, PathBuf};

use geometry::{LastSight, MapView, OrientedPoints, VoxelGrid, VoxelKey, pcd, ply};
use nalgebra::Point3;
use node_shell::{NodeFailure, Unusable, keep_version, output_file, write_whole_file};

use crate::octomap::{self, Octree};
use crate::{LoadError, Map, WholeMap};

/// The resolution of an octomap and the edge of a map of means are equal if they differ by no more than this share: octomap writes
/// a decimal number of six digits.
const SAME_EDGE: f64 = 1e-5;

/// The path of the file, and its format.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct MapFile {
    path: PathBuf,
    format: Format,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Format {
    Ply,
    Pcd,
    Octomap,
}

/// The points of a map at one time, to be written by another thread.
pub(super) struct Snapshot {
    points: OrientedPoints,
    views: Vec<MapView>,
    sights: Vec<LastSight>,
    grid: VoxelGrid,
    max_voxels: usize,
}

/// A saved map.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct Saved {
    pub(super) points: usize,
    /// The former file, if it was kept.
    pub(super) former: Option<Former>,
}

/// A file that another map has replaced.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct Former {
    pub(super) version: PathBuf,
    /// `None` if it could not be read as a map.
    pub(super) points: Option<usize>,
}

impl Snapshot {
    /// # Errors
    /// When a tile on disk cannot be read at present.
    pub(super) fn of(map: &Map) -> Result<Self, NodeFailure> {
        let WholeMap { points, views, sights, unreadable } = map.whole();
        if let Some(error) = unreadable.iter().find(|error| !error.is_loss()) {
            return Err(format!("the map could not be saved: {error}").into());
        }
        // The lost tiles cannot be recovered; the rest is saved.
        if let Some(error) = unreadable.first() {
            tracing::warn!("{} tiles are missing in the saved map: {error}", unreadable.len());
        }
        Ok(Self { points, views, sights, grid: *map.grid(), max_voxels: map.max_voxels() })
    }

    pub(super) fn points(&self) -> usize {
        self.points.points_m.len()
    }
}

impl MapFile {
    /// The file at the path of `parameter`, with the format of its extension; none for an empty path.
    /// A path that cannot be written is an error now, and not when a map is to be saved.
    pub(super) fn new(parameter: &str, path: &str) -> Result<Option<Self>, NodeFailure> {
        let Some(path) = output_file(parameter, path)? else { return Ok(None) };
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
        Ok(Some(Self { path, format }))
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Whether there is a file, with something in it: one that was made empty, so that a container can mount it, has no map yet.
    pub(super) fn exists(&self) -> bool {
        fs::metadata(&self.path).is_ok_and(|file| file.len() > 0)
    }

    /// Writes the map under a temporary name first: a reader never finds half a file, and an earlier
    /// map is replaced only by a complete one, also when the power fails. With `keeps_former` the existing file is kept
    /// as a numbered version ([`keep_version`]) if it differs. The map, its points, its bytes and the former file have the memory by turns, two
    /// of them at a time beside the map: all at once were more than three times what the map takes.
    ///
    /// # Errors
    /// When the folder cannot be written or is full; the file is then unchanged.
    pub(super) fn write(
        &self,
        snapshot: Snapshot,
        keeps_former: bool,
    ) -> Result<Saved, NodeFailure> {
        let failed = |reason: &dyn std::fmt::Display| {
            format!("the map could not be saved to {}: {reason}", self.path.display())
        };
        let Snapshot { points, views, sights, grid, max_voxels } = snapshot;
        let OrientedPoints { points_m, normals, colours } = &points;
        let bytes = match self.format {
            Format::Ply => ply::encode_map_to_continue(&points, &views, &sights),
            Format::Pcd => pcd::encode_with_colours(points_m, normals, colours),
            Format::Octomap => {
                let voxels: Vec<VoxelKey> = points_m.iter().map(|point| grid.key(point)).collect();
                octomap::encode(grid.edge_m(), &voxels).map_err(|error| failed(&error))?
            }
        };
        let count = points_m.len();
        drop((points, views, sights));
        let mut version = None;
        if keeps_former && self.exists() {
            let before = fs::read(&self.path).map_err(|error| failed(&error))?;
            if before != bytes {
                version = keep_version(&self.path).map_err(|error| failed(&error))?;
            }
        }
        write_whole_file(&self.path, &bytes).map_err(|error| failed(&error))?;
        drop(bytes);
        let former = version.map(|version| {
            let before = fs::read(&version).map_err(|error| error.to_string());
            let file = before.and_then(|before| self.points_of(&before, max_voxels));
            Former { points: file.ok().map(|file| file.points.points_m.len()), version }
        });
        Ok(Saved { points: count, former })
    }

    /// Replaces the map by the file's points, in `frame_id`. Returns the number of voxels.
    ///
    /// # Errors
    /// When the file cannot be read, or tiles of it cannot be spilled. When it is no map, or does not fit the parameters, for good
    /// ([`Unusable`]). But for the tiles the map is unchanged.
    pub(super) fn load(&self, map: &mut Map, frame_id: &str) -> Result<usize, NodeFailure> {
        let failed = |reason: &dyn std::fmt::Display| {
            format!("the map could not be loaded from {}: {reason}", self.path.display())
        };
        let bytes = fs::read(&self.path).map_err(|error| failed(&error))?;
        let unusable = |reason: &dyn std::fmt::Display| Unusable::new(failed(reason));
        let file = self.points_of(&bytes, map.max_voxels()).map_err(|reason| unusable(&reason))?;
        drop(bytes);
        check_edge(file.edge_m, map).map_err(|reason| unusable(&reason))?;
        map.replace_coloured(&file.points, frame_id).map_err(|error| -> NodeFailure {
            match error {
                LoadError::NoRoom { .. } => failed(&error).into(),
                LoadError::TooManyBlocks { .. } | LoadError::TooManyVoxels { .. } => {
                    unusable(&error).into()
                }
            }
        })?;
        map.add_views(file.views);
        map.take_last_sights(file.sights);
        tracing::info!("loaded a map of {} voxels from {}", map.len(), self.path.display());
        Ok(map.len())
    }

    fn points_of(&self, bytes: &[u8], max_voxels: usize) -> Result<FilePoints, String> {
        match self.format {
            Format::Ply => ply::decode_with_normals(bytes)
                .and_then(|points| Ok((points, ply::views_of(bytes)?, ply::last_sights_of(bytes)?)))
                .map_err(|error| error.to_string()),
            Format::Pcd => pcd::decode_with_normals(bytes)
                .map(|points| (points, Vec::new(), Vec::new()))
                .map_err(|error| error.to_string()),
            Format::Octomap => {
                let octree =
                    octomap::decode(bytes, max_voxels).map_err(|error| error.to_string())?;
                return Ok(FilePoints {
                    points: OrientedPoints {
                        points_m: centres_m(&octree),
                        ..OrientedPoints::default()
                    },
                    views: Vec::new(),
                    sights: Vec::new(),
                    edge_m: Some(octree.edge_m),
                });
            }
        }
        .map(|(points, views, sights)| FilePoints { points, views, sights, edge_m: None })
    }
}

/// The content of a file.
struct FilePoints {
    points: OrientedPoints,
    /// Of a PLY file of a map of depth images.
    views: Vec<MapView>,
    /// Of such a file that this node wrote.
    sights: Vec<LastSight>,
    /// Of an octomap the edge of its voxels.
    edge_m: Option<f64>,
}

/// A map of means has no room for voxels of another edge.
fn check_edge(edge_m: Option<f64>, map: &Map) -> Result<(), String> {
    let own_m = map.grid().edge_m();
    match (edge_m, map) {
        (Some(edge_m), Map::Means(_)) if (edge_m - own_m).abs() > SAME_EDGE * own_m => {
            Err(format!("its resolution is {edge_m} m, and voxel_edge_m is {own_m} m"))
        }
        _ => Ok(()),
    }
}

/// The centres of voxels. Within octomap's range each lies in its voxel also in single precision.
fn centres_m(octree: &Octree) -> Vec<Point3<f32>> {
    let middle = |cell: i32| ((f64::from(cell) + 0.5) * octree.edge_m) as f32;
    let centre = |voxel: &VoxelKey| [voxel.x, voxel.y, voxel.z].map(middle).into();
    octree.voxels.iter().map(centre).collect()
}
