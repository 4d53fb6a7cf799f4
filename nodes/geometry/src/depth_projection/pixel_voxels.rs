//! The voxels of an image's pixels, kept from the reduction of its points for those who ask for them again.

use crate::rigid::RigidTransform;
use crate::{DepthImage, PixelArea, VoxelBox, VoxelGrid, VoxelKey};

/// A pixel without a point is in no voxel.
const NO_VOXEL: u32 = u32::MAX;

/// The voxel of each pixel of a depth image. Its memory is used again for the next image.
#[derive(Clone, Debug, Default)]
pub struct PixelVoxels {
    /// With what they were made; `None` while there are none.
    made_with: Option<(VoxelGrid, RigidTransform)>,
    width_px: usize,
    keys: Vec<VoxelKey>,
    /// Of each pixel, row by row, the number of its voxel among the keys.
    voxels: Vec<u32>,
}

impl PixelVoxels {
    pub(super) fn forget(&mut self) {
        self.made_with = None;
    }

    pub(super) fn begin(&mut self, image: &DepthImage, made_with: (VoxelGrid, RigidTransform)) {
        self.made_with = Some(made_with);
        self.width_px = image.width_px();
        // Those of the last image are all written over.
        self.voxels.resize(image.width_px() * image.height_px(), NO_VOXEL);
    }

    /// The places of the pixels of a block, which are in no voxel yet.
    #[inline]
    pub(super) fn of_block(&mut self, first: usize, pixels: usize) -> &mut [u32] {
        let voxels = self.voxels.get_mut(first..first + pixels).unwrap_or_default();
        voxels.fill(NO_VOXEL);
        voxels
    }

    /// Ends with the keys of the voxels, in the order of their numbers.
    pub(super) fn end(&mut self, keys: &[VoxelKey]) {
        self.keys.clear();
        self.keys.extend_from_slice(keys);
    }

    /// Whether the points were taken to their frame by this transform, and reduced by this grid.
    pub(crate) fn are_made_with(&self, grid: &VoxelGrid, transform: &RigidTransform) -> bool {
        self.made_with == Some((*grid, *transform))
    }

    /// As [`DepthFrame::for_each_voxel`](crate::DepthFrame::for_each_voxel), of the image that they are of.
    pub(crate) fn for_each(
        &self,
        PixelArea { columns_px, rows_px }: PixelArea,
        within: &VoxelBox,
        mut take: impl FnMut(usize, VoxelKey),
    ) {
        let are_within: Vec<bool> = self.keys.iter().map(|key| within.contains(*key)).collect();
        let width_px = self.width_px.max(1);
        let rows = self.voxels.chunks_exact(width_px).enumerate();
        for (row_px, row) in rows.take(rows_px.end).skip(rows_px.start) {
            let columns_px = columns_px.start..columns_px.end.min(width_px);
            let first = row_px * width_px + columns_px.start;
            let pixels = (first..).zip(row.get(columns_px).unwrap_or_default());
            for (pixel, voxel) in pixels {
                let voxel = *voxel as usize;
                if are_within.get(voxel) == Some(&true)
                    && let Some(key) = self.keys.get(voxel)
                {
                    take(pixel, *key);
                }
            }
        }
    }
}
