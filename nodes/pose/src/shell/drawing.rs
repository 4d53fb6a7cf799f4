//! A picture of the features and their status.

use msgs::sensor_msgs::Image;
use msgs::std_msgs::Header;

use crate::frame::Frame;
use crate::image::GrayImage;
use crate::tracking::{FeatureStatus, Tracked};

/// Bytes of a pixel of `rgb8`.
const CHANNELS: usize = 3;
/// A corner is drawn as a square of this many pixels to each side.
const CORNER_PX: i64 = 2;

/// The colours, distinguishable with red-green colour blindness, too (Okabe and Ito 2008).
fn color(status: FeatureStatus) -> [u8; CHANNELS] {
    match status {
        FeatureStatus::New => [86, 180, 233],
        FeatureStatus::Inlier => [0, 158, 115],
        FeatureStatus::Outlier => [213, 94, 0],
        FeatureStatus::LeftOut => [204, 121, 167],
    }
}

/// The gray image with the corners as squares and the segments as lines: known ones that the pose explains in green, those that
/// it does not in red, new ones in blue, those of moving things in purple.
pub(super) fn drawn(gray: &GrayImage, frame: &Frame, tracked: &Tracked, header: Header) -> Image {
    let mut data: Vec<u8> = gray.pixels().iter().flat_map(|value| [*value; CHANNELS]).collect();
    let (width, height) = (gray.width_px(), gray.height_px());
    let mut dot = |x: i64, y: i64, color: [u8; CHANNELS]| {
        let inside = (0..width as i64).contains(&x) && (0..height as i64).contains(&y);
        let start = if inside { (y as usize * width + x as usize) * CHANNELS } else { usize::MAX };
        if let Some(pixel) = data.get_mut(start..start.saturating_add(CHANNELS)) {
            pixel.copy_from_slice(&color);
        }
    };
    for (index, line) in frame.lines.iter().enumerate() {
        let color = color(tracked.lines.get(index).copied().unwrap_or_default());
        let [start, along] = [line.segment.start_px, line.segment.along_px()];
        let steps = line.segment.length_px().ceil().max(1.0);
        for step in 0..=steps as u32 {
            let share = step as f32 / steps;
            let place = [start[0] + share * along[0], start[1] + share * along[1]];
            dot(place[0].round() as i64, place[1].round() as i64, color);
        }
    }
    for (index, corner) in frame.corners.iter().enumerate() {
        let color = color(tracked.corners.get(index).copied().unwrap_or_default());
        let (x, y) = (corner.pixel.x.round() as i64, corner.pixel.y.round() as i64);
        for off in -CORNER_PX..=CORNER_PX {
            for (x, y) in [
                (x + off, y - CORNER_PX),
                (x + off, y + CORNER_PX),
                (x - CORNER_PX, y + off),
                (x + CORNER_PX, y + off),
            ] {
                dot(x, y, color);
            }
        }
    }
    Image {
        header,
        height: height as u32,
        width: width as u32,
        encoding: "rgb8".to_owned(),
        is_bigendian: 0,
        step: (width * CHANNELS) as u32,
        data,
    }
}
