//! The common part of the two formats of point files: a header of lines, then one record a point.

mod colours;
mod parts;

use nalgebra::{Point3, Vector3};

pub(crate) use parts::Parts;

/// A file of points could not be read.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
pub enum PointFileError {
    /// The first bytes are not those of the format.
    #[error("this is no {format} file: it does not begin with '{expected}'")]
    NotThisFormat {
        /// The format that was expected.
        format: &'static str,
        /// How such a file begins.
        expected: &'static str,
    },
    /// The header breaks off.
    #[error("the header has no line '{expected}': the file is cut off or damaged")]
    UnfinishedHeader {
        /// The line that ends a header.
        expected: &'static str,
    },
    /// A line of the header does not make sense.
    #[error("line {line} of the header, '{text}': {reason}")]
    Header {
        /// Counted from 1.
        line: usize,
        /// The text there, its first 80 characters.
        text: String,
        /// What is wrong with it.
        reason: &'static str,
    },
    /// The points have no such coordinate.
    #[error("the points have no field '{field}'")]
    MissingField {
        /// x, y or z.
        field: &'static str,
    },
    /// A field of a PCD file has no kind of number, or one that does not exist.
    #[error("the lines SIZE and TYPE state no known kind of number for the field '{field}'")]
    FieldKind {
        /// The field's name, its first 80 characters.
        field: String,
    },
    /// There are fewer points than the header states.
    #[error("the header states {stated} points, but there are {found}: the file is cut off")]
    Truncated {
        /// How many points there should be.
        stated: usize,
        /// How many whole ones there are.
        found: usize,
    },
    /// The compressed points of a PCD file are not what its header states.
    #[error(
        "the header states {stated} bytes of points, but {found} are compressed: the file is cut off or damaged"
    )]
    Compressed {
        /// How many bytes there should be.
        stated: usize,
        /// How many there are.
        found: usize,
    },
    /// A number of an ASCII file is invalid.
    #[error("point {point}: '{text}' is not a number")]
    Number {
        /// Counted from 0.
        point: usize,
        /// The text there, its first 80 characters.
        text: String,
    },
    /// A point is where single precision is too coarse for it.
    #[error(
        "point {point} has the number {number}, which single precision, as maps have it, holds to {rounding_mm} mm only"
    )]
    TooFar {
        /// Counted from 0.
        point: usize,
        /// The number, as it is in the file.
        number: String,
        /// By how much it would be rounded, in whole millimetres.
        rounding_mm: u64,
    },
}

/// Numbers are rounded by no more: a tenth of the finest voxel edge, and less than any sensor's noise.
const MOST_ROUNDING_M: f64 = 0.001;

/// A number of a record in single precision.
///
/// # Errors
/// When it is too large for that.
fn single(point: usize, number: f64) -> Result<f32, PointFileError> {
    let single = number as f32;
    let rounding_m = (f64::from(single) - number).abs();
    // Of what is not finite the difference is no number.
    if rounding_m > MOST_ROUNDING_M {
        let rounding_mm = (rounding_m * 1e3).round() as u64;
        return Err(PointFileError::TooFar { point, number: number.to_string(), rounding_mm });
    }
    Ok(single)
}

impl PointFileError {
    pub(crate) fn header(line: usize, text: &str, reason: &'static str) -> Self {
        Self::Header { line, text: shortened(text), reason }
    }
}

/// Enough of a text to recognise it by.
fn shortened(text: &str) -> String {
    text.chars().take(80).collect()
}

/// A number of a binary record.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

impl Scalar {
    pub(crate) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    /// Reads from the beginning of `bytes`, least significant byte first; `None` where they do not
    /// suffice.
    fn read(self, bytes: &[u8]) -> Option<f64> {
        Some(match self {
            Self::I8 => i8::from_le_bytes(*bytes.first_chunk()?).into(),
            Self::U8 => u8::from_le_bytes(*bytes.first_chunk()?).into(),
            Self::I16 => i16::from_le_bytes(*bytes.first_chunk()?).into(),
            Self::U16 => u16::from_le_bytes(*bytes.first_chunk()?).into(),
            Self::I32 => i32::from_le_bytes(*bytes.first_chunk()?).into(),
            Self::U32 => u32::from_le_bytes(*bytes.first_chunk()?).into(),
            Self::I64 => i64::from_le_bytes(*bytes.first_chunk()?) as f64,
            Self::U64 => u64::from_le_bytes(*bytes.first_chunk()?) as f64,
            Self::F32 => f32::from_le_bytes(*bytes.first_chunk()?).into(),
            Self::F64 => f64::from_le_bytes(*bytes.first_chunk()?),
        })
    }
}

