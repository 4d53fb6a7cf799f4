//! PCD version 0.7, the format of the Point Cloud Library.

mod compressed;

use std::borrow::Cow;

use nalgebra::{Point3, Vector3};

use crate::point_file::{
    Encoding, OrientedPoints, Parts, PointFileError, RecordLayout, Scalar, append_binary,
    split_header,
};

/// A binary PCD file of points in metres, unorganised.
#[must_use]
pub fn encode(points_m: &[Point3<f32>]) -> Vec<u8> {
    let count = points_m.len();
    let mut bytes = format!(
        "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\n\
         TYPE F F F\nCOUNT 1 1 1\nWIDTH {count}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\n\
         POINTS {count}\nDATA binary\n"
    )
    .into_bytes();
    append_binary(&mut bytes, points_m);
    bytes
}

/// The same with a normal for each point (`normal_x`, `normal_y`, `normal_z`, as PCL's `PointNormal` has them); without where
/// there are none, or not as many.
#[must_use]
pub fn encode_with_normals(points_m: &[Point3<f32>], normals: &[Vector3<f32>]) -> Vec<u8> {
    encode_with_colours(points_m, normals, &[])
}

/// The same with a normal and a colour for each point (`rgb`, as PCL's `PointXYZRGB` has it: the bytes 0, red, green and blue of
/// a number, in a field of type float); without the one or the other where there are none, or not as many.
#[must_use]
pub fn encode_with_colours(
    points_m: &[Point3<f32>],
    normals: &[Vector3<f32>],
    colours: &[[u8; 3]],
) -> Vec<u8> {
    let parts = Parts::of(points_m, normals, colours);
    let (count, mut fields) = (points_m.len(), vec!["x", "y", "z"]);
    if parts.normals.is_some() {
        fields.extend(["normal_x", "normal_y", "normal_z"]);
    }
    if parts.colours.is_some() {
        fields.push("rgb");
    }
    if fields.len() == 3 {
        return encode(points_m);
    }
    let each = |word: &str| vec![word; fields.len()].join(" ");
    let (names, sizes, types, counts) = (fields.join(" "), each("4"), each("F"), each("1"));
    let mut bytes = format!(
        "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\n\
         FIELDS {names}\nSIZE {sizes}\nTYPE {types}\nCOUNT {counts}\n\
         WIDTH {count}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {count}\nDATA binary\n"
    )
    .into_bytes();
    parts.append(&mut bytes, |bytes, [red, green, blue]| bytes.extend([blue, green, red, 0]));
    bytes
}

/// The points of a PCD file, ASCII, binary or compressed, whatever other fields they have.
/// Points with a coordinate that is not finite are left out: in an organised cloud they represent
/// pixels that saw nothing. Points stay where the file has them: `VIEWPOINT` is from where they were seen, as for PCL.
///
/// # Errors
/// When the bytes are no such file, or are cut off.
pub fn decode(bytes: &[u8]) -> Result<Vec<Point3<f32>>, PointFileError> {
    let (header, body) = read(bytes)?;
    header.layout()?.decode(header.encoding(), &body, header.points()?)
}

/// The same with the normals and the colours; none of them where the file has none.
///
/// # Errors
/// As [`decode`].
pub fn decode_with_normals(bytes: &[u8]) -> Result<OrientedPoints, PointFileError> {
    let (header, body) = read(bytes)?;
    header.layout()?.decode_with_normals(header.encoding(), &body, header.points()?)
}

/// What the header says, and the bytes behind it, as if they had not been compressed.
fn read(bytes: &[u8]) -> Result<(Header<'_>, Cow<'_, [u8]>), PointFileError> {
    if !bytes.starts_with(b"# .PCD") && !bytes.starts_with(b"VERSION") {
        return Err(PointFileError::NotThisFormat { format: "PCD", expected: "# .PCD" });
    }
    let (lines, body) = split_header(bytes, "DATA")?;
    let mut header = Header::default();
    for (line, text) in lines {
        header.take(line, text)?;
    }
    let body = if header.data == Data::Compressed {
        Cow::Owned(compressed::records(body, &header.field_bytes()?, header.points()?)?)
    } else {
        Cow::Borrowed(body)
    };
    Ok((header, body))
}

/// How the points are written.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
enum Data {
    Ascii,
    #[default]
    Binary,
    Compressed,
}

