//! PLY, the Stanford polygon format: points for MeshLab, CloudCompare and Open3D.

use nalgebra::{Point3, Vector3};

use crate::point_file::{
    Encoding, HeaderLine, OrientedPoints, Parts, PointFileError, RecordLayout, Scalar, split_header,
};
use crate::{LastSight, MapView, TriangleMesh};

/// The lines of a header, and the bytes behind it.
type Header<'a> = (Vec<HeaderLine<'a>>, &'a [u8]);

/// A binary PLY file, least significant byte first, of points in metres.
#[must_use]
pub fn encode(points_m: &[Point3<f32>]) -> Vec<u8> {
    encode_with_colours(points_m, &[], &[])
}

/// The same with a normal for each point (`nx`, `ny`, `nz`); without where there are none, or not as many.
#[must_use]
pub fn encode_with_normals(points_m: &[Point3<f32>], normals: &[Vector3<f32>]) -> Vec<u8> {
    encode_with_colours(points_m, normals, &[])
}

/// The same with a normal and a colour for each point (`red`, `green`, `blue`); without the one or the other where there are
/// none, or not as many.
#[must_use]
pub fn encode_with_colours(
    points_m: &[Point3<f32>],
    normals: &[Vector3<f32>],
    colours: &[[u8; 3]],
) -> Vec<u8> {
    encode_elements(points_m.len(), &Parts::of(points_m, normals, colours), "", &[])
}

/// The same of a map, with the views that it was seen from, as comments of the header: [`views_of`] reads them, and other
/// programs pass over them.
#[must_use]
pub fn encode_map(points: &OrientedPoints, views: &[MapView]) -> Vec<u8> {
    let OrientedPoints { points_m, normals, colours } = points;
    encode_elements(points_m.len(), &Parts::of(points_m, normals, colours), "", views)
}

/// The same with how the map was seen last, as the element `last_sight` behind the vertices: [`last_sights_of`] reads it, and other programs pass
/// over it.
#[must_use]
pub fn encode_map_to_continue(
    points: &OrientedPoints,
    views: &[MapView],
    sights: &[LastSight],
) -> Vec<u8> {
    if sights.is_empty() {
        return encode_map(points, views);
    }
    let OrientedPoints { points_m, normals, colours } = points;
    let properties = LAST_SIGHT_NAMES.map(|name| format!("property float {name}\n")).concat();
    let element = format!("element {LAST_SIGHT} {}\n{properties}", sights.len());
    let parts = Parts::of(points_m, normals, colours);
    let mut bytes = encode_elements(points_m.len(), &parts, &element, views);
    let numbers = sights.iter().flat_map(LastSight::numbers);
    bytes.extend(numbers.flat_map(f32::to_le_bytes));
    bytes
}

/// The same of triangles: their vertices, and the element `face` with `vertex_indices`.
#[must_use]
pub fn encode_mesh(mesh: &TriangleMesh) -> Vec<u8> {
    let TriangleMesh { points_m, normals, colours, triangles } = mesh;
    let faces =
        format!("element face {}\nproperty list uchar int vertex_indices\n", triangles.len());
    let parts = Parts::of(points_m, normals, colours);
    let mut bytes = encode_elements(points_m.len(), &parts, &faces, &[]);
    bytes.reserve(triangles.len() * 13);
    for triangle in triangles {
        bytes.push(3);
        triangle.iter().for_each(|index| bytes.extend(index.to_le_bytes()));
    }
    bytes
}

/// The element of how a map was seen last, and its properties, each a `float`.
const LAST_SIGHT: &str = "last_sight";
const LAST_SIGHT_NAMES: [&str; LastSight::NUMBERS] =
    ["x", "y", "z", "from_x", "from_y", "from_z", "lasted_s"];

/// How the comment of a view begins.
const VIEW: [&str; 2] = ["comment", "view"];

/// The header, with what it says of further elements and of views, and the vertices.
fn encode_elements(
    vertices: usize,
    parts: &Parts<'_>,
    further_elements: &str,
    views: &[MapView],
) -> Vec<u8> {
    let [comment, view] = VIEW;
    let mut header = "ply\nformat binary_little_endian 1.0\n".to_owned();
    header.extend(views.iter().map(|of_map| format!("{comment} {view} {of_map}\n")));
    header += &format!(
        "element vertex {vertices}\nproperty float x\nproperty float y\nproperty float z\n"
    );
    if parts.normals.is_some() {
        header += "property float nx\nproperty float ny\nproperty float nz\n";
    }
    if parts.colours.is_some() {
        header += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
    }
    header += further_elements;
    header += "end_header\n";
    let mut bytes = header.into_bytes();
    parts.append(&mut bytes, |bytes, colour| bytes.extend(colour));
    bytes
}

