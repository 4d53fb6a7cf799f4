//! How long the messages of one camera frame take: `cargo bench -p msgs`.

#![allow(clippy::print_stdout, reason = "the table is what this program is for")]

use std::hint::black_box;
use std::time::Instant;

use geometry::{Cloud, DepthImage, DepthPixels, Stamp};
use msgs::sensor_msgs::{Image, PointCloud2};
use msgs::{cdr, convert};
use nalgebra::Point3;

const WIDTH_PX: usize = 640;
const HEIGHT_PX: usize = 480;
const PIXELS: usize = WIDTH_PX * HEIGHT_PX;
const ROUNDS: usize = 101;

/// The median of [`ROUNDS`] runs.
fn median_ms<T>(mut work: impl FnMut() -> T) -> f64 {
    let mut durations_ms: Vec<f64> = (0..ROUNDS)
        .map(|_| {
            let start = Instant::now();
            black_box(work());
            start.elapsed().as_secs_f64() * 1e3
        })
        .collect();
    durations_ms.sort_by(f64::total_cmp);
    durations_ms[ROUNDS / 2]
}

/// A point for each pixel; one in five, in no order, is without a return.
fn cloud_message(point_step: usize, big_endian: bool) -> PointCloud2 {
    let points_m = vec![Point3::new(1.5, -0.25, 0.75); PIXELS];
    let plain = convert::message_from_cloud(&Cloud { points_m, ..Cloud::default() });
    let mut data = vec![0; PIXELS * point_step];
    let mut state = 1_u32;
    for (record, source) in data.chunks_exact_mut(point_step).zip(plain.data.chunks_exact(12)) {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        for (axis, bytes) in source.chunks_exact(4).enumerate() {
            let nothing = state.is_multiple_of(5);
            let value =
                if nothing { [0, 0, 0xC0, 0x7F] } else { [bytes[0], bytes[1], bytes[2], bytes[3]] };
            let mut value = value;
            if big_endian {
                value.reverse();
            }
            record[4 * axis..4 * axis + 4].copy_from_slice(&value);
        }
    }
    PointCloud2 {
        height: HEIGHT_PX as u32,
        width: WIDTH_PX as u32,
        point_step: point_step as u32,
        row_step: (WIDTH_PX * point_step) as u32,
        is_bigendian: big_endian,
        data,
        ..plain
    }
}

fn main() {
    for (name, message) in [
        ("16 bytes a point", cloud_message(16, false)),
        ("32 bytes a point", cloud_message(32, false)),
        ("32 bytes, big endian", cloud_message(32, true)),
    ] {
        let convert_ms = median_ms(|| convert::cloud_from_message(&message));
        let bytes = cdr::encode(&message).unwrap_or_default();
        let encode_ms = median_ms(|| cdr::encode(&message));
        let decode_ms = median_ms(|| cdr::decode::<PointCloud2>(&bytes));
        let copy_ms = median_ms(|| bytes.clone());
        println!(
            "PointCloud2, {name}: to a cloud {convert_ms:.3} ms, encode {encode_ms:.3} ms, \
             decode {decode_ms:.3} ms (copying the bytes: {copy_ms:.3} ms)"
        );
    }
    let pixels = DepthPixels::Millimetres((0..PIXELS).map(|pixel| pixel as u16).collect());
    let size_px = (WIDTH_PX, HEIGHT_PX);
    let Ok(image) = DepthImage::new(Stamp::default(), String::new(), size_px, pixels) else {
        return;
    };
    let message: Image = convert::message_from_depth(&image);
    let convert_ms = median_ms(|| convert::depth_from_message(&message));
    let back_ms = median_ms(|| convert::message_from_depth(&image));
    println!("Image, 16UC1: to a depth image {convert_ms:.3} ms, back {back_ms:.3} ms");
    let points_m = vec![Point3::new(1.5, -0.25, 0.75); PIXELS];
    let cloud = Cloud { points_m, ..Cloud::default() };
    let back_ms = median_ms(|| convert::message_from_cloud(&cloud));
    println!("Cloud of {PIXELS} points to its message {back_ms:.3} ms");
}
