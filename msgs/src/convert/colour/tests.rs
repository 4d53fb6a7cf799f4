use geometry::{Cloud, Stamp};
use nalgebra::Point3;
use proptest::prelude::*;

use super::*;
use crate::convert::{ImageCodec, compressed_message_from_image, image_from_compressed_message};

fn image(encoding: &str, width: u32, step: u32, data: &[u8]) -> Image {
    let encoding = encoding.to_owned();
    let height = (data.len() / step as usize) as u32;
    Image { encoding, width, height, step, data: data.to_vec(), ..Image::default() }
}

#[test]
fn each_encoding_gives_red_green_and_blue() {
    let two = [[1, 2, 3], [4, 5, 6]];
    let cases: [(&str, &[u8]); 8] = [
        ("rgb8", &[1, 2, 3, 4, 5, 6]),
        ("bgr8", &[3, 2, 1, 6, 5, 4]),
        ("8UC3", &[3, 2, 1, 6, 5, 4]),
        ("rgba8", &[1, 2, 3, 0, 4, 5, 6, 255]),
        ("bgra8", &[3, 2, 1, 0, 6, 5, 4, 255]),
        ("8UC4", &[3, 2, 1, 0, 6, 5, 4, 255]),
        ("mono8", &[7, 8]),
        ("8UC1", &[7, 8]),
    ];
    for (encoding, data) in cases {
        let read = colour_image_from_message(&image(encoding, 2, data.len() as u32, data)).unwrap();
        let expected = if data.len() == 2 { [[7; 3], [8; 3]] } else { two };
        assert_eq!(read.pixels(), expected, "{encoding}");
        assert_eq!((read.width_px(), read.height_px()), (2, 1));
    }
    let padded = image("bgr8", 1, 4, &[3, 2, 1, 99, 6, 5, 4, 99]);
    assert_eq!(colour_image_from_message(&padded).unwrap().pixels(), two);
}

#[test]
fn what_is_no_colour_image_is_named() {
    let error = colour_image_from_message(&image("16UC1", 1, 2, &[0; 2])).unwrap_err();
    assert!(error.to_string().contains("16UC1") && error.to_string().contains("bgra8"), "{error}");
    let mut short = image("rgb8", 2, 6, &[0; 6]);
    short.height = 2;
    assert!(colour_image_from_message(&short).is_err());
}

/// What a driver compresses is read with the same colours, by whatever order they had.
#[test]
fn compressed_images_have_the_same_colours() {
    let raw = image("bgr8", 2, 6, &[3, 2, 1, 6, 5, 4]);
    let expected = colour_image_from_message(&raw).unwrap();
    let compressed = compressed_message_from_image(&raw, ImageCodec::Png).unwrap();
    let back = image_from_compressed_message(&compressed).unwrap();
    assert_eq!(colour_image_from_message(&back).unwrap(), expected);
    let again = message_from_colour_image(&expected, "camera");
    assert_eq!((again.encoding.as_str(), again.step), ("rgb8", 6));
    assert_eq!(colour_image_from_message(&again).unwrap(), expected);
}

fn coloured(points: &[([f32; 3], [u8; 3])]) -> ColouredCloud {
    let (points_m, colours) = points.iter().map(|(at, it)| (Point3::from(*at), *it)).unzip();
    let cloud = Cloud { stamp: Stamp::from_nanos(5), frame_id: "map".to_owned(), points_m };
    ColouredCloud { cloud, colours }
}

proptest! {
    #[test]
    fn a_coloured_cloud_comes_back(
        points in proptest::collection::vec((proptest::array::uniform3(-9.0..9.0_f32), any::<[u8; 3]>()), 1..50),
    ) {
        let cloud = coloured(&points);
        let message = message_from_coloured_cloud(&cloud);
        prop_assert_eq!(coloured_cloud_from_message(&message).unwrap(), cloud.clone());
        prop_assert_eq!(super::super::cloud_from_message(&message).unwrap(), cloud.cloud);
    }
}

#[test]
fn the_field_is_the_one_that_viewers_expect() {
    let cloud = coloured(&[([1.0, 2.0, 3.0], [200, 100, 50])]);
    let message = message_from_coloured_cloud(&cloud);
    let field = message.fields.last().unwrap();
    assert_eq!(
        (field.name.as_str(), field.offset, field.datatype),
        ("rgb", 12, PointField::FLOAT32)
    );
    assert_eq!((message.point_step, message.row_step, message.data.len()), (16, 16, 16));
    let packed = u32::from_le_bytes(message.data[12..].try_into().unwrap());
    assert_eq!(packed, 0x00c8_6432);
    let plain = ColouredCloud { colours: Vec::new(), ..cloud.clone() };
    assert_eq!(message_from_coloured_cloud(&plain), message_from_cloud(&cloud.cloud));
    assert_eq!(coloured_cloud_from_message(&message_from_coloured_cloud(&plain)).unwrap(), plain);
}

/// Drivers call the field a float or an unsigned number, `rgb` or `rgba`, and some write the largest byte first.
#[test]
fn colours_of_drivers_are_read() {
    let cloud = coloured(&[([1.0, 2.0, 3.0], [200, 100, 50]), ([f32::NAN; 3], [9, 8, 7])]);
    for (name, datatype) in [("rgb", PointField::FLOAT32), ("rgba", PointField::UINT32)] {
        let mut message = message_from_coloured_cloud(&cloud);
        message.fields[3].name = name.to_owned();
        message.fields[3].datatype = datatype;
        let all = colours_from_cloud_message(&message).unwrap();
        assert_eq!(all, Some(vec![[200, 100, 50], [9, 8, 7]]));
        assert_eq!(coloured_cloud_from_message(&message).unwrap().colours, [[200, 100, 50]]);
        message.is_bigendian = true;
        message.data.as_chunks_mut::<4>().0.iter_mut().for_each(|bytes| bytes.reverse());
        assert_eq!(colours_from_cloud_message(&message).unwrap(), all);
        message.fields[3].datatype = PointField::UINT8;
        assert_eq!(colours_from_cloud_message(&message).unwrap(), None);
    }
}