/// The vertices of a PLY file, ASCII or binary with the least significant byte first, whatever other
/// fields they have. Vertices with a coordinate that is not finite are left out.
///
/// # Errors
/// When the bytes are no such file, or are cut off.
pub fn decode(bytes: &[u8]) -> Result<Vec<Point3<f32>>, PointFileError> {
    let (layout, encoding, body, vertices) = read(bytes)?;
    layout.decode(encoding, body, vertices)
}

/// The same with the normals and the colours; none of them where the file has none.
///
/// # Errors
/// As [`decode`].
pub fn decode_with_normals(bytes: &[u8]) -> Result<OrientedPoints, PointFileError> {
    let (layout, encoding, body, vertices) = read(bytes)?;
    layout.decode_with_normals(encoding, body, vertices)
}

/// The views that a map was seen from; none where the file says of none, as those of other programs.
///
/// # Errors
/// When the bytes are no such file, or their header is cut off.
pub fn views_of(bytes: &[u8]) -> Result<Vec<MapView>, PointFileError> {
    let lines = header_of(bytes)?.0.into_iter();
    // What is no view is a comment of somebody else's.
    Ok(lines.filter_map(|(_, line)| words_after(line, VIEW)?.parse().ok()).collect())
}

/// How a map was seen last; nothing where the file does not say it as [`encode_map_to_continue`] does.
///
/// # Errors
/// When the bytes are no such file, or are cut off.
pub fn last_sights_of(bytes: &[u8]) -> Result<Vec<LastSight>, PointFileError> {
    let lines = header_of(bytes)?.0;
    let (layout, encoding, body, vertices) = read(bytes)?;
    let mut behind_vertices = lines
        .iter()
        .map(|(_, line)| line.trim())
        .skip_while(|line| words_after(line, ["element", "vertex"]).is_none())
        .skip(1)
        .skip_while(|line| !line.starts_with("element"));
    let element = behind_vertices.next();
    let count =
        element.and_then(|line| words_after(line, ["element", LAST_SIGHT])?.trim().parse().ok());
    let mut has_property = |name: &str| {
        let line = behind_vertices.next();
        line.and_then(|line| words_after(line, ["property", "float"])).map(str::trim) == Some(name)
    };
    let is_ours = encoding == Encoding::BinaryLittleEndian
        && LAST_SIGHT_NAMES.into_iter().all(&mut has_property);
    let Some(count) = count.filter(|_| is_ours) else { return Ok(Vec::new()) };
    let first = vertices.saturating_mul(layout.bytes());
    let (numbers, _) = body.get(first..).unwrap_or_default().as_chunks::<4>();
    let (records, _) = numbers.as_chunks::<{ LastSight::NUMBERS }>();
    if records.len() < count {
        return Err(PointFileError::Truncated { stated: count, found: records.len() });
    }
    let sights = records.iter().take(count);
    Ok(sights.filter_map(|record| LastSight::of_numbers(record.map(f32::from_le_bytes))).collect())
}

/// What stands behind these words; `None` of a line that does not begin with them.
fn words_after<'a>(line: &'a str, words: [&str; 2]) -> Option<&'a str> {
    words.iter().try_fold(line, |rest, word| rest.trim_start().strip_prefix(word))
}

fn header_of(bytes: &[u8]) -> Result<Header<'_>, PointFileError> {
    if !bytes.starts_with(b"ply") {
        return Err(PointFileError::NotThisFormat { format: "PLY", expected: "ply" });
    }
    split_header(bytes, "end_header")
}

