//! Binary OctoMap files (`.bt`), as octomap 1.x writes and reads them: which voxels are occupied, without their means.
//!
//! The format is that of the OctoMap library's `OcTree::writeBinary`, as its documentation has it (Hornung et al.,
//! "OctoMap", Autonomous Robots 34, 2013, section 5.4: two bits a child). Lines of text: `# Octomap OcTree binary
//! file`, comments, `id OcTree`, `size` (nodes of the tree), `res` (the edge of a leaf in m), `data`. Then the
//! nodes from the root on, depth first: two bytes for the eight children of a node, the first four in the first byte,
//! each with two bits of which the lower one comes first: 00 not known, 10 a free leaf, 01 an occupied leaf, 11 a
//! node whose own two bytes follow once its parent's are there. Child 1 is the upper half along x, 2 along y, 4
//! along z. There are 16 levels.
//!
//! # Limits
//! A key of octomap's is ours plus 32768, in 16 bits: cells from -32768 to 32767 an axis, 2.6 km about the origin
//! at an edge of 8 cm. What lies beyond cannot be written, and is told. Free space is not written, since the map
//! keeps none, and is passed over by the reader.

mod reader;
mod writer;

#[cfg(test)]
mod tests;

use geometry::VoxelKey;

pub use reader::decode;
pub use writer::encode;

/// The first line of a file.
const FIRST_LINE: &str = "# Octomap OcTree binary file";

/// Levels of the tree below its root.
const LEVELS: u32 = 16;

/// What octomap adds to the number of a cell to have a key.
const KEY_OFFSET: i64 = 1 << (LEVELS - 1);

/// The two bits of a child.
const FREE: u16 = 0b01;
const OCCUPIED: u16 = 0b10;
const INNER: u16 = 0b11;

/// The occupied voxels of a file.
#[derive(Clone, PartialEq, Debug)]
pub struct Octree {
    /// The edge of a voxel.
    pub edge_m: f64,
    /// The voxels, each once, in the order of the file.
    pub voxels: Vec<VoxelKey>,
}

/// A file cannot be written or read.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
pub enum OctomapError {
    /// Voxels that have no key in an octomap.
    #[error(
        "{voxels} of the voxels are beyond what an octomap holds, cells -32768 to 32767 an axis; .ply and .pcd have \
         no such bound"
    )]
    OutOfReach {
        /// How many.
        voxels: usize,
    },
    /// The file begins in another way.
    #[error("this is no binary octomap: the first line is not '{FIRST_LINE}'")]
    NotThisFormat,
    /// A line of the header is missing or means nothing.
    #[error("the header of the octomap has no valid '{entry}'")]
    Header {
        /// The entry's first word.
        entry: &'static str,
    },
    /// The nodes end too early.
    #[error("the octomap is cut off within its {nodes} nodes")]
    CutOff {
        /// The nodes that the header promises.
        nodes: usize,
    },
    /// The header promises another number of nodes than there are.
    #[error("the octomap has {found} nodes, not the {promised} of its header")]
    OtherSize {
        /// By the header.
        promised: usize,
        /// In the data.
        found: usize,
    },
    /// A node of the lowest level has children.
    #[error("the octomap has more than {LEVELS} levels")]
    TooDeep,
    /// More voxels than were asked for: an occupied node high in the tree stands for all voxels below it.
    #[error("the octomap has more than {most} occupied voxels")]
    TooManyVoxels {
        /// So many were allowed.
        most: usize,
    },
}
