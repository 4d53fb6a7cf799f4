//! What drivers write in another way than the simulator.

use std::f32::consts::TAU;

use geometry::{DepthImage, DepthPixels, Distortion};
use msgs::convert::{self, DepthCodec, InverseDepth, MetresAs};
use msgs::sensor_msgs::{CompressedImage, Image, LaserScan};

/// Bytes that a driver leaves free behind each row.
const PADDING: usize = 6;

/// The lenses: a Kinect's, an Azure Kinect's, an OAK's, and one of 2 mm.
pub(super) const PLUMB_BOB: Distortion =
    Distortion::PlumbBob([0.138_263, -0.279_976, 0.002_072, 0.008_884, 0.0]);
pub(super) const RATIONAL: Distortion =
    Distortion::Rational([0.52, -2.5, 0.000_4, -0.000_2, 1.4, 0.4, -2.3, 1.35]);
pub(super) const PRISM: Distortion = Distortion::RationalPrism([
    0.52, -2.5, 0.000_4, -0.000_2, 1.4, 0.4, -2.3, 1.35, 0.002, -0.000_8, 0.001_4, 0.000_4,
]);
pub(super) const FISHEYE: Distortion = Distortion::Equidistant([0.02, -0.01, 0.003, -0.000_5]);

/// How `compressed_depth_image_transport` compresses.
#[derive(Clone, Copy)]
pub(super) struct Codec {
    codec: DepthCodec,
    metres_as: fn() -> MetresAs,
}

pub(super) const PNG: Codec = Codec { codec: DepthCodec::Png, metres_as: MetresAs::default };
pub(super) const RVL: Codec = Codec { codec: DepthCodec::Rvl, metres_as: MetresAs::default };
/// Its default for metres: the inverse of the depth in steps.
pub(super) const PNG_OF_METRES: Codec =
    Codec { codec: DepthCodec::Png, metres_as: || MetresAs::InverseDepth(InverseDepth::default()) };

impl Codec {
    pub(super) fn compressed(self, image: &Image) -> CompressedImage {
        let depth = convert::depth_from_message(image).unwrap();
        convert::compressed_message_from_depth_with(&depth, self.codec, (self.metres_as)()).unwrap()
    }
}

/// Each beam so many times, at smaller steps.
pub(super) fn finer(scan: &mut LaserScan, times: usize) {
    let step_rad = scan.angle_increment / times as f32;
    // Around the beam that they are made of.
    scan.angle_min -= step_rad * (times - 1) as f32 / 2.0;
    scan.angle_increment = step_rad;
    scan.time_increment /= times as f32;
    scan.ranges = scan.ranges.iter().flat_map(|range| std::iter::repeat_n(*range, times)).collect();
    scan.angle_max = scan.angle_min + step_rad * (scan.ranges.len() - 1) as f32;
}

/// What has no return in a scan is written so.
pub(super) fn no_return(scan: &mut LaserScan, as_written: f32) {
    let is_range = scan.range_min..=scan.range_max;
    for range in scan.ranges.iter_mut().filter(|range| !is_range.contains(*range)) {
        *range = as_written;
    }
}

/// The same beams, the last one first.
pub(super) fn backwards(scan: &mut LaserScan) {
    scan.ranges.reverse();
    (scan.angle_min, scan.angle_max) = (scan.angle_max, scan.angle_min);
    scan.angle_increment = -scan.angle_increment;
}

/// The beams from straight ahead on, from 0 to 2 pi.
pub(super) fn from_zero(scan: &mut LaserScan) {
    let ahead = (-scan.angle_min / scan.angle_increment).round() as usize;
    let azimuth_rad = scan.angle_min + ahead as f32 * scan.angle_increment;
    scan.ranges.rotate_left(ahead);
    scan.angle_min = azimuth_rad;
    scan.angle_max = azimuth_rad + TAU - scan.angle_increment;
}

pub(super) fn first_beam_again(scan: &mut LaserScan) {
    scan.ranges.push(scan.ranges[0]);
    scan.angle_max += scan.angle_increment;
}

/// As a scanner sees it whose z axis points down.
pub(super) fn upside_down(scan: &mut LaserScan) {
    scan.ranges.reverse();
    (scan.angle_min, scan.angle_max) = (-scan.angle_max, -scan.angle_min);
}

/// In metres, with this where nothing was measured.
pub(super) fn in_metres(image: &mut Image, nothing: f32) {
    let depth = convert::depth_from_message(image).unwrap();
    let DepthPixels::Millimetres(pixels) = depth.pixels() else { panic!("in metres already") };
    let metres = |&pixel: &u16| if pixel == 0 { nothing } else { f32::from(pixel) * 1e-3 };
    let pixels = DepthPixels::Metres(pixels.iter().map(metres).collect());
    let size_px = (depth.width_px(), depth.height_px());
    let depth = DepthImage::new(depth.stamp, depth.frame_id, size_px, pixels).unwrap();
    *image = convert::message_from_depth(&depth);
}

pub(super) fn big_endian_and_padded(image: &mut Image) {
    let bytes = image.step as usize / image.width as usize;
    image.data.chunks_exact_mut(bytes).for_each(<[u8]>::reverse);
    let rows = image.data.chunks_exact(image.step as usize);
    image.data = rows.flat_map(|row| [row, &[0xEE; PADDING]].concat()).collect();
    image.step += PADDING as u32;
    image.is_bigendian = 1;
}
