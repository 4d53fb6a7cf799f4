//! Trajectories as text: the formats of the TUM RGB-D benchmark, of KITTI odometry, and of EuRoC.
//!
//! | format | columns | recognised by |
//! |---|---|---|
//! | TUM | seconds (ORB-SLAM3: nanoseconds) x y z qx qy qz qw | 8 columns between blanks |
//! | KITTI | the upper three rows of the pose's matrix, row by row; no stamps | 12 columns between blanks |
//! | EuRoC | nanoseconds, x, y, z, qw, qx, qy, qz, and others that are ignored | 8 columns or more between commas |
//!
//! `#` begins a comment. A first line without any number is a header: between commas its names say where the quaternion's w is, as
//! OKVIS2 has it at the end. Lines may end with CR LF.
//! A pose with a non-finite number is not an error, since trackers write such poses when they are lost; it is counted.
#![cfg_attr(not(test), deny(clippy::indexing_slicing))]

mod header;
mod number;
#[cfg(test)]
mod tests;

use geometry::Stamp;
use nalgebra::{Matrix3, Rotation3, SVD, UnitQuaternion};
use serde::Serialize;

use self::header::{QuaternionOrder, commented_order, order};
use self::number::{decimal_seconds, integer_nanoseconds, number, tum_stamp};
use super::path::{RawPose, Trajectory};

/// How far a printed matrix may be from a rotation, by the entries of `R^T R - I`: seven digits leave 1e-6.
const LARGEST_DEVIATION: f64 = 1e-2;
/// The most iterations of the decomposition of a 3x3 matrix; ten are usual.
const MOST_SVD_ROUNDS: usize = 1000;
/// The most characters of a malformed line in an error message.
const SHOWN_CHARACTERS: usize = 60;

const TUM_COLUMNS: usize = 8;
const KITTI_COLUMNS: usize = 12;
const EUROC_COLUMNS: usize = 8;

/// The format of a trajectory.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum TrajectoryFormat {
    /// That of the TUM RGB-D benchmark.
    Tum,
    /// That of KITTI odometry.
    Kitti,
    /// That of EuRoC.
    Euroc,
}

impl TrajectoryFormat {
    /// Its name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Tum => "TUM",
            Self::Kitti => "KITTI",
            Self::Euroc => "EuRoC",
        }
    }
}

/// A trajectory and the format of its text.
#[derive(Clone, PartialEq, Debug)]
pub struct ParsedTrajectory {
    /// The format.
    pub format: TrajectoryFormat,
    /// The trajectory.
    pub trajectory: Trajectory,
}

/// A text is not a trajectory. Lines count from 1.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
pub enum ParseError {
    /// There is no line with a pose.
    #[error("it contains no poses")]
    Empty,
    /// A line is not UTF-8.
    #[error("line {line}: not UTF-8 text")]
    NotText {
        /// The line.
        line: usize,
    },
    /// No format has such a first line.
    #[error(
        "line {line}: {columns} columns are not a known trajectory format (TUM has 8 between blanks, KITTI 12, EuRoC 8 \
         or more between commas): '{text}'"
    )]
    UnknownFormat {
        /// The line.
        line: usize,
        /// Its columns.
        columns: usize,
        /// Its beginning.
        text: String,
    },
    /// A line has another number of columns than its format.
    #[error("line {line}: {found} columns, but a line of {} has {wanted}", format.name())]
    Columns {
        /// The line.
        line: usize,
        /// The format of the lines before.
        format: TrajectoryFormat,
        /// The number of columns that it should have.
        wanted: usize,
        /// The number of columns that it has.
        found: usize,
    },
    /// The names of a header's columns are not those of a pose.
    #[error(
        "line {line}: the header calls columns 2 to 8 '{text}', but x, y, z and then qw, qx, qy, qz or qx, qy, qz, qw are \
         read between commas"
    )]
    Header {
        /// The line.
        line: usize,
        /// The names.
        text: String,
    },
    /// A column is not a number.
    #[error("line {line}, column {column}: '{text}' is not a number")]
    NotANumber {
        /// The line.
        line: usize,
        /// The column, from 1.
        column: usize,
        /// Its text.
        text: String,
    },
    /// A stamp is invalid in this format.
    #[error("line {line}: '{text}' is not a stamp in {wanted}")]
    Stamp {
        /// The line.
        line: usize,
        /// The text in place of the stamp.
        text: String,
        /// The stamps of the format.
        wanted: &'static str,
    },
    /// A matrix is not a rotation.
    #[error("line {line}: the left three columns of the matrix are not a rotation")]
    NoRotation {
        /// The line.
        line: usize,
    },
}

