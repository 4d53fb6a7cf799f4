use nalgebra::{Isometry3, Point3, Vector3};

use super::*;
use crate::{CameraModel, DepthFrame, DepthImage, DepthPixels, Distortion, RayTable};

fn camera((width_px, height_px): (usize, usize), focal_px: f64) -> CameraModel {
    CameraModel {
        width_px,
        height_px,
        fx_px: focal_px,
        fy_px: focal_px,
        cx_px: (width_px as f64 - 1.0) / 2.0,
        cy_px: (height_px as f64 - 1.0) / 2.0,
        distortion: Distortion::None,
    }
}

fn depth(size_px: (usize, usize), depths_mm: Vec<u16>) -> DepthImage {
    let pixels = DepthPixels::Millimetres(depths_mm);
    DepthImage::new(Stamp::from_nanos(7), "camera".to_owned(), size_px, pixels).unwrap()
}

/// Each pixel has its column and row as its colour.
fn numbered((width_px, height_px): (usize, usize)) -> ColourImage {
    let pixels = (0..height_px)
        .flat_map(|row| (0..width_px).map(move |column| [column as u8, row as u8, 200]));
    ColourImage::new(Stamp::from_nanos(7), (width_px, height_px), pixels.collect()).unwrap()
}

fn registration(
    depth: &CameraModel,
    colour: &CameraModel,
    colour_from_depth: &Isometry3<f64>,
) -> ColourRegistration {
    ColourRegistration::new(&RayTable::new(depth).unwrap(), colour, colour_from_depth).unwrap()
}

#[test]
fn images_of_one_camera_belong_together_pixel_by_pixel() {
    let camera = camera((8, 6), 7.0);
    let colour = numbered((8, 6));
    let same = registration(&camera, &camera, &Isometry3::identity());
    let colours = same.colours(&colour, &depth((8, 6), vec![1000; 48])).unwrap();
    assert_eq!(colours, colour.pixels());
}

#[test]
fn black_is_no_missing_colour() {
    let camera = camera((2, 1), 7.0);
    let black = ColourImage::new(Stamp::default(), (2, 1), vec![[0; 3], [9; 3]]).unwrap();
    let same = registration(&camera, &camera, &Isometry3::identity());
    let colours = same.colours(&black, &depth((2, 1), vec![1000; 2])).unwrap();
    assert_eq!(colours, [DARKEST, [9; 3]]);
}

/// A colour image of twice as many pixels over the same view: each depth pixel shows four of them, and has one of these.
#[test]
fn a_finer_camera_with_the_same_centre_gives_the_pixel_on_the_ray() {
    let (coarse, fine) = (camera((8, 6), 7.0), camera((16, 12), 14.0));
    let looked_up = registration(&coarse, &fine, &Isometry3::identity());
    let colours = looked_up.colours(&numbered((16, 12)), &depth((8, 6), vec![0; 48])).unwrap();
    for (pixel, [column, row, _]) in colours.into_iter().enumerate() {
        let off = |seen: u8, own: usize| (f64::from(seen) - (2.0 * own as f64 + 0.5)).abs();
        assert!(off(column, pixel % 8) <= 0.5 && off(row, pixel / 8) <= 0.5, "{pixel}");
    }
}

#[test]
fn what_the_colour_camera_does_not_show_has_no_colour() {
    let (wide, narrow) = (camera((9, 1), 7.0), camera((3, 1), 7.0));
    let looked_up = registration(&wide, &narrow, &Isometry3::identity());
    let colours = looked_up.colours(&numbered((3, 1)), &depth((9, 1), vec![1000; 9])).unwrap();
    let none = [NO_COLOUR; 3];
    assert_eq!(colours[..3], none);
    assert_eq!(colours[3..6], [[0, 0, 200], [1, 0, 200], [2, 0, 200]]);
    assert_eq!(colours[6..], none);
}

/// A lens bends the image: the colour is that of where the point is seen, not that of the same pixel.
#[test]
fn the_lens_of_the_colour_camera_counts() {
    let straight = camera((64, 48), 60.0);
    let distortion = Distortion::PlumbBob([0.2, 0.0, 0.0, 0.0, 0.0]);
    let bent = CameraModel { distortion, ..straight };
    let looked_up = registration(&straight, &bent, &Isometry3::identity());
    let colours = looked_up.colours(&numbered((64, 48)), &depth((64, 48), vec![0; 64 * 48]));
    let colours = colours.unwrap();
    let mut bent_pixels = 0;
    for (pixel, colour) in colours.into_iter().enumerate() {
        let (column, row) = (pixel % 64, pixel / 64);
        let ray = straight.ray(&nalgebra::Point2::new(column as f64, row as f64)).unwrap();
        let expected = match bent.project(&Point3::new(ray.x, ray.y, 1.0)) {
            Some(at) => [at.x.round().max(0.0) as u8, at.y.round().max(0.0) as u8, 200],
            None => NO_COLOUR,
        };
        assert_eq!(colour, expected, "{column} {row}");
        bent_pixels += usize::from(colour != [column as u8, row as u8, 200]);
    }
    assert!(bent_pixels > 500, "{bent_pixels}");
}

