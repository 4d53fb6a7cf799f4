//! LAS and LAZ files (ASPRS LAS 1.4), point by point.

use std::io::{self, Seek, SeekFrom, Write};
use std::sync::{Arc, Mutex, PoisonError};

use las::point::Format;
use las::{Builder, Color, Point, Transform, Vector, Vlr, Writer};

/// The resolution of the coordinates.
pub(crate) const STEP_M: f64 = 0.001;

/// Why a file is not whole.
#[derive(Debug, thiserror::Error)]
pub(crate) enum LasError {
    /// A coordinate does not fit.
    #[error(
        "a point at {position_m:?} m: a LAS file has steps of {STEP_M} m in 32 bits, from {offset_m:?} m on"
    )]
    TooFar {
        /// Where it is.
        position_m: [f64; 3],
        /// The origin of the file's coordinates.
        offset_m: [f64; 3],
    },
    /// The folder is full, say.
    #[error(transparent)]
    Write(#[from] io::Error),
    /// The library refuses.
    #[error(transparent)]
    Library(#[from] las::Error),
}

/// A file that is written. The library's writer closes the file when it is dropped, and panics where that fails: so it is told of no
/// error, of the file or of a coordinate.
pub(crate) struct LasFile<W: Write + Seek + Send + Sync + 'static> {
    writer: Writer<Sink<W>>,
    offset_m: [f64; 3],
    failed: Failed,
}

/// What the points of a file have, and how it is written.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct LasKind {
    pub(crate) has_colour: bool,
    /// As LAZ.
    pub(crate) is_compressed: bool,
    /// The projected reference system that the coordinates are in, by its number at EPSG.
    pub(crate) epsg: Option<u16>,
}

impl<W: Write + Seek + Send + Sync + 'static> LasFile<W> {
    /// A file with coordinates from about `offset_m` on.
    pub(crate) fn new(inner: W, offset_m: [f64; 3], kind: LasKind) -> Result<Self, LasError> {
        // Coordinates, intensities and colours; no times.
        let mut format = Format::new(0)?;
        (format.has_color, format.is_compressed) = (kind.has_colour, kind.is_compressed);
        let mut builder = Builder::from((1, 4));
        builder.point_format = format;
        builder.generating_software = "stillmap".to_owned();
        let whole = |along_m: f64| if along_m.is_finite() { along_m.floor() } else { 0.0 };
        let offset_m = offset_m.map(whole);
        let [x, y, z] = offset_m.map(|offset| Transform { scale: STEP_M, offset });
        builder.transforms = Vector { x, y, z };
        builder.vlrs.extend(kind.epsg.map(reference_system));
        let failed = Failed::default();
        let sink = Sink { inner, position: 0, length: 0, failed: Arc::clone(&failed) };
        let writer = Writer::new(sink, builder.into_header()?)?;
        Ok(Self { writer, offset_m, failed })
    }

    /// Writes a point; colours have 8 bits, of which the brightest is the brightest of 16.
    pub(crate) fn push(
        &mut self,
        position_m: [f64; 3],
        intensity: u16,
        colour: Option<[u8; 3]>,
    ) -> Result<(), LasError> {
        let Vector { x, y, z } = *self.writer.header().transforms();
        let fits = |(along, along_m): (Transform, f64)| along.inverse(along_m).is_ok();
        if !position_m.iter().all(|along_m| along_m.is_finite())
            || ![x, y, z].into_iter().zip(position_m).all(fits)
        {
            return Err(LasError::TooFar { position_m, offset_m: self.offset_m });
        }
        let [x, y, z] = position_m;
        let colour = colour.map(|colour| colour.map(|value| u16::from(value) * 257));
        self.writer.write_point(Point {
            x,
            y,
            z,
            intensity,
            color: colour.map(|[red, green, blue]| Color::new(red, green, blue)),
            return_number: 1,
            number_of_returns: 1,
            ..Point::default()
        })?;
        self.check()
    }

    /// Ends the file. What it is written to may have to be flushed.
    pub(crate) fn finish(mut self) -> Result<W, LasError> {
        self.writer.close()?;
        self.check()?;
        Ok(self.writer.into_inner()?.inner)
    }

    fn check(&self) -> Result<(), LasError> {
        let failed = self.failed.lock().unwrap_or_else(PoisonError::into_inner).take();
        failed.map_or(Ok(()), |error| Err(error.into()))
    }
}

/// What names the reference system of the coordinates: GeoTIFF keys, which the LAS specification has for points without times. The
/// header of keys (OGC GeoTIFF 1.1, section 7.1.2), and the keys in rising order: the model is projected, and which one it is.
fn reference_system(epsg: u16) -> Vlr {
    const HEADER: [u16; 3] = [1, 1, 0];
    const MODEL_TYPE: u16 = 1024;
    const PROJECTED: u16 = 1;
    const PROJECTED_SYSTEM: u16 = 3072;
    let keys = [[MODEL_TYPE, 0, 1, PROJECTED], [PROJECTED_SYSTEM, 0, 1, epsg]];
    let numbers = HEADER.into_iter().chain([keys.len() as u16]).chain(keys.into_iter().flatten());
    Vlr {
        user_id: "LASF_Projection".to_owned(),
        record_id: 34735,
        description: "GeoTIFF keys".to_owned(),
        data: numbers.flat_map(u16::to_le_bytes).collect(),
    }
}

/// The first error of a file that was not reported yet.
type Failed = Arc<Mutex<Option<io::Error>>>;

/// Keeps errors of the file from the library, which goes on writing.
struct Sink<W> {
    /// At its start.
    inner: W,
    position: u64,
    length: u64,
    failed: Failed,
}

impl<W> Sink<W> {
    /// `value`, or what it is without the file.
    fn or_note<T>(&mut self, value: io::Result<T>, otherwise: T) -> io::Result<T> {
        Ok(value.unwrap_or_else(|error| {
            self.failed.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
            otherwise
        }))
    }
}

impl<W: Write> Write for Sink<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.inner.write_all(bytes).map(|()| bytes.len());
        self.position += bytes.len() as u64;
        self.length = self.length.max(self.position);
        self.or_note(written, bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        let flushed = self.inner.flush();
        self.or_note(flushed, ())
    }
}

impl<W: Seek> Seek for Sink<W> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let position = match to {
            SeekFrom::Start(position) => Some(position),
            SeekFrom::Current(by) => self.position.checked_add_signed(by),
            SeekFrom::End(by) => self.length.checked_add_signed(by),
        };
        let position = position.ok_or(io::ErrorKind::InvalidInput)?;
        self.position = position;
        // The file is where the library has it also after a part that could not be written.
        let sought = self.inner.seek(SeekFrom::Start(position)).map(|_| position);
        self.or_note(sought, position)
    }
}

#[cfg(test)]
mod tests;
