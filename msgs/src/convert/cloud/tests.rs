use geometry::Stamp;
use nalgebra::Point3;
use proptest::prelude::*;

use super::*;

fn field(name: &str, offset: u32, datatype: u8) -> PointField {
    PointField { name: name.to_owned(), offset, datatype, count: 1 }
}

/// How the points of a test are written into a message.
#[derive(Clone, Debug)]
struct Writing {
    /// Name, offset and datatype of each field.
    fields: Vec<(&'static str, u32, u8)>,
    point_step: u32,
    width: u32,
    height: u32,
    /// Bytes behind each row.
    row_padding: u32,
    big_endian: bool,
}

impl Writing {
    fn floats(points: usize, point_step: u32) -> Self {
        let float = PointField::FLOAT32;
        Self {
            fields: vec![("x", 0, float), ("y", 4, float), ("z", 8, float)],
            point_step,
            width: points as u32,
            height: 1,
            row_padding: 0,
            big_endian: false,
        }
    }

    fn bytes_of(&self, value: f64, datatype: u8) -> Vec<u8> {
        macro_rules! bytes {
            ($number:expr) => {
                if self.big_endian {
                    $number.to_be_bytes().to_vec()
                } else {
                    $number.to_le_bytes().to_vec()
                }
            };
        }
        match datatype {
            PointField::INT8 => bytes!((value as i8)),
            PointField::UINT8 => bytes!((value as u8)),
            PointField::INT16 => bytes!((value as i16)),
            PointField::UINT16 => bytes!((value as u16)),
            PointField::INT32 => bytes!((value as i32)),
            PointField::UINT32 => bytes!((value as u32)),
            PointField::FLOAT32 => bytes!((value as f32)),
            _ => bytes!(value),
        }
    }

