//! Grid and plan in one picture.

use std::path::Path;

use geometry::{GridCell, OccupancyGrid};
use image::{Rgb, RgbImage};
use robot::Failure;

/// Pixels a cell.
const SCALE: u32 = 4;

/// Draws what is right in grey, what is wrong in colours: occupied where nothing is red, free in a body orange, unknown but in
/// sight blue.
pub(super) fn write(
    path: &Path,
    grid: &OccupancyGrid,
    plan: &OccupancyGrid,
    in_sight: &[bool],
) -> Result<(), Failure> {
    let colour = |index: usize| {
        let seen = in_sight.get(index).copied().unwrap_or_default();
        match (grid.cells.get(index), plan.cells.get(index)) {
            (Some(GridCell::Occupied), Some(GridCell::Occupied)) => [0, 0, 0],
            (Some(GridCell::Free), Some(GridCell::Free)) => [255, 255, 255],
            (Some(GridCell::Occupied), _) => [220, 0, 0],
            (Some(GridCell::Free), _) => [255, 150, 0],
            (_, Some(GridCell::Occupied)) => [150, 150, 150],
            _ if seen => [140, 180, 255],
            _ => [205, 205, 205],
        }
    };
    let (width, height) = (grid.width as u32, grid.height as u32);
    let picture = RgbImage::from_fn(width * SCALE, height * SCALE, |x, y| {
        let row = height - 1 - y / SCALE;
        Rgb(colour((row * width + x / SCALE) as usize))
    });
    picture
        .save(path)
        .map_err(|error| Failure::new(format!("cannot write {}: {error}", path.display())))
}
