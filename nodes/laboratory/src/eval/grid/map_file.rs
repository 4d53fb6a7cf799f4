//! Reads the pair of files of `map_server`.

use std::path::Path;

use geometry::{GridCell, OccupancyGrid};
use robot::Failure;
use serde::Deserialize;

/// An origin is at most so many cells away, along x and y: cells are counted in 32 bits.
const FARTHEST_CELLS: f64 = (1 << 30) as f64;

/// What the YAML file says.
#[derive(Deserialize)]
struct MapYaml {
    image: String,
    resolution: f64,
    origin: [f64; 3],
    #[serde(default)]
    negate: u8,
    occupied_thresh: f64,
    free_thresh: f64,
}

/// The grid of a YAML file and its image, by the rules of the mode `trinary`.
///
/// # Errors
/// When a file cannot be read, or is another one.
pub fn read(path: &Path) -> Result<OccupancyGrid, Failure> {
    let wrong =
        |reason: &dyn std::fmt::Display| Failure::new(format!("{}: {reason}", path.display()));
    let text = std::fs::read_to_string(path).map_err(|error| wrong(&error))?;
    let yaml: MapYaml = serde_saphyr::from_str(&text).map_err(|error| wrong(&error))?;
    if !(yaml.resolution.is_finite() && yaml.resolution > 0.0) {
        return Err(wrong(&format_args!("a resolution of {} m is none", yaml.resolution)));
    }
    let image = path.parent().unwrap_or(Path::new("")).join(&yaml.image);
    let bytes = std::fs::read(&image)
        .map_err(|error| Failure::new(format!("{}: {error}", image.display())))?;
    let (width, height, shades) = pgm(&bytes)
        .ok_or_else(|| Failure::new(format!("{} is no binary PGM of 8 bits", image.display())))?;
    let cell = |shade: &u8| {
        let shade = if yaml.negate == 0 { 255 - shade } else { *shade };
        let occupancy = f64::from(shade) / 255.0;
        if occupancy > yaml.occupied_thresh {
            GridCell::Occupied
        } else if occupancy < yaml.free_thresh {
            GridCell::Free
        } else {
            GridCell::Unknown
        }
    };
    let least = [yaml.origin[0], yaml.origin[1]].map(|m| (m / yaml.resolution).round());
    if !least.iter().all(|cells| cells.abs() <= FARTHEST_CELLS) {
        let [x_m, y_m, ..] = yaml.origin;
        return Err(wrong(&format_args!(
            "an origin at ({x_m:?}, {y_m:?}) m is more than {FARTHEST_CELLS} cells of {:?} m away",
            yaml.resolution
        )));
    }
    let least = least.map(|cells| cells as i32);
    Ok(OccupancyGrid {
        frame_id: "map".to_owned(),
        resolution_m: yaml.resolution,
        least,
        width,
        height,
        cells: shades.chunks(width).rev().flatten().map(cell).collect(),
        ..OccupancyGrid::default()
    })
}

/// Width, height and shades of a binary PGM without comments.
fn pgm(bytes: &[u8]) -> Option<(usize, usize, &[u8])> {
    let mut rest = bytes;
    let mut word = || {
        let from = rest.iter().position(|byte| !byte.is_ascii_whitespace())?;
        let text = rest.get(from..)?;
        let end = text.iter().position(u8::is_ascii_whitespace)?;
        let (word, after) = text.split_at(end);
        rest = after;
        std::str::from_utf8(word).ok()
    };
    let (kind, width, height, most) = (word()?, word()?, word()?, word()?);
    let (width, height): (usize, usize) = (width.parse().ok()?, height.parse().ok()?);
    let shades = rest.get(1..)?;
    let is_whole = width > 0 && width.checked_mul(height) == Some(shades.len());
    (kind == "P5" && most == "255" && is_whole).then_some((width, height, shades))
}

#[cfg(test)]
mod tests;
