//! The distance up to which each beam certainly shows free space.
//!
//! The bearing of a beam has an error of up to half a step, its pose has an error, and its range has noise. The beam
//! therefore certainly passed free space only as far as every return of the same scan that could lie on its path, given
//! these errors, is farther away: the visible region of the scan, reduced by the errors at its boundary. This one rule
//! covers depth edges (a beam that passes an object closely does not show the space beside it), walls seen at grazing
//! angles, and parallax.

use super::deskewed_scan::DeskewedScan;

/// A return reduces the clear range of at most so many beams at each side, even if more are within the angle of the error.
/// It bounds the computing time for scanners with very fine steps.
const MOST_PLACES: f64 = 64.0;

/// The distance up to which each beam of `scan` certainly shows free space: 0 for a beam without a return, which any
/// dark surface may have absorbed, and at most `reach_m`. `margin_m` is kept before each return.
pub(super) fn clear_distances_m(scan: &DeskewedScan, margin_m: f64, reach_m: f64) -> Vec<f64> {
    let mut clear_m: Vec<f64> =
        scan.beams.iter().map(|beam| if beam.hit.is_some() { reach_m } else { 0.0 }).collect();
    for (index, beam) in scan.beams.iter().enumerate() {
        let Some(hit) = &beam.hit else { continue };
        let range_m = f64::from(hit.range_m);
        let limit_m = (range_m - hit.error_m - margin_m).max(0.0);
        // The errors of two bearings, half a step each, add up to one step.
        let aside_rad = scan.step_rad + beam.bearing_error_rad + beam.origin_error_m / range_m;
        let places = (aside_rad / scan.step_rad).min(MOST_PLACES).floor() as isize;
        for offset in -places..=places {
            if let Some(place) = scan.neighbour(index, offset)
                && limit_m < clear_m[place]
            {
                clear_m[place] = limit_m;
            }
        }
    }
    clear_m
}

#[cfg(test)]
mod tests {
    use super::super::testing::{StaticPlatform, static_scan};
    use super::*;

    #[test]
    fn an_object_reduces_the_clear_range_beside_it_and_a_gap_shows_nothing() {
        let mut ranges_m = vec![4.0_f32; 360];
        ranges_m[180] = 2.0;
        ranges_m[200] = f32::INFINITY;
        let scan = static_scan(&StaticPlatform::default(), &ranges_m);
        let clear_m = clear_distances_m(&scan, 0.05, 8.0);
        let before_m = |beam: usize| {
            let hit = scan.beams[beam].hit.unwrap();
            f64::from(hit.range_m) - hit.error_m - 0.05
        };
        assert_eq!(clear_m[180], before_m(180));
        assert_eq!((clear_m[179], clear_m[181]), (before_m(180), before_m(180)));
        assert_eq!((clear_m[178], clear_m[182]), (before_m(178), before_m(182)));
        assert_eq!(clear_m[200], 0.0);
        // Across the seam of a full scan.
        ranges_m[0] = 1.0;
        let scan = static_scan(&StaticPlatform::default(), &ranges_m);
        assert!(clear_distances_m(&scan, 0.05, 8.0)[359] < 1.0);
    }
}
