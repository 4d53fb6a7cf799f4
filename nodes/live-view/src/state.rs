//! All that is shown: the map, the latest cycle, the state of the nodes.

use std::sync::Arc;

use geometry::VoxelEdgeError;

use crate::map::LiveMap;
use crate::mesh::LiveMesh;
use crate::message::{Kind, message};
use crate::moment::{Moment, of_moment};

/// A message that takes the place of the one before it.
#[derive(Clone, Debug)]
pub(crate) struct Numbered {
    pub(crate) number: u64,
    pub(crate) message: Arc<[u8]>,
}

/// All that is shown. Its size is bounded by those of the map and of the mesh.
#[derive(Clone, Debug)]
pub struct LiveState {
    map: LiveMap,
    mesh: LiveMesh,
    moment: Option<Numbered>,
    status: Option<Numbered>,
    messages: u64,
}

impl LiveState {
    /// Nothing yet; the map has at most `most_voxels` of `voxel_edge_m`, the mesh `most_triangles`.
    ///
    /// # Errors
    /// When the edge is no length.
    pub fn new(
        voxel_edge_m: f64,
        most_voxels: usize,
        most_triangles: usize,
    ) -> Result<Self, VoxelEdgeError> {
        let map = LiveMap::new(voxel_edge_m, most_voxels)?;
        Ok(Self {
            map,
            mesh: LiveMesh::new(most_triangles),
            moment: None,
            status: None,
            messages: 0,
        })
    }

    /// The map.
    #[must_use]
    pub fn map(&self) -> &LiveMap {
        &self.map
    }

    /// The map, to take what was published of it.
    pub fn map_mut(&mut self) -> &mut LiveMap {
        &mut self.map
    }

    /// The triangles of the map.
    #[must_use]
    pub fn mesh(&self) -> &LiveMesh {
        &self.mesh
    }

    /// The triangles, to take what was published of them.
    pub fn mesh_mut(&mut self) -> &mut LiveMesh {
        &mut self.mesh
    }

    /// Takes the latest cycle.
    pub fn set_moment(&mut self, moment: &Moment<'_>) {
        self.moment = Some(self.numbered(of_moment(moment)));
    }

    /// Takes the state of the nodes, as JSON.
    pub fn set_status(&mut self, json: &str) {
        self.status = Some(self.numbered(message(Kind::Status, json.as_bytes())));
    }

    /// Forgets what is only of now: nobody looks any more, and who comes next is to see nothing that is old.
    pub fn forget_moment(&mut self) {
        (self.moment, self.status) = (None, None);
    }

    pub(crate) fn moment(&self) -> Option<&Numbered> {
        self.moment.as_ref()
    }

    pub(crate) fn status(&self) -> Option<&Numbered> {
        self.status.as_ref()
    }

    fn numbered(&mut self, message: Vec<u8>) -> Numbered {
        self.messages += 1;
        Numbered { number: self.messages, message: message.into() }
    }
}