/// What the header says, and the bytes behind it.
fn read(bytes: &[u8]) -> Result<(RecordLayout, Encoding, &[u8], usize), PointFileError> {
    let (lines, body) = header_of(bytes)?;
    let mut encoding = None;
    let mut vertices = None;
    let mut in_vertex = false;
    let mut layout = RecordLayout::default();
    for (line, text) in lines {
        let error = |reason| PointFileError::header(line, text, reason);
        match *text.split_ascii_whitespace().collect::<Vec<_>>() {
            ["format", "ascii", _] => encoding = Some(Encoding::Ascii),
            ["format", "binary_little_endian", _] => encoding = Some(Encoding::BinaryLittleEndian),
            ["format", ..] => return Err(error("only ascii and binary_little_endian are read")),
            ["element", "vertex", count] => {
                vertices = Some(count.parse().map_err(|_| error("the count is not a number"))?);
                in_vertex = true;
            }
            ["element", ..] if vertices.is_none() => {
                return Err(error("the vertices must be the first element"));
            }
            ["element", ..] => in_vertex = false,
            ["property", "list", ..] if in_vertex => {
                return Err(error("a list within a vertex is not read"));
            }
            ["property", kind, name] if in_vertex => {
                let scalar = scalar(kind).ok_or(error("this kind of number is not known"))?;
                layout.push(name, scalar, 1);
            }
            _ => {}
        }
    }
    let encoding = encoding.ok_or(PointFileError::UnfinishedHeader { expected: "format" })?;
    let vertices =
        vertices.ok_or(PointFileError::UnfinishedHeader { expected: "element vertex" })?;
    Ok((layout, encoding, body, vertices))
}

