//! Depth images as the colour camera would have taken them.

use geometry::{CameraModel, CameraModelError, DepthImage, DepthPixels, DepthSizeError, RayTable};
use nalgebra::{Isometry3, Point3};

/// Moves the depths of a depth camera into the image of a colour camera beside it, for drivers that do not.
#[derive(Clone, Debug)]
pub struct DepthRegistration {
    rays: RayTable,
    color: CameraModel,
    color_from_depth: Isometry3<f32>,
    /// How many columns and rows of the colour image a depth pixel covers: half of them, to each side.
    half_columns: f32,
    half_rows: f32,
}

/// A camera or an image does not fit.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
pub enum DepthRegistrationError {
    /// The numbers do not describe a camera.
    #[error(transparent)]
    Camera(#[from] CameraModelError),
    /// The colour camera has distortion.
    #[error("depths are registered to the rectified colour camera, which has no distortion")]
    DistortedColor,
    /// The transform between the cameras is not a finite one.
    #[error("the transform from the depth camera to the colour camera is not finite")]
    Transform,
    /// The image was taken by another camera.
    #[error("the depth image has {width_px} x {height_px} pixels, the camera {camera_px:?}")]
    ImageSize {
        /// Columns of the image.
        width_px: usize,
        /// Rows of the image.
        height_px: usize,
        /// Columns and rows of the camera.
        camera_px: (usize, usize),
    },
    /// The depth image could not be put together.
    #[error(transparent)]
    Depth(#[from] DepthSizeError),
}

/// No depth pixel covers more colour pixels than this to each side: a colour image of sixteen times the columns.
const MOST_HALF_PX: f32 = 8.0;

impl DepthRegistration {
    /// From the images of `depth`, as its lens shows them, to those of `color`, which are rectified.
    ///
    /// # Errors
    /// When the numbers do not describe cameras, `color` has distortion, or the transform is not finite.
    pub fn new(
        depth: &CameraModel,
        color: &CameraModel,
        color_from_depth: &Isometry3<f64>,
    ) -> Result<Self, DepthRegistrationError> {
        color.validate()?;
        let rays = RayTable::new(depth)?;
        if !color.distortion.is_none() {
            return Err(DepthRegistrationError::DistortedColor);
        }
        if !color_from_depth.to_homogeneous().iter().all(|number| number.is_finite()) {
            return Err(DepthRegistrationError::Transform);
        }
        // A depth pixel spans 1 / f of its own; a surface as far away spans as much of the colour image.
        let half = |color_px: f64, depth_px: f64| {
            (0.5 * color_px / depth_px).min(f64::from(MOST_HALF_PX)) as f32
        };
        Ok(Self {
            rays,
            color: *color,
            color_from_depth: color_from_depth.cast(),
            half_columns: half(color.fx_px, depth.fx_px),
            half_rows: half(color.fy_px, depth.fy_px),
        })
    }

    /// The depth image in millimetres as the colour camera would have taken it. Each depth pixel covers the colour
    /// pixels whose centres it hits, at least one, and of several depths the nearest counts.
    ///
    /// # Errors
    /// When the image is not of the depth camera's size.
    pub fn register(
        &self,
        image: &DepthImage,
        frame_id: &str,
    ) -> Result<DepthImage, DepthRegistrationError> {
        let (width_px, height_px) = (image.width_px(), image.height_px());
        let camera_px = (self.rays.width_px(), self.rays.height_px());
        if (width_px, height_px) != camera_px {
            return Err(DepthRegistrationError::ImageSize { width_px, height_px, camera_px });
        }
        let (columns, rows) = (self.color.width_px, self.color.height_px);
        let mut nearest_m = vec![f32::INFINITY; columns * rows];
        for row in 0..height_px {
            for column in 0..width_px {
                let Some(depth_m) = image.depth_m(column, row) else { continue };
                let Some(ray) = self.rays.ray(column, row) else { continue };
                let point = Point3::new(ray.x * depth_m, ray.y * depth_m, depth_m);
                self.cover(&(self.color_from_depth * point), &mut nearest_m);
            }
        }
        let pixels = match image.pixels() {
            DepthPixels::Millimetres(_) => {
                DepthPixels::Millimetres(nearest_m.into_iter().map(millimetres).collect())
            }
            DepthPixels::Metres(_) => DepthPixels::Metres(
                nearest_m.into_iter().map(|m| if m.is_finite() { m } else { f32::NAN }).collect(),
            ),
        };
        Ok(DepthImage::new(image.stamp, frame_id.to_owned(), (columns, rows), pixels)?)
    }

    /// Writes a point of the colour camera's frame to the pixels that it covers.
    fn cover(&self, point: &Point3<f32>, nearest_m: &mut [f32]) {
        if point.z <= 0.0 {
            return;
        }
        let color = &self.color;
        let column = color.fx_px as f32 * point.x / point.z + color.cx_px as f32;
        let row = color.fy_px as f32 * point.y / point.z + color.cy_px as f32;
        let span = |middle: f32, half: f32, size: usize| {
            // The centres from middle - half to below middle + half; at least the nearest.
            let nearest = middle.round();
            let first = (middle - half).ceil().min(nearest).max(0.0);
            let last = ((middle + half).ceil() - 1.0).max(nearest).min(size as f32 - 1.0);
            // An empty span where the point is beyond the image, or nowhere.
            if first <= last { first as usize..last as usize + 1 } else { 0..0 }
        };
        let columns = span(column, self.half_columns, color.width_px);
        for row in span(row, self.half_rows, color.height_px) {
            let start = row * color.width_px;
            let covered = nearest_m.get_mut(start + columns.start..start + columns.end);
            for depth_m in covered.unwrap_or_default() {
                *depth_m = depth_m.min(point.z);
            }
        }
    }
}

/// A depth as `16UC1` has it: 0 where there is none, and where it does not fit.
fn millimetres(depth_m: f32) -> u16 {
    let millimetres = (depth_m * 1e3).round();
    if millimetres <= f32::from(u16::MAX) { millimetres as u16 } else { 0 }
}

#[cfg(test)]
mod tests {
    use geometry::{Distortion, Stamp};
    use nalgebra::{Translation3, UnitQuaternion, Vector3};

    use super::*;

    fn camera(width_px: usize, height_px: usize, focal_px: f64) -> CameraModel {
        CameraModel {
            width_px,
            height_px,
            fx_px: focal_px,
            fy_px: focal_px,
            cx_px: (width_px - 1) as f64 / 2.0,
            cy_px: (height_px - 1) as f64 / 2.0,
            distortion: Distortion::None,
        }
    }

    fn depth(size_px: (usize, usize), depth_mm: impl Fn(usize, usize) -> u16) -> DepthImage {
        let pixels = (0..size_px.1).flat_map(|row| (0..size_px.0).map(move |column| (column, row)));
        let pixels = pixels.map(|(column, row)| depth_mm(column, row)).collect();
        DepthImage::new(
            Stamp::default(),
            "depth".to_owned(),
            size_px,
            DepthPixels::Millimetres(pixels),
        )
        .unwrap()
    }

    #[test]
    fn the_same_camera_changes_nothing() {
        let camera = camera(64, 48, 60.0);
        let image = depth((64, 48), |column, row| (column * row % 7 * 500) as u16);
        let registration =
            DepthRegistration::new(&camera, &camera, &Isometry3::identity()).unwrap();
        assert_eq!(registration.register(&image, "depth").unwrap(), image);
    }

    /// A wall seen from a depth camera, moved and turned against a colour camera of twice the resolution.
    #[test]
    fn a_wall_is_where_the_colour_camera_would_measure_it_without_holes() {
        let (depth_camera, color_camera) = (camera(160, 120, 150.0), camera(320, 240, 300.0));
        let turn = UnitQuaternion::from_euler_angles(0.01, -0.02, 0.015);
        let color_from_depth = Isometry3::from_parts(Translation3::new(0.05, 0.01, 0.02), turn);
        let depth_from_color = color_from_depth.inverse();
        // The wall is z = 2 m + 0.2 x in the colour camera's frame.
        let (normal, offset_m) = (Vector3::new(-0.2, 0.0, 1.0), 2.0);
        let in_depth = depth_from_color.rotation * normal;
        let offset_in_depth_m = offset_m - normal.dot(&color_from_depth.translation.vector);
        let image = depth((160, 120), |column, row| {
            let ray = depth_camera.ray(&nalgebra::Point2::new(column as f64, row as f64)).unwrap();
            (1e3 * offset_in_depth_m / in_depth.dot(&Vector3::new(ray.x, ray.y, 1.0))).round()
                as u16
        });
        let registration =
            DepthRegistration::new(&depth_camera, &color_camera, &color_from_depth).unwrap();
        let registered = registration.register(&image, "color").unwrap();
        assert_eq!(registered.frame_id, "color");
        let mut holes = 0;
        for row in 20..220 {
            for column in 30..290 {
                let ray =
                    color_camera.ray(&nalgebra::Point2::new(column as f64, row as f64)).unwrap();
                let expected_m = offset_m / normal.dot(&Vector3::new(ray.x, ray.y, 1.0));
                match registered.depth_m(column, row) {
                    None => holes += 1,
                    Some(depth_m) => assert!(
                        (f64::from(depth_m) - expected_m).abs() < 0.005,
                        "{column} {row}: {depth_m} {expected_m}"
                    ),
                }
            }
        }
        assert!(holes < 200 * 260 / 100, "{holes}");
    }

    #[test]
    fn of_two_things_behind_each_other_the_nearer_counts() {
        let camera = camera(64, 48, 60.0);
        // The colour camera is 0.2 m to the right, so that a near thing moves 12 pixels to the left, a far one 3.
        let color_from_depth = Isometry3::translation(-0.2, 0.0, 0.0);
        let image =
            depth((64, 48), |column, _| if (30..40).contains(&column) { 1000 } else { 4000 });
        let registration = DepthRegistration::new(&camera, &camera, &color_from_depth).unwrap();
        let registered = registration.register(&image, "color").unwrap();
        for column in 18..28 {
            assert_eq!(registered.depth_m(column, 20), Some(1.0), "{column}");
        }
        assert_eq!(registered.depth_m(17, 20), Some(4.0));
        // What the near thing hid from the depth camera.
        assert_eq!(registered.depth_m(30, 20), None);
    }

    #[test]
    fn what_does_not_fit_is_refused() {
        let camera = camera(64, 48, 60.0);
        let registration =
            DepthRegistration::new(&camera, &camera, &Isometry3::identity()).unwrap();
        let error = registration.register(&depth((2, 2), |_, _| 1), "color").unwrap_err();
        assert!(error.to_string().contains("2 x 2"), "{error}");
        let far = Isometry3::translation(f64::NAN, 0.0, 0.0);
        let error = DepthRegistration::new(&camera, &camera, &far).unwrap_err();
        assert_eq!(error, DepthRegistrationError::Transform);
        let bent = CameraModel { distortion: Distortion::PlumbBob([0.1; 5]), ..camera };
        let error = DepthRegistration::new(&camera, &bent, &Isometry3::identity()).unwrap_err();
        assert_eq!(error, DepthRegistrationError::DistortedColor);
    }
}
