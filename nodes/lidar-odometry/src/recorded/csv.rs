//! The files of Road LiDAR's section 2.4, option C: a line for each revolution, the time in milliseconds first, then
//! a value for each shot (three in the file of coordinates).

use std::f64::consts::TAU;
use std::fmt;

use geometry::{LidarReturn, Revolution, Stamp};
use nalgebra::Point3;

use super::columns::{Row, organised};
use crate::packets::{Calibration, Model};

/// One of the files.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum CsvFile {
    /// `x y z` of each shot, in metres.
    Coordinates,
    /// The intensity of each shot.
    Intensities,
}

impl fmt::Display for CsvFile {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Coordinates => "coordinates",
            Self::Intensities => "intensities",
        })
    }
}

/// Why files are no recording.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
pub enum CsvError {
    /// A value is no number.
    #[error("line {line} of the {file}: '{text}' is no number")]
    Number {
        /// Which file.
        file: CsvFile,
        /// Which line, from 1.
        line: usize,
        /// The text there.
        text: String,
    },
    /// The files are of different recordings.
    #[error("{coordinates} lines of coordinates, but {intensities} of intensities")]
    Lines {
        /// Lines of the one file.
        coordinates: usize,
        /// Lines of the other.
        intensities: usize,
    },
    /// The lines do not fit each other.
    #[error(
        "line {line} holds {coordinates} coordinates, three a shot, but {intensities} intensities"
    )]
    Values {
        /// Which line, from 1.
        line: usize,
        /// Values of the one file after the time.
        coordinates: usize,
        /// Values of the other after the time.
        intensities: usize,
    },
    /// The times of the two files differ.
    #[error(
        "line {line} is of {coordinates_ms} ms in the coordinates, but of {intensities_ms} ms in the intensities"
    )]
    Times {
        /// Which line, from 1.
        line: usize,
        /// The one time.
        coordinates_ms: f64,
        /// The other.
        intensities_ms: f64,
    },
}

/// The revolutions in the texts of the files of coordinates and of intensities, from a scanner of a model whose lasers
/// are in one place. Values are separated by commas, semicolons or blanks. The files of distances and angles say
/// nothing more, and are not needed.
///
/// A shot belongs to the row whose laser is nearest to its elevation; coordinates that are not finite, or all zero,
/// are no returns. The times of shots are unknown: all are 0.
///
/// Revolutions are made one by one: each has room for all shots of its scanner, 600 kB and more, however short its line is.
///
/// # Errors
/// When a value is no number, or the two files do not fit each other.
pub fn revolutions_from_csv(
    coordinates: &str,
    intensities: &str,
    model: Model,
    frame_id: &str,
) -> Result<impl Iterator<Item = Revolution> + use<>, CsvError> {
    let coordinates = lines(coordinates, CsvFile::Coordinates)?;
    let intensities = lines(intensities, CsvFile::Intensities)?;
    if coordinates.len() != intensities.len() {
        return Err(CsvError::Lines {
            coordinates: coordinates.len(),
            intensities: intensities.len(),
        });
    }
    let rows: Vec<f32> = Calibration::of_data_sheet(model)
        .row_elevations_deg()
        .iter()
        .map(|elevation_deg| elevation_deg.to_radians() as f32)
        .collect();
    let columns = (1.0 / (TURN_RATE_HZ * model.firing_period_s())) as usize;
    let pairs: Vec<(Line, Line)> = coordinates.into_iter().zip(intensities).collect();
    pairs.iter().try_for_each(|(points, intensities)| points.check(intensities))?;
    let frame_id = frame_id.to_owned();
    Ok(pairs.into_iter().filter_map(move |(points, intensities)| {
        let stamp = Stamp::default().plus_seconds(points.time_ms / 1000.0);
        let rows = points.rows(&intensities, &rows);
        organised(stamp, &frame_id, rows, columns, TAU / 2.0)
    }))
}

/// How fast the scanner is taken to turn: all that depends on it is how many columns there are.
const TURN_RATE_HZ: f64 = 10.0;

/// A line of a file.
struct Line {
    number: usize,
    time_ms: f64,
    values: Vec<f32>,
}

fn lines(text: &str, file: CsvFile) -> Result<Vec<Line>, CsvError> {
    let mut lines = Vec::new();
    for (index, text) in text.lines().enumerate() {
        let mut words = text
            .split(|c: char| matches!(c, ',' | ';') || c.is_whitespace())
            .filter(|word| !word.is_empty());
        let error = |word: &str| CsvError::Number {
            file,
            line: index + 1,
            text: word.chars().take(16).collect(),
        };
        let Some(time) = words.next() else { continue };
        let time_ms = time.parse::<f64>().ok().filter(|time_ms| time_ms.is_finite());
        let time_ms = time_ms.ok_or_else(|| error(time))?;
        let values =
            words.map(|word| word.parse().map_err(|_| error(word))).collect::<Result<_, _>>()?;
        lines.push(Line { number: index + 1, time_ms, values });
    }
    Ok(lines)
}