/// The entries of a header, each with its line.
#[derive(Clone, Debug, Default)]
struct Header<'a> {
    fields: Vec<&'a str>,
    sizes: Vec<&'a str>,
    types: Vec<&'a str>,
    counts: Vec<usize>,
    points: Option<usize>,
    data: Data,
}

impl<'a> Header<'a> {
    fn take(&mut self, line: usize, text: &'a str) -> Result<(), PointFileError> {
        let error = |reason| PointFileError::header(line, text, reason);
        let number = |word: &&str| word.parse().map_err(|_| error("a number was expected"));
        match *text.split_ascii_whitespace().collect::<Vec<_>>() {
            ["FIELDS", ref fields @ ..] => self.fields = fields.to_vec(),
            ["SIZE", ref sizes @ ..] => self.sizes = sizes.to_vec(),
            ["TYPE", ref types @ ..] => self.types = types.to_vec(),
            ["COUNT", ref counts @ ..] => {
                self.counts = counts.iter().map(number).collect::<Result<_, _>>()?;
            }
            ["POINTS", ref count] => self.points = Some(number(count)?),
            ["DATA", "ascii"] => self.data = Data::Ascii,
            ["DATA", "binary"] => self.data = Data::Binary,
            ["DATA", "binary_compressed"] => self.data = Data::Compressed,
            ["DATA", ..] => return Err(error("ascii, binary or binary_compressed was expected")),
            _ => {}
        }
        Ok(())
    }

    fn layout(&self) -> Result<RecordLayout, PointFileError> {
        let mut layout = RecordLayout::default();
        for (name, scalar, count) in self.kinds()? {
            layout.push(name, scalar, count);
        }
        Ok(layout)
    }

    /// The size of each field.
    fn field_bytes(&self) -> Result<Vec<usize>, PointFileError> {
        let kinds = self.kinds()?.into_iter();
        Ok(kinds.map(|(_, scalar, count)| scalar.size().saturating_mul(count)).collect())
    }

    /// Name, kind of number and count of each field.
    fn kinds(&self) -> Result<Vec<(&'a str, Scalar, usize)>, PointFileError> {
        let mut kinds = Vec::new();
        for (index, name) in self.fields.iter().enumerate() {
            let kind = (self.types.get(index).copied(), self.sizes.get(index).copied());
            let scalar = match kind {
                (Some("I"), Some("1")) => Scalar::I8,
                (Some("U"), Some("1")) => Scalar::U8,
                (Some("I"), Some("2")) => Scalar::I16,
                (Some("U"), Some("2")) => Scalar::U16,
                (Some("I"), Some("4")) => Scalar::I32,
                (Some("U"), Some("4")) => Scalar::U32,
                (Some("I"), Some("8")) => Scalar::I64,
                (Some("U"), Some("8")) => Scalar::U64,
                (Some("F"), Some("4")) => Scalar::F32,
                (Some("F"), Some("8")) => Scalar::F64,
                _ => {
                    return Err(PointFileError::FieldKind {
                        field: name.chars().take(80).collect(),
                    });
                }
            };
            // Without a COUNT line each field is one number.
            let count =
                if self.counts.is_empty() { Some(1) } else { self.counts.get(index).copied() };
            kinds.push((*name, scalar, count.unwrap_or(1)));
        }
        Ok(kinds)
    }

    fn encoding(&self) -> Encoding {
        match self.data {
            Data::Ascii => Encoding::Ascii,
            Data::Binary | Data::Compressed => Encoding::BinaryLittleEndian,
        }
    }

    fn points(&self) -> Result<usize, PointFileError> {
        self.points.ok_or(PointFileError::UnfinishedHeader { expected: "POINTS" })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn points_survive_the_file(
            points in proptest::collection::vec(proptest::array::uniform3(-1e6..1e6_f32), 0..50),
        ) {
            let points: Vec<_> = points.into_iter().map(Point3::from).collect();
            prop_assert_eq!(decode(&encode(&points)).unwrap(), points);
        }

        #[test]
        fn no_bytes_make_it_panic(mut bytes in proptest::collection::vec(any::<u8>(), 0..300), cut in 0..260_usize) {
            let _ = decode(&bytes);
            let mut file = encode(&[Point3::origin(); 3]);
            file.truncate(cut);
            file.append(&mut bytes);
            let _ = decode(&file);
        }
    }

