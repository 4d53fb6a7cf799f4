mod organised;
mod rendered;

use super::*;
use crate::{DepthPixels, Distortion, Stamp};

fn camera() -> CameraModel {
    let (width_px, height_px, distortion) = (3, 2, Distortion::None);
    let (fx_px, fy_px, cx_px, cy_px) = (3.0, 3.0, 1.0, 0.5);
    CameraModel { width_px, height_px, fx_px, fy_px, cx_px, cy_px, distortion }
}

fn image(size_px: (usize, usize), pixels: DepthPixels) -> DepthImage {
    DepthImage::new(Stamp::from_nanos(7), "camera".to_owned(), size_px, pixels).unwrap()
}

#[test]
fn metres_become_whole_millimetres_and_what_is_no_depth_becomes_none() {
    let metres = vec![1.0004, f32::NAN, f32::INFINITY, -1.0, 0.0, 80.0];
    let frame = DepthFrame::new(image((3, 2), DepthPixels::Metres(metres)), camera()).unwrap();
    let expected = DepthPixels::Millimetres(vec![1000, 0, 0, 0, 0, u16::MAX - 1]);
    assert_eq!(frame.image(), &image((3, 2), expected));
}

#[test]
fn an_image_of_another_size_than_its_camera_is_refused() {
    let depths = DepthPixels::Millimetres(vec![1000; 6]);
    assert!(DepthFrame::new(image((3, 2), depths.clone()), camera()).is_ok());
    let error = DepthFrame::new(image((2, 3), depths), camera()).unwrap_err();
    assert!(error.to_string().contains("2 x 3"), "{error}");
}

/// Regression: each image was copied.
#[test]
fn an_image_in_millimetres_is_not_copied() {
    let image = Arc::new(image((3, 2), DepthPixels::Millimetres(vec![1000; 6])));
    let frame = DepthFrame::new(Arc::clone(&image), camera()).unwrap();
    assert!(std::ptr::eq(frame.image(), &*image));
}

#[test]
fn a_mask_of_another_size_than_the_image_is_refused() {
    let image = image((3, 2), DepthPixels::Millimetres(vec![1000; 6]));
    let frame = Arc::new(DepthFrame::new(image, camera()).unwrap());
    let masked = MaskedDepth::new(Arc::clone(&frame), vec![true; 6]).unwrap();
    assert_eq!((masked.frame(), masked.is_moving()), (&frame, &[true; 6][..]));
    let refused = MaskedDepth::new(frame, vec![true; 5]);
    assert_eq!(refused, Err(MaskSizeError { mask_pixels: 5, image_pixels: 6 }));
}

#[test]
fn what_was_computed_of_a_frame_is_shared_while_it_is_kept() {
    let image = image((3, 2), DepthPixels::Millimetres(vec![1000; 6]));
    let frame = DepthFrame::new(image, camera()).unwrap();
    assert_eq!(frame.computed::<u32>(), None);
    let kept = Arc::new(7_u32);
    frame.share(&kept);
    frame.share(&Arc::new(8_u32));
    assert!(frame.computed::<u32>().is_some_and(|shared| Arc::ptr_eq(&shared, &kept)));
    assert_eq!(frame.computed::<u64>(), None, "another type");
    let of_another_kind = Arc::new(9_u64);
    frame.share(&of_another_kind);
    drop(kept);
    assert_eq!(frame.computed::<u32>(), None);
    assert_eq!(frame.computed::<u64>(), Some(of_another_kind));
}
