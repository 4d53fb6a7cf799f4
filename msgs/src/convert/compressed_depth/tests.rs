use geometry::Stamp;
use proptest::prelude::*;

use super::*;

/// A picture that no encoder of this project wrote: 5 x 5 pixels, the five rows with the five filters
/// of PNG in their order, compressed by zlib.
#[rustfmt::skip]
const PICTURE: [u8; 121] = [
    0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a, 0x00, 0x00, 0x00, 0x0d, 0x49, 0x48, 0x44, 0x52,
    0x00, 0x00, 0x00, 0x05, 0x00, 0x00, 0x00, 0x05, 0x10, 0x00, 0x00, 0x00, 0x00, 0xf8, 0x94, 0xa5,
    0x7a, 0x00, 0x00, 0x00, 0x40, 0x49, 0x44, 0x41, 0x54, 0x78, 0xda, 0x63, 0x60, 0x60, 0x60, 0x60,
    0x64, 0x60, 0x62, 0xf8, 0xcf, 0xc8, 0xc0, 0xc8, 0x7a, 0x07, 0xc8, 0xfc, 0xf7, 0x5b, 0xf5, 0xff,
    0x7f, 0x26, 0xae, 0x23, 0x5c, 0x87, 0xb8, 0x8e, 0xf1, 0x2f, 0x62, 0x64, 0x64, 0xfe, 0xb9, 0xfd,
    0xe7, 0xe7, 0xdf, 0x9e, 0xc2, 0x2b, 0xef, 0x9a, 0xb0, 0xfc, 0xff, 0xc1, 0xc8, 0x58, 0xb7, 0xeb,
    0xff, 0x7f, 0x31, 0x26, 0x00, 0xd5, 0x5d, 0x15, 0x1d, 0x1b, 0x9b, 0x61, 0x00, 0x00, 0x00, 0x00,
    0x00, 0x49, 0x45, 0x4e, 0x44, 0xae, 0x42, 0x60, 0x82,
];
#[rustfmt::skip]
const PICTURE_PIXELS: [u16; 25] = [
    0, 1, 2, 255, 256,
    1500, 1501, 1499, 0, 65535,
    4000, 3999, 4001, 4002, 0,
    7, 70, 700, 7000, 60000,
    65535, 0, 32768, 32767, 1,
];
/// Where the width and behind it the height stand in the picture.
const WIDTH_AT: usize = 16;

fn message(format: &str, parameters: [f32; 2], picture: &[u8]) -> CompressedImage {
    let mut data = INVERSE_DEPTH.to_le_bytes().to_vec();
    data.extend(parameters.iter().flat_map(|parameter| parameter.to_le_bytes()));
    data.extend(picture);
    CompressedImage { format: format.to_owned(), data, ..CompressedImage::default() }
}

fn error_of(message: &CompressedImage) -> CompressedImageError {
    match compressed_depth_from_message(message) {
        Err(ConvertError::Compressed(error)) => error,
        other => panic!("{other:?}"),
    }
}

fn image(size_px: (usize, usize), pixels: DepthPixels) -> DepthImage {
    DepthImage::new(Stamp::from_nanos(77), "camera".to_owned(), size_px, pixels).unwrap()
}

#[test]
fn the_picture_of_another_encoder_is_read() {
    for format in [
        "16UC1; compressedDepth png",
        "16UC1; compressedDepth",
        "16UC1;compressedDepth  png ",
        "mono16; compressedDepth png",
    ] {
        let read = compressed_depth_from_message(&message(format, [3.0, 4.0], &PICTURE)).unwrap();
        assert_eq!((read.width_px(), read.height_px()), (5, 5), "{format}");
        // The largest value is no depth.
        let measured =
            PICTURE_PIXELS.map(|depth_mm| if depth_mm == u16::MAX { 0 } else { depth_mm });
        assert_eq!(read.pixels(), &DepthPixels::Millimetres(measured.to_vec()), "{format}");
    }
}

