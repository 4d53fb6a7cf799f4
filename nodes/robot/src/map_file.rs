//! Files of saved maps: read in any of the forms that the suite writes, and written.

use std::path::Path;

use geometry::{MapView, MapViews, OrientedPoints, PointFileError, VoxelKey, pcd, ply};
use node_shell::write_whole_file;
use reconstruction::{WholeMap, octomap};

use crate::failure::Failure;

/// An octomap may have so many voxels, of 12 bytes each, and as many points,
const MOST_VOXELS: usize = 100_000_000;
/// but no more than these for each byte of its file: two bytes stand for eight leaves, and one leaf for any number of voxels. A map
/// has few leaves that are larger than a voxel, since its surfaces are one voxel thick.
const MOST_VOXELS_PER_BYTE: usize = 1000;
/// However small the file is, it may have this many.
const FEW_VOXELS: usize = 1_000_000;

/// What to do with points far from the origin, as those on a projection of the earth.
pub(crate) const SHIFT: &str = "shift the points to near the origin first, as CloudCompare does when it opens them (Global shift), and save that; \
     `stillmap export --origin X Y Z` adds the shift again";

/// A map as it is saved.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct MapFile {
    /// The points, with their normals and colours where the file has them.
    pub points: OrientedPoints,
    /// The places that the map was seen from, where the file has them.
    pub views: Vec<MapView>,
    /// The edge of its voxels, where the file says it.
    pub edge_m: Option<f64>,
}

impl MapFile {
    /// The map of a run.
    pub(crate) fn of(map: WholeMap) -> Self {
        let WholeMap { points, views, .. } = map;
        Self { points, views, edge_m: None }
    }

    /// Reads a .ply, .pcd or .bt file.
    ///
    /// # Errors
    /// When it is no such file, or cannot be read.
    pub fn read(path: &Path) -> Result<Self, Failure> {
        let wrong =
            |reason: &dyn std::fmt::Display| Failure::new(format!("{}: {reason}", path.display()));
        let of_points = |error: PointFileError| match error {
            PointFileError::TooFar { .. } => wrong(&error).fix(SHIFT),
            _ => wrong(&error),
        };
        let bytes = || std::fs::read(path).map_err(|error| wrong(&error));
        let extension = path.extension().and_then(|extension| extension.to_str());
        match extension.map(str::to_ascii_lowercase).as_deref() {
            Some("ply") => {
                let bytes = bytes()?;
                let points = ply::decode_with_normals(&bytes).map_err(of_points)?;
                let views = ply::views_of(&bytes).map_err(|error| wrong(&error))?;
                // No more than a map has, whatever the file says.
                let views: MapViews = views.into_iter().collect();
                Ok(Self { points, views: views.as_slice().to_vec(), edge_m: None })
            }
            Some("pcd") => {
                let points = pcd::decode_with_normals(&bytes()?).map_err(of_points)?;
                Ok(Self { points, ..Self::default() })
            }
            Some("bt") => {
                let bytes = bytes()?;
                let octree = octomap::decode(&bytes, most_voxels_of(bytes.len()))
                    .map_err(|error| wrong(&error))?;
                let middle = |cell: i32| ((f64::from(cell) + 0.5) * octree.edge_m) as f32;
                let centre = |voxel: &VoxelKey| [voxel.x, voxel.y, voxel.z].map(middle).into();
                let points_m = octree.voxels.iter().map(centre).collect();
                let points = OrientedPoints { points_m, ..OrientedPoints::default() };
                Ok(Self { points, edge_m: Some(octree.edge_m), ..Self::default() })
            }
            _ => Err(wrong(&"this is no saved map").fix("its name must end in .ply, .pcd or .bt")),
        }
    }

    /// Writes a .ply or .pcd file whole. A .pcd file has no views.
    ///
    /// # Errors
    /// When the name ends in something else, or the file cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), Failure> {
        let OrientedPoints { points_m, normals, colours } = &self.points;
        let extension = path.extension().and_then(|extension| extension.to_str());
        let bytes = match extension.map(str::to_ascii_lowercase).as_deref() {
            Some("ply") => ply::encode_map(&self.points, &self.views),
            Some("pcd") => pcd::encode_with_colours(points_m, normals, colours),
            _ => {
                return Err(Failure::new(format!("{}: no name of a map", path.display()))
                    .fix("its name must end in .ply or .pcd"));
            }
        };
        write(path, &bytes)
    }
}

/// The voxels that an octomap of so many bytes may have.
fn most_voxels_of(file_bytes: usize) -> usize {
    file_bytes.saturating_mul(MOST_VOXELS_PER_BYTE).clamp(FEW_VOXELS, MOST_VOXELS)
}

/// Writes a file whole, or leaves the one that is there.
pub(crate) fn write(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    write_whole_file(path, bytes)
        .map_err(|error| Failure::new(format!("cannot write {}: {error}", path.display())))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Regression: a map in coordinates of the earth got steps of half a metre.
    #[test]
    fn points_far_from_the_origin_are_refused_with_what_to_do() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("utm.pcd");
        let file = "# .PCD v0.7\nFIELDS x y z\nSIZE 8 8 8\nTYPE F F F\nPOINTS 1\nDATA ascii\n458000.3 5428000.7 112\n";
        std::fs::write(&path, file).unwrap();
        let refused = MapFile::read(&path).unwrap_err().to_string();
        for part in ["point 0", "458000.3", "13 mm", "--origin"] {
            assert!(refused.contains(part), "{part}: {refused}");
        }
    }

    /// 130 bytes stood for 10^8 voxels, which took 2.4 GB.
    #[test]
    fn a_small_octomap_does_not_take_the_memory_of_a_large_one() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("solid.bt");
        // One inner node after the other down to 2^8 voxels an axis, all of it occupied: 1.7 * 10^7 voxels.
        let header = "# Octomap OcTree binary file\nid OcTree\nsize 9\nres 0.05\ndata\n";
        let mut file = header.as_bytes().to_vec();
        file.extend([[3, 0]; 7].as_flattened());
        file.extend([2, 0]);
        std::fs::write(&path, &file).unwrap();
        let refused = MapFile::read(&path).unwrap_err().to_string();
        assert!(refused.contains("voxels"), "{refused}");
        assert_eq!(most_voxels_of(50_000), 50_000_000);
    }
}
