//! E57 files (ASTM E2807) of a map.

use std::io::Cursor;

use e57::{
    E57Writer, Extension, Quaternion, Record, RecordDataType, RecordName, RecordValue, Transform,
    Translation,
};
use geometry::OrientedPoints;

/// The extension that has normals, at libe57.org.
const NORMALS: (&str, &str) = ("nor", "http://www.libe57.org/E57_NOR_surface_normals.txt");

/// The points with their normals and colours, where they have some. The coordinates are those of the map, in single precision; its
/// origin is at `origin_m` in the file's frame. The same points give the same bytes.
///
/// # Errors
/// When the library refuses.
pub(crate) fn encode(points: &OrientedPoints, origin_m: [f64; 3]) -> Result<Vec<u8>, e57::Error> {
    let OrientedPoints { points_m, normals, colours } = points;
    let mut file = Cursor::new(Vec::new());
    let mut writer = E57Writer::new(&mut file, &guid(points, 0))?;
    let single = |name| Record { name, data_type: RecordDataType::Single { min: None, max: None } };
    let byte = |name| Record { name, data_type: RecordDataType::U8 };
    let mut fields = [RecordName::CartesianX, RecordName::CartesianY, RecordName::CartesianZ]
        .map(single)
        .to_vec();
    let has_normals = normals.len() == points_m.len() && !normals.is_empty();
    if has_normals {
        let (namespace, url) = NORMALS;
        writer.register_extension(Extension::new(namespace, url))?;
        let field = |name: &str| RecordName::Unknown {
            namespace: namespace.to_owned(),
            name: name.to_owned(),
        };
        fields.extend(["normalX", "normalY", "normalZ"].map(field).map(single));
    }
    let has_colours = colours.len() == points_m.len() && !colours.is_empty();
    if has_colours {
        let names = [RecordName::ColorRed, RecordName::ColorGreen, RecordName::ColorBlue];
        fields.extend(names.map(byte));
    }
    let mut cloud = writer.add_pointcloud(&guid(points, 1), fields)?;
    cloud.set_name(Some("static map".to_owned()));
    let [x, y, z] = origin_m;
    let rotation = Quaternion::default();
    cloud.set_transform(Some(Transform { rotation, translation: Translation { x, y, z } }));
    for (index, point_m) in points_m.iter().enumerate() {
        let mut values: Vec<RecordValue> =
            point_m.iter().copied().map(RecordValue::Single).collect();
        let normal = normals.get(index).filter(|_| has_normals);
        values.extend(
            normal.iter().flat_map(|normal| normal.iter()).copied().map(RecordValue::Single),
        );
        let colour = colours.get(index).filter(|_| has_colours);
        values
            .extend(colour.into_iter().flatten().map(|part| RecordValue::Integer((*part).into())));
        cloud.add_point(values)?;
    }
    cloud.finalize()?;
    writer.finalize()?;
    drop(writer);
    Ok(file.into_inner())
}

/// A name that no file of other points has: their check sums in the form of a GUID. `part` tells the names within a file apart.
fn guid(points: &OrientedPoints, part: u32) -> String {
    let OrientedPoints { points_m, normals, colours } = points;
    let sum = |bytes: &mut dyn Iterator<Item = u8>| {
        let mut hasher = crc32fast::Hasher::new_with_initial(part);
        bytes.for_each(|byte| hasher.update(&[byte]));
        hasher.finalize()
    };
    let along = |axis: usize| {
        sum(&mut points_m.iter().flat_map(|point_m| point_m.coords[axis].to_le_bytes()))
    };
    let normals =
        normals.iter().flat_map(|normal| normal.iter()).copied().flat_map(f32::to_le_bytes);
    let rest = sum(&mut normals.chain(colours.iter().flatten().copied()));
    let digits = format!("{:08x}{:08x}{:08x}{rest:08x}", along(0), along(1), along(2));
    let group = |from: usize, to: usize| digits.get(from..to).unwrap_or_default();
    format!(
        "{{{}-{}-{}-{}-{}}}",
        group(0, 8),
        group(8, 12),
        group(12, 16),
        group(16, 20),
        group(20, 32)
    )
}

#[cfg(test)]
mod tests {
    use e57::E57Reader;
    use nalgebra::{Point3, Vector3};

    use super::*;

    fn points(has_normals: bool, has_colours: bool) -> OrientedPoints {
        let points_m: Vec<Point3<f32>> =
            (0..1000_u16).map(|i| Point3::new(0.01 * f32::from(i), -2.5, 0.125)).collect();
        let normals = points_m.iter().map(|_| Vector3::z()).filter(|_| has_normals).collect();
        let colours =
            (0..1000).map(|i| [(i % 256) as u8, 7, 255]).filter(|_| has_colours).collect();
        OrientedPoints { points_m, normals, colours }
    }

    #[test]
    fn points_are_read_back_where_the_origin_puts_them() {
        for (has_normals, has_colours) in
            [(false, false), (true, false), (false, true), (true, true)]
        {
            let points = points(has_normals, has_colours);
            let bytes = encode(&points, [500_000.0, 5_400_000.0, 120.5]).unwrap();
            let mut reader = E57Reader::new(Cursor::new(&bytes)).unwrap();
            let clouds = reader.pointclouds();
            let [cloud] = clouds.as_slice() else { panic!("{} clouds", clouds.len()) };
            assert_eq!(reader.extensions().len(), usize::from(has_normals));
            // By the pose of the cloud, as its readers apply it.
            let read: Vec<e57::Point> =
                reader.pointcloud_simple(cloud).unwrap().map(Result::unwrap).collect();
            assert_eq!(read.len(), 1000);
            for (index, (read, point_m)) in read.iter().zip(&points.points_m).enumerate() {
                let e57::CartesianCoordinate::Valid { x, y, z } = read.cartesian else { panic!() };
                let expected = point_m.cast::<f64>() + Vector3::new(500_000.0, 5_400_000.0, 120.5);
                assert!((Point3::new(x, y, z) - expected).norm() < 1e-6);
                let expected = points.colours.get(index);
                let colour = read.color.as_ref().map(|colour| {
                    [colour.red, colour.green, colour.blue].map(|part| (part * 255.0).round() as u8)
                });
                assert_eq!(colour.as_ref(), expected);
            }
            assert_eq!(bytes, encode(&points, [500_000.0, 5_400_000.0, 120.5]).unwrap());
        }
    }

    #[test]
    fn an_empty_map_is_a_file_and_other_points_have_another_name() {
        let bytes = encode(&OrientedPoints::default(), [0.0; 3]).unwrap();
        assert_eq!(E57Reader::new(Cursor::new(bytes)).unwrap().pointclouds()[0].records, 0);
        let names = [
            guid(&points(true, true), 0),
            guid(&points(true, false), 0),
            guid(&points(true, true), 1),
        ];
        assert!(names[0] != names[1] && names[0] != names[2] && names[0].len() == 38, "{names:?}");
    }
}