    #[test]
    fn the_bytes_are_those_of_the_format() {
        let file = encode(&[Point3::new(1.0, -2.0, 0.5)]);
        let body = [0, 0, 0x80, 0x3f, 0, 0, 0, 0xc0, 0, 0, 0, 0x3f];
        let (header, found) = file.split_at(file.len() - body.len());
        assert_eq!(found, body);
        assert_eq!(
            std::str::from_utf8(header).unwrap(),
            "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\n\
             TYPE F F F\nCOUNT 1 1 1\nWIDTH 1\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 1\n\
             DATA binary\n"
        );
    }

    #[test]
    fn an_organised_ascii_file_is_read_without_its_holes() {
        let file = "# .PCD v.7 - Point Cloud Data file format\nVERSION .7\nFIELDS rgb normal x y z\n\
            SIZE 4 4 4 4 4\nTYPE F F F F F\nCOUNT 1 3 1 1 1\nWIDTH 2\nHEIGHT 2\n\
            VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 4\nDATA ascii\n\
            4.2e-38 0 0 1 1.5 -2.5 3.5\n0 0 0 1 nan nan nan\n0 0 0 1 0 0 inf\n0 0 0 1 1 2 3\n";
        let expected = [Point3::new(1.5, -2.5, 3.5), Point3::new(1.0, 2.0, 3.0)];
        assert_eq!(decode(file.as_bytes()).unwrap(), expected);
    }

    #[test]
    fn binary_fields_are_found_where_the_header_says() {
        let mut file =
            b"VERSION 0.7\nFIELDS pad y x z\nSIZE 1 8 4 2\nTYPE U F F I\nCOUNT 3 1 1 1\n\
            WIDTH 1\nHEIGHT 1\nPOINTS 1\nDATA binary\n"
                .to_vec();
        file.extend([9, 9, 9]);
        file.extend(2.25_f64.to_le_bytes());
        file.extend(1.5_f32.to_le_bytes());
        file.extend((-300_i16).to_le_bytes());
        assert_eq!(decode(&file).unwrap(), [Point3::new(1.5, 2.25, -300.0)]);
    }

    #[test]
    fn what_is_wrong_is_said() {
        let good = String::from_utf8(encode(&[])).unwrap();
        let with = |from: &str, to: &str| good.replace(from, to).into_bytes();
        for (file, part) in [
            (b"ply".to_vec(), "no PCD file"),
            (good.as_bytes()[..60].to_vec(), "'DATA'"),
            (with("DATA binary", "DATA zipped"), "line 11 of the header, 'DATA zipped'"),
            (with("DATA binary", "DATA binary_compressed"), "0 are compressed"),
            (with("POINTS 0", "POINTS many"), "line 10"),
            (with("POINTS 0", "POINTS 9"), "states 9 points, but there are 0"),
            (with("POINTS 0\n", ""), "'POINTS'"),
            (with("x y z", "x y w"), "no field 'z'"),
            (with("TYPE F F F", "TYPE F F"), "field 'z'"),
            (with("SIZE 4 4 4", "SIZE 4 4 3"), "field 'z'"),
            (with("COUNT 1 1 1", "COUNT 1 1 -1"), "line 6"),
        ] {
            let error = decode(&file).unwrap_err().to_string();
            assert!(error.contains(part), "{error}");
        }
        let huge = with("COUNT 1 1 1", "COUNT 18446744073709551615 1 1");
        let huge = String::from_utf8(huge).unwrap().replace("POINTS 0", "POINTS 1");
        let error = decode(huge.as_bytes()).unwrap_err();
        assert_eq!(error, PointFileError::Truncated { stated: 1, found: 0 });
    }

    /// Regression: the form in which PCL's `savePCDFileBinaryCompressed` writes was refused.
    #[test]
    fn a_compressed_file_is_read() {
        let header = b"# .PCD v0.7\nVERSION 0.7\nFIELDS x y z ring rgb\nSIZE 4 4 4 2 4\nTYPE F F F U U\n\
            COUNT 1 1 1 1 1\nWIDTH 5\nHEIGHT 1\nVIEWPOINT 1 2 3 0 1 0 0\nPOINTS 5\nDATA binary_compressed\n";
        // By LibLZF, of five points; the coordinate y of the fourth is NaN.
        let compressed: [u8; 58] = [
            4, 0, 0, 192, 63, 0, 224, 5, 3, 4, 191, 0, 0, 16, 192, 128, 3, 1, 128, 64, 32, 27, 0,
            127, 128, 7, 0, 0, 32, 39, 0, 64, 32, 15, 224, 1, 3, 13, 1, 0, 2, 0, 3, 0, 4, 0, 5, 0,
            10, 50, 100, 255, 224, 5, 3, 1, 100, 255,
        ];
        let mut file = header.to_vec();
        file.extend(58_u32.to_le_bytes());
        file.extend(90_u32.to_le_bytes());
        file.extend(compressed);
        let points = decode_with_normals(&file).unwrap();
        let expected = [[1.5, -2.25, 0.5], [1.5, -2.25, 3.0], [1.5, 4.0, 3.0], [-1.5, 4.0, 3.0]];
        assert_eq!(points.points_m, expected.map(Point3::from));
        assert_eq!(points.colours, [[100, 50, 10]; 4]);
        assert_eq!(decode(&file).unwrap(), points.points_m);
        for cut in header.len()..file.len() {
            let error = decode(&file[..cut]).unwrap_err();
            assert!(matches!(error, PointFileError::Compressed { stated: 90, .. }), "{error}");
        }
    }

