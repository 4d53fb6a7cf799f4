use proptest::prelude::*;

use super::*;
use crate::builtin_interfaces::Time;
use crate::std_msgs::Header;

const JPEG: &[u8] = include_bytes!("../../../tests/data/pictures/red_blue.jpg");
const PROGRESSIVE_JPEG: &[u8] =
    include_bytes!("../../../tests/data/pictures/red_blue_progressive.jpg");
const GREY_JPEG: &[u8] = include_bytes!("../../../tests/data/pictures/ramp.jpg");
const PNG: &[u8] = include_bytes!("../../../tests/data/pictures/red_blue.png");
const ALPHA_PNG: &[u8] = include_bytes!("../../../tests/data/pictures/red_blue_alpha.png");
const GREY_PNG: &[u8] = include_bytes!("../../../tests/data/pictures/ramp.png");
const GREY_16_PNG: &[u8] = include_bytes!("../../../tests/data/pictures/ramp_16_bits.png");

const RED: [u8; 3] = [200, 30, 20];
const BLUE: [u8; 3] = [20, 40, 210];
const WIDTH_PX: usize = 32;
const HEIGHT_PX: usize = 16;

fn header() -> Header {
    Header { stamp: Time { sec: 5, nanosec: 6 }, frame_id: "camera".to_owned() }
}

fn compressed(format: &str, data: &[u8]) -> CompressedImage {
    CompressedImage { header: header(), format: format.to_owned(), data: data.to_vec() }
}

fn read(format: &str, data: &[u8]) -> Image {
    let image = image_from_compressed_message(&compressed(format, data)).unwrap();
    assert_eq!((image.width, image.height), (WIDTH_PX as u32, HEIGHT_PX as u32), "{format}");
    assert_eq!(image.step as usize * HEIGHT_PX, image.data.len(), "{format}");
    assert_eq!((&image.header, image.is_bigendian), (&header(), 0), "{format}");
    image
}

fn error_of(message: &CompressedImage) -> CompressedImageError {
    match image_from_compressed_message(message) {
        Err(ConvertError::Compressed(error)) => error,
        other => panic!("{other:?}"),
    }
}

/// The pixel in the middle of the left and of the right half.
fn halves(image: &Image) -> [[u8; 3]; 2] {
    let pixel = |column: usize| {
        let at = 8 * image.step as usize + 3 * column;
        [image.data[at], image.data[at + 1], image.data[at + 2]]
    };
    [pixel(8), pixel(24)]
}

fn reversed(mut colours: [u8; 3]) -> [u8; 3] {
    colours.reverse();
    colours
}

fn is_near(one: &[u8], other: &[u8], most: u8) -> bool {
    one.len() == other.len()
        && one.iter().zip(other).all(|(one, other)| one.abs_diff(*other) <= most)
}

#[test]
fn colours_are_those_of_the_picture_in_the_order_of_the_raw_image() {
    let pictures = [(JPEG, "jpeg", 3), (PROGRESSIVE_JPEG, "jpeg", 3), (PNG, "png", 0)];
    for (data, codec, most) in pictures.into_iter().chain([(ALPHA_PNG, "png", 0)]) {
        for (raw, encoding, red, blue) in [
            ("rgb8; CODEC compressed bgr8", "rgb8", RED, BLUE),
            ("bgr8; CODEC compressed bgr8", "bgr8", reversed(RED), reversed(BLUE)),
            ("rgba8; CODEC compressed bgr8", "rgb8", RED, BLUE),
            ("yuv422; CODEC compressed bgr8", "bgr8", reversed(RED), reversed(BLUE)),
            ("CODEC", "bgr8", reversed(RED), reversed(BLUE)),
            ("", "bgr8", reversed(RED), reversed(BLUE)),
            ("rgb8;CODEC", "rgb8", RED, BLUE),
            // Two that gave the codec red where it takes blue.
            ("rgb8; CODEC compressed rgb8", "rgb8", reversed(RED), reversed(BLUE)),
            ("bgr8; CODEC compressed rgb8", "bgr8", RED, BLUE),
        ] {
            let format = raw.replace("CODEC", codec);
            let image = read(&format, data);
            assert_eq!(image.encoding, encoding, "{format}");
            let found = halves(&image);
            assert!(is_near(&found[0], &red, most), "{format}: {found:?}");
            assert!(is_near(&found[1], &blue, most), "{format}: {found:?}");
        }
    }
}

