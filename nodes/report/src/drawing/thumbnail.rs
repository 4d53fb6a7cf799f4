//! The map from above, of characters: the upper and the lower half of each are a pixel.

use super::eye::Eye;
use super::raster::Raster;
use super::{MapDrawing, relative};
use crate::pictures::canvas::Colour;
use crate::scene::range_without_outliers;

/// Rows of characters, at most: those of a common terminal, less the figures below.
const MOST_ROWS: usize = 30;
/// Without colours the floor is not drawn: what is higher than the lowest by less than this.
const FLOOR_M: f32 = 0.3;
const UPPER_HALF: char = '\u{2580}';
const LOWER_HALF: char = '\u{2584}';
const BOTH_HALVES: char = '\u{2588}';

/// The colours that a terminal can show.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum TerminalColours {
    /// None: what is higher than the floor is drawn.
    None,
    /// The cube of 6 x 6 x 6 colours of those with 256.
    Indexed,
    /// Red, green and blue of 8 bits.
    True,
}

/// The lines of a thumbnail of the map from above, x to the right and y up, `columns` wide at most. An empty map has none.
#[must_use]
pub fn thumbnail(map: &MapDrawing, columns: usize, colours: TerminalColours) -> Vec<String> {
    if map.points.is_empty() {
        return Vec::new();
    }
    let view = map.projection(Eye::Above, &[], (columns, 2 * MOST_ROWS));
    let mut raster = Raster::new(view.size_px());
    map.points.iter().for_each(|point| map.splat(&mut raster, &view, point));
    let pixels: Vec<Option<(Colour, f32)>> = raster.pixels().collect();
    let rows: Vec<&[Option<(Colour, f32)>]> = pixels.chunks(view.size_px().0.max(1)).collect();
    let is_drawn = standing(&pixels);
    let line = |pair: &[&[Option<(Colour, f32)>]]| {
        let upper = pair.first().copied().unwrap_or_default();
        let lower = |column: usize| pair.get(1).and_then(|row| row.get(column)).copied().flatten();
        let halves = upper.iter().enumerate().map(|(column, upper)| [*upper, lower(column)]);
        match colours {
            TerminalColours::None => {
                let halves =
                    halves.map(|halves| halves.map(|half| half.filter(&is_drawn).is_some()));
                halves.map(plain).collect::<String>().trim_end().to_owned()
            }
            TerminalColours::Indexed => coloured(halves, |[r, g, b]| {
                format!("5;{}", 16 + 36 * sixth(r) + 6 * sixth(g) + sixth(b))
            }),
            TerminalColours::True => coloured(halves, |[r, g, b]| format!("2;{r};{g};{b}")),
        }
    };
    rows.chunks(2).map(line).collect()
}

/// What stands on the floor; everything where nothing does.
fn standing(pixels: &[Option<(Colour, f32)>]) -> impl Fn(&(Colour, f32)) -> bool + use<> {
    let heights_m = || pixels.iter().flatten().map(|(_, height_m)| *height_m);
    let [low_m, high_m] = range_without_outliers(heights_m().collect()).unwrap_or_default();
    let least_m = if relative((low_m + FLOOR_M).into(), [low_m, high_m]) < 1.0 {
        low_m + FLOOR_M
    } else {
        f32::NEG_INFINITY
    };
    move |(_, height_m)| *height_m >= least_m
}

fn plain(halves: [bool; 2]) -> char {
    match halves {
        [false, false] => ' ',
        [true, false] => UPPER_HALF,
        [false, true] => LOWER_HALF,
        [true, true] => BOTH_HALVES,
    }
}

/// A line with the escape sequences of its colours (ECMA-48, SGR), as few as it needs.
fn coloured(
    halves: impl Iterator<Item = [Option<(Colour, f32)>; 2]>,
    code: impl Fn(Colour) -> String,
) -> String {
    const RESET: &str = "\x1b[0m";
    let mut line = String::new();
    let mut set = String::new();
    for halves in halves {
        let [upper, lower] = halves.map(|half| half.map(|(colour, _)| colour));
        let (wanted, character) = match (upper, lower) {
            (None, None) => (String::new(), ' '),
            (Some(upper), None) => (format!("\x1b[38;{}m", code(upper)), UPPER_HALF),
            (None, Some(lower)) => (format!("\x1b[38;{}m", code(lower)), LOWER_HALF),
            (Some(upper), Some(lower)) => {
                (format!("\x1b[38;{};48;{}m", code(upper), code(lower)), UPPER_HALF)
            }
        };
        if wanted != set {
            if !set.is_empty() {
                line.push_str(RESET);
            }
            line.push_str(&wanted);
            set = wanted;
        }
        line.push(character);
    }
    if !set.is_empty() {
        line.push_str(RESET);
    }
    line.trim_end().to_owned()
}

/// A channel as one of the six levels of the cube: 0, 95, 135, 175, 215, 255.
fn sixth(channel: u8) -> u8 {
    const LEVELS: [u8; 6] = [0, 95, 135, 175, 215, 255];
    let nearest = LEVELS.iter().enumerate().min_by_key(|(_, level)| level.abs_diff(channel));
    nearest.map_or(0, |(index, _)| index as u8)
}
