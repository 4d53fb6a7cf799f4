//! The clouds of KITTI (Geiger et al., IJRR 2013) and KITTI-360: `x y z intensity` as 32-bit floats of an HDL-64E.

use std::f64::consts::TAU;

use geometry::{LidarReturn, Revolution, Stamp};
use nalgebra::Point3;

use super::cloud::middle_elevation_rad;
use super::columns::{Row, organised};

/// Bytes of a point.
const POINT_BYTES: usize = 16;
/// Lasers of an HDL-64E.
const ROWS: usize = 64;
/// Columns of a revolution: as the scanner fires them at 10 turns a second, 0.17 degrees apart, and some to spare for
/// points that motion has pushed aside.
const COLUMNS: usize = 2250;

/// Why a file is no cloud of KITTI.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
pub enum KittiError {
    /// It ends within a point, or has none.
    #[error("{bytes} bytes are not a whole number of points of {POINT_BYTES} bytes, at least one")]
    Length {
        /// Bytes of the file.
        bytes: usize,
    },
    /// Its points are not those of an HDL-64E in the order of its lasers.
    #[error(
        "the azimuths pass forward so often that there would be {rows} rows and more; a scan of KITTI has {ROWS}, one \
         after the other, each counterclockwise from forward"
    )]
    Rows {
        /// Rows that were found before the search ended.
        rows: usize,
    },
}

/// The revolution in the bytes of a file.
///
/// The file holds one laser after the other, the highest first, each from forward counterclockwise; where a row ends,
/// the azimuth falls back. Points that are not finite, or at the scanner itself, are no returns.
///
/// The data set has taken the motion out of its clouds as far as it knew it (odometry), or says nothing of times
/// (KITTI-360): all times are 0.
///
/// # Errors
/// When it ends within a point, or the azimuths are not those of 64 rows.
pub fn revolution_from_kitti(
    bytes: &[u8],
    stamp: Stamp,
    frame_id: &str,
) -> Result<Revolution, KittiError> {
    let (points, rest) = bytes.as_chunks::<POINT_BYTES>();
    if points.is_empty() || !rest.is_empty() {
        return Err(KittiError::Length { bytes: bytes.len() });
    }
    let mut rows = vec![Row::default()];
    let mut last_turned_rad = 0.0;
    for point in points {
        let [x_m, y_m, z_m, intensity] = floats(point);
        let position_m = Point3::new(x_m, y_m, z_m);
        if !geometry::is_finite(&position_m) || position_m == Point3::origin() {
            continue;
        }
        // Counterclockwise from forward.
        let turned_rad = f64::from(y_m).atan2(f64::from(x_m)).rem_euclid(TAU);
        if turned_rad < last_turned_rad - TAU / 2.0 {
            if rows.len() == ROWS {
                return Err(KittiError::Rows { rows: rows.len() + 1 });
            }
            rows.push(Row::default());
        }
        last_turned_rad = turned_rad;
        let found = LidarReturn { position_m, intensity, time_s: 0.0 };
        if let Some(row) = rows.last_mut() {
            row.points.push((TAU - turned_rad, found));
        }
    }
    for row in &mut rows {
        row.elevation_rad = middle_elevation_rad(row.positions_m());
        // The head turns in the other direction.
        row.points.reverse();
    }
    let bytes = bytes.len();
    organised(stamp, frame_id, rows, COLUMNS, 0.0).ok_or(KittiError::Length { bytes })
}

fn floats(point: &[u8; POINT_BYTES]) -> [f32; 4] {
    let (values, _) = point.as_chunks::<4>();
    let value = |index: usize| values.get(index).map_or(f32::NAN, |v| f32::from_le_bytes(*v));
    std::array::from_fn(value)
}

#[cfg(test)]
mod tests;
