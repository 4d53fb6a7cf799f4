//! One revolution of a spinning LiDAR.

use nalgebra::Point3;
use serde::{Deserialize, Serialize};

use crate::{Cloud, Stamp};

/// The organised cloud of one revolution of a LiDAR with several lasers: a row for each laser, the highest first, and
/// a column for each firing of all of them, in the order of time. Where nothing returned there is no return.
///
/// Every return was measured from where the scanner was at its own time: while the scanner moves, the revolution is
/// distorted until somebody takes the motion out.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Revolution {
    /// When the first column was measured.
    pub stamp: Stamp,
    /// The frame of the scanner: x forward, y left, z up.
    pub frame_id: String,
    elevations_rad: Vec<f32>,
    azimuths_rad: Vec<f32>,
    returns: Vec<Option<LidarReturn>>,
}

/// A return of a laser.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct LidarReturn {
    /// In the frame of the revolution, finite.
    pub position_m: Point3<f32>,
    /// In the scanner's own unit; the calibrated reflectivity of a Velodyne is 0 to 255.
    pub intensity: f32,
    /// Seconds since the stamp of the revolution.
    pub time_s: f32,
}

/// Why returns are no revolution.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
#[error("{returns} returns are not {rows} rows of {columns} columns")]
pub struct RevolutionSizeError {
    /// Returns that were given.
    pub returns: usize,
    /// Elevations that were given.
    pub rows: usize,
    /// Azimuths that were given.
    pub columns: usize,
}

impl Revolution {
    /// A revolution of returns row by row.
    ///
    /// `elevations_rad` are the rows' angles above the horizon, the highest first. `azimuths_rad` are the columns'
    /// angles about z from x towards y, where the first laser of the column looked: a single laser may have looked
    /// some degrees beside.
    ///
    /// # Errors
    /// When there are not as many returns as rows and columns say.
    pub fn new(
        stamp: Stamp,
        frame_id: String,
        elevations_rad: Vec<f32>,
        azimuths_rad: Vec<f32>,
        returns: Vec<Option<LidarReturn>>,
    ) -> Result<Self, RevolutionSizeError> {
        let (rows, columns) = (elevations_rad.len(), azimuths_rad.len());
        if rows.checked_mul(columns) != Some(returns.len()) {
            return Err(RevolutionSizeError { returns: returns.len(), rows, columns });
        }
        Ok(Self { stamp, frame_id, elevations_rad, azimuths_rad, returns })
    }

    /// Rows: the lasers.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.elevations_rad.len()
    }

    /// Columns: the firings of all lasers.
    #[must_use]
    pub fn columns(&self) -> usize {
        self.azimuths_rad.len()
    }

    /// The angle of each row above the horizon, the highest first.
    #[must_use]
    pub fn elevations_rad(&self) -> &[f32] {
        &self.elevations_rad
    }

    /// The angle of each column about z, from x towards y, within -pi .. pi.
    #[must_use]
    pub fn azimuths_rad(&self) -> &[f32] {
        &self.azimuths_rad
    }

    /// All cells, row by row.
    #[must_use]
    pub fn returns(&self) -> &[Option<LidarReturn>] {
        &self.returns
    }

    /// The cells of a row; empty where there is no such row.
    #[must_use]
    pub fn row(&self, row: usize) -> &[Option<LidarReturn>] {
        let columns = self.columns();
        if row >= self.rows() {
            return &[];
        }
        self.returns.get(row * columns..(row + 1) * columns).unwrap_or_default()
    }

    /// The return of a cell.
    #[must_use]
    pub fn at(&self, row: usize, column: usize) -> Option<&LidarReturn> {
        self.row(row).get(column)?.as_ref()
    }

    /// The returns, row by row, without empty cells.
    pub fn measured(&self) -> impl Iterator<Item = &LidarReturn> {
        self.returns.iter().flatten()
    }

    /// The same cells with other contents: `change` takes the column and what returned there.
    #[must_use]
    pub fn map(&self, mut change: impl FnMut(usize, &LidarReturn) -> Option<LidarReturn>) -> Self {
        let columns = self.columns().max(1);
        let cells = self.returns.iter().enumerate();
        let returns = cells
            .map(|(index, cell)| cell.as_ref().and_then(|found| change(index % columns, found)))
            .collect();
        Self { returns, ..self.clone_without_returns() }
    }

    /// The points alone, row by row.
    #[must_use]
    pub fn cloud(&self) -> Cloud {
        Cloud {
            stamp: self.stamp,
            frame_id: self.frame_id.clone(),
            points_m: self.measured().map(|found| found.position_m).collect(),
        }
    }

    fn clone_without_returns(&self) -> Self {
        Self {
            stamp: self.stamp,
            frame_id: self.frame_id.clone(),
            elevations_rad: self.elevations_rad.clone(),
            azimuths_rad: self.azimuths_rad.clone(),
            returns: Vec::new(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn return_at(x_m: f32) -> Option<LidarReturn> {
        Some(LidarReturn { position_m: Point3::new(x_m, 0.0, 0.0), intensity: 1.0, time_s: 0.0 })
    }

    fn two_rows_of_three() -> Revolution {
        let returns =
            vec![return_at(1.0), None, return_at(3.0), None, return_at(5.0), return_at(6.0)];
        let stamp = Stamp::from_nanos(9);
        Revolution::new(stamp, "velodyne".to_owned(), vec![0.1, -0.1], vec![0.2, 0.1, 0.0], returns)
            .unwrap()
    }

    #[test]
    fn cells_are_found_by_row_and_column() {
        let revolution = two_rows_of_three();
        assert_eq!((revolution.rows(), revolution.columns()), (2, 3));
        assert_eq!(revolution.at(1, 2).unwrap().position_m.x, 6.0);
        assert_eq!(revolution.at(0, 1), None);
        assert_eq!((revolution.at(2, 0), revolution.at(0, 3)), (None, None));
        assert_eq!(revolution.row(0).len(), 3);
        assert!(revolution.row(2).is_empty());
        assert!(revolution.row(usize::MAX).is_empty());
    }

    #[test]
    fn the_cloud_holds_what_returned() {
        let cloud = two_rows_of_three().cloud();
        let x_m: Vec<f32> = cloud.points_m.iter().map(|point| point.x).collect();
        assert_eq!(x_m, [1.0, 3.0, 5.0, 6.0]);
        assert_eq!((cloud.stamp.as_nanos(), cloud.frame_id.as_str()), (9, "velodyne"));
    }

    #[test]
    fn a_change_keeps_the_cells_and_may_drop_their_contents() {
        let left = two_rows_of_three().map(|column, found| {
            (column < 2).then_some(LidarReturn { time_s: column as f32, ..*found })
        });
        assert_eq!((left.rows(), left.columns(), left.measured().count()), (2, 3, 2));
        assert_eq!(left.elevations_rad(), [0.1, -0.1]);
        assert_eq!(left.azimuths_rad(), [0.2, 0.1, 0.0]);
        assert_eq!((left.at(0, 0).unwrap().time_s, left.at(1, 1).unwrap().time_s), (0.0, 1.0));
        assert_eq!(left.at(1, 2), None);
    }

    #[test]
    fn sizes_that_do_not_fit_are_refused() {
        let error = Revolution::new(
            Stamp::default(),
            String::new(),
            vec![0.0; 2],
            vec![0.0; 3],
            vec![None; 5],
        )
        .unwrap_err();
        assert_eq!(error.to_string(), "5 returns are not 2 rows of 3 columns");
    }
}
