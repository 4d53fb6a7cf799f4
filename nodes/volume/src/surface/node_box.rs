//! A box of nodes, and the blocks that these are of.

use geometry::VoxelKey;
use nalgebra::Vector3;

use crate::block::{BLOCK_EDGE, BlockBox, BlockKey};

/// The nodes between two, these included.
pub(super) struct NodeBox {
    least: [i32; 3],
    most: [i32; 3],
}

impl NodeBox {
    /// The corners of the voxel that a place lies in, in edges.
    pub(super) fn of_voxel(place: &Vector3<f64>) -> Self {
        // The casts saturate.
        let least: [i32; 3] = place.map(|along| along.floor() as i32).into();
        Self { least, most: least.map(|along| along.saturating_add(1)) }
    }

    /// Those within half a box around a place, in edges.
    pub(super) fn around(middle: &Vector3<f64>, half: &Vector3<f64>) -> Self {
        // The casts saturate.
        let least = (middle - half).map(|along| along.ceil() as i32);
        let most = (middle + half).map(|along| along.floor() as i32);
        Self { least: least.into(), most: most.into() }
    }

    /// Those of the cells that half a box around a place reaches, in edges.
    pub(super) fn of_cells(middle: &Vector3<f64>, half: &Vector3<f64>) -> Self {
        // The casts saturate.
        let least = (middle - half).map(|along| along.floor() as i32);
        let most = (middle + half).map(|along| along.ceil() as i32);
        Self { least: least.into(), most: most.into() }
    }

    /// The blocks that they are of.
    pub(super) fn blocks(&self) -> BlockBox {
        let block = |[x, y, z]: [i32; 3]| BlockKey::of(VoxelKey { x, y, z });
        BlockBox { least: block(self.least), most: block(self.most) }
    }

    /// Those of a block.
    pub(super) fn of_block(&self, key: BlockKey) -> impl Iterator<Item = VoxelKey> + use<> {
        let first = key.voxel(0);
        let [x, y, z] = [(first.x, 0), (first.y, 1), (first.z, 2)].map(|(first, axis)| {
            let last = first.saturating_add(BLOCK_EDGE as i32 - 1);
            first.max(self.least[axis])..=last.min(self.most[axis])
        });
        z.flat_map(move |z| {
            let x = x.clone();
            y.clone().flat_map(move |y| x.clone().map(move |x| VoxelKey { x, y, z }))
        })
    }
}