fn scalar(kind: &str) -> Option<Scalar> {
    Some(match kind {
        "char" | "int8" => Scalar::I8,
        "uchar" | "uint8" => Scalar::U8,
        "short" | "int16" => Scalar::I16,
        "ushort" | "uint16" => Scalar::U16,
        "int" | "int32" => Scalar::I32,
        "uint" | "uint32" => Scalar::U32,
        "float" | "float32" => Scalar::F32,
        "double" | "float64" => Scalar::F64,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// A UTM map got steps of half a metre.
    #[test]
    fn doubles_that_single_precision_would_round_are_refused() {
        let header = "ply\nformat ascii 1.0\nelement vertex 2\nproperty double x\nproperty double y\nproperty double z\nend_header\n";
        let near = format!("{header}1000.123 -2000.7 12\nnan 0 0\n");
        assert_eq!(decode(near.as_bytes()).unwrap(), [Point3::new(1000.123, -2000.7, 12.0)]);
        let far = format!("{header}1 2 3\n458000.3 5428000.7 112\n");
        let refused = decode(far.as_bytes()).unwrap_err();
        let number = "458000.3".to_owned();
        assert_eq!(refused, PointFileError::TooFar { point: 1, number, rounding_mm: 13 });
        let mut binary = header.replace("ascii", "binary_little_endian").into_bytes();
        for value in [1.0, 2.0, 3.0, 1.0, 5_428_000.7_f64, 112.0] {
            binary.extend(value.to_le_bytes());
        }
        let refused = decode_with_normals(&binary).unwrap_err();
        let number = "5428000.7".to_owned();
        assert_eq!(refused, PointFileError::TooFar { point: 1, number, rounding_mm: 200 });
    }

    #[test]
    fn a_mesh_is_read_as_its_vertices() {
        let mesh = TriangleMesh {
            points_m: [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.5]].map(Point3::from).to_vec(),
            normals: vec![Vector3::z(); 3],
            colours: vec![[1, 2, 3], [4, 5, 6], [7, 8, 9]],
            triangles: vec![[0, 1, 2], [2, 1, 0]],
        };
        let bytes = encode_mesh(&mesh);
        let OrientedPoints { points_m, normals, colours } = decode_with_normals(&bytes).unwrap();
        assert_eq!((points_m, normals, colours), (mesh.points_m, mesh.normals, mesh.colours));
        assert!(bytes.ends_with(&[3, 2, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0]));
        let header = String::from_utf8_lossy(&bytes[..bytes.len() - 26 - 3 * 27]).into_owned();
        assert!(header.ends_with(
            "property uchar blue\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n"
        ));
    }

    proptest! {
        #[test]
        fn points_survive_the_file(
            points in proptest::collection::vec(proptest::array::uniform3(-1e6..1e6_f32), 0..50),
        ) {
            let points: Vec<_> = points.into_iter().map(Point3::from).collect();
            prop_assert_eq!(decode(&encode(&points)).unwrap(), points);
        }

        #[test]
        fn no_bytes_make_it_panic(mut bytes in proptest::collection::vec(any::<u8>(), 0..300), cut in 0..200_usize) {
            let _ = decode(&bytes);
            let mut file = encode(&[Point3::origin(); 3]);
            file.truncate(cut);
            file.append(&mut bytes);
            let _ = decode(&file);
            let _ = last_sights_of(&file);
        }
    }

    #[test]
    fn the_views_of_a_map_stand_in_the_header() {
        let points = OrientedPoints {
            points_m: vec![Point3::new(1.0, 2.0, 3.0)],
            ..OrientedPoints::default()
        };
        let line = "7 1.0000 2.0000 0.5000 0.00000 0.00000 0.00000 1.00000 640 480 525.00 525.00 319.50 239.50";
        let views = vec![line.parse::<MapView>().unwrap(); 2];
        let file = encode_map(&points, &views);
        assert_eq!(views_of(&file).unwrap(), views);
        assert_eq!(decode_with_normals(&file).unwrap(), points);
        assert_eq!(encode_map(&points, &[]), encode(&points.points_m));
        let other = String::from_utf8_lossy(&file).replace("comment view 7", "comment viewed 7");
        assert_eq!(views_of(other.as_bytes()).unwrap(), []);
        assert!(views_of(b"ply\ncut off").is_err());
    }

    #[test]
    fn how_a_map_was_seen_last_stands_behind_its_points() {
        let points = OrientedPoints {
            points_m: vec![Point3::new(1.0, 2.0, 3.0), Point3::new(4.0, 5.0, 6.0)],
            normals: vec![Vector3::x(); 2],
            colours: vec![[1, 2, 3]; 2],
        };
        let sight = |lasted_s: f32| LastSight {
            middle_m: Point3::new(1.04, 2.0, -3.0),
            from_m: Point3::new(0.5, -0.25, 1.0),
            lasted_s,
        };
        let sights = [sight(0.0), sight(61.5)];
        let file = encode_map_to_continue(&points, &[], &sights);
        assert_eq!(last_sights_of(&file).unwrap(), sights);
        assert_eq!(decode_with_normals(&file).unwrap(), points);
        // Others, and what is none.
        assert_eq!(encode_map_to_continue(&points, &[], &[]), encode_map(&points, &[]));
        assert_eq!(last_sights_of(&encode_map(&points, &[])).unwrap(), []);
        let mesh = TriangleMesh { triangles: vec![[0, 1, 0]], ..TriangleMesh::default() };
        assert_eq!(last_sights_of(&encode_mesh(&mesh)).unwrap(), []);
        let none =
            encode_map_to_continue(&points, &[], &[sight(-1.0), sight(f32::NAN), sight(2.0)]);
        assert_eq!(last_sights_of(&none).unwrap(), [sight(2.0)]);
        let cut_off = last_sights_of(&file[..file.len() - 1]).unwrap_err();
        assert_eq!(cut_off, PointFileError::Truncated { stated: 2, found: 1 });
    }

    #[test]
    fn normals_stand_beside_the_points_where_there_are_any() {
        let points = [Point3::new(1.0, -2.0, 0.5), Point3::new(0.0, 3.0, 0.25)];
        let normals = [Vector3::x(), Vector3::new(0.0, 0.6, -0.8)];
        let file = encode_with_normals(&points, &normals);
        assert_eq!(decode(&file).unwrap(), points);
        let (points_m, colours) = (points.to_vec(), Vec::new());
        let expected = OrientedPoints { points_m, normals: normals.to_vec(), colours };
        assert_eq!(decode_with_normals(&file).unwrap(), expected);
        let without = OrientedPoints { normals: Vec::new(), ..expected };
        assert_eq!(decode_with_normals(&encode(&points)).unwrap(), without);
        assert!(file.ends_with(&[0.6_f32.to_le_bytes(), (-0.8_f32).to_le_bytes()].concat()));
        assert_eq!(encode_with_normals(&points, &[]), encode(&points));
    }

    #[test]
    fn colours_stand_behind_points_and_normals() {
        let points = [Point3::new(1.0, -2.0, 0.5), Point3::new(0.0, 3.0, 0.25)];
        let (normals, colours) = ([Vector3::x(), Vector3::y()], [[255, 128, 1], [0, 0, 0]]);
        let file = encode_with_colours(&points, &normals, &colours);
        let expected = OrientedPoints {
            points_m: points.to_vec(),
            normals: normals.to_vec(),
            colours: colours.to_vec(),
        };
        assert_eq!(decode_with_normals(&file).unwrap(), expected);
        let without = OrientedPoints { normals: Vec::new(), ..expected };
        let file = encode_with_colours(&points, &[], &colours);
        assert_eq!(decode_with_normals(&file).unwrap(), without);
        assert_eq!(decode(&file).unwrap(), points);
        let header = b"property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n";
        let header_ends = file.windows(header.len()).position(|part| part == header).unwrap();
        let records = &file[header_ends + header.len()..];
        assert_eq!(records.len(), 2 * 15);
        assert_eq!(records[12..15], [255, 128, 1]);
        assert_eq!(
            encode_with_colours(&points, &normals, &[]),
            encode_with_normals(&points, &normals),
            "without colours as before"
        );
    }

    #[test]
    fn a_point_that_is_left_out_takes_its_colour_with_it() {
        let file = "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\n\
            property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n\
            nan 0 0 1 2 3\n1 2 3 40 50 60\n";
        let read = decode_with_normals(file.as_bytes()).unwrap();
        assert_eq!((read.points_m.len(), read.colours), (1, vec![[40, 50, 60]]));
    }

    #[test]
    fn the_bytes_are_those_of_the_format() {
        let header = b"ply\nformat binary_little_endian 1.0\nelement vertex 1\n\
            property float x\nproperty float y\nproperty float z\nend_header\n";
        let body = [0, 0, 0x80, 0x3f, 0, 0, 0, 0xc0, 0, 0, 0, 0x3f];
        assert_eq!(encode(&[Point3::new(1.0, -2.0, 0.5)]), [&header[..], &body].concat());
    }

    #[test]
    fn an_ascii_file_of_another_program_is_read() {
        let file = "ply\r\nformat ascii 1.0\r\ncomment by hand\r\nelement vertex 3\r\n\
            property uchar red\r\nproperty double z\r\nproperty float x\r\nproperty float y\r\n\
            element face 1\r\nproperty list uchar int vertex_indices\r\nend_header\r\n\
            255 3.5 1.5 -2.5\r\n0 nan 0 0\r\n7 3 1 2e0\r\n3 0 1 2\r\n";
        let expected = [Point3::new(1.5, -2.5, 3.5), Point3::new(1.0, 2.0, 3.0)];
        assert_eq!(decode(file.as_bytes()).unwrap(), expected);
    }

    #[test]
    fn binary_fields_are_found_where_the_header_says() {
        let mut file =
            b"ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty short a\n\
            property double y\nproperty float x\nproperty uchar z\nend_header\n"
                .to_vec();
        file.extend([9, 9]);
        file.extend(2.25_f64.to_le_bytes());
        file.extend(1.5_f32.to_le_bytes());
        file.push(200);
        assert_eq!(decode(&file).unwrap(), [Point3::new(1.5, 2.25, 200.0)]);
    }

    #[test]
    fn what_is_wrong_is_said() {
        let good = String::from_utf8(encode(&[])).unwrap();
        let with = |from: &str, to: &str| good.replace(from, to).into_bytes();
        for (file, part) in [
            (b"solid".to_vec(), "no PLY file"),
            (good.as_bytes()[..40].to_vec(), "'end_header'"),
            (
                with("binary_little", "binary_big"),
                "line 2 of the header, 'format binary_big_endian 1.0'",
            ),
            (with("vertex 0", "vertex many"), "not a number"),
            (with("vertex 0", "vertex 18446744073709551615"), "but there are 0"),
            (with("property float y", "property float w"), "no field 'y'"),
            (with("float z", "half z"), "line 6"),
            (with("property float z", "property list uchar float z"), "list"),
            (with("element vertex", "element edge 1\nelement vertex"), "first element"),
            (with("element vertex 0\n", ""), "'element vertex'"),
        ] {
            let error = decode(&file).unwrap_err().to_string();
            assert!(error.contains(part), "{error}");
        }
        let ascii = with("binary_little_endian", "ascii");
        let one = String::from_utf8(ascii).unwrap().replace("vertex 0", "vertex 1") + "1 2 three\n";
        let error = decode(one.as_bytes()).unwrap_err();
        assert_eq!(error, PointFileError::Number { point: 0, text: "three".to_owned() });
    }
}