/// The colour camera is 10 cm to the right: what is near is farther to the left in its image, by the depth.
#[test]
fn a_camera_beside_sees_each_depth_elsewhere() {
    let camera = camera((64, 1), 50.0);
    let colour_from_depth = Isometry3::translation(-0.1, 0.0, 0.0);
    let looked_up = registration(&camera, &camera, &colour_from_depth);
    let colours = |depth_mm: u16| {
        looked_up.colours(&numbered((64, 1)), &depth((64, 1), vec![depth_mm; 64])).unwrap()
    };
    // 50 px * 0.1 m / 1 m, and / 2.5 m.
    assert_eq!(colours(1000)[40], [35, 0, 200]);
    assert_eq!(colours(2500)[40], [38, 0, 200]);
    assert_eq!(colours(1000)[3], NO_COLOUR, "left of the colour image");
    assert_eq!(colours(0)[40], NO_COLOUR, "no depth");
}

/// A box before a wall hides a strip of the wall from the colour camera: it does not get the colour of the box.
#[test]
fn what_is_hidden_from_the_colour_camera_has_no_colour() {
    let camera = camera((64, 1), 50.0);
    let looked_up = registration(&camera, &camera, &Isometry3::translation(-0.1, 0.0, 0.0));
    let depths_mm = (0..64).map(|column| if (30..40).contains(&column) { 1000 } else { 5000 });
    let colours = looked_up.colours(&numbered((64, 1)), &depth((64, 1), depths_mm.collect()));
    let colours = colours.unwrap();
    // The box is seen at 25 to 34, the wall one pixel to the left of itself.
    assert_eq!(colours[30], [25, 0, 200]);
    assert_eq!(colours[39], [34, 0, 200]);
    assert_eq!(colours[25], [24, 0, 200]);
    for (column, colour) in colours.iter().enumerate().take(30).skip(26) {
        assert_eq!(*colour, NO_COLOUR, "{column} is behind the box");
    }
    assert_eq!(colours[41], [40, 0, 200]);
}

#[test]
fn images_of_another_size_than_their_camera_are_refused() {
    let camera = camera((8, 6), 7.0);
    let same = registration(&camera, &camera, &Isometry3::identity());
    let depths = depth((8, 6), vec![1000; 48]);
    let error = same.colours(&numbered((6, 8)), &depths).unwrap_err();
    assert!(error.to_string().contains("6 x 8"), "{error}");
    let error = same.colours(&numbered((8, 6)), &depth((6, 8), vec![0; 48])).unwrap_err();
    assert!(error.to_string().contains("6 x 8"), "{error}");
    assert!(ColourImage::new(Stamp::default(), (2, 3), vec![[0; 3]; 5]).is_err());
    let frame = DepthFrame::new(depths, camera).unwrap();
    assert!(frame.clone().with_colours(vec![[1; 3]; 47]).is_err());
    assert_eq!(frame.clone().colours(), None);
    let coloured = frame.with_colours(vec![[1; 3]; 48]).unwrap();
    assert_eq!(coloured.colours(), Some(&[[1; 3]; 48][..]));
    let nowhere = Isometry3::from(Vector3::repeat(f64::NAN));
    let rays = RayTable::new(&camera).unwrap();
    assert!(ColourRegistration::new(&rays, &camera, &nowhere).is_err());
}

/// The points of a cloud without pixels give their colours to the image that they are rendered into: the nearest one of a pixel.
#[test]
fn a_rendered_image_has_the_colours_of_the_points_that_it_shows() {
    let camera = camera((8, 6), 7.0);
    let mut depths_mm = vec![0; 48];
    depths_mm[2 * 8 + 3] = 1500;
    let frame = DepthFrame::new(depth((8, 6), depths_mm), camera).unwrap();
    let point = |depth_m: f32| Point3::new(-0.5 / 7.0 * depth_m, -0.5 / 7.0 * depth_m, depth_m);
    let points = [(point(2.0), [9; 3]), (point(1.5), [5, 6, 7]), (point(1.5), [8; 3])];
    let colours = frame.colours_of_points(points.iter().map(|(point, colour)| (point, *colour)));
    assert_eq!(colours.len(), 48);
    assert_eq!(colours[2 * 8 + 3], [5, 6, 7]);
    assert_eq!(colours.iter().filter(|colour| **colour != NO_COLOUR).count(), 1);
}
