//! The triangles as they are shown: by blocks of the map, each with the number of its last change.

use std::collections::BTreeMap;
use std::ops::Bound;

use geometry::{MeshUpdate, TriangleMesh, is_finite};
use nalgebra::Point3;

use crate::map::BlockKey;

/// The finest step of a corner's position: that of the points of the map.
const FINEST_STEP_M: f32 = 0.001;
/// Steps along the edge of a block's bounds, at most.
const MOST_STEPS: f32 = 65_535.0;

/// The triangles of the map, as the node that makes them has published them.
#[derive(Clone, PartialEq, Debug)]
pub struct LiveMesh {
    most_triangles: usize,
    blocks: BTreeMap<BlockKey, MeshBlock>,
    triangles: usize,
    refused: usize,
    /// Counts all changes.
    revision: u64,
}

/// The triangles of a block.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct MeshBlock {
    changed: u64,
    pub(crate) least_m: Point3<f32>,
    pub(crate) step_m: f32,
    /// Three corners a triangle, in steps from `least_m`.
    pub(crate) corners: Vec<[u16; 3]>,
    /// One a corner, or none.
    pub(crate) colours: Vec<[u8; 3]>,
}

impl MeshBlock {
    pub(crate) fn triangles(&self) -> usize {
        self.corners.len() / 3
    }

    fn of(mesh: &TriangleMesh, changed: u64) -> Option<Self> {
        let corner = |index: &u32| {
            let index = *index as usize;
            let point_m = *mesh.points_m.get(index).filter(|point_m| is_finite(point_m))?;
            Some((point_m, mesh.colours.get(index).copied()))
        };
        let triangle = |corners: &[u32; 3]| {
            let [first, second, third] = corners.each_ref().map(corner);
            Some([first?, second?, third?])
        };
        let placed: Vec<_> = mesh.triangles.iter().filter_map(triangle).flatten().collect();
        let first = placed.first()?.0;
        let ends = |[least, most]: [Point3<f32>; 2], (point_m, _): &(Point3<f32>, _)| {
            [least.inf(point_m), most.sup(point_m)]
        };
        let [least_m, most_m] = placed.iter().fold([first; 2], ends);
        let step_m = ((most_m - least_m).max() / MOST_STEPS).max(FINEST_STEP_M);
        // The casts saturate.
        let steps = |point_m: &Point3<f32>| {
            ((point_m - least_m) / step_m).map(|along| along.round() as u16).into()
        };
        Some(Self {
            changed,
            least_m,
            step_m,
            corners: placed.iter().map(|(point_m, _)| steps(point_m)).collect(),
            colours: placed.iter().filter_map(|(_, colour)| *colour).collect(),
        })
    }
}

impl LiveMesh {
    /// No triangles, and room for so many.
    #[must_use]
    pub fn new(most_triangles: usize) -> Self {
        Self { most_triangles, blocks: BTreeMap::new(), triangles: 0, refused: 0, revision: 1 }
    }

    /// How many triangles there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.triangles
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.triangles == 0
    }

    /// How many triangles were left out since the mesh was full.
    #[must_use]
    pub fn refused(&self) -> usize {
        self.refused
    }

    /// Counts the changes.
    pub(crate) fn revision(&self) -> u64 {
        self.revision
    }

    /// Takes what has changed. A block for whose triangles there is no room has none.
    pub fn take(&mut self, update: &MeshUpdate) {
        if update.is_anew {
            self.clear();
        }
        for piece in &update.pieces {
            self.revision += 1;
            if let Some(before) = self.blocks.remove(&piece.block) {
                self.triangles -= before.triangles();
            }
            let Some(block) = MeshBlock::of(&piece.mesh, self.revision) else { continue };
            let triangles = block.triangles();
            if self.triangles + triangles > self.most_triangles {
                self.refused += triangles;
                continue;
            }
            self.triangles += triangles;
            self.blocks.insert(piece.block, block);
        }
    }

    /// Forgets all triangles.
    pub fn clear(&mut self) {
        self.blocks.clear();
        (self.triangles, self.refused) = (0, 0);
        self.revision += 1;
    }

    pub(crate) fn block(&self, key: &BlockKey) -> Option<&MeshBlock> {
        self.blocks.get(key)
    }

    /// The number of the last change of a block that has triangles.
    pub(crate) fn changed(&self, key: &BlockKey) -> Option<u64> {
        self.blocks.get(key).map(|block| block.changed)
    }

    /// The blocks of a range of keys, each with the number of its last change.
    pub(crate) fn blocks_in(
        &self,
        range: (Bound<BlockKey>, Bound<BlockKey>),
    ) -> impl Iterator<Item = (BlockKey, u64)> {
        self.blocks.range(range).map(|(key, block)| (*key, block.changed))
    }
}
