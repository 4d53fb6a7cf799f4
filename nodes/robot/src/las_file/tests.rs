use std::io::Cursor;

use super::*;

const KINDS: [LasKind; 4] = [
    LasKind { has_colour: false, is_compressed: false, epsg: None },
    LasKind { has_colour: true, is_compressed: false, epsg: None },
    LasKind { has_colour: false, is_compressed: true, epsg: None },
    LasKind { has_colour: true, is_compressed: true, epsg: None },
];

/// A hillside 1 km away.
fn positions_m() -> impl Iterator<Item = [f64; 3]> {
    (0..10_000).map(|index| {
        let (x, y) = (f64::from(index % 100), f64::from(index / 100));
        [1000.0 + 0.02 * x, -0.02 * y, 0.001 * x * y]
    })
}

fn colour(index: usize) -> [u8; 3] {
    [(index % 256) as u8, 0, 255]
}

/// Writes all, as far as it goes.
fn write<W: Write + Seek + Send + Sync + 'static>(inner: W, kind: LasKind) -> Result<W, LasError> {
    let mut file = LasFile::new(inner, [1000.0, -2.0, 0.0], kind)?;
    for (index, position_m) in positions_m().enumerate() {
        file.push(position_m, 7, kind.has_colour.then(|| colour(index)))?;
    }
    file.finish()
}

#[test]
fn points_are_read_back_to_a_millimetre_with_their_colours() {
    let sizes = KINDS.map(|kind| {
        let bytes = write(Cursor::new(Vec::new()), kind).unwrap().into_inner();
        let size = bytes.len();
        let mut reader = las::Reader::new(Cursor::new(bytes)).unwrap();
        assert_eq!(reader.header().point_format().is_compressed, kind.is_compressed);
        let read = reader.read_all().unwrap();
        let read: Vec<Point> = read.points().map(Result::unwrap).collect();
        assert_eq!(read.len(), positions_m().count());
        for (index, (read, position_m)) in read.iter().zip(positions_m()).enumerate() {
            let read_m = [read.x, read.y, read.z];
            let off_m = read_m.iter().zip(position_m).map(|(a, b)| (a - b).abs());
            assert!(off_m.fold(0.0, f64::max) <= 0.51 * STEP_M && read.intensity == 7);
            let brightness = |it: &Color| [it.red, it.green, it.blue].map(|value| value / 257);
            let expected = kind.has_colour.then(|| colour(index).map(u16::from));
            assert_eq!(read.color.as_ref().map(brightness), expected);
        }
        size
    });
    assert!(sizes[2] * 2 < sizes[0] && sizes[3] * 2 < sizes[1], "{sizes:?}");
}

/// The library reads the number off the keys by itself.
#[test]
fn the_reference_system_is_in_the_header() {
    for kind in KINDS {
        let kind = LasKind { epsg: Some(25832), ..kind };
        let bytes = write(Cursor::new(Vec::new()), kind).unwrap().into_inner();
        let reader = las::Reader::new(Cursor::new(bytes)).unwrap();
        let known = reader.header().get_geotiff_crs().unwrap().unwrap();
        let ids: Vec<u16> = known.entries.iter().map(|entry| entry.id).collect();
        assert_eq!(ids, [1024, 3072]);
    }
}

#[test]
fn an_empty_file_is_one() {
    let file = LasFile::new(Cursor::new(Vec::new()), [f64::NAN; 3], KINDS[3]).unwrap();
    let bytes = file.finish().unwrap().into_inner();
    assert_eq!(las::Reader::new(Cursor::new(bytes)).unwrap().header().number_of_points(), 0);
}

#[test]
fn a_point_that_does_not_fit_is_an_error() {
    for kind in KINDS {
        for wrong in [1e9, f64::NAN, f64::NEG_INFINITY] {
            let mut file = LasFile::new(Cursor::new(Vec::new()), [0.0; 3], kind).unwrap();
            let colour = kind.has_colour.then_some([1, 2, 3]);
            file.push([1.0, 2.0, 3.0], 0, colour).unwrap();
            let error = file.push([0.0, wrong, 0.0], 0, colour).unwrap_err();
            assert!(matches!(error, LasError::TooFar { .. }), "{error}");
        }
    }
}

/// A disk with so much room.
struct Disk {
    file: Cursor<Vec<u8>>,
    room: usize,
}

impl Write for Disk {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.file.position() as usize + bytes.len() > self.room {
            return Err(io::ErrorKind::StorageFull.into());
        }
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Seek for Disk {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.file.seek(to)
    }
}

/// Regression: the library's writer panicked when it was dropped.
#[test]
fn a_full_disk_is_an_error_wherever_it_is_full() {
    for kind in KINDS {
        let whole = write(Cursor::new(Vec::new()), kind).unwrap().into_inner().len();
        for room in [0, 1, 100, 375, 400, 1_000, whole / 2, whole - 1] {
            let written = write(Disk { file: Cursor::default(), room }, kind);
            let is_full = |error: LasError| match error {
                LasError::Write(error) => error.kind() == io::ErrorKind::StorageFull,
                _ => false,
            };
            assert!(written.map_or_else(is_full, |_| false), "{kind:?} {room}");
        }
        assert!(write(Disk { file: Cursor::default(), room: whole }, kind).is_ok());
    }
}
