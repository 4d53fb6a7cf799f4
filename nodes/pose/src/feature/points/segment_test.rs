//! FAST-9 (Rosten and Drummond 2006): how strong a corner is at every pixel.

use multiversion::multiversion;

/// How far the ring of sixteen pixels reaches.
pub(super) const RING_RADIUS_PX: usize = 3;
/// Columns that are worked on at once: the test has no branch within, so that a compiler makes vectors of it.
pub(super) const BLOCK_PX: usize = 32;
/// The pixels that a block reads of each row.
const SPAN_PX: usize = BLOCK_PX + 2 * RING_RADIUS_PX;
/// Rows that the ring touches.
const RING_ROWS: usize = 2 * RING_RADIUS_PX + 1;

/// The rows around a block.
type Window<'a> = [&'a [u8; SPAN_PX]; RING_ROWS];

/// The strength of a corner at the pixels of one row: the largest threshold below which the segment test finds the
/// pixel to be a corner, that is, nine neighbours on the ring are all brighter than the pixel by more than the
/// threshold, or all darker. It is 0 where it is not above `threshold`, and within three pixels of the ends.
///
/// `rows` are the row itself and three above and below it. All have the length of `output`, which is at least
/// `BLOCK_PX + 6`; otherwise nothing is written.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2"))]
pub(super) fn row_strengths(rows: [&[u8]; RING_ROWS], threshold: u8, output: &mut [u8]) {
    let width = output.len();
    if width < SPAN_PX {
        return;
    }
    output[..RING_RADIUS_PX].fill(0);
    output[width - RING_RADIUS_PX..].fill(0);
    let last = width - SPAN_PX;
    let mut start = 0;
    loop {
        let mut window: Window = [&[0; SPAN_PX]; RING_ROWS];
        for (window, row) in window.iter_mut().zip(rows) {
            let Some(span) = row.get(start..start + SPAN_PX).and_then(|span| span.try_into().ok())
            else {
                return;
            };
            *window = span;
        }
        let middle = start + RING_RADIUS_PX;
        let Some(output) = output.get_mut(middle..middle + BLOCK_PX) else { return };
        if may_hold_a_corner(&window, threshold) {
            block_strengths(&window, threshold, output);
        } else {
            output.fill(0);
        }
        if start == last {
            return;
        }
        // The last block overlaps the one before it.
        start = (start + BLOCK_PX).min(last);
    }
}

/// Nine neighbours in a row hold two of the four in the directions of the compass that follow one another, and these
/// must be brighter or darker as well: whether that is so anywhere in the block.
#[inline(always)]
fn may_hold_a_corner(window: &Window, threshold: u8) -> bool {
    let mut most = 0_u8;
    for i in 0..BLOCK_PX {
        let centre = window[3][i + 3];
        let (north, south) = (window[0][i + 3], window[6][i + 3]);
        let (west, east) = (window[3][i], window[3][i + 6]);
        let bright = north.max(south).min(west.max(east)).saturating_sub(centre);
        let dark = centre.saturating_sub(north.min(south).max(west.min(east)));
        most = most.max(bright.max(dark));
    }
    most > threshold
}

/// The strengths of a block: over all sixteen arcs of nine pixels, the darkest pixel of the brightest arc less the
/// centre, or the centre less the brightest pixel of the darkest arc.
#[inline(always)]
fn block_strengths(window: &Window, threshold: u8, output: &mut [u8]) {
    let [r0, r1, r2, r3, r4, r5, r6] = *window;
    for (i, output) in output.iter_mut().enumerate().take(BLOCK_PX) {
        let centre = r3[i + 3];
        // Clockwise from the north.
        let ring = [
            r0[i + 3],
            r0[i + 4],
            r1[i + 5],
            r2[i + 6],
            r3[i + 6],
            r4[i + 6],
            r5[i + 5],
            r6[i + 4],
            r6[i + 3],
            r6[i + 2],
            r5[i + 1],
            r4[i],
            r3[i],
            r2[i],
            r1[i + 1],
            r0[i + 2],
        ];
        let brightest_arc = best_arc::<true>(&ring);
        let darkest_arc = best_arc::<false>(&ring);
        let strength = brightest_arc.saturating_sub(centre).max(centre.saturating_sub(darkest_arc));
        *output = if strength > threshold { strength } else { 0 };
    }
}

/// The best of the sixteen arcs of nine pixels: the darkest pixel of the brightest arc, or the reverse. Two
/// arcs each share eight pixels, and differ in the one at either end. Plain loops of a known length: closures would
/// not become vectors.
#[inline(always)]
fn best_arc<const BRIGHT: bool>(ring: &[u8; 16]) -> u8 {
    let mut pairs = [0; 8];
    for k in 0..8 {
        pairs[k] = worse::<BRIGHT>(ring[2 * k + 1], ring[(2 * k + 2) % 16]);
    }
    let mut fours = [0; 8];
    for k in 0..8 {
        fours[k] = worse::<BRIGHT>(pairs[k], pairs[(k + 1) % 8]);
    }
    let mut best = if BRIGHT { 0 } else { u8::MAX };
    for k in 0..8 {
        let eight = worse::<BRIGHT>(fours[k], fours[(k + 2) % 8]);
        let end = better::<BRIGHT>(ring[2 * k], ring[(2 * k + 9) % 16]);
        best = better::<BRIGHT>(best, worse::<BRIGHT>(eight, end));
    }
    best
}

#[inline(always)]
fn better<const BRIGHT: bool>(a: u8, b: u8) -> u8 {
    if BRIGHT {
        if a > b { a } else { b }
    } else if a < b {
        a
    } else {
        b
    }
}

#[inline(always)]
fn worse<const BRIGHT: bool>(a: u8, b: u8) -> u8 {
    if BRIGHT {
        if a < b { a } else { b }
    } else if a > b {
        a
    } else {
        b
    }
}
