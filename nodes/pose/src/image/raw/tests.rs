use super::*;

const RED: [u8; 3] = [200, 30, 10];

fn raw<'a>(
    encoding: &str,
    size: (usize, usize),
    step_bytes: usize,
    data: &'a [u8],
) -> RawImage<'a> {
    let encoding = encoding.parse().unwrap();
    let (width_px, height_px) = size;
    RawImage { width_px, height_px, encoding, is_big_endian: false, step_bytes, data }
}

/// Rows of pixels, with three bytes of padding after each but the last.
fn padded(
    pixel: impl Fn(usize, usize) -> Vec<u8>,
    (width, height): (usize, usize),
) -> (usize, Vec<u8>) {
    let mut data = Vec::new();
    let mut step = 0;
    for row in 0..height {
        let start = data.len();
        data.extend((0..width).flat_map(|column| pixel(column, row)));
        step = data.len() - start + 3;
        if row + 1 < height {
            data.extend([9; 3]);
        }
    }
    (step, data)
}

#[test]
fn every_encoding_gives_the_brightness() {
    let [r, g, b] = RED;
    let expected = (0.299 * 200.0 + 0.587 * 30.0 + 0.114 * 10.0_f64).round() as u8;
    let y = expected;
    let cases: [(&str, Vec<u8>); 12] = [
        ("mono8", vec![y]),
        ("8UC1", vec![y]),
        ("mono16", vec![7, y]),
        ("16UC1", vec![250, y]),
        ("rgb8", vec![r, g, b]),
        ("bgr8", vec![b, g, r]),
        ("8UC3", vec![b, g, r]),
        ("rgba8", vec![r, g, b, 1]),
        ("bgra8", vec![b, g, r, 1]),
        ("8UC4", vec![b, g, r, 1]),
        ("yuv422", vec![128, y]),
        ("yuyv", vec![y, 128]),
    ];
    for (encoding, pixel) in cases {
        let (step, data) = padded(|_, _| pixel.clone(), (4, 3));
        let gray = gray_from_raw(&raw(encoding, (4, 3), step, &data)).unwrap();
        assert_eq!((gray.width_px(), gray.height_px()), (4, 3));
        assert!(
            gray.pixels().iter().all(|&gray| gray.abs_diff(expected) <= 1),
            "{encoding}: {gray:?}"
        );
    }
    let bytes = [y, 7];
    let mut big = raw("mono16", (1, 1), 2, &bytes);
    big.is_big_endian = true;
    assert_eq!(gray_from_raw(&big).unwrap().pixels(), [y]);
}

#[test]
fn pixels_keep_their_places() {
    let value = |column: usize, row: usize| (column * 10 + row) as u8;
    for encoding in ["mono8", "mono16", "rgb8", "bgra8", "yuv422", "yuv422_yuy2"] {
        let pixel = |column, row| {
            let value = value(column, row);
            match encoding {
                "mono8" => vec![value],
                "mono16" => vec![0, value],
                "rgb8" => vec![value; 3],
                "bgra8" => vec![value; 4],
                "yuv422" => vec![128, value],
                _ => vec![value, 128],
            }
        };
        let (step, data) = padded(pixel, (6, 4));
        let gray = gray_from_raw(&raw(encoding, (6, 4), step, &data)).unwrap();
        for row in 0..4 {
            for column in 0..6 {
                assert_eq!(gray.pixel(column, row), Some(value(column, row)), "{encoding}");
            }
        }
    }
}

/// A scene whose colours change evenly is interpolated without an error, whatever the pattern.
#[test]
fn all_eight_bayer_patterns_give_the_brightness_of_an_even_scene() {
    let colour = |column: usize, row: usize| {
        [40 + 4 * column + 2 * row, 90 + 2 * column + 4 * row, 200 - 6 * column]
            .map(|value| value as u8)
    };
    let (width, height) = (12, 10);
    for (name, colours) in [("rggb", "rggb"), ("bggr", "bggr"), ("gbrg", "gbrg"), ("grbg", "grbg")]
    {
        for bits in ["8", "16"] {
            let pixel = |column: usize, row: usize| {
                let which = colours.as_bytes()[row % 2 * 2 + column % 2];
                let channel =
                    ["r", "g", "b"].iter().position(|c| c.as_bytes()[0] == which).unwrap();
                let value = colour(column, row)[channel];
                if bits == "8" { vec![value] } else { vec![0, value] }
            };
            let (step, data) = padded(pixel, (width, height));
            let encoding = format!("bayer_{name}{bits}");
            let gray = gray_from_raw(&raw(&encoding, (width, height), step, &data)).unwrap();
            for row in 1..height - 1 {
                for column in 1..width - 1 {
                    let [r, g, b] = colour(column, row);
                    let expected = luma(r, g, b);
                    let found = gray.pixel(column, row).unwrap();
                    assert!(
                        found.abs_diff(expected) <= 1,
                        "{encoding} {column} {row}: {found} {expected}"
                    );
                }
            }
        }
    }
}

#[test]
fn bytes_that_hold_no_such_image_are_refused() {
    let data = [0; 100];
    let error = |image| gray_from_raw(&image).unwrap_err();
    let short_step = RawImageError::Step { step_bytes: 5, width_px: 2, needed_bytes: 6 };
    assert_eq!(error(raw("rgb8", (2, 2), 5, &data)), short_step);
    let short_data = RawImageError::Data { bytes: 100, height_px: 11, needed_bytes: 106 };
    assert_eq!(error(raw("rgb8", (2, 11), 10, &data)), short_data);
    assert_eq!(
        error(raw("yuv422", (3, 1), 6, &data)),
        RawImageError::Size { width_px: 3, height_px: 1 }
    );
    for size in [(usize::MAX, 2), (1 << 20, 1 << 20), (usize::MAX, 1)] {
        assert!(matches!(error(raw("mono8", size, 10, &data)), RawImageError::Size { .. }));
    }
    let huge_step = raw("mono8", (2, 3), usize::MAX, &data);
    assert!(gray_from_raw(&huge_step).is_err());
    for size in [(0, 0), (0, 5), (5, 0)] {
        assert!(gray_from_raw(&raw("mono8", size, 5, &[])).unwrap().pixels().is_empty());
    }
    assert!("rgb9".parse::<PixelEncoding>().unwrap_err().to_string().contains("\"rgb9\""));
}
