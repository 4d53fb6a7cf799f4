//! Depth images.

use geometry::{DepthImage, DepthPixels};

use super::error::excerpt;
use super::rows::{Rows, StatedSizes};
use super::{ConvertError, stamp_from_time, time_from_stamp};
use crate::sensor_msgs::Image;
use crate::std_msgs::Header;

/// Depth in millimetres (REP-118), 0 where nothing was measured.
const MILLIMETRES: &str = "16UC1";
/// The name of some drivers for the same.
const MILLIMETRES_TOO: &str = "mono16";
/// Depth in metres (REP-118), not finite where nothing was measured.
const METRES: &str = "32FC1";

/// The depth image of a message: `16UC1` or `mono16` in millimetres, `32FC1` in metres.
///
/// # Errors
/// When the encoding is another, rows overlap, or the data is shorter than they are.
pub fn depth_from_message(message: &Image) -> Result<DepthImage, ConvertError> {
    let pixels = match message.encoding.as_str() {
        MILLIMETRES | MILLIMETRES_TOO => DepthPixels::Millimetres(whole_pixels(message)?),
        METRES => DepthPixels::Metres(pixels(message, f32::from_le_bytes, f32::from_be_bytes)?),
        other => return Err(no_depth_encoding(other)),
    };
    let stamp = stamp_from_time(message.header.stamp);
    let size_px = (message.width as usize, message.height as usize);
    Ok(DepthImage::new(stamp, message.header.frame_id.clone(), size_px, pixels)?)
}

/// The bytes of a pixel of this depth image where nothing was measured: 0 in millimetres, NaN in metres.
///
/// # Errors
/// When the encoding is none of a depth image.
pub(super) fn unmeasured_pixel(message: &Image) -> Result<&'static [u8], ConvertError> {
    const LITTLE_NAN: [u8; 4] = f32::NAN.to_le_bytes();
    const BIG_NAN: [u8; 4] = f32::NAN.to_be_bytes();
    match message.encoding.as_str() {
        MILLIMETRES | MILLIMETRES_TOO => Ok(&[0; 2]),
        METRES if message.is_bigendian == 0 => Ok(&LITTLE_NAN),
        METRES => Ok(&BIG_NAN),
        other => Err(no_depth_encoding(other)),
    }
}

fn no_depth_encoding(other: &str) -> ConvertError {
    let wanted = "depth image: 16UC1, mono16 and 32FC1 are";
    ConvertError::Encoding { encoding: excerpt(other), wanted }
}

/// The pixels of an image of 16 bits.
pub(super) fn whole_pixels(message: &Image) -> Result<Vec<u16>, ConvertError> {
    pixels(message, u16::from_le_bytes, u16::from_be_bytes)
}

fn pixels<T, const BYTES: usize>(
    message: &Image,
    little: impl Fn([u8; BYTES]) -> T,
    big: impl Fn([u8; BYTES]) -> T,
) -> Result<Vec<T>, ConvertError> {
    let sizes = StatedSizes {
        message: "Image",
        width: message.width,
        height: message.height,
        record_bytes: BYTES as u32,
        step: message.step,
    };
    let rows = Rows::checked(&message.data, &sizes)?;
    let mut pixels = Vec::with_capacity(rows.records());
    for row in rows.iter() {
        let (row, _) = row.as_chunks::<BYTES>();
        if message.is_bigendian == 0 {
            pixels.extend(row.iter().map(|pixel| little(*pixel)));
        } else {
            pixels.extend(row.iter().map(|pixel| big(*pixel)));
        }
    }
    Ok(pixels)
}

/// The message of a depth image, little endian, without padding.
#[must_use]
pub fn message_from_depth(image: &DepthImage) -> Image {
    let (encoding, data) = match image.pixels() {
        DepthPixels::Millimetres(pixels) => (MILLIMETRES, whole_pixel_bytes(pixels)),
        DepthPixels::Metres(pixels) => {
            (METRES, pixels.iter().flat_map(|pixel| pixel.to_le_bytes()).collect())
        }
    };
    let size_px = (image.width_px(), image.height_px());
    let header = Header { stamp: time_from_stamp(image.stamp), frame_id: image.frame_id.clone() };
    image_message(header, encoding, size_px, data)
}

/// Pixels of 16 bits as in a message.
pub(super) fn whole_pixel_bytes(pixels: &[u16]) -> Vec<u8> {
    pixels.iter().flat_map(|pixel| pixel.to_le_bytes()).collect()
}

/// A little-endian image without padding.
pub(super) fn image_message(
    header: Header,
    encoding: &str,
    (width_px, height_px): (usize, usize),
    data: Vec<u8>,
) -> Image {
    let counted = |count: usize| u32::try_from(count).unwrap_or(u32::MAX);
    Image {
        header,
        height: counted(height_px),
        width: counted(width_px),
        encoding: encoding.to_owned(),
        is_bigendian: 0,
        step: counted(data.len().checked_div(height_px).unwrap_or(0)),
        data,
    }
}

