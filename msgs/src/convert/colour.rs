//! Colour images, and the colours of clouds.

#[cfg(test)]
mod tests;

use geometry::{ColourImage, ColouredCloud, is_finite};

use super::cloud::layout::FieldPlace;
use super::depth::image_message;
use super::error::excerpt;
use super::rows::{Rows, StatedSizes};
use super::{
    ConvertError, message_from_cloud, organised_points_from_message, stamp_from_time,
    time_from_stamp,
};
use crate::sensor_msgs::{Image, PointCloud2, PointField};
use crate::std_msgs::Header;

/// The fields of a cloud that a colour is read from, the first that there is: of PCL, and of some drivers.
const COLOUR_FIELDS: [&str; 2] = ["rgb", "rgba"];
/// The encoding of the colours of a depth image.
const RGB8: &str = "rgb8";

/// The colour image of a message: `rgb8`, `bgr8`, `rgba8`, `bgra8` (`8UC3` and `8UC4` are the last two orders of OpenCV), and greys,
/// `mono8`. What is not opaque counts as if it were.
///
/// # Errors
/// When the encoding is another, rows overlap, or the data is shorter than they are.
pub fn colour_image_from_message(message: &Image) -> Result<ColourImage, ConvertError> {
    let (record_bytes, order) = match message.encoding.as_str() {
        "rgb8" => (3, [0, 1, 2]),
        // OpenCV's own order, which nameless channels have.
        "bgr8" | "8UC3" => (3, [2, 1, 0]),
        "rgba8" => (4, [0, 1, 2]),
        "bgra8" | "8UC4" => (4, [2, 1, 0]),
        "mono8" | "8UC1" => (1, [0, 0, 0]),
        other => {
            let wanted = "colour image: rgb8, bgr8, rgba8, bgra8, 8UC3, 8UC4, mono8 and 8UC1 are";
            return Err(ConvertError::Encoding { encoding: excerpt(other), wanted });
        }
    };
    let sizes = StatedSizes {
        message: "Image",
        width: message.width,
        height: message.height,
        record_bytes,
        step: message.step,
    };
    let rows = Rows::checked(&message.data, &sizes)?;
    let mut pixels = Vec::with_capacity(rows.records());
    for row in rows.iter() {
        match (record_bytes, order) {
            (3, [0, ..]) => pixels.extend_from_slice(row.as_chunks::<3>().0),
            (3, _) => pixels.extend(row.as_chunks::<3>().0.iter().map(|&[b, g, r]| [r, g, b])),
            (4, [0, ..]) => {
                pixels.extend(row.as_chunks::<4>().0.iter().map(|&[r, g, b, _]| [r, g, b]));
            }
            (4, _) => pixels.extend(row.as_chunks::<4>().0.iter().map(|&[b, g, r, _]| [r, g, b])),
            _ => pixels.extend(row.iter().map(|&grey| [grey; 3])),
        }
    }
    let stamp = stamp_from_time(message.header.stamp);
    let size_px = (message.width as usize, message.height as usize);
    Ok(ColourImage::new(stamp, size_px, pixels)?)
}

/// How a colour image says that a pixel is black.
pub(super) struct BlackPixel {
    /// Bytes of a pixel.
    pub(super) record_bytes: usize,
    /// The first of these; the others, as of opacity, say nothing of it.
    pub(super) bytes: &'static [u8],
    /// Whether two neighbours of a row share their colour.
    pub(super) is_of_pairs: bool,
}

impl BlackPixel {
    /// By the encodings of `sensor_msgs/image_encodings.hpp` whose pixels lie one behind the other. Zeros are black in either byte
    /// order.
    ///
    /// # Errors
    /// When the encoding is another.
    pub(super) fn of(message: &Image) -> Result<Self, ConvertError> {
        let of = |record_bytes, bytes: &'static [u8]| (record_bytes, bytes, false);
        let (record_bytes, bytes, is_of_pairs) = match message.encoding.as_str() {
            "rgb8" | "bgr8" | "8UC3" => of(3, &[0; 3]),
            "rgba8" | "bgra8" | "8UC4" => of(4, &[0; 3]),
            "rgb16" | "bgr16" | "16UC3" => of(6, &[0; 6]),
            "rgba16" | "bgra16" | "16UC4" => of(8, &[0; 6]),
            "mono8" | "8UC1" | "bayer_rggb8" | "bayer_bggr8" | "bayer_gbrg8" | "bayer_grbg8" => {
                of(1, &[0])
            }
            "mono16" | "bayer_rggb16" | "bayer_bggr16" | "bayer_gbrg16" | "bayer_grbg16" => {
                of(2, &[0; 2])
            }
            // Two bytes each: a part of the colour, which is grey in the middle, and the luminance; or the other way round.
            "yuv422" | "uyvy" => (2, &[128, 0][..], true),
            "yuv422_yuy2" | "yuyv" => (2, &[0, 128][..], true),
            other => {
                let wanted = "colour image that can be masked: rgb, bgr, rgba, bgra, mono and bayer of 8 or 16 bits, and yuv422 are";
                return Err(ConvertError::Encoding { encoding: excerpt(other), wanted });
            }
        };
        Ok(Self { record_bytes, bytes, is_of_pairs })
    }
}

