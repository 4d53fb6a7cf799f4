//! The offsets of the coordinates in the records of a cloud.

use nalgebra::Point3;

use crate::convert::ConvertError;
use crate::convert::error::excerpt;
use crate::convert::rows::Rows;
use crate::sensor_msgs::{PointCloud2, PointField};

/// Datatypes of `PointField`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Datatype {
    Int8,
    Uint8,
    Int16,
    Uint16,
    Int32,
    Uint32,
    Float32,
    Float64,
}

impl Datatype {
    fn of(field: &'static str, datatype: u8) -> Result<Self, ConvertError> {
        Ok(match datatype {
            PointField::INT8 => Self::Int8,
            PointField::UINT8 => Self::Uint8,
            PointField::INT16 => Self::Int16,
            PointField::UINT16 => Self::Uint16,
            PointField::INT32 => Self::Int32,
            PointField::UINT32 => Self::Uint32,
            PointField::FLOAT32 => Self::Float32,
            PointField::FLOAT64 => Self::Float64,
            _ => return Err(ConvertError::FieldDatatype { field, datatype }),
        })
    }

    fn size_bytes(self) -> usize {
        match self {
            Self::Int8 | Self::Uint8 => 1,
            Self::Int16 | Self::Uint16 => 2,
            Self::Int32 | Self::Uint32 | Self::Float32 => 4,
            Self::Float64 => 8,
        }
    }

    /// The number at the start of `bytes`: a double holds each of them exactly.
    #[inline]
    fn read(self, bytes: &[u8], big_endian: bool) -> Option<f64> {
        macro_rules! number {
            ($number:ty) => {{
                let bytes = *bytes.first_chunk()?;
                if big_endian {
                    <$number>::from_be_bytes(bytes)
                } else {
                    <$number>::from_le_bytes(bytes)
                }
            }};
        }
        Some(match self {
            Self::Int8 => f64::from(number!(i8)),
            Self::Uint8 => f64::from(number!(u8)),
            Self::Int16 => f64::from(number!(i16)),
            Self::Uint16 => f64::from(number!(u16)),
            Self::Int32 => f64::from(number!(i32)),
            Self::Uint32 => f64::from(number!(u32)),
            Self::Float32 => f64::from(number!(f32)),
            Self::Float64 => number!(f64),
        })
    }
}

/// One field within the record of a point; it lies within it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(in crate::convert) struct FieldPlace {
    offset: usize,
    datatype: Datatype,
}

impl FieldPlace {
    /// Its number in the record of a point.
    #[inline]
    pub(in crate::convert) fn read(self, record: &[u8], big_endian: bool) -> Option<f64> {
        self.datatype.read(record.get(self.offset..)?, big_endian)
    }

    /// Its four bytes in the record of a point, as a whole number; `None` where it has another number of them.
    #[inline]
    pub(in crate::convert) fn bits(self, record: &[u8], big_endian: bool) -> Option<u32> {
        let bytes = *record.get(self.offset..)?.first_chunk()?;
        let bits = if big_endian { u32::from_be_bytes(bytes) } else { u32::from_le_bytes(bytes) };
        (self.datatype.size_bytes() == 4).then_some(bits)
    }

    /// The bytes of NaN, and where they go in the record of a point; `None` for whole numbers.
    pub(in crate::convert) fn not_a_number(
        self,
        big_endian: bool,
    ) -> Option<(std::ops::Range<usize>, [u8; 8])> {
        let size_bytes = self.datatype.size_bytes();
        let mut bytes = [0; 8];
        match (self.datatype, big_endian) {
            (Datatype::Float32, false) => front(&mut bytes, f32::NAN.to_le_bytes()),
            (Datatype::Float32, true) => front(&mut bytes, f32::NAN.to_be_bytes()),
            (Datatype::Float64, false) => bytes = f64::NAN.to_le_bytes(),
            (Datatype::Float64, true) => bytes = f64::NAN.to_be_bytes(),
            _ => return None,
        }
        Some((self.offset..self.offset + size_bytes, bytes))
    }

    /// Where a message says that a field is.
    pub(in crate::convert) fn of(
        message: &PointCloud2,
        field: &'static str,
    ) -> Result<Self, ConvertError> {
        let mut named = message.fields.iter().filter(|candidate| candidate.name == field);
        let Some(found) = named.next() else {
            let mut present = Vec::new();
            // Enough to see what the cloud is.
            const MOST: usize = 12;
            present.extend(message.fields.iter().take(MOST).map(|field| excerpt(&field.name)));
            return Err(ConvertError::MissingField { field, present: present.join(", ") });
        };
        let others = named.count();
        if others > 0 {
            return Err(ConvertError::RepeatedField { field, times: others + 1 });
        }
        let PointField { offset, datatype, count, .. } = *found;
        let datatype = Datatype::of(field, datatype)?;
        // Old drivers leave the count 0 where they mean 1.
        if count > 1 {
            return Err(ConvertError::FieldCount { field, count });
        }
        let size_bytes = datatype.size_bytes();
        let point_step = message.point_step;
        if u64::from(offset) + size_bytes as u64 > u64::from(point_step) {
            return Err(ConvertError::FieldOutsidePoint { field, offset, size_bytes, point_step });
        }
        Ok(Self { offset: offset as usize, datatype })
    }
}