#[test]
fn greys_keep_the_encoding_of_the_raw_image() {
    let ramp: Vec<u8> = (0..HEIGHT_PX).flat_map(|_| (0..WIDTH_PX as u8).map(|x| 8 * x)).collect();
    for (format, encoding) in [
        ("mono8; jpeg compressed ", "mono8"),
        ("mono8; png compressed ", "mono8"),
        ("8UC1; png compressed ", "8UC1"),
        ("bayer_rggb8; jpeg compressed ", "bayer_rggb8"),
        ("jpeg", "mono8"),
        ("png", "mono8"),
        ("rgb8; jpeg compressed bgr8", "mono8"),
        ("mono16; png compressed ", "mono8"),
        ("bayer_rggb16; png compressed ", "mono8"),
    ] {
        for (data, most) in [(GREY_JPEG, 3), (GREY_PNG, 0)] {
            let image = read(format, data);
            assert_eq!(image.encoding, encoding, "{format}");
            assert!(is_near(&image.data, &ramp, most), "{format}: {:?}", image.data);
        }
    }
    for (format, encoding) in [
        ("16UC1; png compressed ", "16UC1"),
        ("mono16; png compressed ", "mono16"),
        ("bayer_grbg16; png compressed ", "bayer_grbg16"),
        ("png", "16UC1"),
        ("mono8; png compressed ", "16UC1"),
    ] {
        let image = read(format, GREY_16_PNG);
        assert_eq!(image.encoding, encoding);
        let pixels = image.data.as_chunks().0.iter().map(|pair| u16::from_le_bytes(*pair));
        assert!(pixels.eq((0..512).map(|pixel| pixel * 100)), "{format}");
    }
}

#[test]
fn what_is_no_picture_is_named() {
    let depth = error_of(&compressed("16UC1; compressedDepth png", PNG));
    assert!(matches!(depth, CompressedImageError::DepthFormat { .. }), "{depth}");
    for data in [&[][..], b"GIF89a", &JPEG[1..], &[0; 40]] {
        let other = error_of(&compressed("rgb8; jpeg compressed bgr8", data));
        assert!(matches!(other, CompressedImageError::PictureFormat { .. }), "{other}");
    }
}

#[test]
fn pictures_that_are_cut_are_errors_and_not_grey_from_there_on() {
    for data in [JPEG, GREY_JPEG, PROGRESSIVE_JPEG, PNG] {
        // The end mark of PNG, 12 bytes, says nothing about the pixels.
        let unread = if data == PNG { 12 } else { 0 };
        for length in 8..data.len() - unread {
            let error = error_of(&compressed("", &data[..length]));
            assert!(matches!(error, CompressedImageError::Picture { .. }), "{length}: {error}");
        }
    }
}

#[test]
fn data_behind_a_picture_are_ignored() {
    for data in [JPEG, GREY_JPEG, PROGRESSIVE_JPEG, PNG] {
        let padded: Vec<u8> = data.iter().copied().chain([0; 100]).collect();
        assert_eq!(read("", &padded), read("", data));
    }
}

#[test]
fn a_size_that_the_data_cannot_hold_is_refused_before_it_is_allocated() {
    // Height and width stand behind the mark of the frame, its length and the bits of its samples.
    let frame = JPEG.windows(2).position(|pair| pair == [0xFF, 0xC0]).unwrap();
    let mut data = JPEG.to_vec();
    data[frame + 5..frame + 9].copy_from_slice(&[0xFF; 4]);
    assert_eq!(
        error_of(&compressed("jpeg", &data)),
        CompressedImageError::BeyondData {
            codec: "jpeg",
            width: 65_535,
            height: 65_535,
            data_bytes: JPEG.len()
        }
    );
}

