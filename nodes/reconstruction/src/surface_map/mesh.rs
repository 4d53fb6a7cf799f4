//! The map as triangles.

use geometry::TriangleMesh;
use volume::{BlockMesh, MeshJoiner, PointRules};

use super::SurfaceMap;
use crate::MeshError;

impl SurfaceMap {
    /// The surface as triangles, those of spilled tiles included, in ascending order of the blocks, or tile by tile: `volume`,
    /// `surface/mesh.rs`. Costs by the whole map, and where tiles are spilled the time to read each some two times.
    ///
    /// # Errors
    /// When there are no triangles, or a spilled tile cannot be read for now. What is lost is left out.
    pub fn mesh(&self) -> Result<TriangleMesh, MeshError> {
        let rules = PointRules::default();
        let whole = match &self.spill {
            None => self.surface.mesh(rules),
            Some(spill) => {
                let (mut joiner, mut mesh) = (MeshJoiner::default(), BlockMesh::default());
                let unreadable = self.visit_blocks_of(&spill.tiles.by_key(), |key, looked_at| {
                    self.surface.mesh_of_both(looked_at, key, rules, &mut mesh);
                    joiner.add(key, &mesh);
                });
                if let Some(error) = unreadable.into_iter().find(|error| !error.is_loss()) {
                    return Err(error.into());
                }
                joiner.finish()
            }
        };
        if whole.triangles.is_empty() { Err(MeshError::NoTriangles) } else { Ok(whole) }
    }
}
