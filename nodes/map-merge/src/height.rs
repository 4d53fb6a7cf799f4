//! By how much one map may lie above another: where the level surfaces of both, floors above all, are at one height.

use std::collections::BTreeMap;

use crate::saved_map::{Lie, PreparedMap};

/// The bins of heights: as thick as a floor with its noise.
const BIN_M: f64 = 0.05;
/// A height comes into question when the level surfaces agree at it by this share of the best: floor upon floor, and not a table, nor
/// the floor of one upon the ceiling of the other where both have both.
const LEAST_SHARE: f64 = 0.7;
/// Heights nearer to each other than this end at the same one in the registration.
const APART_BINS: i64 = 6;
/// No more are tried: as many floors of a building, seen through their stairs.
const MOST: usize = 3;

/// The shifts along z, in metres, that bring the level surfaces of `b` to those of `a`: the best first.
pub(crate) fn shifts_m(a: &PreparedMap, b: &PreparedMap) -> Vec<f64> {
    let is_sided = a.is_sided && b.is_sided;
    let [of_a, of_b] = [a, b].map(|map| {
        let mut bins: BTreeMap<(bool, i64), f64> = BTreeMap::new();
        for piece in map.lying(Lie::Level) {
            let bin = (piece.place_m.z / BIN_M).floor() as i64;
            *bins.entry((is_sided && piece.normal.z < 0.0, bin)).or_default() +=
                map.edge_m * map.edge_m;
        }
        bins
    });
    let mut agreement: BTreeMap<i64, f64> = BTreeMap::new();
    for ((side_a, bin_a), area_a) in &of_a {
        for ((side_b, bin_b), area_b) in &of_b {
            if side_a == side_b {
                *agreement.entry(bin_a - bin_b).or_default() += area_a * area_b;
            }
        }
    }
    let mut ranked: Vec<(i64, f64)> = agreement.into_iter().collect();
    ranked.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    let least = ranked.first().map_or(0.0, |(_, best)| LEAST_SHARE * best);
    let mut found: Vec<i64> = Vec::new();
    for (shift, _) in ranked.into_iter().take_while(|(_, agreement)| *agreement >= least) {
        if found.len() < MOST && found.iter().all(|other| (other - shift).abs() >= APART_BINS) {
            found.push(shift);
        }
    }
    if found.is_empty() {
        found.push(0);
    }
    found.into_iter().map(|shift| shift as f64 * BIN_M).collect()
}

#[cfg(test)]
mod tests {
    use estimation::Serial;
    use geometry::OrientedPoints;
    use nalgebra::Point3;

    use super::*;
    use crate::saved_map::SavedMap;

    /// A floor at a height, and a table half as large 0.75 m above it.
    fn floor(height_m: f32) -> PreparedMap {
        let at = |cell: i32| cell as f32 * 0.05;
        let lattice = || (0..60).flat_map(|a| (0..60).map(move |b| (at(a), at(b))));
        let table =
            lattice().filter(|(x, _)| *x < 1.5).map(|(x, y)| Point3::new(x, y, height_m + 0.75));
        let points_m = lattice().map(|(x, y)| Point3::new(x, y, height_m)).chain(table).collect();
        let points = OrientedPoints { points_m, ..OrientedPoints::default() };
        let map = SavedMap { points, views: Vec::new(), edge_m: 0.05 };
        PreparedMap::new(&map, &Serial).unwrap()
    }

    #[test]
    fn floors_meet_and_a_table_does_not_meet_a_floor() {
        let (a, b) = (floor(-1.02), floor(0.31));
        let found = shifts_m(&a, &b);
        let level =
            |map: &PreparedMap, z_m: f64| (map.level_from_map * Point3::new(0.0, 0.0, z_m)).z;
        let expected_m = level(&a, -1.02) - level(&b, 0.31);
        assert!(found.len() == 1 && (found[0] - expected_m).abs() <= BIN_M, "{found:?}");
    }
}