/// An image whose pixels the encoding's bytes count up to, each row with two bytes of padding.
fn padded(encoding: &str, pixel_bytes: usize) -> Image {
    let row_bytes = WIDTH_PX * pixel_bytes;
    let row = |row: usize| {
        // Smooth, so that JPEG keeps it.
        (0..row_bytes).map(move |at| (at / pixel_bytes * 4 + row * 3 + at % pixel_bytes * 9) as u8)
    };
    Image {
        header: header(),
        height: HEIGHT_PX as u32,
        width: WIDTH_PX as u32,
        encoding: encoding.to_owned(),
        is_bigendian: 0,
        step: row_bytes as u32 + 2,
        data: (0..HEIGHT_PX).flat_map(|at| row(at).chain([99, 99])).collect(),
    }
}

/// The pixels without their padding.
fn rows(image: &Image, row_bytes: usize) -> Vec<u8> {
    image.data.chunks(image.step as usize).flat_map(|row| row[..row_bytes].to_vec()).collect()
}

#[test]
fn images_come_back_from_png_as_they_were() {
    for (encoding, pixel_bytes, format) in [
        ("rgb8", 3, "rgb8; png compressed bgr8"),
        ("bgr8", 3, "bgr8; png compressed bgr8"),
        ("mono8", 1, "mono8; png compressed "),
        ("8UC1", 1, "8UC1; png compressed "),
        ("16UC1", 2, "16UC1; png compressed "),
        ("mono16", 2, "mono16; png compressed "),
    ] {
        let image = padded(encoding, pixel_bytes);
        let message = compressed_message_from_image(&image, ImageCodec::Png).unwrap();
        assert_eq!((message.format.as_str(), &message.header), (format, &header()));
        let read = read(format, &message.data);
        let expected = Image {
            step: (WIDTH_PX * pixel_bytes) as u32,
            data: rows(&image, WIDTH_PX * pixel_bytes),
            ..image
        };
        assert_eq!(read, expected);
    }
    let mut big_endian = padded("16UC1", 2);
    big_endian.is_bigendian = 1;
    let message = compressed_message_from_image(&big_endian, ImageCodec::Png).unwrap();
    let data = rows(&big_endian, 2 * WIDTH_PX);
    let swapped: Vec<u8> =
        data.as_chunks().0.iter().flat_map(|[high, low]| [*low, *high]).collect();
    assert_eq!(read(&message.format, &message.data).data, swapped);
}

#[test]
fn what_is_not_opaque_is_left_out() {
    for (encoding, read_as) in [("rgba8", "rgb8"), ("bgra8", "bgr8")] {
        let image = padded(encoding, 4);
        let expected: Vec<u8> = rows(&image, 4 * WIDTH_PX)
            .as_chunks::<4>()
            .0
            .iter()
            .flat_map(|pixel| pixel[..3].to_vec())
            .collect();
        let png = compressed_message_from_image(&image, ImageCodec::Png).unwrap();
        let read_png = read(&png.format, &png.data);
        assert_eq!((read_png.encoding.as_str(), &read_png.data), (read_as, &expected));
        let jpeg = compressed_message_from_image(&image, ImageCodec::default()).unwrap();
        let read_jpeg = read(&jpeg.format, &jpeg.data);
        assert_eq!(read_jpeg.encoding, read_as);
        assert!(is_near(&read_jpeg.data, &expected, 12), "{encoding}");
    }
}