/// Reads a trajectory; its format is recognised by its first line.
///
/// # Errors
/// When a line does not have the format; see [`ParseError`].
pub fn parse_trajectory(text: &[u8]) -> Result<ParsedTrajectory, ParseError> {
    let mut format = None;
    let mut stamped: Vec<(Stamp, RawPose)> = Vec::new();
    let mut numbered: Vec<RawPose> = Vec::new();
    let mut is_first = true;
    // That of EuRoC.
    let mut quaternion = commented_order(text).unwrap_or(QuaternionOrder::Wxyz);
    for row in rows(text) {
        let row = row?;
        if std::mem::take(&mut is_first) && row.is_header() {
            if row.format() == Ok(TrajectoryFormat::Euroc) {
                quaternion = row.order()?;
            }
            continue;
        }
        let format = match format {
            Some(format) => format,
            None => *format.insert(row.format()?),
        };
        row.check_columns(format)?;
        match format {
            TrajectoryFormat::Tum => {
                stamped.push((row.stamp("seconds", tum_stamp)?, row.pose(QuaternionOrder::Xyzw)?));
            }
            TrajectoryFormat::Euroc => {
                let stamp = row.stamp("whole nanoseconds", integer_nanoseconds)?;
                stamped.push((stamp, row.pose(quaternion)?));
            }
            TrajectoryFormat::Kitti => numbered.push(row.matrix()?),
        }
    }
    let format = format.ok_or(ParseError::Empty)?;
    let trajectory = match format {
        TrajectoryFormat::Kitti => Trajectory::numbered(numbered),
        TrajectoryFormat::Tum | TrajectoryFormat::Euroc => Trajectory::stamped(stamped),
    };
    Ok(ParsedTrajectory { format, trajectory })
}

/// Reads the stamps of a sequence's frames in seconds, one per line, as in KITTI's `times.txt`.
///
/// # Errors
/// When a line is not a stamp.
pub fn parse_stamps(text: &[u8]) -> Result<Vec<Stamp>, ParseError> {
    rows(text)
        .map(|row| {
            let row = row?;
            let [text] = row.columns[..] else {
                return Err(row.no_stamp(row.columns.join(" ").as_str(), "seconds, one per line"));
            };
            decimal_seconds(text).ok_or_else(|| row.no_stamp(text, "seconds"))
        })
        .collect()
}

/// A line with content.
struct Row<'a> {
    line: usize,
    columns: Vec<&'a str>,
    has_commas: bool,
}

/// The lines that are neither empty nor comments.
fn rows(text: &[u8]) -> impl Iterator<Item = Result<Row<'_>, ParseError>> {
    // Some editors begin a file with a byte order mark.
    let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text);
    text.split(|byte| *byte == b'\n').zip(1..).filter_map(|(bytes, line)| {
        let Ok(text) = std::str::from_utf8(bytes) else {
            return Some(Err(ParseError::NotText { line }));
        };
        let content = text.split('#').next().unwrap_or_default().trim();
        if content.is_empty() {
            return None;
        }
        let has_commas = content.contains(',');
        let columns = if has_commas {
            let content = content.strip_suffix(',').unwrap_or(content);
            content.split(',').map(str::trim).collect()
        } else {
            content.split_whitespace().collect()
        };
        Some(Ok(Row { line, columns, has_commas }))
    })
}