/// The points of a file, with their normals and colours.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct OrientedPoints {
    /// The points, in metres.
    pub points_m: Vec<Point3<f32>>,
    /// The normal of each; none at all where the file has none.
    pub normals: Vec<Vector3<f32>>,
    /// Red, green and blue of each; none at all where the file has none.
    pub colours: Vec<[u8; 3]>,
}

/// The encoding of the numbers after the header.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Encoding {
    Ascii,
    BinaryLittleEndian,
}

/// The offsets of the coordinates in a record.
#[derive(Clone, Debug, Default)]
pub(crate) struct RecordLayout {
    /// Offset in bytes, column in an ASCII line, and kind of x, y, z.
    coordinates: [Option<(usize, usize, Scalar)>; 3],
    /// The same of the normal.
    normal: [Option<(usize, usize, Scalar)>; 3],
    /// The same of red, green and blue, of one byte each.
    colour: [Option<(usize, usize, Scalar)>; 3],
    /// The same of the three in one number of four bytes.
    packed_colour: Option<(usize, usize, Scalar)>,
    bytes: usize,
    columns: usize,
}

impl RecordLayout {
    /// Adds a field of `count` numbers behind the others.
    pub(crate) fn push(&mut self, name: &str, scalar: Scalar, count: usize) {
        const NAMES: [&str; 3] = ["x", "y", "z"];
        /// Of PLY files, and of PCL's.
        const NORMALS: [[&str; 2]; 3] =
            [["nx", "normal_x"], ["ny", "normal_y"], ["nz", "normal_z"]];
        /// Of PLY files,
        const COLOURS: [&str; 3] = ["red", "green", "blue"];
        /// and of PCL's.
        const PACKED_COLOURS: [&str; 2] = ["rgb", "rgba"];
        if let Some(axis) = NAMES.iter().position(|&axis| axis == name) {
            self.coordinates[axis].get_or_insert((self.bytes, self.columns, scalar));
        }
        if let Some(axis) = NORMALS.iter().position(|names| names.contains(&name)) {
            self.normal[axis].get_or_insert((self.bytes, self.columns, scalar));
        }
        if let Some(part) = COLOURS.iter().position(|&part| part == name)
            && scalar == Scalar::U8
        {
            self.colour[part].get_or_insert((self.bytes, self.columns, scalar));
        }
        if PACKED_COLOURS.contains(&name)
            && matches!(scalar, Scalar::F32 | Scalar::U32 | Scalar::I32)
        {
            self.packed_colour.get_or_insert((self.bytes, self.columns, scalar));
        }
        // A wrong header may overflow; a record of that size then finds no bytes.
        self.bytes = self.bytes.saturating_add(scalar.size().saturating_mul(count));
        self.columns = self.columns.saturating_add(count);
    }

    /// The bytes of a binary record.
    pub(crate) fn bytes(&self) -> usize {
        self.bytes
    }

    /// Reads `stated` records from `body`. Points with a coordinate that is not finite mark pixels
    /// that saw nothing, and are left out.
    pub(crate) fn decode(
        &self,
        encoding: Encoding,
        body: &[u8],
        stated: usize,
    ) -> Result<Vec<Point3<f32>>, PointFileError> {
        let records = self.records(self.axes()?, encoding, body, stated)?;
        let mut points_m: Vec<Point3<f32>> = records.into_iter().map(Point3::from).collect();
        points_m.retain(crate::is_finite);
        Ok(points_m)
    }

    /// The same with a normal and a colour for each point; none where the records have none.
    pub(crate) fn decode_with_normals(
        &self,
        encoding: Encoding,
        body: &[u8],
        stated: usize,
    ) -> Result<OrientedPoints, PointFileError> {
        let [x, y, z] = self.axes()?;
        let mut points_m: Vec<Point3<f32>> = Vec::new();
        let mut normals = Vec::new();
        let mut is_finite = Vec::new();
        let mut take = |point_m: Point3<f32>| {
            is_finite.push(crate::is_finite(&point_m));
            points_m.extend(crate::is_finite(&point_m).then_some(point_m));
            crate::is_finite(&point_m)
        };
        if let [Some(nx), Some(ny), Some(nz)] = self.normal {
            for record in self.records([x, y, z, nx, ny, nz], encoding, body, stated)? {
                let [x, y, z, nx, ny, nz] = record;
                normals.extend(take(Point3::new(x, y, z)).then_some(Vector3::new(nx, ny, nz)));
            }
        } else {
            for record in self.records([x, y, z], encoding, body, stated)? {
                take(record.into());
            }
        }
        let colours = self.colours(encoding, body, stated)?.into_iter().zip(is_finite);
        let colours = colours.filter_map(|(colour, is_finite)| is_finite.then_some(colour));
        Ok(OrientedPoints { points_m, normals, colours: colours.collect() })
    }

