//! The content of pictures on a wall.

use super::lattice::{bits, floor, share, unit};

/// Paper, ink and frames.
const PAPER: [f32; 3] = [0.8, 0.79, 0.74];
const INK: [f32; 3] = [0.04, 0.04, 0.06];
const FRAMES: [[f32; 3]; 3] = [[0.03, 0.03, 0.03], [0.28, 0.16, 0.07], [0.75, 0.75, 0.75]];
/// The width of a frame as a share of half the picture.
const FRAME_SHARE: f32 = 0.06;

/// The colour of the picture in the square of a grid, at a position in the square (both coordinates in
/// `[0, 1)`); `None` on the bare wall.
pub(super) fn picture(square: [i32; 2], at: [f32; 2], filled: f32, seed: u32) -> Option<[f32; 3]> {
    let key = bits(square[0], square[1], seed);
    if share(key) >= filled {
        return None;
    }
    let draw = |index: i32| unit(index, 0, key);
    let half = [0.22 + 0.24 * draw(1), 0.22 + 0.24 * draw(2)];
    let middle = [
        0.5 + (0.48 - half[0]) * (2.0 * draw(3) - 1.0),
        0.5 + (0.48 - half[1]) * (2.0 * draw(4) - 1.0),
    ];
    let (s, t) = ((at[0] - middle[0]) / half[0], (at[1] - middle[1]) / half[1]);
    if s.abs() > 1.0 || t.abs() > 1.0 {
        return None;
    }
    if s.abs().max(t.abs()) > 1.0 - FRAME_SHARE {
        return FRAMES.get((draw(5) * 3.0) as usize).copied();
    }
    // Within the frame, from 0 to 1.
    let (s, t) = ((s + 1.0) / 2.0, (t + 1.0) / 2.0);
    Some(match (draw(6) * 3.0) as u8 {
        0 => blocks(s, t, key),
        1 => print(s, t, key),
        _ => bands(s, t, key),
    })
}

/// A strong colour: one channel bright, one dark, one between.
pub(super) fn vivid(bits: u32) -> [f32; 3] {
    let mut colour = [0.75, 0.08, 0.08 + 0.67 * share(bits)];
    colour.rotate_right((bits % 3) as usize);
    if bits & 8 > 0 {
        colour.swap(0, 1);
    }
    // A quarter of them is dark, a quarter pale.
    match bits >> 4 & 3 {
        0 => colour.map(|channel| channel * 0.3),
        1 => colour.map(|channel| 0.45 + channel * 0.45),
        _ => colour,
    }
}

/// Rectangles of random colours.
fn blocks(s: f32, t: f32, key: u32) -> [f32; 3] {
    let columns = 3.0 + (key & 3) as f32;
    let rows = 3.0 + (key >> 2 & 3) as f32;
    vivid(bits((s * columns) as i32, (t * rows) as i32, key ^ 0x51))
}

/// Lines of words on paper, with a heading.
fn print(s: f32, t: f32, key: u32) -> [f32; 3] {
    const LINES: f32 = 14.0;
    const WORDS: f32 = 9.0;
    let margin = !(0.08..0.92).contains(&s) || !(0.06..0.94).contains(&t);
    let (line, word) = ((t * LINES) as i32, (s * WORDS) as i32);
    let (in_line, in_word) = ((t * LINES).fract(), (s * WORDS).fract());
    let heading = t > 0.8;
    let inked = if heading {
        (0.83..0.9).contains(&t) && unit((s * 16.0) as i32, 77, key) < 0.8
    } else {
        (0.3..0.75).contains(&in_line) && in_word < 0.35 + 0.6 * unit(word, line, key)
    };
    if inked && !margin { INK } else { PAPER }
}

/// Slanting bands with a disc over them.
fn bands(s: f32, t: f32, key: u32) -> [f32; 3] {
    let slant = 2.0 * share(key.wrapping_mul(0x9e37_79b1)) - 1.0;
    let (dx, dy) = (s - 0.5, t - 0.55);
    let radius = (dx * dx + dy * dy).sqrt();
    let band =
        if radius < 0.3 { 100 + (radius * 10.0) as i32 } else { floor((s * slant + t) * 7.0) };
    vivid(bits(band, 5, key))
}