impl Row<'_> {
    fn is_header(&self) -> bool {
        self.columns.iter().all(|text| number(text).is_none())
    }

    /// The order that a header's names say.
    fn order(&self) -> Result<QuaternionOrder, ParseError> {
        order(&self.columns).ok_or_else(|| {
            let names = self.columns.get(1..EUROC_COLUMNS).unwrap_or_default();
            ParseError::Header { line: self.line, text: shown(&names.join(", ")) }
        })
    }

    fn format(&self) -> Result<TrajectoryFormat, ParseError> {
        match (self.has_commas, self.columns.len()) {
            (false, TUM_COLUMNS) => Ok(TrajectoryFormat::Tum),
            (false, KITTI_COLUMNS) => Ok(TrajectoryFormat::Kitti),
            (true, EUROC_COLUMNS..) => Ok(TrajectoryFormat::Euroc),
            (has_commas, columns) => {
                let text = self.columns.join(if has_commas { "," } else { " " });
                Err(ParseError::UnknownFormat { line: self.line, columns, text: shown(&text) })
            }
        }
    }

    fn check_columns(&self, format: TrajectoryFormat) -> Result<(), ParseError> {
        let found = self.columns.len();
        let (wanted, is_good) = match format {
            TrajectoryFormat::Tum => (TUM_COLUMNS, found == TUM_COLUMNS),
            TrajectoryFormat::Kitti => (KITTI_COLUMNS, found == KITTI_COLUMNS),
            TrajectoryFormat::Euroc => (EUROC_COLUMNS, found >= EUROC_COLUMNS),
        };
        if is_good && self.has_commas == (format == TrajectoryFormat::Euroc) {
            return Ok(());
        }
        Err(ParseError::Columns { line: self.line, format, wanted, found })
    }

    /// `N` columns from the given one on, from 0.
    fn numbers<const N: usize>(&self, first: usize) -> Result<[f64; N], ParseError> {
        let mut numbers = [0.0; N];
        for (value, index) in numbers.iter_mut().zip(first..) {
            let text = self.columns.get(index).copied().unwrap_or_default();
            *value = number(text).ok_or_else(|| ParseError::NotANumber {
                line: self.line,
                column: index + 1,
                text: shown(text),
            })?;
        }
        Ok(numbers)
    }

    /// The stamp in the first column.
    fn stamp(
        &self,
        wanted: &'static str,
        read: fn(&str) -> Option<Stamp>,
    ) -> Result<Stamp, ParseError> {
        let text = self.columns.first().copied().unwrap_or_default();
        read(text).ok_or_else(|| self.no_stamp(text, wanted))
    }

    fn no_stamp(&self, text: &str, wanted: &'static str) -> ParseError {
        ParseError::Stamp { line: self.line, text: shown(text), wanted }
    }

    /// The position and the quaternion after the stamp.
    fn pose(&self, quaternion: QuaternionOrder) -> Result<RawPose, ParseError> {
        let position_m = self.numbers(1)?;
        Ok(RawPose { position_m, quaternion_xyzw: quaternion.xyzw(self.numbers(4)?) })
    }

    /// The pose of a matrix of three rows and four columns.
    fn matrix(&self) -> Result<RawPose, ParseError> {
        let numbers: [f64; KITTI_COLUMNS] = self.numbers(0)?;
        let [a, b, c, x, d, e, f, y, g, h, i, z] = numbers;
        let position_m = [x, y, z];
        if numbers.iter().any(|value| !value.is_finite()) {
            return Ok(RawPose { position_m, quaternion_xyzw: [f64::NAN; 4] });
        }
        let rotation = nearest_rotation(&Matrix3::new(a, b, c, d, e, f, g, h, i))
            .ok_or(ParseError::NoRotation { line: self.line })?;
        let numbers = UnitQuaternion::from_rotation_matrix(&rotation);
        Ok(RawPose { position_m, quaternion_xyzw: [numbers.i, numbers.j, numbers.k, numbers.w] })
    }
}

/// The rotation nearest to a rounded matrix.
fn nearest_rotation(matrix: &Matrix3<f64>) -> Option<Rotation3<f64>> {
    let deviation = (matrix.transpose() * matrix - Matrix3::identity()).amax();
    if !(deviation <= LARGEST_DEVIATION && matrix.determinant() > 0.0) {
        return None;
    }
    let svd = SVD::try_new(*matrix, true, true, f64::EPSILON, MOST_SVD_ROUNDS)?;
    Some(Rotation3::from_matrix_unchecked(svd.u? * svd.v_t?))
}

fn shown(text: &str) -> String {
    let mut shown: String = text.chars().take(SHOWN_CHARACTERS).collect();
    if shown.len() < text.len() {
        shown.push_str("...");
    }
    shown
}