    fn axes(&self) -> Result<[(usize, usize, Scalar); 3], PointFileError> {
        let [x, y, z] = self.coordinates;
        let missing = |field| PointFileError::MissingField { field };
        Ok([x.ok_or(missing("x"))?, y.ok_or(missing("y"))?, z.ok_or(missing("z"))?])
    }

    fn records<const N: usize>(
        &self,
        fields: [(usize, usize, Scalar); N],
        encoding: Encoding,
        body: &[u8],
        stated: usize,
    ) -> Result<Vec<[f32; N]>, PointFileError> {
        match encoding {
            Encoding::Ascii => Self::decode_ascii(fields, body, stated),
            Encoding::BinaryLittleEndian => self.decode_binary(fields, body, stated),
        }
    }

    fn decode_binary<const N: usize>(
        &self,
        fields: [(usize, usize, Scalar); N],
        body: &[u8],
        stated: usize,
    ) -> Result<Vec<[f32; N]>, PointFileError> {
        // The fields exist, so a record has bytes.
        let found = body.len() / self.bytes.max(1);
        if found < stated {
            return Err(PointFileError::Truncated { stated, found });
        }
        let number = |record: &[u8], (offset, _, scalar): (usize, usize, Scalar)| {
            record.get(offset..).and_then(|bytes| scalar.read(bytes)).unwrap_or(f64::NAN)
        };
        let records = body.chunks_exact(self.bytes.max(1)).take(stated);
        let mut singles = Vec::with_capacity(stated);
        for (point, record) in records.enumerate() {
            let mut of_record = [0.0; N];
            for (value, field) in of_record.iter_mut().zip(fields) {
                *value = single(point, number(record, field))?;
            }
            singles.push(of_record);
        }
        Ok(singles)
    }

    fn decode_ascii<const N: usize>(
        fields: [(usize, usize, Scalar); N],
        body: &[u8],
        stated: usize,
    ) -> Result<Vec<[f32; N]>, PointFileError> {
        let text = String::from_utf8_lossy(body);
        let mut records = Vec::new();
        let lines = text.lines().filter(|line| !line.trim().is_empty()).take(stated);
        for (point, line) in lines.enumerate() {
            let mut record = [0.0; N];
            for (number, (_, column, _)) in record.iter_mut().zip(fields) {
                let word = line.split_ascii_whitespace().nth(column).unwrap_or_default();
                let error = |_| PointFileError::Number { point, text: shortened(word) };
                *number = single(point, word.parse::<f64>().map_err(error)?)?;
            }
            records.push(record);
        }
        if records.len() < stated {
            return Err(PointFileError::Truncated { stated, found: records.len() });
        }
        Ok(records)
    }
}

/// A line of a header, numbered from 1.
pub(crate) type HeaderLine<'a> = (usize, &'a str);

/// The lines of a header up to and with the one that begins with `last`, and the bytes behind it.
pub(crate) fn split_header<'a>(
    bytes: &'a [u8],
    last: &'static str,
) -> Result<(Vec<HeaderLine<'a>>, &'a [u8]), PointFileError> {
    let mut lines = Vec::new();
    let mut rest = bytes;
    while let Some(end) = rest.iter().position(|&byte| byte == b'\n') {
        let (line, behind) = rest.split_at(end);
        rest = behind.get(1..).unwrap_or_default();
        // Bytes that are no text cannot belong to a header.
        let Ok(line) = std::str::from_utf8(line) else { break };
        let line = line.trim_end_matches('\r');
        lines.push((lines.len() + 1, line));
        if line.split_ascii_whitespace().next() == Some(last) {
            return Ok((lines, rest));
        }
    }
    Err(PointFileError::UnfinishedHeader { expected: last })
}

/// The coordinates of points one after the other, least significant byte first.
pub(crate) fn append_binary(bytes: &mut Vec<u8>, points_m: &[Point3<f32>]) {
    bytes.reserve(points_m.len() * 3 * size_of::<f32>());
    for value_m in points_m.iter().flat_map(|point_m| point_m.iter()) {
        bytes.extend_from_slice(&value_m.to_le_bytes());
    }
}
