//! Pictures of several clouds of one place, side by side.

use geometry::VoxelGrid;
use nalgebra::Point3;

use super::{PictureError, PictureFrame, Shade, View, map_picture};

/// A cloud, drawn.
#[derive(Clone, PartialEq, Debug)]
pub struct CloudPicture {
    /// The bytes of a PNG file.
    pub png: Vec<u8>,
    /// Its columns and rows.
    pub size_px: (u32, u32),
}

/// A picture of each cloud, in voxels of `edge_m`, all in one frame and one scale of colours, with the path
/// `path_m` in white. Points and path are in one frame.
///
/// # Errors
/// When the edge is not a positive number, or a picture cannot be encoded.
pub fn cloud_pictures(
    view: View,
    clouds_m: &[&[Point3<f32>]],
    path_m: &[Point3<f32>],
    edge_m: f64,
) -> Result<Vec<CloudPicture>, PictureError> {
    let grid = VoxelGrid::new(edge_m)?;
    let frame = PictureFrame::fit(view, clouds_m, path_m, &grid);
    let fullest = |cloud: &&[Point3<f32>]| {
        frame.columns(cloud).into_iter().map(|column| column.points).max().unwrap_or(0)
    };
    let shade = Shade { fullest: clouds_m.iter().map(fullest).max().unwrap_or(0) };
    let draw = |cloud: &&[Point3<f32>]| -> Result<CloudPicture, PictureError> {
        let png = map_picture(&frame, &shade, cloud, path_m)?;
        Ok(CloudPicture { png, size_px: frame.size_px() })
    };
    clouds_m.iter().map(draw).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clouds_share_one_frame_and_an_empty_one_is_all_background() {
        let wall: Vec<_> =
            (0..20).map(|y| Point3::new(4.05, y as f32 * 0.1 + 0.05, 0.05)).collect();
        let near = [Point3::new(1.05, 0.05, 0.05)];
        let pictures = cloud_pictures(View::Top, &[&wall, &near, &[]], &[], 0.1).unwrap();
        let decoded: Vec<_> = pictures
            .iter()
            .map(|picture| image::load_from_memory(&picture.png).unwrap().into_rgb8())
            .collect();
        let drawn = |index: usize| {
            let background = *decoded[index].get_pixel(0, 0);
            let below_px = decoded[index].height() - 16;
            decoded[index]
                .enumerate_pixels()
                .filter(|(_, y, pixel)| *y < below_px && **pixel != background)
                .count()
        };
        assert!(decoded.iter().all(|picture| picture.dimensions() == decoded[0].dimensions()));
        assert_eq!(drawn(0), 20 * drawn(1), "each point is one voxel");
        assert_eq!(drawn(2), 0);
        assert!(cloud_pictures(View::Top, &[], &[], 0.0).is_err());
    }
}