impl Line {
    fn check(&self, intensities: &Self) -> Result<(), CsvError> {
        if self.time_ms != intensities.time_ms {
            return Err(CsvError::Times {
                line: self.number,
                coordinates_ms: self.time_ms,
                intensities_ms: intensities.time_ms,
            });
        }
        let (coordinates, intensities) = (self.values.len(), intensities.values.len());
        if intensities.checked_mul(3) != Some(coordinates) {
            return Err(CsvError::Values { line: self.number, coordinates, intensities });
        }
        Ok(())
    }

    /// The points by rows, each row as the head turns: clockwise from behind.
    fn rows(&self, intensities: &Self, elevations_rad: &[f32]) -> Vec<Row> {
        let empty = |elevation_rad: &f32| Row { elevation_rad: *elevation_rad, points: Vec::new() };
        let mut rows: Vec<Row> = elevations_rad.iter().map(empty).collect();
        for (point, intensity) in self.values.as_chunks::<3>().0.iter().zip(&intensities.values) {
            let position_m = Point3::from(*point);
            if !geometry::is_finite(&position_m) || position_m == Point3::origin() {
                continue;
            }
            let [x_m, y_m, z_m] = *point;
            let elevation_rad = z_m.atan2(x_m.hypot(y_m));
            let nearest = rows.iter_mut().min_by(|a, b| {
                let off_rad = |row: &Row| (row.elevation_rad - elevation_rad).abs();
                off_rad(a).total_cmp(&off_rad(b))
            });
            let turned_rad = (TAU / 2.0 - f64::from(y_m).atan2(f64::from(x_m))).rem_euclid(TAU);
            if let Some(row) = nearest {
                let found = LidarReturn { position_m, intensity: *intensity, time_s: 0.0 };
                row.points.push((turned_rad, found));
            }
        }
        for row in &mut rows {
            row.points.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        }
        rows
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(coordinates: &str, intensities: &str) -> Result<Vec<Revolution>, CsvError> {
        revolutions_from_csv(coordinates, intensities, Model::Hdl32e, "velodyne")
            .map(Iterator::collect)
    }

    #[test]
    fn lines_become_revolutions() {
        // Forward at the horizon, to the right 10.67 degrees up, nothing, behind 30.67 degrees down.
        let up = 10.0 * 10.67_f64.to_radians().tan();
        let down = -10.0 * 30.67_f64.to_radians().tan();
        let coordinates =
            format!("1500,10,0,0,0,-10,{up},0,0,0,-10,0.01,{down}\n\n1600.5;1;2;nan\n");
        let revolutions = read(&coordinates, "1500,7,8,9,10\n1600.5;3\n").unwrap();
        assert_eq!(revolutions.len(), 2);
        let first = &revolutions[0];
        assert_eq!((first.rows(), first.columns()), (32, 2170));
        assert_eq!(first.stamp, Stamp::from_secs_nanos(1, 500_000_000));
        let found: Vec<_> = (0..32)
            .flat_map(|row| (0..first.columns()).map(move |column| (row, column)))
            .filter_map(|(row, column)| Some((row, column, first.at(row, column)?.intensity)))
            .collect();
        // From behind clockwise: forward half round, the right after three quarters.
        assert_eq!(found, [(0, 1627, 8.0), (8, 1085, 7.0), (31, 0, 10.0)]);
        assert_eq!(revolutions[1].measured().count(), 0);
    }

    #[test]
    fn what_is_wrong_is_said() {
        let error = |a: &str, b: &str| read(a, b).unwrap_err().to_string();
        assert_eq!(error("1,2,x,4", "1,2"), "line 1 of the coordinates: 'x' is no number");
        assert_eq!(error("1,2,3,4", "inf,2"), "line 1 of the intensities: 'inf' is no number");
        assert_eq!(error("1,2,3,4\n2", "1,2"), "2 lines of coordinates, but 1 of intensities");
        assert_eq!(
            error("1,2,3,4", "1,2,3"),
            "line 1 holds 3 coordinates, three a shot, but 2 intensities"
        );
        assert!(error("1,2,3,4", "2,2").contains("1 ms in the coordinates, but of 2 ms"));
        assert_eq!(read("", "").unwrap(), []);
    }
}
