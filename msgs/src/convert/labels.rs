//! Label images.

use geometry::LabelImage;

use super::depth::{image_message, whole_pixel_bytes, whole_pixels};
use super::error::excerpt;
use super::pose::header_of;
use super::{ConvertError, stamp_from_time};
use crate::sensor_msgs::Image;

/// A number of 16 bits for each pixel.
const LABELS: &str = "mono16";
/// The name of some writers for the same.
const LABELS_TOO: &str = "16UC1";

/// The label image of a message, `mono16` or `16UC1`: the number of an object for each pixel, 0 for what
/// does not move.
///
/// # Errors
/// When the encoding is another, rows overlap, or the data is shorter than they are.
pub fn labels_from_message(message: &Image) -> Result<LabelImage, ConvertError> {
    let encoding = message.encoding.as_str();
    if ![LABELS, LABELS_TOO].contains(&encoding) {
        let wanted = "label image: mono16 and 16UC1 are";
        return Err(ConvertError::Encoding { encoding: excerpt(encoding), wanted });
    }
    let stamp = stamp_from_time(message.header.stamp);
    let size_px = (message.width as usize, message.height as usize);
    let frame_id = message.header.frame_id.clone();
    Ok(LabelImage::new(stamp, frame_id, size_px, whole_pixels(message)?)?)
}

/// The message of a label image, `mono16`, little endian, without padding.
#[must_use]
pub fn message_from_labels(image: &LabelImage) -> Image {
    let header = header_of(image.stamp, &image.frame_id);
    let size_px = (image.width_px(), image.height_px());
    image_message(header, LABELS, size_px, whole_pixel_bytes(image.object_ids()))
}

#[cfg(test)]
mod tests {
    use geometry::Stamp;
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn labels_are_read_and_other_images_refused() {
        let encoding = "16UC1".to_owned();
        let (width, height, step, data) = (2, 1, 4, vec![1, 0, 0, 2]);
        let message = Image { encoding, width, height, step, data, ..Image::default() };
        assert_eq!(labels_from_message(&message).unwrap().object_ids(), [1, 512]);

        let metres = Image { encoding: "32FC1".to_owned(), ..message.clone() };
        let error = labels_from_message(&metres).unwrap_err();
        assert!(matches!(error, ConvertError::Encoding { .. }), "{error}");
        let cut = Image { data: vec![1, 0, 0], ..message };
        let error = labels_from_message(&cut).unwrap_err();
        assert!(matches!(error, ConvertError::DataTooShort { .. }), "{error}");
    }

    proptest! {
        #[test]
        fn labels_come_back(
            width in 1..9_usize,
            height in 1..9_usize,
            labels in proptest::collection::vec(any::<u16>(), 64),
        ) {
            let (stamp, frame_id) = (Stamp::from_nanos(9), "optical".to_owned());
            let labels = labels[..width * height].to_vec();
            let image = LabelImage::new(stamp, frame_id, (width, height), labels).unwrap();
            prop_assert_eq!(labels_from_message(&message_from_labels(&image)), Ok(image));
        }
    }
}
