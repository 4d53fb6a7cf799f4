use proptest::prelude::*;

use super::*;
use crate::convert::{depth_from_message, organised_cloud_from_message};
use crate::sensor_msgs::PointField;

fn beams(mask: &[bool], background_m: Option<f32>) -> Vec<MovingBeam> {
    let moving = (0..).zip(mask).filter(|(_, is_moving)| **is_moving);
    moving.map(|(index, _)| MovingBeam { index, background_m }).collect()
}

/// The bits of the numbers: NaN is no other NaN by accident.
fn bits(ranges: &[f32]) -> Vec<u32> {
    ranges.iter().map(|range| range.to_bits()).collect()
}

#[test]
fn a_beam_is_filled_only_where_the_background_is_known_and_in_range() {
    let message = LaserScan { ranges: vec![1.0; 4], range_max: 8.0, ..LaserScan::default() };
    let beam = |index, background_m| MovingBeam { index, background_m };
    let moving = [beam(0, Some(3.0)), beam(1, None), beam(2, Some(9.0)), beam(77, Some(2.0))];
    let filled = static_scan(&message, &moving, BeamFill::Background);
    assert_eq!(bits(&filled.ranges), bits(&[3.0, f32::NAN, f32::NAN, 1.0]));
    let cut = static_scan(&message, &moving, BeamFill::Nan);
    assert_eq!(bits(&cut.ranges), bits(&[f32::NAN, f32::NAN, f32::NAN, 1.0]));
}

#[test]
fn a_ray_that_a_scan_has_again_after_a_turn_is_judged_as_the_first_time() {
    let angle_increment = std::f32::consts::TAU / 4.0;
    let message = LaserScan { ranges: vec![1.0; 6], angle_increment, ..LaserScan::default() };
    let moving = beams(&[false, true, false, false], None);
    let cut = static_scan(&message, &moving, BeamFill::Nan);
    assert_eq!(bits(&cut.ranges), bits(&[1.0, f32::NAN, 1.0, 1.0, 1.0, f32::NAN]));
    let alone = dynamic_scan(&message, &moving);
    let nan = f32::NAN;
    assert_eq!(bits(&alone.ranges), bits(&[nan, 1.0, nan, nan, nan, 1.0]));
}

#[test]
fn a_mask_of_another_size_is_refused_with_both() {
    let image = Image {
        encoding: "16UC1".to_owned(),
        width: 2,
        height: 1,
        step: 4,
        data: vec![1; 4],
        ..Image::default()
    };
    let error = depth_without(&image, &[true], true).unwrap_err();
    assert_eq!(error, ConvertError::Mask { message: "Image", entries: 1, records: 2 });
    let colour = Image { encoding: "rgb8".to_owned(), ..image };
    assert!(matches!(depth_without(&colour, &[true; 2], true), Err(ConvertError::Encoding { .. })));
}

#[test]
fn whole_numbers_cannot_be_taken_out_of_a_cloud() {
    let field = |name: &str, offset| PointField {
        name: name.to_owned(),
        offset,
        datatype: PointField::INT16,
        count: 1,
    };
    let cloud = PointCloud2 {
        width: 1,
        height: 1,
        point_step: 6,
        row_step: 6,
        fields: vec![field("x", 0), field("y", 2), field("z", 4)],
        data: vec![1; 6],
        ..PointCloud2::default()
    };
    assert_eq!(cloud_without(&cloud, &[true], true), Err(ConvertError::NotANumber { field: "x" }));
    assert_eq!(cloud_without(&cloud, &[false], true), Ok(cloud));
}

/// Encodings with the bytes of a pixel, what is black, and how many neighbours share a colour.
const COLOURS: [(&str, usize, &[u8], usize); 14] = [
    ("rgb8", 3, &[0; 3], 1),
    ("bgr8", 3, &[0; 3], 1),
    ("8UC3", 3, &[0; 3], 1),
    ("rgba8", 4, &[0; 3], 1),
    ("bgra8", 4, &[0; 3], 1),
    ("mono8", 1, &[0], 1),
    ("mono16", 2, &[0; 2], 1),
    ("rgb16", 6, &[0; 6], 1),
    ("bgra16", 8, &[0; 6], 1),
    ("bayer_grbg8", 1, &[0], 1),
    ("bayer_rggb16", 2, &[0; 2], 1),
    ("yuv422", 2, &[128, 0], 2),
    ("yuv422_yuy2", 2, &[0, 128], 2),
    ("yuyv", 2, &[0, 128], 2),
];

