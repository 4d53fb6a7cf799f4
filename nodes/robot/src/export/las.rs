//! A map as a LAS or LAZ file (ASPRS LAS 1.4).

use std::io::Cursor;

use geometry::OrientedPoints;
use las::point::Format;
use las::{Builder, Color, Point, Transform, Vector, Writer};
use nalgebra::Point3;

/// The resolution of the coordinates.
const STEP_M: f64 = 0.001;

/// Why there is no file.
#[derive(Debug, thiserror::Error)]
pub(super) enum LasError {
    #[error("a point lies {away_m:.0} m from the first one: a LAS file has {STEP_M} m in 32 bits")]
    TooFar { away_m: f64 },
    #[error(transparent)]
    Library(#[from] las::Error),
}

/// The points with their colours, where they have some; compressed as LAZ on demand. A file of this kind has no normals.
///
/// # Errors
/// When a point is farther from the first one than 32 bits of millimetres tell: 2,100 km.
pub(super) fn encode(points: &OrientedPoints, is_compressed: bool) -> Result<Vec<u8>, LasError> {
    let OrientedPoints { points_m, colours, .. } = points;
    let first_m = points_m.first().copied().unwrap_or_else(Point3::origin);
    let offset_m = first_m.map(|along_m| f64::from(along_m).floor());
    // Looked for here: the library's writer panics when it ends with such a point.
    for point_m in points_m {
        let away_m = (point_m.cast::<f64>() - offset_m).amax();
        if away_m / STEP_M >= f64::from(i32::MAX) {
            return Err(LasError::TooFar { away_m });
        }
    }
    let mut format = Format::new(0)?;
    format.has_color = !colours.is_empty();
    format.is_compressed = is_compressed;
    let mut builder = Builder::from((1, 4));
    builder.point_format = format;
    builder.generating_software = "stillmap".to_owned();
    let axis = |offset: f64| Transform { scale: STEP_M, offset };
    builder.transforms = Vector { x: axis(offset_m.x), y: axis(offset_m.y), z: axis(offset_m.z) };
    let mut writer = Writer::new(Cursor::new(Vec::new()), builder.into_header()?)?;
    for (index, point_m) in points_m.iter().enumerate() {
        // Eight bits of colour as sixteen: 255 is the brightest in both.
        let color = colours.get(index).map(|colour| colour.map(|value| u16::from(value) * 257));
        writer.write_point(Point {
            x: point_m.x.into(),
            y: point_m.y.into(),
            z: point_m.z.into(),
            color: color.map(|[red, green, blue]| Color::new(red, green, blue)),
            return_number: 1,
            number_of_returns: 1,
            ..Point::default()
        })?;
    }
    writer.close()?;
    Ok(writer.into_inner()?.into_inner())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_map_is_read_back_to_a_millimetre_with_its_colours() {
        let points_m: Vec<_> = (0..10_000_u16)
            .map(|index| {
                let (x, y) = (f32::from(index % 100), f32::from(index / 100));
                Point3::new(1000.0 + 0.02 * x, -0.02 * y, 0.001 * x * y)
            })
            .collect();
        let colours: Vec<_> = (0..10_000_u16).map(|index| [(index % 256) as u8, 0, 255]).collect();
        let bare = OrientedPoints { points_m: points_m.clone(), ..OrientedPoints::default() };
        let coloured = OrientedPoints { colours: colours.clone(), ..bare.clone() };
        let mut sizes = Vec::new();
        for (points, is_compressed) in
            [(&bare, false), (&coloured, false), (&bare, true), (&coloured, true)]
        {
            let bytes = encode(points, is_compressed).unwrap();
            sizes.push(bytes.len());
            let mut reader = las::Reader::new(Cursor::new(bytes)).unwrap();
            assert_eq!(reader.header().point_format().is_compressed, is_compressed);
            let read = reader.read_all().unwrap();
            let read: Vec<Point> = read.points().map(Result::unwrap).collect();
            assert_eq!(read.len(), points_m.len());
            for (index, (read, point_m)) in read.iter().zip(&points_m).enumerate() {
                let off_m = Point3::new(read.x, read.y, read.z) - point_m.cast::<f64>();
                assert!(off_m.amax() <= 0.51 * STEP_M, "{off_m}");
                let colour = points.colours.get(index).map(|colour| colour.map(u16::from));
                let brightest = |it: &Color| [it.red, it.green, it.blue].map(|value| value / 257);
                assert_eq!(read.color.as_ref().map(brightest), colour);
            }
        }
        assert!(sizes[2] * 2 < sizes[0] && sizes[3] * 2 < sizes[1], "{sizes:?}");
        assert!(encode(&OrientedPoints::default(), true).is_ok(), "an empty map is one");
    }

    #[test]
    fn a_point_too_far_from_the_first_is_an_error() {
        let points_m = vec![Point3::origin(), Point3::new(1e9, 0.0, 0.0)];
        assert!(encode(&OrientedPoints { points_m, ..OrientedPoints::default() }, false).is_err());
    }
}
