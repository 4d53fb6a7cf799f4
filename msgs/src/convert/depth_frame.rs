//! The depth image of a cycle, and the mask of what moves in it.

use std::sync::Arc;

use geometry::{DepthFrame, MaskedDepth, Stamp};

use super::depth::image_message;
use super::pose::header_of;
use super::{
    ConvertError, DepthCodec, MetresAs, camera_from_message, colour_image_from_message,
    compressed_depth_from_message, compressed_message_from_depth_with, message_from_camera,
};
use crate::stillmap_msgs;

/// The depth image of a cycle whose cloud has a stamp; `None` where there is none.
///
/// # Errors
/// When there are several, the image or its camera is none, or they are not of each other or of the cloud.
pub(super) fn depth_frame_from_messages(
    messages: &[stillmap_msgs::DepthFrame],
    cloud_stamp: Stamp,
) -> Result<Option<Arc<DepthFrame>>, ConvertError> {
    let message = match messages {
        [] => return Ok(None),
        [message] => message,
        several => return Err(ConvertError::DepthFrames { frames: several.len() }),
    };
    let image = compressed_depth_from_message(&message.image)?;
    if image.stamp != cloud_stamp {
        return Err(ConvertError::DepthStamp {
            depth_stamp_ns: image.stamp.as_nanos(),
            cloud_stamp_ns: cloud_stamp.as_nanos(),
        });
    }
    let camera = camera_from_message(&message.camera)?;
    let frame = DepthFrame::new(image, camera)?;
    Ok(Some(Arc::new(match message.colour.as_slice() {
        [] => frame,
        [colour] => frame.with_colours(colour_image_from_message(colour)?.pixels().to_vec())?,
        several => return Err(ConvertError::ColourImages { images: several.len() }),
    })))
}

/// The message of the depth image of a cycle: one, or none.
pub(super) fn messages_from_depth_frame(
    frame: Option<&DepthFrame>,
) -> Vec<stillmap_msgs::DepthFrame> {
    let Some(frame) = frame else { return Vec::new() };
    let image = frame.image();
    // Millimetres of an image as large as a camera's: no codec refuses it.
    let compressed =
        compressed_message_from_depth_with(image, DepthCodec::Rvl, MetresAs::Millimetres);
    let camera = message_from_camera(frame.camera(), image.stamp, &image.frame_id);
    let size_px = (image.width_px(), image.height_px());
    let colour = frame.colours().map(|colours| {
        let header = header_of(image.stamp, &image.frame_id);
        image_message(header, "rgb8", size_px, colours.as_flattened().to_vec())
    });
    let colour = colour.into_iter().collect();
    compressed
        .map(|image| stillmap_msgs::DepthFrame { image, camera, colour })
        .into_iter()
        .collect()
}

/// The depth image and the mask of a segmented cycle whose cloud has a stamp.
///
/// # Errors
/// As [`depth_frame_from_messages`], or when the mask is not one of the image.
pub(super) fn masked_depth_from_messages(
    messages: &[stillmap_msgs::DepthFrame],
    moving_pixels: &[u8],
    cloud_stamp: Stamp,
) -> Result<Option<MaskedDepth>, ConvertError> {
    let frame = depth_frame_from_messages(messages, cloud_stamp)?;
    let pixels = frame.as_ref().map_or(0, |frame| frame.image().pixels().len());
    let (bytes, expected) = (moving_pixels.len(), pixels.div_ceil(8));
    if bytes != expected {
        return Err(ConvertError::MovingPixels { bytes, pixels, expected });
    }
    let bits = moving_pixels.iter().flat_map(|byte| (0..8).map(move |bit| byte >> bit & 1 == 1));
    let is_moving = bits.take(pixels).collect();
    Ok(frame.map(|frame| MaskedDepth::new(frame, is_moving)).transpose()?)
}

