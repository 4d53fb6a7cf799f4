//! The two files of Nav2's `map_server`: an image (PGM) and what it means (YAML).
//!
//! As its documentation has it ("Map Server / Saver", mode `trinary`): a pixel of shade `s` has the occupancy
//! `(255 - s) / 255`; above `occupied_thresh` it is occupied, below `free_thresh` free, else unknown. The first row of the
//! image is that of the greatest y; `origin` is the pose of the lower left pixel's corner. `map_saver` writes 0, 254 and 205.

use std::fmt::Write as _;

use super::{GridCell, OccupancyGrid};

/// Above this occupancy a cell is occupied: the value of `map_saver`.
pub const OCCUPIED_THRESHOLD: f64 = 0.65;
/// Below this occupancy a cell is free. The shade of unknown cells, 205, has an occupancy of 0.19608: a greater threshold,
/// such as Nav2's default for saving of 0.25, would make them free.
pub const FREE_THRESHOLD: f64 = 0.196;

/// The shades of `map_saver`.
const OCCUPIED_SHADE: u8 = 0;
const FREE_SHADE: u8 = 254;
const UNKNOWN_SHADE: u8 = 205;

impl OccupancyGrid {
    /// The image: a binary PGM (Netpbm's P5).
    #[must_use]
    pub fn pgm(&self) -> Vec<u8> {
        let mut bytes = format!("P5\n{} {}\n255\n", self.width, self.height).into_bytes();
        let shade = |cell: &GridCell| match cell {
            GridCell::Occupied => OCCUPIED_SHADE,
            GridCell::Free => FREE_SHADE,
            GridCell::Unknown => UNKNOWN_SHADE,
        };
        for row in self.cells.chunks(self.width.max(1)).rev() {
            bytes.extend(row.iter().map(shade));
        }
        bytes
    }

    /// The YAML file of an image with this name, which is in the same folder.
    #[must_use]
    pub fn map_yaml(&self, image: &str) -> String {
        let origin_m = self.origin_m();
        let mut yaml = String::new();
        // A JSON text is a YAML text, whatever is in the name.
        let name = quoted_text(image);
        let _ = writeln!(yaml, "image: {name}\nmode: trinary");
        let _ = writeln!(yaml, "resolution: {}", number(self.resolution_m));
        let _ = writeln!(yaml, "origin: [{}, {}, 0.0]", number(origin_m.x), number(origin_m.y));
        let _ = writeln!(yaml, "negate: 0");
        let _ =
            writeln!(yaml, "occupied_thresh: {OCCUPIED_THRESHOLD}\nfree_thresh: {FREE_THRESHOLD}");
        yaml
    }
}

/// Nine decimals are finer than any map; a sum of floating point numbers is not written with its rounding.
fn number(value: f64) -> String {
    let text = format!("{value:.9}");
    let text = text.trim_end_matches('0');
    // YAML readers take "1." for a text.
    if text.ends_with('.') { format!("{text}0") } else { text.to_owned() }
}

/// A text in double quotes.
fn quoted_text(text: &str) -> String {
    let mut quoted = String::from("\"");
    for character in text.chars() {
        match character {
            '"' | '\\' => {
                quoted.push('\\');
                quoted.push(character);
            }
            _ if character.is_control() => {
                let _ = write!(quoted, "\\u{:04x}", u32::from(character));
            }
            _ => quoted.push(character),
        }
    }
    quoted.push('"');
    quoted
}
