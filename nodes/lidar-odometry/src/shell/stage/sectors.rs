//! Whether clouds are whole turns of the scanner, or parts of them: then each sees another sector than the one before.

use nalgebra::Point3;

/// The horizon in parts: a bit of a number for each.
const PARTS: f32 = 120.0;
/// Clouds with less than this share of their parts in common see different sectors. Lasers of one moment look up to 16 degrees apart, so that
/// neighbouring sectors overlap.
const LEAST_IN_COMMON: f64 = 1.0 / 3.0;
/// So many in a row are no chance.
const OTHERS_IN_A_ROW: u32 = 3;

/// What the last clouds saw of the horizon.
#[derive(Clone, Debug, Default)]
pub(super) struct Sectors {
    last: u128,
    others_in_a_row: u32,
}

impl Sectors {
    /// Whether a cloud sees another sector than the one before.
    pub(super) fn is_another(&mut self, points_m: &[Point3<f32>]) -> bool {
        let now = points_m.iter().filter_map(part).fold(0, |parts, part| parts | (1_u128 << part));
        let last = std::mem::replace(&mut self.last, now);
        let fewer = last.count_ones().min(now.count_ones());
        let common = (last & now).count_ones();
        let is_another = f64::from(common) < LEAST_IN_COMMON * f64::from(fewer);
        self.others_in_a_row = if is_another { self.others_in_a_row.saturating_add(1) } else { 0 };
        is_another
    }

    /// Whether the last clouds are parts of turns.
    pub(super) fn are_parts_of_turns(&self) -> bool {
        self.others_in_a_row >= OTHERS_IN_A_ROW
    }
}

/// The part of the horizon that a point is in, along the sides of a square in place of a circle: no angle is needed.
fn part(point_m: &Point3<f32>) -> Option<u32> {
    let across = point_m.y / (point_m.x.abs() + point_m.y.abs());
    let quarters = if point_m.x < 0.0 { 2.0 - across } else { across };
    let turns = quarters.rem_euclid(4.0) / 4.0;
    turns.is_finite().then(|| ((PARTS * turns) as u32).min(PARTS as u32 - 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points of lasers that look up to so many degrees apart, while the scanner turned from one azimuth to another.
    fn cloud(from_deg: f32, to_deg: f32, apart_deg: f32) -> Vec<Point3<f32>> {
        let at = |share: f32, off_deg: f32| {
            let azimuth_rad = (from_deg + share * (to_deg - from_deg) + off_deg).to_radians();
            Point3::new(9.0 * azimuth_rad.cos(), 9.0 * azimuth_rad.sin(), off_deg)
        };
        let shares = (0..200_u16).map(|step| f32::from(step) / 200.0);
        shares
            .flat_map(|share| [at(share, 0.0), at(share, 0.5 * apart_deg), at(share, apart_deg)])
            .collect()
    }

    /// How many of clouds that follow each other see another sector, and whether they are taken for parts of turns.
    fn seen(clouds: u16, span_deg: f32, step_deg: f32, apart_deg: f32) -> (usize, bool) {
        let mut sectors = Sectors::default();
        let others = (0..clouds).filter(|number| {
            let from_deg = 77.0 + step_deg * f32::from(*number);
            sectors.is_another(&cloud(from_deg, from_deg + span_deg, apart_deg))
        });
        (others.count(), sectors.are_parts_of_turns())
    }

    /// Regression: halves and sixths of turns were followed for hundreds of metres beside the truth, without a word.
    #[test]
    fn parts_of_turns_are_told_from_turns_and_from_scanners_that_look_ahead() {
        for sectors in [2, 3, 6, 12] {
            let span_deg = 360.0 / f32::from(sectors as u8);
            assert_eq!(seen(20, span_deg, span_deg, 0.0), (19, true), "{sectors}");
        }
        // The lasers of an HDL-64E.
        assert_eq!(seen(20, 60.0, 60.0, 16.0), (19, true));
        // Turns that begin anywhere, and a scanner that does not turn.
        assert_eq!(seen(20, 360.0, 130.0, 0.0), (0, false));
        assert_eq!(seen(20, 359.0, 0.2, 16.0), (0, false));
        assert_eq!(seen(20, 70.0, 0.0, 0.0), (0, false));
    }

    #[test]
    fn clouds_without_points_and_points_above_the_scanner_say_nothing() {
        let mut sectors = Sectors::default();
        let above = [Point3::new(0.0, 0.0, 3.0), Point3::new(f32::NAN, 0.0, 0.0)];
        for points_m in [&[][..], &above, &cloud(0.0, 90.0, 0.0), &above, &cloud(180.0, 270.0, 0.0)]
        {
            assert!(!sectors.is_another(points_m));
        }
    }
}
