//! By which yaw one map may lie in another: where the walls of both run alike.

use std::f64::consts::{PI, TAU};

use crate::saved_map::{Lie, Piece, PreparedMap};

/// Bins of the azimuth of an upright surface. The two sides of a wall count alike, so that they cover half a turn.
const BINS: usize = 180;
const BIN_RAD: f64 = PI / BINS as f64;
/// A yaw comes into question from this share of the way from the mean of the correlation to its maximum on. A building of right angles
/// leaves four yaws with a degree or two around each, a round one all of them.
const LEAST_SHARE: f64 = 0.7;
/// By so much the yaw of the maximum may be off.
const UNSURE_RAD: f64 = BIN_RAD / 2.0;

/// The yaws that come into question, ascending: each turns the level frame of `b` to that of `a`. No two are nearer to each other than
/// `step_rad`, or a bin if that is more.
pub(crate) fn yaws_rad(a: &PreparedMap, b: &PreparedMap, step_rad: f64) -> Vec<f64> {
    let [a, b] = [a, b].map(|map| histogram(map.lying(Lie::Upright)));
    let correlation: Vec<f64> = (0..BINS)
        .map(|shift| (0..BINS).map(|bin| a[(bin + shift) % BINS] * b[bin]).sum())
        .collect();
    let most = correlation.iter().copied().fold(0.0, f64::max);
    let mean = correlation.iter().sum::<f64>() / BINS as f64;
    let least = mean + LEAST_SHARE * (most - mean);
    let fine = (UNSURE_RAD / step_rad).floor() as i32;
    let mut yaws_rad = Vec::new();
    for (shift, _) in correlation.iter().enumerate().filter(|(_, value)| **value >= least) {
        for half_turn in [0.0, PI] {
            let middle_rad = shift as f64 * BIN_RAD + half_turn;
            yaws_rad.extend(
                (-fine..=fine)
                    .map(|step| (middle_rad + f64::from(step) * step_rad).rem_euclid(TAU)),
            );
        }
    }
    yaws_rad.sort_by(f64::total_cmp);
    yaws_rad
}

/// How much upright surface faces each way, smoothed over a bin to either side.
fn histogram<'a>(upright: impl Iterator<Item = &'a Piece>) -> Vec<f64> {
    let mut bins = vec![0.0; BINS];
    for Piece { normal, .. } in upright {
        let in_bins = normal.y.atan2(normal.x).rem_euclid(PI) / BIN_RAD;
        let (first, share) = (in_bins as usize, in_bins.fract());
        bins[first % BINS] += 1.0 - share;
        bins[(first + 1) % BINS] += share;
    }
    let at = |bin: usize| bins[bin % BINS];
    (0..BINS).map(|bin| at(bin + BINS - 1) + 2.0 * at(bin) + at(bin + 1)).collect()
}

#[cfg(test)]
mod tests {
    use estimation::Serial;
    use geometry::OrientedPoints;
    use nalgebra::{Point3, Rotation2, Rotation3, Vector3};

    use super::*;
    use crate::saved_map::SavedMap;

    /// Two walls at a right angle.
    fn corner(yaw_rad: f64) -> PreparedMap {
        let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), yaw_rad);
        let at = |cell: i32| f64::from(cell) * 0.05;
        let lattice = (0..60).flat_map(|a| (0..40).map(move |b| (a, b)));
        let walls = lattice.flat_map(|(a, b)| {
            [Point3::new(at(a), 0.0, at(b)), Point3::new(0.0, 0.6 * at(a), at(b))]
        });
        let points_m = walls.map(|point| (turn * point).cast()).collect();
        let points = OrientedPoints { points_m, ..OrientedPoints::default() };
        let map = SavedMap { points, views: Vec::new(), edge_m: 0.05 };
        PreparedMap::new(&map, &Serial).unwrap()
    }

    #[test]
    fn the_true_yaw_is_among_those_of_right_angles() {
        for yaw_rad in [0.0, 0.3, 1.1, 2.9, 4.0, 5.5] {
            let found = yaws_rad(&corner(0.2), &corner(0.2 - yaw_rad), 0.02);
            let off_rad = |yaw: &f64| Rotation2::new(yaw - yaw_rad).angle().abs();
            let off_rad = found.iter().map(off_rad).fold(PI, f64::min);
            assert!(off_rad < BIN_RAD && found.len() < 60, "{off_rad} of {}", found.len());
        }
    }
}