#[test]
fn encodings_of_which_it_is_not_known_what_is_black_are_refused() {
    for encoding in ["nv21", "yuv420", "16UC1", "32FC1", "", "rgb"] {
        let image = Image {
            encoding: encoding.to_owned(),
            width: 1,
            height: 1,
            step: 4,
            data: vec![7; 4],
            ..Image::default()
        };
        let error = colour_without(&image, &[true], true).unwrap_err();
        assert!(matches!(error, ConvertError::Encoding { .. }), "{error}");
    }
}

proptest! {
    /// A step that is shorter than a row, rows that are missing, images without pixels, masks of another size.
    #[test]
    fn any_colour_image_is_survived(
        encoding in prop::sample::select(COLOURS.map(|(encoding, ..)| encoding).to_vec()),
        width in prop_oneof![0..5_u32, any::<u32>()],
        height in prop_oneof![0..5_u32, any::<u32>()],
        step in prop_oneof![0..40_u32, any::<u32>()],
        data in prop::collection::vec(any::<u8>(), 0..99),
        mask in prop::collection::vec(any::<bool>(), 0..20),
        is_bigendian in any::<u8>(),
    ) {
        let message =
            Image { width, height, step, data, is_bigendian, encoding: encoding.to_owned(), ..Image::default() };
        if let Ok(filtered) = colour_without(&message, &mask, true) {
            prop_assert_eq!(u64::from(width) * u64::from(height), mask.len() as u64);
            prop_assert_eq!(filtered.data.len(), message.data.len());
        }
    }

    #[test]
    fn what_moves_is_black_and_all_other_bytes_of_a_colour_image_are_as_they_were(
        (encoding, pixel_bytes, black, shared) in prop::sample::select(COLOURS.to_vec()),
        (width, height) in (1..8_u32, 1..6_u32),
        padding in 0..5_u32,
        is_bigendian in 0..2_u8,
        bytes in prop::collection::vec(any::<u8>(), 7 * 5 * 8 + 5 * 5),
        mask in prop::collection::vec(prop::bool::weighted(0.3), 35),
    ) {
        let step = width * pixel_bytes as u32 + padding;
        let message = Image {
            width, height, step, is_bigendian,
            encoding: encoding.to_owned(),
            data: bytes[..(step * height) as usize].to_vec(),
            ..Image::default()
        };
        let mask = &mask[..(width * height) as usize];
        for removed in [true, false] {
            let filtered = colour_without(&message, mask, removed).unwrap();
            let mut expected = message.clone();
            for pixel in 0..mask.len() {
                let (column, row) = (pixel % width as usize, pixel / width as usize);
                let first = column - column % shared;
                let together = first..(first + shared).min(width as usize);
                let is_moving = together.clone().any(|column| mask[row * width as usize + column]);
                if is_moving == removed {
                    let at = row * step as usize + column * pixel_bytes;
                    expected.data[at..at + black.len()].copy_from_slice(black);
                }
            }
            prop_assert_eq!(&filtered, &expected);
        }
    }

    #[test]
    fn beams_that_do_not_move_are_bit_identical(
        beams_of_scan in prop::collection::vec((any::<f32>(), any::<f32>(), any::<bool>()), 0..80),
        background_m in prop::option::of(0.1..5.0_f32),
        fill in prop_oneof![Just(BeamFill::Nan), Just(BeamFill::Background)],
        angle_min in any::<f32>(),
    ) {
        let ranges: Vec<f32> = beams_of_scan.iter().map(|beam| beam.0).collect();
        let intensities: Vec<f32> = beams_of_scan.iter().map(|beam| beam.1).collect();
        let mask: Vec<bool> = beams_of_scan.iter().map(|beam| beam.2).collect();
        let mut message =
            LaserScan { ranges, intensities, angle_min, range_max: 8.0, ..LaserScan::default() };
        message.header.frame_id = "laser".to_owned();
        message.header.stamp.nanosec = 7;
        let moving = beams(&mask, background_m);
        let (kept, taken) = (static_scan(&message, &moving, fill), dynamic_scan(&message, &moving));
        for (beam, is_moving) in mask.iter().enumerate() {
            let [raw, kept, taken] =
                [&message, &kept, &taken].map(|scan| scan.ranges[beam].to_bits());
            let fill_m = background_m.filter(|_| fill == BeamFill::Background);
            let empty = f32::NAN.to_bits();
            let filled = fill_m.unwrap_or(f32::NAN).to_bits();
            prop_assert_eq!((kept, taken), if *is_moving { (filled, raw) } else { (raw, empty) });
        }
        for scan in [kept, taken] {
            prop_assert_eq!(bits(&scan.intensities), bits(&message.intensities));
            prop_assert_eq!(&scan.header, &message.header);
            prop_assert_eq!(scan.angle_min.to_bits(), message.angle_min.to_bits());
            prop_assert_eq!(scan.ranges.len(), message.ranges.len());
        }
    }

    #[test]
    fn pixels_that_do_not_move_are_bit_identical(
        (width, height) in (1..7_u32, 1..7_u32),
        padding in 0..5_u32,
        metres in any::<bool>(),
        is_bigendian in 0..2_u8,
        bytes in prop::collection::vec(any::<u8>(), 7 * 7 * 4 + 7 * 5),
        mask in prop::collection::vec(any::<bool>(), 49),
    ) {
        let (encoding, pixel_bytes) = if metres { ("32FC1", 4) } else { ("16UC1", 2) };
        let step = width * pixel_bytes + padding;
        let message = Image {
            width, height, step, is_bigendian,
            encoding: encoding.to_owned(),
            data: bytes[..(step * height) as usize].to_vec(),
            ..Image::default()
        };
        let mask = &mask[..(width * height) as usize];
        for removed in [true, false] {
            let filtered = depth_without(&message, mask, removed).unwrap();
            let depths = depth_from_message(&filtered).unwrap();
            let mut rest = filtered.clone();
            for (pixel, is_moving) in mask.iter().enumerate() {
                let (column, row) = (pixel % width as usize, pixel / width as usize);
                if *is_moving == removed {
                    prop_assert_eq!(depths.depth_m(column, row), None);
                    let at = row * step as usize + column * pixel_bytes as usize;
                    let own = at..at + pixel_bytes as usize;
                    rest.data[own.clone()].copy_from_slice(&message.data[own]);
                }
            }
            prop_assert_eq!(&rest, &message);
        }
    }

    #[test]
    fn points_that_do_not_move_are_bit_identical(
        (width, height) in (1..6_u32, 1..6_u32),
        padding in 0..5_u32,
        is_bigendian in any::<bool>(),
        bytes in prop::collection::vec(any::<u8>(), 25 * 20 + 25),
        mask in prop::collection::vec(any::<bool>(), 25),
    ) {
        let field = |name: &str, offset, datatype| {
            PointField { name: name.to_owned(), offset, datatype, count: 1 }
        };
        let float = PointField::FLOAT32;
        let fields = vec![
            field("rgb", 0, float), field("z", 4, float), field("x", 8, float), field("y", 16, float),
        ];
        let row_step = width * 20 + padding;
        let message = PointCloud2 {
            width, height, row_step, is_bigendian, fields,
            point_step: 20,
            data: bytes[..(row_step * height) as usize].to_vec(),
            is_dense: true,
            ..PointCloud2::default()
        };
        let mask = &mask[..(width * height) as usize];
        let filtered = cloud_without(&message, mask, true).unwrap();
        let organised = organised_cloud_from_message(&filtered).unwrap();
        for (_, [column, row]) in organised.with_pixels() {
            prop_assert!(!mask[row * width as usize + column]);
        }
        let mut rest = filtered.clone();
        for (point, _) in mask.iter().enumerate().filter(|(_, is_moving)| **is_moving) {
            let (column, row) = (point % width as usize, point / width as usize);
            let start = row * row_step as usize + column * 20;
            for coordinate in [4, 8, 16] {
                let own = start + coordinate..start + coordinate + 4;
                rest.data[own.clone()].copy_from_slice(&message.data[own]);
            }
        }
        prop_assert_eq!(filtered.is_dense, !mask.contains(&true));
        rest.is_dense = true;
        prop_assert_eq!(&rest, &message);
    }
}