#[test]
fn quantised_inverse_depth_becomes_metres() {
    // The usual parameters: quantisation 100 up to 10 m, so that a = 100 * 101 and b = 1 - a / 10.
    let (a, b) = (10_100.0_f32, 1.0 - 1010.0_f32);
    for format in ["32FC1; compressedDepth png", "32FC1; compressedDepth"] {
        let read = compressed_depth_from_message(&message(format, [a, b], &PICTURE)).unwrap();
        assert_eq!(read.depth_m(0, 0), None);
        assert_eq!(read.depth_m(1, 0), Some(10.0));
        let near_m = read.depth_m(0, 1).unwrap();
        assert!((f64::from(near_m) - 10_100.0 / 2509.0).abs() < 1e-6, "{near_m}");
        let DepthPixels::Metres(pixels) = read.pixels() else { panic!("{read:?}") };
        assert!(pixels[0].is_nan());
    }
    // A parameter b among the values: at and below it there is no depth.
    let read = message("32FC1; compressedDepth png", [1.0, 2.0], &PICTURE);
    let read = compressed_depth_from_message(&read).unwrap();
    assert_eq!((read.depth_m(1, 0), read.depth_m(2, 0)), (None, None));
    assert_eq!(read.depth_m(3, 0), Some(1.0 / 253.0));
    for (a, b) in [(0.0, 1.0), (-1.0, 1.0), (f32::NAN, 1.0), (1.0, f32::INFINITY)] {
        let error = error_of(&message("32FC1; compressedDepth png", [a, b], &PICTURE));
        assert!(matches!(error, CompressedImageError::Quantisation { .. }), "{error}");
    }
}

#[test]
fn messages_of_other_codecs_and_transports_are_named() {
    let error = error_of(&message("16UC1; compressedDepth zstd", [0.0; 2], &[0; 9]));
    assert_eq!(error, CompressedImageError::DepthCodec { codec: "zstd".to_owned() });
    assert!(error.to_string().contains("compressedDepth.format"), "{error}");
    for format in ["", "png", "16UC1", "rgb8; jpeg compressed bgr8", "8UC1; compressedDepth png"] {
        let error = error_of(&message(format, [0.0; 2], &PICTURE));
        assert_eq!(error, CompressedImageError::NoDepthFormat { format: format.to_owned() });
    }
    let error = error_of(&message(&"é".repeat(1000), [0.0; 2], &PICTURE));
    assert!(error.to_string().len() < 350, "{error}");
}

#[test]
fn data_that_is_cut_anywhere_is_an_error_until_only_the_end_mark_is_missing() {
    let whole = message("16UC1; compressedDepth png", [0.0; 2], &PICTURE);
    let end_mark = HEADER_BYTES + PICTURE.len() - 12;
    for data_bytes in 0..end_mark {
        let mut cut = whole.clone();
        cut.data.truncate(data_bytes);
        let error = error_of(&cut);
        if data_bytes < HEADER_BYTES {
            let header_bytes = HEADER_BYTES;
            let expected = CompressedImageError::Header { codec: "png", data_bytes, header_bytes };
            assert_eq!(error, expected);
        } else {
            let is_damage = matches!(error, CompressedImageError::Picture { codec: "png", .. });
            assert!(is_damage, "{data_bytes}: {error}");
        }
    }
}

#[test]
fn a_size_that_the_data_cannot_hold_is_refused_before_it_is_allocated() {
    let mut picture = PICTURE.to_vec();
    picture[WIDTH_AT..WIDTH_AT + 8]
        .copy_from_slice(&[0x7f, 0xff, 0xff, 0xff, 0x7f, 0xff, 0xff, 0xff]);
    // The header's checksum, so that only the size is wrong.
    let mut checksum = u32::MAX;
    for byte in &picture[12..29] {
        checksum ^= u32::from(*byte);
        for _ in 0..8 {
            checksum = (checksum >> 1) ^ (0xedb8_8320 & (checksum & 1).wrapping_neg());
        }
    }
    picture[29..33].copy_from_slice(&(!checksum).to_be_bytes());
    let side = 0x7fff_ffff;
    assert_eq!(
        error_of(&message("16UC1; compressedDepth png", [0.0; 2], &picture)),
        CompressedImageError::BeyondData {
            codec: "png",
            width: side,
            height: side,
            data_bytes: PICTURE.len()
        }
    );
}

