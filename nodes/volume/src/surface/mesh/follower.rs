//! What a listener has to be told of the mesh: the blocks whose triangles are new, have moved or have gone, so many at a time.

use std::collections::HashMap;

use geometry::BuildVoxelHasher;

use super::{BlockMesh, GridEdge, MeshVertex};
use crate::block::BlockKey;
use crate::surface::waiting::WaitingBlocks;
use crate::surface::{LISTENER_TOLERANCE_IN_EDGES, PointRules, Surface};

/// Places along an edge of the grid are remembered in steps of this share of it.
const STEPS: f32 = 255.0;

/// The triangles of a block, which take the place of those that a listener has of it.
#[derive(Clone, PartialEq, Debug)]
pub struct MeshChange {
    /// The block.
    pub key: BlockKey,
    /// Its triangles; none where they have gone.
    pub mesh: BlockMesh,
}

/// What listeners know of the mesh. A block is told of again as a whole when one of its vertices has moved by more than
/// [`LISTENER_TOLERANCE_IN_EDGES`], has come or gone, or has its first colour: two blocks may differ by so much along their
/// border. Blocks wait in the order in which they changed first.
#[derive(Clone, Debug, Default)]
pub struct MeshFollower {
    waiting: WaitingBlocks,
    /// What was told of each block that has triangles. Looked up by key alone, and sorted where its order counts.
    told: HashMap<BlockKey, Told, BuildVoxelHasher>,
    mesh: BlockMesh,
}

#[derive(Clone, PartialEq, Eq, Debug, Default)]
struct Told {
    vertices: Vec<ToldVertex>,
    triangles: usize,
    /// Some listener was not told: it is told of again in any case.
    is_stale: bool,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct ToldVertex {
    edge: GridEdge,
    along: u8,
    has_colour: bool,
}

impl ToldVertex {
    fn of(vertex: &MeshVertex) -> Self {
        // The cast saturates.
        let along = (vertex.along * STEPS).round() as u8;
        Self { edge: vertex.edge, along, has_colour: vertex.colour.is_some() }
    }

    /// Whether a listener that was told of `self` has to be told of this one.
    fn is_news(&self, now: &Self) -> bool {
        // Rounding adds a step, half of one at both places.
        let untold = LISTENER_TOLERANCE_IN_EDGES as f32 * STEPS - 1.0;
        self.edge != now.edge
            || f32::from(self.along.abs_diff(now.along)) > untold
            || now.has_colour && !self.has_colour
    }
}

impl Told {
    fn has_news(&self, mesh: &BlockMesh) -> bool {
        self.is_stale
            || self.triangles != mesh.triangles.len()
            || self.vertices.len() != mesh.vertices.len()
            || self
                .vertices
                .iter()
                .zip(&mesh.vertices)
                .any(|(told, now)| told.is_news(&ToldVertex::of(now)))
    }
}

impl MeshFollower {
    /// Takes in what the latest image changed. To be called after each.
    pub fn follow(&mut self, surface: &Surface) {
        self.waiting.follow(surface);
    }

    /// A block was removed, or put there, by hand.
    pub fn follow_block(&mut self, key: BlockKey) {
        self.waiting.has_changed(key);
    }

    /// A block has left for a store: listeners keep its triangles, and are told of them again when it is looked at next.
    pub fn left(&mut self, key: BlockKey) {
        if let Some(told) = self.told.get_mut(&key) {
            *told = Told { is_stale: true, ..Told::default() };
        }
    }

    /// A listener that knows nothing is there: all blocks are told of, to every listener.
    pub fn begin_to_show(&mut self, surface: &Surface) {
        self.told.values_mut().for_each(|told| told.is_stale = true);
        let mut told: Vec<BlockKey> = self.told.keys().copied().collect();
        told.sort_unstable();
        for key in surface.block_keys().into_iter().chain(told) {
            self.waiting.wait(key);
        }
    }

    /// The block that is looked at next.
    #[must_use]
    pub fn next_waiting(&self) -> Option<BlockKey> {
        self.waiting.next()
    }

    /// The block that would be looked at next comes after all others.
    pub fn postpone(&mut self) {
        self.waiting.postpone();
    }

    /// How many blocks wait to be looked at.
    #[must_use]
    pub fn waiting(&self) -> usize {
        self.waiting.len()
    }

    /// The next changes: of so many blocks that there are no more than `most_triangles`, or of one block. What does not fit
    /// waits, and comes before what changes later.
    pub fn take(
        &mut self,
        surface: &Surface,
        rules: PointRules,
        most_triangles: usize,
    ) -> Vec<MeshChange> {
        let (mut changes, mut taken) = (Vec::new(), 0);
        while self.take_next(surface, rules, most_triangles, &mut taken, &mut changes) {}
        changes
    }

    /// The change of the next block, behind those before it, which have `taken` triangles. Returns whether there was a block that
    /// fits: [`MeshFollower::take`], block by block, for a surface of which the next block and those around it must be brought into
    /// memory first.
    pub fn take_next(
        &mut self,
        surface: &Surface,
        rules: PointRules,
        most_triangles: usize,
        taken: &mut usize,
        changes: &mut Vec<MeshChange>,
    ) -> bool {
        let Some(key) = self.waiting.next() else { return false };
        let mut mesh = std::mem::take(&mut self.mesh);
        surface.mesh_of(key, rules, &mut mesh);
        let told = self.told.get(&key);
        let is_news = told.map_or(!mesh.is_empty(), |told| told.has_news(&mesh));
        let fits = !is_news || *taken == 0 || *taken + mesh.triangles.len() <= most_triangles;
        if fits {
            self.waiting.done();
        }
        if fits && is_news {
            // What has gone counts, too: a message says so.
            *taken += mesh.triangles.len().max(1);
            if mesh.is_empty() {
                self.told.remove(&key);
            } else {
                let vertices = mesh.vertices.iter().map(ToldVertex::of).collect();
                let triangles = mesh.triangles.len();
                self.told.insert(key, Told { vertices, triangles, is_stale: false });
            }
            changes.push(MeshChange { key, mesh: mesh.clone() });
        }
        self.mesh = mesh;
        fits
    }

    /// The memory taken, in bytes.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        let told =
            self.told.values().map(|told| told.vertices.capacity() * size_of::<ToldVertex>());
        told.sum::<usize>()
            + self.told.capacity() * size_of::<(BlockKey, Told)>()
            + self.waiting.memory_bytes()
    }
}
