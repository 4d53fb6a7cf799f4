//! Points of a row to columns by azimuth.

use std::f64::consts::{PI, TAU};

use geometry::{LidarReturn, Revolution, Stamp};
use nalgebra::Point3;

/// A row of points in the order in which the head passed them.
#[derive(Clone, Debug, Default)]
pub(super) struct Row {
    pub(super) elevation_rad: f32,
    /// Each with how far the head had turned from the first column, within 0 .. 2 pi.
    pub(super) points: Vec<(f64, LidarReturn)>,
}

/// The revolution of rows, the highest first: as many columns as requested, or as the longest row has points if that
/// is more. A point goes to the column of its angle, or to the next free one: rows keep their order and lose nothing.
/// The head starts at `first_azimuth_rad` and turns clockwise.
pub(super) fn organised(
    stamp: Stamp,
    frame_id: &str,
    rows: Vec<Row>,
    least_columns: usize,
    first_azimuth_rad: f64,
) -> Option<Revolution> {
    let longest = rows.iter().map(|row| row.points.len()).max().unwrap_or(0);
    let columns = least_columns.max(longest);
    let step_rad = TAU / columns.max(1) as f64;
    let azimuth_rad = |column: usize| {
        let azimuth_rad = first_azimuth_rad - (column as f64 + 0.5) * step_rad;
        ((azimuth_rad + PI).rem_euclid(TAU) - PI) as f32
    };
    let mut returns = vec![None; rows.len() * columns];
    for (row, cells) in rows.iter().zip(returns.chunks_mut(columns.max(1))) {
        for ((_, found), column) in row.points.iter().zip(row.columns(columns, step_rad)) {
            if let Some(cell) = cells.get_mut(column) {
                *cell = Some(*found);
            }
        }
    }
    let elevations_rad = rows.iter().map(|row| row.elevation_rad).collect();
    let azimuths_rad = (0..columns).map(azimuth_rad).collect();
    Revolution::new(stamp, frame_id.to_owned(), elevations_rad, azimuths_rad, returns).ok()
}

impl Row {
    /// Where its points are.
    pub(super) fn positions_m(&self) -> impl Iterator<Item = Point3<f32>> {
        self.points.iter().map(|(_, found)| found.position_m)
    }

    /// The column of each point: rising, all different, below `columns`.
    fn columns(&self, columns: usize, step_rad: f64) -> Vec<usize> {
        let mut next_free = 0;
        let mut found: Vec<usize> = self
            .points
            .iter()
            .map(|(turned_rad, _)| {
                let column = ((turned_rad / step_rad) as usize).max(next_free);
                next_free = column + 1;
                column
            })
            .collect();
        // Columns that were pushed over the end go back.
        let mut last_free = columns;
        for column in found.iter_mut().rev() {
            last_free = last_free.saturating_sub(1);
            last_free = last_free.min(*column);
            *column = last_free;
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;
    use proptest::prelude::*;

    use super::*;

    fn row(turned_rad: &[f64]) -> Row {
        let point = |(index, turned_rad): (usize, &f64)| {
            let position_m = Point3::new(index as f32, 0.0, 0.0);
            (*turned_rad, LidarReturn { position_m, intensity: 0.0, time_s: 0.0 })
        };
        Row { elevation_rad: 0.0, points: turned_rad.iter().enumerate().map(point).collect() }
    }

    proptest! {
        #[test]
        fn no_point_is_lost_and_the_order_stays(
            turned_rad in proptest::collection::vec(-0.1..6.4_f64, 0..60),
            least in 0..80_usize,
        ) {
            let row = row(&turned_rad);
            let revolution = organised(Stamp::default(), "", vec![row], least, 0.0).unwrap();
            prop_assert_eq!(revolution.columns(), least.max(turned_rad.len()));
            let found: Vec<usize> = revolution.measured().map(|found| found.position_m.x as usize).collect();
            prop_assert_eq!(found, (0..turned_rad.len()).collect::<Vec<_>>());
        }
    }

    #[test]
    fn points_stand_in_the_column_of_their_angle() {
        let step_rad = TAU / 8.0;
        let points = row(&[0.1, 1.5 * step_rad, 1.6 * step_rad, 7.9 * step_rad]);
        let revolution = organised(Stamp::default(), "", vec![points], 8, 0.0).unwrap();
        let columns: Vec<usize> =
            (0..8).filter(|column| revolution.at(0, *column).is_some()).collect();
        assert_eq!(columns, [0, 1, 2, 7]);
        // Clockwise from forward.
        assert!((f64::from(revolution.azimuths_rad()[0]) + 0.5 * step_rad).abs() < 1e-6);
        assert!((f64::from(revolution.azimuths_rad()[7]) - 0.5 * step_rad).abs() < 1e-6);
    }
}
