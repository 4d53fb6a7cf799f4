//! Pictures of the map from above and from the side, with and without removal.
//!
//! Each view has one frame for all its pictures: the same metres lie at the same pixels in the same colours,
//! so that two pictures can be compared by looking from one to the other.

pub(crate) mod canvas;
mod clouds;
mod frame;
#[cfg(test)]
mod tests;

use geometry::{VoxelEdgeError, VoxelGrid};
use nalgebra::Point3;

pub(crate) use self::canvas::HEIGHT_COLOURS;
use self::canvas::{Canvas, Colour, faded, height_colour};
pub use self::clouds::{CloudPicture, cloud_pictures};
pub use self::frame::{PictureFrame, View};
use crate::{KeptOut, KeptOutCause, RunRecord};

/// The voxels that are not in the map since something moved there, and those for another reason.
pub(crate) const REMOVED: Colour = [0xff, 0x8a, 0x3d];
const NOT_CONFIRMED: Colour = [0xb5, 0x8c, 0xff];
/// The static map where it is only the background of what was removed.
const BACKDROP: Colour = [0x5b, 0x6b, 0x7f];
/// Where the rig went.
pub(crate) const PATH: Colour = [0xff, 0xff, 0xff];

/// The pictures of a run's maps, as the bytes of PNG files.
#[derive(Clone, PartialEq, Debug)]
pub struct MapPictures {
    /// From above: x to the right, y up.
    pub top: ViewPictures,
    /// From the right-hand side: x to the right, z up.
    pub side: ViewPictures,
}

/// The pictures of one view, all in one frame.
#[derive(Clone, PartialEq, Debug)]
pub struct ViewPictures {
    /// Where the pictures' pixels lie in the map.
    pub frame: PictureFrame,
    /// The static map.
    pub with_removal: Vec<u8>,
    /// The map that the same clouds give when nothing is removed.
    pub without_removal: Vec<u8>,
    /// The voxels that are not in the map, over the static map: those in which something moved, and the others below them.
    pub removed: Vec<u8>,
}

/// A picture cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum PictureError {
    /// The run's voxel edge is no length.
    #[error("the map cannot be drawn on its voxel grid")]
    Edge(#[from] VoxelEdgeError),
    /// The encoder failed.
    #[error("a picture of the map could not be written as PNG")]
    Encode(#[from] image::ImageError),
    /// The encoder of animated pictures failed.
    #[error("an animated picture of the map could not be written as PNG")]
    Animate(#[from] png::EncodingError),
}

/// The pictures of the maps of `run`, and of `kept_out` over the map, with the rig's path in white and a bar of
/// [`PictureFrame::scale_bar_m`] in the lower left corner.
///
/// # Errors
/// When the run's voxel edge is not a positive number, or a picture cannot be encoded.
pub fn map_pictures(run: &RunRecord, kept_out: &[KeptOut]) -> Result<MapPictures, PictureError> {
    let grid = VoxelGrid::new(run.voxel_edge_m)?;
    let (moved, other): (Vec<&KeptOut>, Vec<&KeptOut>) =
        kept_out.iter().partition(|voxel| voxel.cause == KeptOutCause::Moved);
    let points = |voxels: &[&KeptOut]| voxels.iter().map(|voxel| voxel.point_m).collect::<Vec<_>>();
    let removed = [points(&other), points(&moved)];
    let path: Vec<Point3<f32>> = run
        .cycles
        .iter()
        .map(|cycle| Point3::from(cycle.map_from_rig.translation.vector.cast::<f32>()))
        .collect();
    let view = |view| -> Result<ViewPictures, PictureError> {
        let frame = PictureFrame::fit(view, &[&run.static_map, &run.unfiltered_map], &path, &grid);
        // The brightness is that of the fuller map in both, or the same wall would differ between them.
        let fullest = frame.columns(&run.unfiltered_map).into_iter().map(|c| c.points).max();
        let shade = Shade { fullest: fullest.unwrap_or(0) };
        Ok(ViewPictures {
            with_removal: map_picture(&frame, &shade, &run.static_map, &path)?,
            without_removal: map_picture(&frame, &shade, &run.unfiltered_map, &path)?,
            removed: removal_picture(&frame, &shade, &run.static_map, &removed, &path)?,
            frame,
        })
    };
    Ok(MapPictures { top: view(View::Top)?, side: view(View::Side)? })
}

/// How bright a column of the map is: the more points lie behind each other, the brighter.
struct Shade {
    fullest: u32,
}

impl Shade {
    /// The brightness of a column that holds a single point.
    const FLOOR: f64 = 0.55;

    fn brightness(&self, points: u32) -> f64 {
        let logarithm = |count: u32| f64::from(count).ln_1p();
        let fullness = (logarithm(points) / logarithm(self.fullest.max(1))).min(1.0);
        Self::FLOOR + (1.0 - Self::FLOOR) * fullness
    }
}

fn map_picture(
    frame: &PictureFrame,
    shade: &Shade,
    points: &[Point3<f32>],
    path: &[Point3<f32>],
) -> Result<Vec<u8>, PictureError> {
    let mut canvas = canvas_of(frame);
    canvas.paint_columns(frame, &frame.columns(points), |column| {
        let height = frame.relative_height(column.mean_height_m());
        faded(height_colour(height), shade.brightness(column.points))
    });
    finish(canvas, frame, path)
}

fn removal_picture(
    frame: &PictureFrame,
    shade: &Shade,
    kept: &[Point3<f32>],
    [other, moved]: &[Vec<Point3<f32>>; 2],
    path: &[Point3<f32>],
) -> Result<Vec<u8>, PictureError> {
    let mut canvas = canvas_of(frame);
    canvas.paint_columns(frame, &frame.columns(kept), |column| {
        faded(BACKDROP, shade.brightness(column.points))
    });
    for (points, colour) in [(other, NOT_CONFIRMED), (moved, REMOVED)] {
        canvas.paint_columns(frame, &frame.columns(points), |column| {
            faded(colour, shade.brightness(column.points))
        });
    }
    finish(canvas, frame, path)
}

fn canvas_of(frame: &PictureFrame) -> Canvas {
    let (width_px, height_px) = frame.size_px();
    Canvas::new((width_px as usize, height_px as usize))
}

fn finish(
    mut canvas: Canvas,
    frame: &PictureFrame,
    path: &[Point3<f32>],
) -> Result<Vec<u8>, PictureError> {
    canvas.paint_path(path.iter().map(|point| frame.pixel_of(point)), PATH);
    canvas.paint_scale_bar(frame);
    Ok(canvas.into_png()?)
}
