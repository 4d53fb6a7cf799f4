//! The list of a driver's points, organised by its rings.

use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};

use geometry::{LidarCloud, LidarReturn, Revolution};
use nalgebra::Point3;

use super::columns::{Row, organised};

/// No scanner has more lasers: rings that are more are none.
const MOST_ROWS: usize = 256;
/// Columns of a revolution: 0.2 degrees apart, as scanners fire them at ten turns a second; more where a row has more.
const COLUMNS: usize = 1800;
/// A row with more points is invalid, and would make a picture of any size.
const MOST_COLUMNS: usize = 16_384;

/// The revolution of a cloud, a row for each ring, the highest first; `None` where the cloud has no rings, has more of
/// them than any scanner, or more points in one than any turn.
///
/// Rings are sorted by where they look, whatever the driver's order. Columns go by where the points are, clockwise from behind.
#[must_use]
pub fn revolution_from_cloud(cloud: &LidarCloud) -> Option<Revolution> {
    let rings = cloud.rings.as_deref()?;
    let mut rows: BTreeMap<u16, Row> = BTreeMap::new();
    for (index, (point_m, ring)) in cloud.points_m.iter().zip(rings).enumerate() {
        let of = |list: &Option<Vec<f32>>| list.as_ref().and_then(|list| list.get(index)).copied();
        let found = LidarReturn {
            position_m: *point_m,
            intensity: of(&cloud.intensities).unwrap_or(0.0),
            time_s: of(&cloud.times_s).unwrap_or(0.0),
        };
        let azimuth_rad = f64::from(point_m.y).atan2(f64::from(point_m.x));
        rows.entry(*ring).or_default().points.push((PI - azimuth_rad, found));
        if rows.len() > MOST_ROWS {
            return None;
        }
    }
    let mut rows: Vec<Row> = rows.into_values().collect();
    if rows.iter().any(|row| row.points.len() > MOST_COLUMNS) {
        return None;
    }
    for row in &mut rows {
        row.points.sort_by(|a, b| a.0.total_cmp(&b.0));
        row.elevation_rad = middle_elevation_rad(row.positions_m());
    }
    rows.sort_by(|a, b| b.elevation_rad.total_cmp(&a.elevation_rad));
    debug_assert!(rows.iter().all(|row| row.points.iter().all(|(turned, _)| *turned <= TAU)));
    organised(cloud.stamp, &cloud.frame_id, rows, COLUMNS, PI)
}

/// The median: lasers are beside the scanner's centre, so that near points seem to be at other angles.
pub(crate) fn middle_elevation_rad(points_m: impl Iterator<Item = Point3<f32>>) -> f32 {
    let elevation_rad = |point_m: Point3<f32>| point_m.z.atan2(point_m.x.hypot(point_m.y));
    let mut elevations_rad: Vec<f32> = points_m.map(elevation_rad).collect();
    let middle = elevations_rad.len() / 2;
    if elevations_rad.is_empty() {
        return 0.0;
    }
    *elevations_rad.select_nth_unstable_by(middle, f32::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rings_in_any_order_become_rows_from_the_highest() {
        let points_m = vec![
            Point3::new(10.0, 0.0, -1.0),
            Point3::new(0.0, 10.0, 2.0),
            Point3::new(10.0, 1.0, -1.0),
            Point3::new(-9.0, 9.0, 2.5),
        ];
        let cloud = LidarCloud {
            points_m,
            rings: Some(vec![5, 0, 5, 0]),
            intensities: Some(vec![1.0, 2.0, 3.0, 4.0]),
            ..LidarCloud::default()
        };
        let revolution = revolution_from_cloud(&cloud).unwrap();
        assert_eq!((revolution.rows(), revolution.columns()), (2, COLUMNS));
        let intensities = |row: usize| -> Vec<f32> {
            revolution.row(row).iter().flatten().map(|found| found.intensity).collect()
        };
        // Clockwise from behind: first what is behind on the left.
        assert_eq!((intensities(0), intensities(1)), (vec![4.0, 2.0], vec![3.0, 1.0]));
        assert!(revolution.elevations_rad()[0] > 0.1 && revolution.elevations_rad()[1] < 0.0);
        assert_eq!(revolution_from_cloud(&LidarCloud { rings: None, ..cloud }), None);
    }

    #[test]
    fn what_no_scanner_has_is_no_revolution() {
        let many = |points: usize, rings: Vec<u16>| LidarCloud {
            points_m: vec![Point3::new(1.0, 1.0, 1.0); points],
            rings: Some(rings),
            ..LidarCloud::default()
        };
        assert_eq!(revolution_from_cloud(&many(300, (0..300).collect())), None);
        assert_eq!(revolution_from_cloud(&many(20_000, vec![7; 20_000])), None);
        assert!(revolution_from_cloud(&many(0, vec![])).is_some());
    }
}
