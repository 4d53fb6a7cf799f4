//! The distance up to which each beam certainly shows free space.
//!
//! The bearing of a beam has an error of up to half a step, and its range has noise. The beam therefore certainly passed free space
//! only as far as the returns of the beams beside it are: the visible region of the scan, reduced at its boundary. This one rule
//! covers depth edges (a beam that passes an object closely does not show the space beside it) and walls seen at grazing angles.
//! Errors of the pose are in those of the returns.

use super::deskewed_scan::DeskewedScan;

/// The distance up to which each beam of `scan` certainly shows free space: 0 for a beam without a return, which any
/// dark surface may have absorbed, and at most `reach_m`. `margin_m` is kept before each return.
pub(super) fn clear_distances_m(scan: &DeskewedScan, margin_m: f64, reach_m: f64) -> Vec<f64> {
    let mut clear_m: Vec<f64> =
        scan.beams.iter().map(|beam| if beam.hit.is_some() { reach_m } else { 0.0 }).collect();
    for (index, beam) in scan.beams.iter().enumerate() {
        let Some(hit) = &beam.hit else { continue };
        let limit_m = (f64::from(hit.range_m) - hit.error_m - margin_m).max(0.0);
        // The errors of two bearings, half a step each, add up to one step.
        for offset in -1..=1 {
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
