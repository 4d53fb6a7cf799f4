//! Messages without the beams, pixels or points that move, or with these alone. All else is as the driver sent it, bit for bit.

#[cfg(test)]
mod tests;

use std::iter;

use geometry::{BeamFill, MovingBeam, rays_in_turn};

use super::ConvertError;
use super::cloud::layout::FieldPlace;
use super::colour::BlackPixel;
use super::depth::unmeasured_pixel;
use super::rows::{Rows, StatedSizes};
use crate::sensor_msgs::{Image, LaserScan, PointCloud2};

/// The beams of a message in the direction of this one: itself, and where the scan goes on beyond a turn, the same one again.
fn in_direction_of(message: &LaserScan, index: usize) -> impl Iterator<Item = usize> + use<> {
    let again = rays_in_turn(message.angle_increment).map(|turn| index.saturating_add(turn));
    iter::once(index).chain(again)
}

/// The scan without the beams that move. Beams beyond the scan's last are ignored.
#[must_use]
pub fn static_scan(message: &LaserScan, moving: &[MovingBeam], fill: BeamFill) -> LaserScan {
    let mut filtered = message.clone();
    for beam in moving {
        let known_m = match fill {
            BeamFill::Nan => None,
            BeamFill::Background => {
                beam.background_m.filter(|range_m| *range_m <= message.range_max)
            }
        };
        for index in in_direction_of(message, beam.index as usize) {
            if let Some(range_m) = filtered.ranges.get_mut(index) {
                *range_m = known_m.unwrap_or(f32::NAN);
            }
        }
    }
    filtered
}

/// The scan with the beams that move alone; the others are NaN.
#[must_use]
pub fn dynamic_scan(message: &LaserScan, moving: &[MovingBeam]) -> LaserScan {
    let mut filtered = message.clone();
    filtered.ranges.fill(f32::NAN);
    for beam in moving {
        for index in in_direction_of(message, beam.index as usize) {
            let ranges = (filtered.ranges.get_mut(index), message.ranges.get(index));
            if let (Some(to), Some(from)) = ranges {
                *to = *from;
            }
        }
    }
    filtered
}

/// The depth image without the pixels whose entry in `is_moving`, row by row, is `removed`: they are 0 in `16UC1` and `mono16`,
/// NaN in `32FC1` (REP-118).
///
/// # Errors
/// When the message is no depth image, or the mask is of another size.
pub fn depth_without(
    message: &Image,
    is_moving: &[bool],
    removed: bool,
) -> Result<Image, ConvertError> {
    let nothing = unmeasured_pixel(message)?;
    image_without(message, is_moving, removed, (nothing.len(), nothing))
}

/// The colour image without the pixels whose entry in `is_moving`, row by row, is `removed`: they are black, and as opaque as they
/// were. Of two pixels that share their colour (`yuv422`) both are taken for moving where one of them is.
///
/// # Errors
/// When the encoding is none of which it is known what is black, or the mask is of another size.
pub fn colour_without(
    message: &Image,
    is_moving: &[bool],
    removed: bool,
) -> Result<Image, ConvertError> {
    let black = BlackPixel::of(message)?;
    let record = (black.record_bytes, black.bytes);
    if !black.is_of_pairs {
        return image_without(message, is_moving, removed, record);
    }
    let mut pairs = is_moving.to_vec();
    for row in pairs.chunks_mut((message.width as usize).max(1)) {
        row.chunks_mut(2).for_each(|pair| pair.fill(pair.contains(&true)));
    }
    image_without(message, &pairs, removed, record)
}

/// The image with these bytes at the beginning of each record whose entry in `is_moving` is `removed`.
fn image_without(
    message: &Image,
    is_moving: &[bool],
    removed: bool,
    (record_bytes, bytes): (usize, &[u8]),
) -> Result<Image, ConvertError> {
    let sizes = StatedSizes {
        message: "Image",
        width: message.width,
        height: message.height,
        record_bytes: record_bytes as u32,
        step: message.step,
    };
    let rows = Rows::checked(&message.data, &sizes)?;
    check_mask("Image", is_moving, &rows)?;
    let mut filtered = message.clone();
    let starts = rows.record_starts(record_bytes).zip(is_moving);
    for (start, _) in starts.filter(|(_, is_moving)| **is_moving == removed) {
        overwrite(&mut filtered.data, start, bytes);
    }
    Ok(filtered)
}

/// The cloud without the points whose entry in `is_moving`, row by row, is `removed`: their x, y and z are NaN, and the cloud is
/// not dense.
///
/// # Errors
/// When the cloud is none, its coordinates cannot be NaN, or the mask is of another size.
pub fn cloud_without(
    message: &PointCloud2,
    is_moving: &[bool],
    removed: bool,
) -> Result<PointCloud2, ConvertError> {
    let rows = Rows::checked(&message.data, &message.into())?;
    check_mask("PointCloud2", is_moving, &rows)?;
    let mut filtered = message.clone();
    if !is_moving.contains(&removed) {
        return Ok(filtered);
    }
    let coordinate = |field| {
        FieldPlace::of(message, field)?
            .not_a_number(message.is_bigendian)
            .ok_or(ConvertError::NotANumber { field })
    };
    let coordinates = [coordinate("x")?, coordinate("y")?, coordinate("z")?];
    filtered.is_dense = false;
    let starts = rows.record_starts(message.point_step as usize).zip(is_moving);
    for (start, _) in starts.filter(|(_, is_moving)| **is_moving == removed) {
        for (place, bytes) in &coordinates {
            let nan = bytes.get(..place.len()).unwrap_or(bytes);
            overwrite(&mut filtered.data, start + place.start, nan);
        }
    }
    Ok(filtered)
}

/// Puts bytes in the place of those from `start` on, which the rows are known to have.
fn overwrite(data: &mut [u8], start: usize, bytes: &[u8]) {
    let places = data.iter_mut().skip(start);
    places.zip(bytes).for_each(|(place, byte)| *place = *byte);
}

fn check_mask(
    message: &'static str,
    is_moving: &[bool],
    rows: &Rows<'_>,
) -> Result<(), ConvertError> {
    let (entries, records) = (is_moving.len(), rows.records());
    if entries == records { Ok(()) } else { Err(ConvertError::Mask { message, entries, records }) }
}