#[cfg(test)]
mod tests {
    use geometry::Stamp;
    use proptest::prelude::*;

    use super::*;

    fn image(encoding: &str, (width, height): (u32, u32), step: u32, data: &[u8]) -> Image {
        let encoding = encoding.to_owned();
        Image { encoding, width, height, step, data: data.to_vec(), ..Image::default() }
    }

    #[test]
    fn millimetres_are_read_in_both_byte_orders_and_without_padding() {
        let data = [1, 0, 2, 1, 99, 3, 0, 4, 0, 99];
        for encoding in ["16UC1", "mono16"] {
            let mut message = image(encoding, (2, 2), 5, &data);
            let read = depth_from_message(&message).unwrap();
            assert_eq!(read.pixels(), &DepthPixels::Millimetres(vec![1, 258, 3, 4]));
            assert_eq!((read.width_px(), read.height_px()), (2, 2));
            message.is_bigendian = 1;
            let read = depth_from_message(&message).unwrap();
            assert_eq!(read.pixels(), &DepthPixels::Millimetres(vec![256, 513, 768, 1024]));
        }
    }

    #[test]
    fn metres_are_read_in_both_byte_orders() {
        let values = [1.5_f32, f32::NAN, -2.25];
        for big_endian in [false, true] {
            let bytes = |v: &f32| if big_endian { v.to_be_bytes() } else { v.to_le_bytes() };
            let data: Vec<u8> = values.iter().flat_map(bytes).collect();
            let mut message = image("32FC1", (3, 1), 12, &data);
            message.is_bigendian = u8::from(big_endian);
            let read = depth_from_message(&message).unwrap();
            assert_eq!(read.depth_m(0, 0), Some(1.5));
            assert_eq!(read.depth_m(1, 0), None);
            let DepthPixels::Metres(pixels) = read.pixels() else { panic!("{read:?}") };
            assert_eq!(pixels[2], -2.25);
        }
    }

    #[test]
    fn images_that_lie_are_named() {
        let error = depth_from_message(&image("rgb8", (1, 1), 3, &[0; 3])).unwrap_err();
        assert_eq!(
            error.to_string(),
            "Image: encoding \"rgb8\" is no depth image: 16UC1, mono16 and 32FC1 are"
        );
        assert_eq!(
            depth_from_message(&image("16UC1", (2, 2), 3, &[0; 8])),
            Err(ConvertError::RowStep { message: "Image", width: 2, row_bytes: 4, step: 3 })
        );
        assert_eq!(
            depth_from_message(&image("32FC1", (2, 2), 8, &[0; 15])),
            Err(ConvertError::DataTooShort {
                message: "Image",
                height: 2,
                step: 8,
                needed_bytes: 16,
                data_bytes: 15
            })
        );
        let long_name = image(&"é".repeat(1000), (1, 1), 1, &[0]);
        assert!(depth_from_message(&long_name).unwrap_err().to_string().len() < 250);
    }

    #[test]
    fn an_image_without_pixels_is_one() {
        let read = depth_from_message(&image("16UC1", (0, 3), 0, &[])).unwrap();
        assert_eq!((read.width_px(), read.height_px()), (0, 3));
        let _ = message_from_depth(&read);
        let read = depth_from_message(&image("16UC1", (4_000_000_000, 0), 0, &[])).unwrap();
        assert_eq!(message_from_depth(&read).step, 0);
    }

    proptest! {
        #[test]
        fn an_image_comes_back(
            width in 1..9_usize,
            height in 1..9_usize,
            values in proptest::collection::vec(any::<u16>(), 64),
            metres in any::<bool>(),
        ) {
            let values = &values[..width * height];
            let pixels = if metres {
                DepthPixels::Metres(values.iter().map(|v| f32::from(*v) * 0.001).collect())
            } else {
                DepthPixels::Millimetres(values.to_vec())
            };
            let stamp = Stamp::from_nanos(77);
            let image =
                DepthImage::new(stamp, "depth".to_owned(), (width, height), pixels).unwrap();
            prop_assert_eq!(depth_from_message(&message_from_depth(&image)), Ok(image));
        }

        #[test]
        fn anything_is_survived(
            encoding in prop_oneof![Just("16UC1"), Just("32FC1")],
            width in prop_oneof![0..9_u32, any::<u32>()],
            height in prop_oneof![0..9_u32, any::<u32>()],
            step in prop_oneof![0..40_u32, any::<u32>()],
            data in proptest::collection::vec(any::<u8>(), 0..99),
        ) {
            if let Ok(read) = depth_from_message(&image(encoding, (width, height), step, &data)) {
                prop_assert!(read.width_px() * read.height_px() * 2 <= data.len());
            }
        }
    }
}
