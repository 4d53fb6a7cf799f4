//! The bytes that the scripts of the pages read: numbers as differences of neighbours, and what the sensors saw in a cycle.
//!
//! The report carries them compressed in its page; the live view sends them. `page/src/payload.js` and `page/src/views.js` read them.

mod planes;
mod text;

use std::io::Write as _;

use flate2::Compression;
use flate2::write::DeflateEncoder;
use geometry::{DynamicZone, ZoneSource};
use nalgebra::{Isometry3, Point2};
use serde_json::{Value, json};

pub use planes::{push_colours, push_differences_16, push_image_8, push_varint};
pub(crate) use text::as_text;
#[cfg(test)]
pub(crate) use text::bytes_of;

use crate::{RigCamera, ScanView, SmallDepth};

/// The depths that a code tells apart: from this one ...
const NEAREST_M: f32 = 0.2;
/// ... to this one, in steps of 2.2 %.
const FARTHEST_M: f32 = 50.0;
const CODES: f32 = 254.0;

/// The colours of the map by height, from the lowest to the highest.
pub const HEIGHT_COLOURS: [[u8; 3]; 5] = crate::pictures::HEIGHT_COLOURS;

/// How much time is spent on making bytes fewer.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Effort {
    /// As a page that is kept warrants.
    Usual,
    /// As a message that is read once warrants.
    Least,
}

/// The bytes, compressed (deflate, RFC 1951).
#[must_use]
pub fn deflated(bytes: &[u8], effort: Effort) -> Vec<u8> {
    let level = match effort {
        Effort::Usual => Compression::default(),
        Effort::Least => Compression::fast(),
    };
    let mut encoder = DeflateEncoder::new(Vec::new(), level);
    // Writing to memory cannot fail.
    let _ = encoder.write_all(bytes);
    encoder.finish().unwrap_or_default()
}

/// Appends a scan, or that there is none.
pub fn push_scan(bytes: &mut Vec<u8>, scan: Option<&ScanView>) {
    let none = ScanView::default();
    let scan = scan.unwrap_or(&none);
    // A scan of more beams is cut: there is none.
    let beams = scan.ranges.len().min(usize::from(u16::MAX));
    bytes.extend((beams as u16).to_le_bytes());
    bytes.extend(scan.first_azimuth_rad.to_le_bytes());
    bytes.extend(scan.azimuth_step_rad.to_le_bytes());
    push_differences_16(bytes, scan.ranges.iter().copied().take(beams));
}

/// Steps of a kept cloud that are one in the bytes: a tenth of a voxel, as of the map's points.
const CLOUD_STEPS: i16 = 2;
/// A step of a cloud in the bytes.
pub const CLOUD_STEP_M: f32 = CLOUD_STEPS as f32 * crate::CLOUD_STEP_M;

/// Appends the static points of a cloud, and then those that move, in steps of [`CLOUD_STEP_M`].
pub fn push_cloud(bytes: &mut Vec<u8>, fixed: &[[i16; 3]], moving: &[[i16; 3]]) {
    bytes.extend(((fixed.len() + moving.len()) as u32).to_le_bytes());
    bytes.extend((moving.len() as u32).to_le_bytes());
    for axis in 0..3 {
        let points = fixed.iter().chain(moving);
        push_differences_16(bytes, points.map(|steps| (steps[axis] / CLOUD_STEPS).cast_unsigned()));
    }
}

/// Appends a depth image, a code a pixel and a bit a pixel for what moves, or that there is none.
pub fn push_depth(
    bytes: &mut Vec<u8>,
    depth: Option<&SmallDepth>,
    is_moving: impl Fn(usize) -> bool,
) {
    let Some(depth) = depth else {
        bytes.extend([0; 4]);
        return;
    };
    bytes.extend((depth.columns as u16).to_le_bytes());
    bytes.extend((depth.rows as u16).to_le_bytes());
    let codes: Vec<u8> = depth.depths_mm.iter().map(|depth_mm| depth_code(*depth_mm)).collect();
    push_image_8(bytes, depth.columns, &codes);
    let mut bits = vec![0_u8; depth.depths_mm.len().div_ceil(8)];
    for pixel in (0..depth.depths_mm.len()).filter(|pixel| is_moving(*pixel)) {
        bits[pixel / 8] |= 1 << (pixel % 8);
    }
    bytes.append(&mut bits);
}

/// 0 where nothing was measured, and 1 to 255 by the logarithm of the depth.
fn depth_code(depth_mm: u16) -> u8 {
    if depth_mm == 0 {
        return 0;
    }
    let relative = (f32::from(depth_mm) * 1e-3 / NEAREST_M).ln() / (FARTHEST_M / NEAREST_M).ln();
    1 + (relative * CODES).round().clamp(0.0, CODES) as u8
}

/// A pose as x, y, z of the translation and x, y, z, w of the unit quaternion.
#[must_use]
pub fn pose(pose: &Isometry3<f64>) -> [f64; 7] {
    let (at_m, turn) = (pose.translation, pose.rotation);
    let fine = |value: f64| (value * 1e5).round() / 1e5;
    [
        rounded(at_m.x),
        rounded(at_m.y),
        rounded(at_m.z),
        fine(turn.i),
        fine(turn.j),
        fine(turn.k),
        fine(turn.w),
    ]
}

/// A zone, as the page draws it.
#[must_use]
pub fn zone(zone: &DynamicZone) -> Value {
    let held = match zone.source {
        ZoneSource::Measured => 0,
        ZoneSource::Held { cycles } => cycles,
    };
    json!({
        "from_rad": rounded(zone.azimuth_min_rad), "to_rad": rounded(zone.azimuth_max_rad), "held": held,
        "near_m": zone.returns.map(|returns| rounded(returns.nearest_m.into())),
        "far_m": zone.returns.map(|returns| rounded(returns.farthest_m.into())),
    })
}

/// Where the camera is in the rig, and the directions of its corners at a depth of 1 m.
#[must_use]
pub fn camera(camera: &RigCamera) -> Value {
    let RigCamera { model, rig_from_camera } = camera;
    let (right, bottom) = (model.width_px as f64 - 0.5, model.height_px as f64 - 0.5);
    let corners: Vec<[f64; 3]> = [(-0.5, -0.5), (right, -0.5), (right, bottom), (-0.5, bottom)]
        .into_iter()
        .filter_map(|(x, y)| model.ray(&Point2::new(x, y)))
        .map(|ray| (rig_from_camera.rotation * ray.push(1.0)).into())
        .collect();
    json!({ "at_m": <[f64; 3]>::from(rig_from_camera.translation.vector), "corners": corners })
}

/// To a thousandth of a metre, second or radian: less than can be seen.
#[must_use]
pub fn rounded(value: f64) -> f64 {
    (value * 1e3).round() / 1e3
}

/// JSON that no text in it can end the script element of: `<` begins every tag and comment, and is only found in texts.
#[must_use]
pub fn json_in_script(value: &Value) -> String {
    value.to_string().replace('<', "\\u003c")
}

/// The colour in which a point of a coloured map is drawn: gray where none was seen, since black is not seen on the dark ground.
#[must_use]
pub fn drawn_colour(colour: [u8; 3]) -> [u8; 3] {
    const UNSEEN: [u8; 3] = [110; 3];
    if colour == geometry::NO_COLOUR { UNSEEN } else { colour }
}