    #[test]
    fn normals_survive_the_file() {
        let points = vec![Point3::new(1.0, -2.0, 0.5), Point3::new(0.0, 3.0, 0.25)];
        let normals = vec![Vector3::x(), Vector3::new(0.0, 0.6, -0.8)];
        let file = encode_with_normals(&points, &normals);
        assert_eq!(decode(&file).unwrap(), points);
        let expected = OrientedPoints { points_m: points, normals, colours: Vec::new() };
        assert_eq!(decode_with_normals(&file).unwrap(), expected);
    }

    #[test]
    fn colours_are_those_of_pcl() {
        let points = vec![Point3::new(1.0, -2.0, 0.5), Point3::new(0.0, 3.0, 0.25)];
        let (normals, colours) = (vec![Vector3::x(); 2], vec![[255, 128, 1], [0, 0, 0]]);
        let file = encode_with_colours(&points, &normals, &colours);
        let expected = OrientedPoints { points_m: points.clone(), normals, colours };
        assert_eq!(decode_with_normals(&file).unwrap(), expected);
        let file = encode_with_colours(&points, &[], &expected.colours);
        let header = String::from_utf8_lossy(&file);
        let lines = "FIELDS x y z rgb\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 1\n";
        assert!(header.contains(lines), "{header}");
        assert!(file.ends_with(&[0; 4]) && file[file.len() - 20..][..4] == [1, 128, 255, 0]);
        assert_eq!(encode_with_colours(&points, &[], &[]), encode(&points), "without, as before");
    }

    #[test]
    fn colours_of_other_programs_are_read() {
        let header = "VERSION 0.7\nFIELDS x y z rgba\nSIZE 4 4 4 4\nTYPE F F F U\nPOINTS 1\n";
        let ascii = format!("{header}DATA ascii\n1 2 3 {}\n", 0xff_64_32_0a_u32);
        assert_eq!(decode_with_normals(ascii.as_bytes()).unwrap().colours, [[100, 50, 10]]);
        let mut binary = format!("{header}DATA binary\n").into_bytes();
        binary.extend([0; 12]);
        binary.extend(0xff_64_32_0a_u32.to_le_bytes());
        assert_eq!(decode_with_normals(&binary).unwrap().colours, [[100, 50, 10]]);
        // PCL writes the bits of the colour as a float.
        let float = header.replace("rgba", "rgb").replace("TYPE F F F U", "TYPE F F F F");
        let ascii = format!("{float}DATA ascii\n1 2 3 {:e}\n", f32::from_bits(0x64_32_0a));
        assert_eq!(decode_with_normals(ascii.as_bytes()).unwrap().colours, [[100, 50, 10]]);
        // PCL 1.7 writes them as a whole number in a field of type float, other programs in one of type int.
        let ascii = format!("{float}DATA ascii\n1 2 3 {}\n", 0xff_64_32_0a_u32);
        assert_eq!(decode_with_normals(ascii.as_bytes()).unwrap().colours, [[100, 50, 10]]);
        let signed = header.replace("TYPE F F F U", "TYPE F F F I");
        let ascii = format!("{signed}DATA ascii\n1 2 3 {}\n", 0xff_64_32_0a_u32 as i32);
        assert_eq!(decode_with_normals(ascii.as_bytes()).unwrap().colours, [[100, 50, 10]]);
        let bad = format!("{header}DATA ascii\n1 2 3 red\n");
        let error = decode_with_normals(bad.as_bytes()).unwrap_err();
        assert_eq!(error, PointFileError::Number { point: 0, text: "red".to_owned() });
    }
}
