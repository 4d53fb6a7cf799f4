//! How far each beam shows free space for sure.
//!
//! A beam is filed under a bearing that is off by up to half a step, is measured from a pose that is off by a
//! little, and ends at a range that is off by its noise. What it passed is therefore sure only as far as
//! every return of the same scan that could lie on its path, given these errors, is farther away: the
//! region that the scan sees, reduced by the errors at its rim. That takes care of depth edges (a beam
//! that passes an object closely does not show the space beside it), of walls seen grazingly, and of
//! parallax, by one rule.

use super::deskewed_scan::DeskewedScan;

/// A return reduces the clear range of the beams beside it up to so many places away; with more beams in the angle of the
/// error the outermost are left out. It bounds the work for scanners of very fine steps.
const MOST_PLACES: f64 = 64.0;

/// The distance up to which each beam of `scan` shows free space for sure: none for a beam without a
/// return, which may have been swallowed by anything, and at most `reach_m`. `margin_m` is left before each
/// return.
pub(super) fn clear_distances_m(scan: &DeskewedScan, margin_m: f64, reach_m: f64) -> Vec<f64> {
    let mut clear_m: Vec<f64> =
        scan.beams.iter().map(|beam| if beam.hit.is_some() { reach_m } else { 0.0 }).collect();
    for (index, beam) in scan.beams.iter().enumerate() {
        let Some(hit) = &beam.hit else { continue };
        let range_m = f64::from(hit.range_m);
        let limit_m = (range_m - hit.error_m - margin_m).max(0.0);
        // One step is what two bearings, each off by half a step, may come closer.
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
        // Round the seam of a full scan.
        ranges_m[0] = 1.0;
        let scan = static_scan(&StaticPlatform::default(), &ranges_m);
        assert!(clear_distances_m(&scan, 0.05, 8.0)[359] < 1.0);
    }
}