/// A mask as bits.
pub(super) fn bits_from_mask(is_moving: &[bool]) -> Vec<u8> {
    let byte = |eight: &[bool]| {
        eight.iter().rev().fold(0, |bits, is_moving| bits << 1 | u8::from(*is_moving))
    };
    is_moving.chunks(8).map(byte).collect()
}

#[cfg(test)]
mod tests {
    use geometry::{CameraModel, DepthImage, DepthPixels, Distortion};
    use proptest::prelude::*;

    use super::*;

    fn frame(depths_mm: Vec<u16>) -> DepthFrame {
        let (width_px, height_px) = (5, depths_mm.len() / 5);
        let (fx_px, fy_px, cx_px, cy_px) = (4.5, 4.25, 2.0, 1.0);
        let distortion = Distortion::PlumbBob([0.1, -0.2, 0.001, 0.002, 0.05]);
        let camera = CameraModel { width_px, height_px, fx_px, fy_px, cx_px, cy_px, distortion };
        let pixels = DepthPixels::Millimetres(depths_mm);
        let size_px = (width_px, height_px);
        let image = DepthImage::new(Stamp::from_nanos(7), "camera".to_owned(), size_px, pixels);
        DepthFrame::new(image.unwrap(), camera).unwrap()
    }

    proptest! {
        /// The map over DDS is that of one process, byte for byte.
        #[test]
        fn image_camera_colours_and_mask_come_back_as_they_were(
            pixels in proptest::collection::vec((any::<u16>(), any::<bool>()), 3 * 5),
            colours in proptest::option::of(proptest::collection::vec(any::<[u8; 3]>(), 3 * 5)),
        ) {
            let (depths_mm, is_moving): (Vec<u16>, Vec<bool>) = pixels.into_iter().unzip();
            let frame = frame(depths_mm);
            let frame = match colours {
                Some(colours) => frame.with_colours(colours).unwrap(),
                None => frame,
            };
            let masked = MaskedDepth::new(Arc::new(frame), is_moving).unwrap();
            let messages = messages_from_depth_frame(Some(masked.frame()));
            let bits = bits_from_mask(masked.is_moving());
            let back = masked_depth_from_messages(&messages, &bits, Stamp::from_nanos(7));
            prop_assert_eq!(back, Ok(Some(masked)));
        }
    }

    #[test]
    fn what_does_not_fit_together_is_refused() {
        let stamp = Stamp::from_nanos(7);
        let messages = messages_from_depth_frame(Some(&frame(vec![900; 15])));
        let take = |messages: &[_], bits: &[u8], stamp| {
            masked_depth_from_messages(messages, bits, stamp).map_err(|error| error.to_string())
        };
        assert_eq!(take(&[], &[], stamp), Ok(None));
        assert!(take(&[], &[0], stamp).unwrap_err().contains("1 bytes"));
        assert!(take(&messages, &[0], stamp).unwrap_err().contains("15 pixels"));
        assert!(take(&messages, &[0, 0], Stamp::from_nanos(8)).unwrap_err().contains("8 ns"));
        let two = [messages.clone(), messages.clone()].concat();
        assert!(take(&two, &[0, 0], stamp).unwrap_err().contains("2 images"));
        let coloured = frame(vec![900; 15]).with_colours(vec![[1, 2, 3]; 15]).unwrap();
        let mut twice = messages_from_depth_frame(Some(&coloured));
        let colour = twice[0].colour[0].clone();
        twice[0].colour.push(colour);
        assert!(take(&twice, &[0, 0], stamp).unwrap_err().contains("2 images"));
        twice[0].colour.pop();
        twice[0].colour[0].height = 2;
        assert!(take(&twice, &[0, 0], stamp).unwrap_err().contains("10 colours"));
        let mut narrow = messages;
        narrow[0].camera.width = 4;
        assert!(take(&narrow, &[0, 0], stamp).unwrap_err().contains("4 x 3"));
    }
}
