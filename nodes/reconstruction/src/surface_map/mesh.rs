//! The map as triangles.

use geometry::{MeshPiece, MeshUpdate, TriangleMesh};
use volume::{BlockBox, BlockMesh, MeshChange, MeshFollower, MeshJoiner, PointRules};

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

    /// A listener to the mesh that knows nothing is there: it is told of all blocks in memory, and of those that others were told
    /// of, and then of what changes.
    pub fn follow_mesh(&mut self) {
        self.followers.mesh.get_or_insert_default().begin_to_show(&self.surface);
    }

    /// There are no listeners to the mesh any more.
    pub fn unfollow_mesh(&mut self) {
        (self.followers.mesh, self.is_mesh_anew) = (None, false);
    }

    /// Another map has taken the place of this one.
    pub(super) fn follow_mesh_anew(&mut self) {
        if let Some(follower) = &mut self.followers.mesh {
            *follower = MeshFollower::default();
            follower.begin_to_show(&self.surface);
            self.is_mesh_anew = true;
        }
    }

    /// The next changes of the mesh: of so many blocks that there are no more than `most_triangles`, or of one block. `None` where there
    /// are none.
    pub fn take_mesh_changes(&mut self, most_triangles: usize) -> Option<MeshUpdate> {
        self.begin_round();
        let (mut changes, mut taken) = (Vec::new(), 0);
        for _ in 0..self.followers.mesh.as_ref().map_or(0, MeshFollower::waiting) {
            let next = self.followers.mesh.as_ref().and_then(MeshFollower::next_waiting);
            let Some(key) = next else { break };
            // Its tile may have been spilled since, or the next one.
            let is_here = self.fetch(BlockBox { least: key, most: key.offset(1, 1, 1) });
            let Some(follower) = &mut self.followers.mesh else { break };
            if !is_here {
                follower.postpone();
                continue;
            }
            let rules = PointRules::default();
            if !follower.take_next(&self.surface, rules, most_triangles, &mut taken, &mut changes) {
                break;
            }
        }
        let is_anew = std::mem::take(&mut self.is_mesh_anew);
        if changes.is_empty() && !is_anew {
            return None;
        }
        let piece = |MeshChange { key, mesh }: MeshChange| MeshPiece {
            block: key.coordinates(),
            mesh: mesh.alone(),
        };
        Some(MeshUpdate {
            stamp: self.stamp,
            frame_id: self.frame_id.clone().unwrap_or_default(),
            is_anew,
            pieces: changes.into_iter().map(piece).collect(),
        })
    }
}