/// The message of a colour image, `rgb8` without padding.
#[must_use]
pub fn message_from_colour_image(image: &ColourImage, frame_id: &str) -> Image {
    let header = Header { stamp: time_from_stamp(image.stamp), frame_id: frame_id.to_owned() };
    let size_px = (image.width_px(), image.height_px());
    image_message(header, RGB8, size_px, image.pixels().as_flattened().to_vec())
}

/// The colours of a cloud, one for each of its points, those included that are not finite: of the field `rgb` or `rgba`, in which
/// 0, red, green and blue are the bytes of a number of 32 bits, the largest first, whether it is called a float or not. `None`
/// where it has no such field.
///
/// # Errors
/// When the field is repeated or not within the point, rows overlap, or the data is shorter than they are.
pub fn colours_from_cloud_message(
    message: &PointCloud2,
) -> Result<Option<Vec<[u8; 3]>>, ConvertError> {
    let is_there = |name: &&&str| {
        let is_it = |field: &PointField| {
            let kinds = [PointField::FLOAT32, PointField::UINT32, PointField::INT32];
            field.name == **name && kinds.contains(&field.datatype)
        };
        message.fields.iter().any(is_it)
    };
    let Some(name) = COLOUR_FIELDS.iter().find(is_there) else { return Ok(None) };
    let place = FieldPlace::of(message, name)?;
    let rows = Rows::checked(&message.data, &message.into())?;
    let colour = |record: &[u8]| {
        let bits = place.bits(record, message.is_bigendian).unwrap_or(0);
        let [_, red, green, blue] = bits.to_be_bytes();
        [red, green, blue]
    };
    let records = |row: &'_ [u8]| -> Vec<[u8; 3]> {
        row.chunks_exact(message.point_step.max(1) as usize).map(colour).collect()
    };
    let mut colours = Vec::with_capacity(rows.records());
    rows.iter().for_each(|row| colours.extend(records(row)));
    Ok(Some(colours))
}

/// The cloud of a message with the colours of its points: none where it has none.
///
/// # Errors
/// As [`super::cloud_from_message`] and [`colours_from_cloud_message`].
pub fn coloured_cloud_from_message(message: &PointCloud2) -> Result<ColouredCloud, ConvertError> {
    let Some(colours) = colours_from_cloud_message(message)? else {
        return Ok(ColouredCloud {
            cloud: super::cloud_from_message(message)?,
            colours: Vec::new(),
        });
    };
    let points_m = organised_points_from_message(message)?;
    let finite = points_m.iter().zip(colours).filter(|(point, _)| is_finite(point));
    let (points_m, colours) = finite.map(|(point, colour)| (*point, colour)).unzip();
    let cloud = geometry::Cloud {
        stamp: stamp_from_time(message.header.stamp),
        frame_id: message.header.frame_id.clone(),
        points_m,
    };
    Ok(ColouredCloud { cloud, colours })
}

/// The message of a cloud with a colour for each point, in a float field `rgb` as viewers and PCL expect it: 16 bytes a point.
/// Without colours, or with another number of them, that of [`message_from_cloud`].
#[must_use]
pub fn message_from_coloured_cloud(coloured: &ColouredCloud) -> PointCloud2 {
    let ColouredCloud { cloud, colours } = coloured;
    let mut message = message_from_cloud(cloud);
    if colours.is_empty() || colours.len() != cloud.points_m.len() {
        return message;
    }
    let offset = message.point_step;
    message.point_step += size_of::<f32>() as u32;
    message.row_step = message.width.saturating_mul(message.point_step);
    let mut data = Vec::with_capacity(colours.len() * message.point_step as usize);
    for (point, &[red, green, blue]) in message.data.chunks_exact(offset as usize).zip(colours) {
        data.extend_from_slice(point);
        data.extend([blue, green, red, 0]);
    }
    message.data = data;
    let (name, datatype) = (COLOUR_FIELDS[0].to_owned(), PointField::FLOAT32);
    message.fields.push(PointField { name, offset, datatype, count: 1 });
    message
}