#[test]
fn pictures_of_other_pixels_are_named() {
    let mut picture = Vec::new();
    write_png(&[1, 2, 3], Layout::Rgb8, (1, 1), &mut picture).unwrap();
    let error = error_of(&message("16UC1; compressedDepth png", [0.0; 2], &picture));
    let found = "colours of 8 bits".to_owned();
    let wanted = "a depth image, grey of 16 bits";
    assert_eq!(error, CompressedImageError::OtherPixels { found, wanted });
}

/// The stream of `rvl/tests.rs`: 0, 0, 5, 6, 0, 4.
const RVL_STREAM: [u8; 4] = [0x13, 0x21, 0xA1, 0x22];

fn rvl_message(format: &str, parameters: [f32; 2], size_px: [u32; 2]) -> CompressedImage {
    let sizes = size_px.iter().flat_map(|side| side.to_le_bytes());
    message(format, parameters, &sizes.chain(RVL_STREAM).collect::<Vec<u8>>())
}

#[test]
fn a_stream_worked_out_by_hand_is_read_and_written() {
    let pixels = DepthPixels::Millimetres(vec![0, 0, 5, 6, 0, 4]);
    for format in ["16UC1; compressedDepth rvl", "16UC1;compressedDepth rvl"] {
        let read = compressed_depth_from_message(&rvl_message(format, [0.0; 2], [3, 2])).unwrap();
        assert_eq!((read.width_px(), read.height_px()), (3, 2), "{format}");
        assert_eq!(read.pixels(), &pixels, "{format}");
    }
    let image = image((3, 2), pixels);
    let written =
        compressed_message_from_depth_with(&image, DepthCodec::Rvl, MetresAs::default()).unwrap();
    let expected = rvl_message("16UC1; compressedDepth rvl", [0.0; 2], [3, 2]);
    assert_eq!((written.format, written.data), (expected.format, expected.data));

    let read = rvl_message("32FC1; compressedDepth rvl", [10_100.0, -1009.0], [2, 3]);
    let read = compressed_depth_from_message(&read).unwrap();
    assert_eq!((read.depth_m(0, 0), read.depth_m(0, 1)), (None, Some(10_100.0 / 1014.0)));
}

#[test]
fn streams_that_are_cut_or_of_other_sizes_are_named() {
    let format = "16UC1; compressedDepth rvl";
    let whole = rvl_message(format, [0.0; 2], [3, 2]);
    for data_bytes in 0..whole.data.len() {
        let mut cut = whole.clone();
        cut.data.truncate(data_bytes);
        let header = |header_bytes, data_bytes| CompressedImageError::Header {
            codec: "rvl",
            data_bytes,
            header_bytes,
        };
        let expected = match data_bytes {
            0..HEADER_BYTES => header(HEADER_BYTES, data_bytes),
            12..20 => header(RVL_SIZE_BYTES, data_bytes - HEADER_BYTES),
            _ => CompressedImageError::Rvl(RvlError::Ends { at_px: 0, pixels: 6 }),
        };
        assert_eq!(error_of(&cut), expected);
    }
    for [width, height] in [[u32::MAX; 2], [4097, 4096], [1 << 16, 1 << 16]] {
        let error = error_of(&rvl_message(format, [0.0; 2], [width, height]));
        let most_pixels = 16_777_216;
        let expected = CompressedImageError::TooLarge { codec: "rvl", width, height, most_pixels };
        assert_eq!(error, expected);
    }
    let error = error_of(&rvl_message(format, [0.0; 2], [4096, 4096]));
    assert!(matches!(error, CompressedImageError::Rvl(RvlError::Ends { at_px: 6, .. })), "{error}");
    // A PNG picture under the name of the other codec.
    let error = error_of(&message(format, [0.0; 2], &PICTURE));
    assert!(error.to_string().contains("\"rvl\" picture of 1196314761 x 169478669"), "{error}");
}