#[test]
fn images_come_back_from_jpeg_nearly_as_they_were() {
    for (encoding, pixel_bytes, format) in [
        ("rgb8", 3, "rgb8; jpeg compressed bgr8"),
        ("bgr8", 3, "bgr8; jpeg compressed bgr8"),
        ("mono8", 1, "mono8; jpeg compressed "),
    ] {
        let image = padded(encoding, pixel_bytes);
        let message = compressed_message_from_image(&image, ImageCodec::default()).unwrap();
        assert_eq!((message.format.as_str(), &message.header), (format, &header()));
        let read = read(format, &message.data);
        assert_eq!(read.encoding, encoding);
        assert!(is_near(&read.data, &rows(&image, WIDTH_PX * pixel_bytes), 12), "{encoding}");
        let worst = ImageCodec::Jpeg(JpegQuality::new(1).unwrap());
        let worst = compressed_message_from_image(&image, worst).unwrap();
        assert!(worst.data.len() < message.data.len());
    }
}

#[test]
fn what_cannot_be_compressed_is_named() {
    for (encoding, codec) in
        [("16UC1", ImageCodec::default()), ("32FC1", ImageCodec::Png), ("yuv422", ImageCodec::Png)]
    {
        let error = compressed_message_from_image(&padded(encoding, 4), codec).unwrap_err();
        assert!(matches!(error, ConvertError::Encoding { .. }), "{error}");
    }
    let mut short = padded("rgb8", 3);
    short.data.pop();
    let error = compressed_message_from_image(&short, ImageCodec::Png).unwrap_err();
    assert!(matches!(error, ConvertError::DataTooShort { .. }), "{error}");
    let flat = |width, height, pixels| {
        let encoding = "mono8".to_owned();
        Image { encoding, width, height, step: width, data: vec![0; pixels], ..Image::default() }
    };
    for (image, codec) in [
        (flat(0, 0, 0), ImageCodec::Png),
        (flat(0, 3, 0), ImageCodec::default()),
        (flat(70_000, 1, 70_000), ImageCodec::default()),
    ] {
        match compressed_message_from_image(&image, codec) {
            Err(ConvertError::Compressed(CompressedImageError::NoPicture { .. })) => {}
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn qualities_are_1_to_100() {
    assert_eq!("95".parse(), Ok(JpegQuality::default()));
    assert_eq!(JpegQuality::new(1).map(JpegQuality::get), Ok(1));
    for text in ["0", "101", "-1", "300", "high", ""] {
        let error = text.parse::<JpegQuality>().unwrap_err().to_string();
        assert!(error.starts_with(&format!("{text:?} is no quality")), "{error}");
    }
}

proptest! {
    #[test]
    fn damage_is_survived(
        picture in prop_oneof![
            Just(JPEG), Just(GREY_JPEG), Just(PROGRESSIVE_JPEG), Just(PNG), Just(ALPHA_PNG),
        ],
        hits in proptest::collection::vec((any::<proptest::sample::Index>(), any::<u8>()), 1..6),
        cut in any::<proptest::sample::Index>(),
        tail in proptest::collection::vec(any::<u8>(), 0..40),
    ) {
        let mut data = picture.to_vec();
        for (at, value) in &hits {
            let at = at.index(data.len());
            data[at] = *value;
        }
        if cut.index(2) == 0 {
            data.truncate(cut.index(data.len() + 1));
        }
        data.extend(tail);
        if let Ok(image) = image_from_compressed_message(&compressed("", &data)) {
            let pixels = image.width as usize * image.height as usize;
            prop_assert!(pixels <= data.len() * 1032);
            prop_assert_eq!(image.step as usize * image.height as usize, image.data.len());
        }
    }

    #[test]
    fn anything_is_survived(
        format in ".{0,40}",
        start in prop_oneof![Just(&JPEG_START[..]), Just(&PNG_START[..]), Just(&[][..])],
        data in proptest::collection::vec(any::<u8>(), 0..99),
    ) {
        let data: Vec<u8> = start.iter().copied().chain(data).collect();
        prop_assert!(image_from_compressed_message(&compressed(&format, &data)).is_err());
    }
}