    /// What is not a coordinate is 0xFF, so that reading beside a coordinate shows.
    fn write(&self, points: &[[f64; 3]]) -> PointCloud2 {
        let row_step = self.width * self.point_step + self.row_padding;
        let mut data = vec![0xFF; (row_step * self.height) as usize];
        for (index, point) in points.iter().enumerate() {
            let (row, column) = (index as u32 / self.width, index as u32 % self.width);
            let start = row * row_step + column * self.point_step;
            for (name, offset, datatype) in &self.fields {
                let Some(axis) = ["x", "y", "z"].iter().position(|axis| axis == name) else {
                    continue;
                };
                let bytes = self.bytes_of(point[axis], *datatype);
                let at = (start + offset) as usize;
                data[at..at + bytes.len()].copy_from_slice(&bytes);
            }
        }
        PointCloud2 {
            height: self.height,
            width: self.width,
            fields: self.fields.iter().map(|(name, at, kind)| field(name, *at, *kind)).collect(),
            is_bigendian: self.big_endian,
            point_step: self.point_step,
            row_step,
            data,
            is_dense: false,
            ..PointCloud2::default()
        }
    }
}

fn points_of(message: &PointCloud2) -> Result<Vec<[f32; 3]>, ConvertError> {
    Ok(cloud_from_message(message)?.points_m.iter().map(|point| point.coords.into()).collect())
}

const POINTS: [[f64; 3]; 6] = [
    [1.0, 2.0, 3.0],
    [4.0, 5.0, 6.0],
    [7.0, 8.0, 9.0],
    [10.0, 11.0, 12.0],
    [13.0, 14.0, 15.0],
    [16.0, 17.0, 18.0],
];

fn expected() -> Vec<[f32; 3]> {
    POINTS.iter().map(|point| point.map(|value| value as f32)).collect()
}

#[test]
fn layouts_of_drivers_are_read() {
    let float = PointField::FLOAT32;
    let organised = |fields, point_step, row_padding| Writing {
        fields,
        point_step,
        width: 3,
        height: 2,
        row_padding,
        big_endian: false,
    };
    for writing in [
        // Kinect v1 and openni2: x y z, four bytes of nothing, rgb, twelve of nothing.
        organised(
            vec![("x", 0, float), ("y", 4, float), ("z", 8, float), ("rgb", 16, float)],
            32,
            0,
        ),
        // realsense2, azure_kinect.
        organised(
            vec![("x", 0, float), ("y", 4, float), ("z", 8, float), ("rgb", 12, float)],
            16,
            0,
        ),
        // Rows padded.
        organised(vec![("x", 0, float), ("y", 4, float), ("z", 8, float)], 12, 20),
        // Fields in another order, one of them before the coordinates.
        organised(
            vec![("intensity", 0, float), ("z", 4, float), ("x", 8, float), ("y", 12, float)],
            16,
            0,
        ),
        // The coordinates behind something, together.
        organised(vec![("t", 0, 6), ("x", 4, float), ("y", 8, float), ("z", 12, float)], 16, 4),
        // Not aligned.
        organised(vec![("x", 1, float), ("y", 5, float), ("z", 9, float), ("ring", 13, 4)], 15, 1),
        // One row.
        Writing::floats(6, 12),
        // The last coordinate ends with the record.
        organised(vec![("x", 8, float), ("y", 4, float), ("z", 12, float)], 16, 0),
    ] {
        for big_endian in [false, true] {
            let writing = Writing { big_endian, ..writing.clone() };
            assert_eq!(points_of(&writing.write(&POINTS)), Ok(expected()), "{writing:?}");
        }
    }
}

#[test]
fn every_datatype_is_read_in_both_byte_orders() {
    for datatype in PointField::INT8..=PointField::FLOAT64 {
        for big_endian in [false, true] {
            let fields = vec![("z", 1, datatype), ("y", 10, datatype), ("x", 19, datatype)];
            let writing =
                Writing { fields, point_step: 27, width: 2, height: 3, row_padding: 3, big_endian };
            assert_eq!(points_of(&writing.write(&POINTS)), Ok(expected()), "{writing:?}");
        }
    }
    // Signed and unsigned differ.
    let negative = |datatype| {
        let fields = vec![("x", 0, datatype), ("y", 8, datatype), ("z", 16, datatype)];
        let writing = Writing { fields, point_step: 24, ..Writing::floats(1, 24) };
        points_of(&writing.write(&[[-3.0, -2.0, -1.0]])).unwrap()
    };
    for datatype in [1, 3, 5, 7, 8] {
        assert_eq!(negative(datatype), [[-3.0, -2.0, -1.0]], "datatype {datatype}");
    }
}

#[test]
fn the_upper_half_of_unsigned_numbers_is_positive() {
    for (datatype, value) in
        [(PointField::UINT8, 200.0), (PointField::UINT16, 40_000.0), (PointField::UINT32, 3e9)]
    {
        let fields = vec![("x", 0, datatype), ("y", 4, datatype), ("z", 8, datatype)];
        let writing = Writing { fields, ..Writing::floats(1, 12) };
        let expected = [value as f32; 3];
        assert_eq!(points_of(&writing.write(&[[value; 3]])), Ok(vec![expected]));
    }
}

#[test]
fn mixed_datatypes_are_read() {
    let fields = vec![
        ("x", 0, PointField::FLOAT64),
        ("y", 8, PointField::FLOAT32),
        ("z", 12, PointField::INT16),
    ];
    let writing = Writing { fields, point_step: 14, ..Writing::floats(6, 14) };
    assert_eq!(points_of(&writing.write(&POINTS)), Ok(expected()));
}

#[test]
fn points_that_are_not_finite_are_dropped_whatever_is_dense_says() {
    let (nan, infinite) = (f64::NAN, f64::INFINITY);
    let mut points = vec![[1.0, 2.0, 3.0]; 200];
    points[0] = [nan, 2.0, 3.0];
    points[1] = [1.0, nan, 3.0];
    points[64] = [1.0, 2.0, nan];
    points[65] = [infinite, 2.0, 3.0];
    points[199] = [1.0, -infinite, 3.0];
    let mut message = Writing::floats(200, 16).write(&points);
    message.is_dense = true;
    assert_eq!(points_of(&message).unwrap(), vec![[1.0, 2.0, 3.0]; 195]);

    // Finite as 64 bits, not as 32.
    let fields = vec![("x", 0, 8), ("y", 8, 8), ("z", 16, 8)];
    let writing = Writing { fields, point_step: 24, ..Writing::floats(2, 24) };
    let message = writing.write(&[[1e300, 0.0, 0.0], [1.0, 2.0, 3.0]]);
    assert_eq!(points_of(&message), Ok(vec![[1.0, 2.0, 3.0]]));
}

#[test]
fn stamp_and_frame_are_kept() {
    let mut message = Writing::floats(1, 12).write(&POINTS[..1]);
    message.header.stamp = crate::builtin_interfaces::Time { sec: 3, nanosec: 4 };
    message.header.frame_id = "camera_depth_optical_frame".to_owned();
    let cloud = cloud_from_message(&message).unwrap();
    assert_eq!(cloud.stamp, Stamp::from_nanos(3_000_000_004));
    assert_eq!(cloud.frame_id, "camera_depth_optical_frame");
}

#[test]
fn a_cloud_without_points_is_empty_whatever_it_says() {
    for (width, height) in [(0, 0), (0, 1), (7, 0), (0, u32::MAX)] {
        let message = PointCloud2 { width, height, ..PointCloud2::default() };
        assert_eq!(points_of(&message), Ok(Vec::new()));
    }
}

#[test]
fn drivers_may_leave_the_count_and_the_row_step_of_a_single_row_unset() {
    let mut message = Writing::floats(6, 12).write(&POINTS);
    message.row_step = 0;
    for field in &mut message.fields {
        field.count = 0;
    }
    assert_eq!(points_of(&message), Ok(expected()));
}

#[test]
fn fields_that_lie_are_named() {
    let whole = Writing::floats(6, 12).write(&POINTS);
    let with = |change: &dyn Fn(&mut PointCloud2)| {
        let mut message = whole.clone();
        change(&mut message);
        cloud_from_message(&message).unwrap_err()
    };
    assert_eq!(
        with(&|message| message.fields[1].name = "range".to_owned()),
        ConvertError::MissingField { field: "y", present: "x, range, z".to_owned() }
    );
    assert_eq!(
        with(&|message| message.fields.push(field("z", 0, 7))),
        ConvertError::RepeatedField { field: "z", times: 2 }
    );
    for datatype in [0, 9, 255] {
        assert_eq!(
            with(&|message| message.fields[0].datatype = datatype),
            ConvertError::FieldDatatype { field: "x", datatype }
        );
    }
    assert_eq!(
        with(&|message| message.fields[0].count = 3),
        ConvertError::FieldCount { field: "x", count: 3 }
    );
    for offset in [9, 12, u32::MAX] {
        assert_eq!(
            with(&|message| message.fields[2].offset = offset),
            ConvertError::FieldOutsidePoint { field: "z", offset, size_bytes: 4, point_step: 12 }
        );
    }
    assert_eq!(
        with(&|message| message.point_step = 0),
        ConvertError::FieldOutsidePoint { field: "x", offset: 0, size_bytes: 4, point_step: 0 }
    );
}

#[test]
fn sizes_that_lie_are_named() {
    let whole = Writing::floats(6, 12).write(&POINTS);
    let with = |width, height, row_step, data_bytes| {
        let mut message = PointCloud2 { width, height, row_step, ..whole.clone() };
        message.data.truncate(data_bytes);
        cloud_from_message(&message)
    };
    assert!(with(6, 1, 72, 72).is_ok());
    assert_eq!(
        with(6, 1, 72, 71),
        Err(ConvertError::DataTooShort {
            message: "PointCloud2",
            height: 1,
            step: 72,
            needed_bytes: 72,
            data_bytes: 71
        })
    );
    // A row beyond the data, and rows that overlap, which would multiply the data.
    assert!(matches!(with(6, 1, 73, 72), Err(ConvertError::DataTooShort { .. })));
    assert_eq!(
        with(6, 1_000_000, 0, 72),
        Err(ConvertError::RowStep { message: "PointCloud2", width: 6, row_bytes: 72, step: 0 })
    );
    assert!(matches!(with(u32::MAX, u32::MAX, 72, 72), Err(ConvertError::RowStep { .. })));
    assert!(matches!(
        with(u32::MAX, u32::MAX, u32::MAX, 72),
        Err(ConvertError::RowStep { row_bytes: 51_539_607_540, .. })
    ));
    assert!(matches!(with(1, u32::MAX, u32::MAX, 72), Err(ConvertError::DataTooShort { .. })));
    assert!(matches!(with(u32::MAX, 1, 0, 72), Err(ConvertError::DataTooShort { .. })));
}

#[test]
fn points_of_an_organised_cloud_keep_their_pixels() {
    let none = [f64::NAN; 3];
    let points = [[1.0, 2.0, 3.0], none, none, none, [4.0, 5.0, 6.0], none];
    let rows = Writing { width: 3, height: 2, row_padding: 5, ..Writing::floats(6, 16) };
    let fields = vec![("x", 4, 7), ("y", 0, 7), ("z", 8, 7)];
    for writing in [rows.clone(), Writing { fields, big_endian: true, ..rows }] {
        let cloud = organised_cloud_from_message(&writing.write(&points)).unwrap();
        assert_eq!((cloud.width_px(), cloud.height_px()), (3, 2));
        let kept: Vec<_> = cloud.with_pixels().map(|(point, pixel)| (point.z, pixel)).collect();
        assert_eq!(kept, [(3.0, [0, 0]), (6.0, [1, 1])]);
    }
}

#[test]
fn the_fast_path_and_the_careful_path_agree_around_the_block() {
    for count in [0, 1, 63, 64, 65, 127, 128, 129, 640] {
        let points: Vec<_> = (0..count)
            .map(|index| [index as f64, if index % 3 == 0 { f64::NAN } else { 0.5 }, -1.0])
            .collect();
        let plain = Writing::floats(count, 16);
        let fields = vec![("x", 4, 7), ("y", 0, 7), ("z", 8, 7)];
        let crossed = Writing { fields, ..plain.clone() };
        let (plain, crossed) = (plain.write(&points), crossed.write(&points));
        let kept = points_of(&plain).unwrap();
        assert_eq!(kept.len(), count - count.div_ceil(3));
        assert_eq!(kept, points_of(&crossed).unwrap());
    }
}

proptest! {
    #[test]
    fn a_cloud_comes_back(
        points in proptest::collection::vec(proptest::array::uniform3(-9e3..9e3_f32), 0..200),
        nanos in 0..i64::from(u32::MAX),
    ) {
        let cloud = Cloud {
            stamp: Stamp::from_nanos(nanos),
            frame_id: "map".to_owned(),
            points_m: points.into_iter().map(Point3::from).collect(),
        };
        let message = message_from_cloud(&cloud);
        let organised = organised_cloud_from_message(&message).unwrap();
        prop_assert_eq!(organised.cloud(), &cloud);
        prop_assert_eq!(cloud_from_message(&message), Ok(cloud));
    }

    #[test]
    fn anything_is_survived(
        size in proptest::array::uniform2(prop_oneof![3 => 0..5_u32, 1 => any::<u32>()]),
        steps in proptest::array::uniform2(prop_oneof![3 => 0..40_u32, 1 => any::<u32>()]),
        offsets in proptest::array::uniform3(prop_oneof![9 => 0..20_u32, 1 => any::<u32>()]),
        datatypes in proptest::array::uniform3(0..10_u8),
        data in proptest::collection::vec(any::<u8>(), 0..200),
        is_bigendian in any::<bool>(),
    ) {
        let names = ["x", "y", "z"].iter().zip(offsets).zip(datatypes);
        let message = PointCloud2 {
            width: size[0],
            height: size[1],
            fields: names.map(|((name, offset), kind)| field(name, offset, kind)).collect(),
            is_bigendian,
            point_step: steps[0],
            row_step: steps[1],
            data,
            ..PointCloud2::default()
        };
        let organised = organised_cloud_from_message(&message);
        prop_assert_eq!(organised.map(|organised| organised.cloud().clone()), cloud_from_message(&message));
        if let Ok(cloud) = cloud_from_message(&message) {
            prop_assert!(cloud.points_m.capacity() <= message.data.len());
            prop_assert!(cloud.points_m.iter().all(|point| point.coords.iter().all(|v| v.is_finite())));
        }
    }
}