#[test]
fn metres_are_rounded_to_millimetres() {
    let depths_m = [1.4996_f32, 65.534, 65.535, 0.0004, -1.0, 0.0, f32::NAN, f32::INFINITY];
    let message =
        compressed_message_from_depth(&image((8, 1), DepthPixels::Metres(depths_m.into())));
    let message = message.unwrap();
    assert_eq!(message.format, "16UC1; compressedDepth png");
    let read = compressed_depth_from_message(&message).unwrap();
    assert_eq!(read.pixels(), &DepthPixels::Millimetres(vec![1500, 65_534, 0, 0, 0, 0, 0, 0]));
}

#[test]
fn an_image_without_pixels_is_no_picture() {
    for size_px in [(0, 0), (3, 0), (0, 3)] {
        let error = compressed_message_from_depth(&image(size_px, DepthPixels::Metres(Vec::new())));
        assert!(is_no_picture(&error, "png"), "{error:?}");
        for pixels in [DepthPixels::Metres(Vec::new()), DepthPixels::Millimetres(Vec::new())] {
            let image = image(size_px, pixels);
            let error =
                compressed_message_from_depth_with(&image, DepthCodec::Rvl, MetresAs::default());
            assert!(is_no_picture(&error, "rvl"), "{error:?}");
        }
    }
    let large = image((1 << 13, 1 << 12), DepthPixels::Millimetres(vec![0; 1 << 25]));
    let error = compressed_message_from_depth_with(&large, DepthCodec::Rvl, MetresAs::default());
    assert!(is_no_picture(&error, "rvl"), "{error:?}");
}

fn is_no_picture(result: &Result<CompressedImage, ConvertError>, of: &str) -> bool {
    let Err(ConvertError::Compressed(error)) = result else { return false };
    matches!(error, CompressedImageError::NoPicture { codec, .. } if *codec == of)
}

#[test]
fn metres_travel_as_inverse_depth_where_that_is_wanted() {
    let depths_m = [1.5_f32, 9.9, 0.5, 12.0, 0.1, 0.0, f32::NAN, -1.0];
    let image = image((4, 2), DepthPixels::Metres(depths_m.into()));
    let as_inverse = MetresAs::InverseDepth(InverseDepth::default());
    for (codec, format) in [
        (DepthCodec::Png, "32FC1; compressedDepth png"),
        (DepthCodec::Rvl, "32FC1; compressedDepth rvl"),
    ] {
        let message = compressed_message_from_depth_with(&image, codec, as_inverse).unwrap();
        assert_eq!(message.format, format);
        assert_eq!(message.data[4..8], 10_100.0_f32.to_le_bytes());
        assert_eq!(message.data[8..12], (-1009.0_f32).to_le_bytes());
        let read = compressed_depth_from_message(&message).unwrap();
        for (column, row, depth_m) in [(0, 0, 1.5), (1, 0, 9.9), (2, 0, 0.5)] {
            let read_m = read.depth_m(column, row).unwrap();
            assert!((read_m - depth_m).abs() < depth_m * depth_m / 20_000.0, "{read_m}");
        }
        for (column, row) in [(3, 0), (0, 1), (1, 1), (2, 1), (3, 1)] {
            assert_eq!(read.depth_m(column, row), None);
        }
    }
}