/// Offsets of x, y and z in the record of a point; each is within it.
pub(super) struct Layout {
    coordinates: [FieldPlace; 3],
    big_endian: bool,
    point_bytes: usize,
}

/// Points that are read before those of them that are finite are appended; they stay in the nearest
/// cache.
const BLOCK_POINTS: usize = 64;

impl Layout {
    /// The layout that a message describes.
    pub(super) fn of(message: &PointCloud2) -> Result<Self, ConvertError> {
        let coordinate = |field| FieldPlace::of(message, field);
        Ok(Self {
            coordinates: [coordinate("x")?, coordinate("y")?, coordinate("z")?],
            big_endian: message.is_bigendian,
            point_bytes: message.point_step as usize,
        })
    }

    /// Appends the points of `rows`, in order, without those that are not finite.
    pub(super) fn append_finite_points(&self, rows: &Rows<'_>, points_m: &mut Vec<Point3<f32>>) {
        match self.offset_of_plain_floats() {
            Some(offset) => self.append(rows, points_m, |record| plain_floats(record, offset)),
            None => self.append(rows, points_m, |record| self.read(record)),
        }
    }

    /// Appends the points of `rows`, in order, those that are not finite too.
    pub(super) fn append_points(&self, rows: &Rows<'_>, points_m: &mut Vec<Point3<f32>>) {
        let plain = self.offset_of_plain_floats();
        for row in rows.iter() {
            points_m.extend(row.chunks_exact(self.point_bytes).filter_map(|record| {
                // The layout lies within the record: there is no record without a point.
                let point = match plain {
                    Some(offset) => plain_floats(record, offset),
                    None => self.read(record),
                };
                point.map(Point3::from)
            }));
        }
    }

    /// The offset of three consecutive little-endian floats x, y, z, as nearly all drivers
    /// write them.
    fn offset_of_plain_floats(&self) -> Option<usize> {
        let [x, y, z] = self.coordinates;
        let floats = self.coordinates.iter().all(|each| each.datatype == Datatype::Float32);
        let in_order = x.offset + 4 == y.offset && y.offset + 4 == z.offset;
        (floats && in_order && !self.big_endian).then_some(x.offset)
    }

    fn read(&self, record: &[u8]) -> Option<[f32; 3]> {
        let read = |place: FieldPlace| {
            // Rounded to what a cloud holds.
            place.read(record, self.big_endian).map(|value| value as f32)
        };
        let [x, y, z] = self.coordinates;
        Some([read(x)?, read(y)?, read(z)?])
    }

    /// Which points are finite cannot be predicted, so that a branch for each would often be taken
    /// wrongly: every point is written to a block, and the next one over it unless it counts.
    #[inline]
    fn append(
        &self,
        rows: &Rows<'_>,
        points_m: &mut Vec<Point3<f32>>,
        read: impl Fn(&[u8]) -> Option<[f32; 3]>,
    ) {
        let mut block = [Point3::origin(); BLOCK_POINTS];
        for row in rows.iter() {
            for records in row.chunks(self.point_bytes.saturating_mul(BLOCK_POINTS)) {
                let mut finite = 0;
                for record in records.chunks_exact(self.point_bytes) {
                    // The layout lies within the record: there is no record without a point.
                    let Some([x, y, z]) = read(record) else { continue };
                    if let Some(place) = block.get_mut(finite) {
                        *place = Point3::new(x, y, z);
                    }
                    finite += usize::from(x.is_finite() & y.is_finite() & z.is_finite());
                }
                points_m.extend_from_slice(block.get(..finite).unwrap_or_default());
            }
        }
    }
}

#[inline]
fn plain_floats(record: &[u8], offset: usize) -> Option<[f32; 3]> {
    let bytes: &[u8; 12] = record.get(offset..)?.first_chunk()?;
    let (floats, _) = bytes.as_chunks::<4>();
    let [x, y, z] = floats else { return None };
    Some([f32::from_le_bytes(*x), f32::from_le_bytes(*y), f32::from_le_bytes(*z)])
}

/// Puts four bytes at the front of eight.
fn front(bytes: &mut [u8; 8], four: [u8; 4]) {
    let [a, b, c, d, ..] = bytes;
    [*a, *b, *c, *d] = four;
}
