//! Shared by the examples that are compared with other programs.

use std::fs;
use std::path::Path;

use pose::image::{GrayImage, RawImage, gray_from_raw};

/// How long this thread has been on a processor.
pub(crate) fn processor_ms() -> f64 {
    let spent = fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    let spent_ns = spent.split(' ').next().and_then(|number| number.parse::<f64>().ok());
    spent_ns.unwrap_or_default() / 1e6
}

/// A picture as the gray image that features are found in.
pub(crate) fn read(path: &Path) -> GrayImage {
    let picture = image::open(path).unwrap().to_rgb8();
    let (width_px, height_px) = (picture.width() as usize, picture.height() as usize);
    let raw = RawImage {
        width_px,
        height_px,
        encoding: "rgb8".parse().unwrap(),
        is_big_endian: false,
        step_bytes: 3 * width_px,
        data: picture.as_raw(),
    };
    gray_from_raw(&raw).unwrap()
}