#[test]
fn a_depth_image_of_a_room_is_a_third_of_its_raw_size() {
    // A wall and a floor as a structured-light camera sees them: disparities in steps of an eighth of a
    // pixel, of which noise hits the next one now and then.
    let (width_px, height_px) = (640, 480);
    let (focal_px, baseline_m) = (525.0, 0.075);
    let mut state = 1_u32;
    let mut pixels = Vec::new();
    for row in 0..height_px {
        for column in 0..width_px {
            state ^= state << 13;
            state ^= state >> 17;
            state ^= state << 5;
            let depth_m = 2.0 + 0.002 * f64::from(column) - 0.003 * f64::from(row.max(240) - 240);
            let noise = f64::from(state % 100) / 100.0 - 0.5;
            let disparity_px = (focal_px * baseline_m / depth_m * 8.0 + noise).round() / 8.0;
            pixels.push((focal_px * baseline_m / disparity_px * 1e3) as u16);
        }
    }
    let raw_bytes = pixels.len() * size_of::<u16>();
    let image = image((width_px as usize, height_px as usize), DepthPixels::Millimetres(pixels));
    let message = compressed_message_from_depth(&image).unwrap();
    assert!(message.data.len() < raw_bytes / 3, "{} of {raw_bytes} bytes", message.data.len());
    assert_eq!(compressed_depth_from_message(&message), Ok(image));
}

proptest! {
    #[test]
    fn millimetres_come_back_as_they_were(
        width in 1..40_usize,
        height in 1..40_usize,
        values in proptest::collection::vec(any::<u16>(), 1600),
        codec in prop_oneof![Just(DepthCodec::Png), Just(DepthCodec::Rvl)],
        metres_as in prop_oneof![
            Just(MetresAs::Millimetres),
            Just(MetresAs::InverseDepth(InverseDepth::default())),
        ],
    ) {
        let pixels = DepthPixels::Millimetres(values[..width * height].to_vec());
        let image = image((width, height), pixels);
        let message = compressed_message_from_depth_with(&image, codec, metres_as).unwrap();
        prop_assert_eq!(&message.data[..HEADER_BYTES], &[0; HEADER_BYTES]);
        prop_assert_eq!(compressed_depth_from_message(&message), Ok(image));
    }

    #[test]
    fn damage_is_survived(
        format in prop_oneof![
            Just("16UC1; compressedDepth png"),
            Just("32FC1; compressedDepth png"),
        ],
        hits in proptest::collection::vec((any::<proptest::sample::Index>(), any::<u8>()), 1..6),
        cut in any::<proptest::sample::Index>(),
        tail in proptest::collection::vec(any::<u8>(), 0..40),
    ) {
        let mut message = message(format, [10_100.0, -1009.0], &PICTURE);
        for (at, value) in &hits {
            let at = at.index(message.data.len());
            message.data[at] = *value;
        }
        message.data.truncate(cut.index(message.data.len() + 1));
        message.data.extend(tail);
        if let Ok(read) = compressed_depth_from_message(&message) {
            prop_assert_eq!((read.width_px(), read.height_px()), (5, 5));
        }
    }

    #[test]
    fn streams_of_anything_are_survived(
        is_metres in any::<bool>(),
        parameters in any::<[u32; 2]>(),
        size_px in prop_oneof![[0..40_u32, 0..40], [any::<u32>(), any::<u32>()]],
        stream in proptest::collection::vec(any::<u8>(), 0..300),
    ) {
        let format =
            if is_metres { "32FC1; compressedDepth rvl" } else { "16UC1; compressedDepth rvl" };
        let sizes = size_px.iter().flat_map(|side| side.to_le_bytes());
        let picture: Vec<u8> = sizes.chain(stream).collect();
        let message = message(format, parameters.map(f32::from_bits), &picture);
        if let Ok(read) = compressed_depth_from_message(&message) {
            prop_assert_eq!((read.width_px() as u32, read.height_px() as u32), size_px.into());
            prop_assert!(read.width_px() * read.height_px() <= MOST_RVL_PIXELS);
        }
    }

    #[test]
    fn anything_is_survived(
        format in ".{0,40}",
        data in proptest::collection::vec(any::<u8>(), 0..99),
    ) {
        let message = CompressedImage { format, data, ..CompressedImage::default() };
        prop_assert!(compressed_depth_from_message(&message).is_err());
    }
}
