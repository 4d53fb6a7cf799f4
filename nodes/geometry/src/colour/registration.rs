//! Which pixel of a colour image shows what a pixel of the depth image shows.

use nalgebra::{Isometry3, Point2, Point3};

use super::{ColourImage, NO_COLOUR, seen_colour};
use crate::{
    CameraModel, CameraModelError, DepthCameraError, DepthImage, RayTable, UnusablePose, check_pose,
};

/// A surface that is farther from the colour camera than what is before it by more than this share of its distance is hidden
/// there: the noise of depth cameras is less than that, and a step of that size in depth seldom is one of colour.
const HIDDEN_SHARE: f32 = 0.03;

/// Looks up the colour of each pixel of a depth image in the image of a colour camera.
///
/// - Where both have the same camera, as with registered images, pixel by pixel.
/// - Where both have the same optical centre, by the ray of the pixel, whatever its depth.
/// - Otherwise by the point that the pixel shows, where no nearer surface hides it from the colour camera.
///
/// A colour is that of the nearest pixel: no mean of several, which at an edge would be the colour of nothing.
#[derive(Clone, Debug)]
pub struct ColourRegistration {
    depth_camera: CameraModel,
    colour_camera: CameraModel,
    colour_from_depth: Isometry3<f64>,
    lookup: Lookup,
}

#[derive(Clone, Debug)]
enum Lookup {
    SamePixel,
    /// For each pixel of the depth image the pixel of the colour image; one beyond the last where that shows nothing of it.
    ByRay(Vec<u32>),
    ByPoint(RayTable),
}

/// Images of which no colours can be looked up.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum ColourRegistrationError {
    /// A camera is none.
    #[error(transparent)]
    Camera(#[from] CameraModelError),
    /// The place of the cameras is none.
    #[error(transparent)]
    Pose(#[from] UnusablePose),
    /// The depth image is of another size than its camera.
    #[error(transparent)]
    Depth(#[from] DepthCameraError),
    /// The colour image is of another size than its camera.
    #[error(
        "the colour image has {width_px} x {height_px} pixels, its camera {camera_width_px} x {camera_height_px}"
    )]
    Colour {
        /// Columns of the image.
        width_px: usize,
        /// Rows of the image.
        height_px: usize,
        /// Columns of the camera.
        camera_width_px: usize,
        /// Rows of the camera.
        camera_height_px: usize,
    },
}

impl ColourRegistrationError {
    /// # Errors
    /// When a colour image of this size is none of its camera.
    pub fn check_size(
        (width_px, height_px): (usize, usize),
        colour_camera: &CameraModel,
    ) -> Result<(), Self> {
        let (camera_width_px, camera_height_px) = (colour_camera.width_px, colour_camera.height_px);
        if (width_px, height_px) == (camera_width_px, camera_height_px) {
            return Ok(());
        }
        Err(Self::Colour { width_px, height_px, camera_width_px, camera_height_px })
    }
}

impl ColourRegistration {
    /// Of a depth camera and a colour camera; `colour_from_depth` takes a point of the optical frame of the one to that of the
    /// other. It costs some 50 ms: make one for two cameras, not for each image.
    ///
    /// # Errors
    /// When the colour camera or the transform is none.
    pub fn new(
        depth_rays: &RayTable,
        colour_camera: &CameraModel,
        colour_from_depth: &Isometry3<f64>,
    ) -> Result<Self, ColourRegistrationError> {
        let depth_camera = depth_rays.camera();
        colour_camera.validate()?;
        check_pose(colour_from_depth)?;
        let lookup = if colour_from_depth.translation.vector.norm() > 0.0 {
            Lookup::ByPoint(depth_rays.clone())
        } else if *colour_from_depth == Isometry3::identity() && depth_camera == colour_camera {
            Lookup::SamePixel
        } else {
            Lookup::ByRay(pixels_by_ray(depth_camera, colour_camera, colour_from_depth))
        };
        Ok(Self {
            depth_camera: *depth_camera,
            colour_camera: *colour_camera,
            colour_from_depth: *colour_from_depth,
            lookup,
        })
    }

    /// Whether it is of these cameras.
    #[must_use]
    pub fn is_of(&self, depth_camera: &CameraModel, colour_camera: &CameraModel) -> bool {
        self.depth_camera == *depth_camera && self.colour_camera == *colour_camera
    }

    /// The colour of each pixel of the depth image, row by row; [`NO_COLOUR`] where the colour camera does not show it.
    ///
    /// # Errors
    /// When an image is of another size than its camera.
    pub fn colours(
        &self,
        colour: &ColourImage,
        depth: &DepthImage,
    ) -> Result<Vec<[u8; 3]>, ColourRegistrationError> {
        let size_px = (colour.width_px(), colour.height_px());
        ColourRegistrationError::check_size(size_px, &self.colour_camera)?;
        let camera_size_px = (self.depth_camera.width_px, self.depth_camera.height_px);
        if (depth.width_px(), depth.height_px()) != camera_size_px {
            return Err(DepthCameraError {
                image_width_px: depth.width_px(),
                image_height_px: depth.height_px(),
                camera_width_px: camera_size_px.0,
                camera_height_px: camera_size_px.1,
            }
            .into());
        }
        let seen = |pixel: u32| {
            colour.pixels().get(pixel as usize).map_or(NO_COLOUR, |it| seen_colour(*it))
        };
        Ok(match &self.lookup {
            Lookup::SamePixel => colour.pixels().iter().map(|it| seen_colour(*it)).collect(),
            Lookup::ByRay(pixels) => pixels.iter().map(|pixel| seen(*pixel)).collect(),
            Lookup::ByPoint(rays) => {
                self.pixels_by_point(rays, depth).into_iter().map(seen).collect()
            }
        })
    }

    /// The pixel of the colour image that shows what each pixel of the depth image shows; one beyond the last where there is none.
    fn pixels_by_point(&self, rays: &RayTable, depth: &DepthImage) -> Vec<u32> {
        let (width_px, height_px) = (depth.width_px(), depth.height_px());
        let none = beyond(&self.colour_camera);
        let mut pixels = vec![none; width_px * height_px];
        let mut depths_m = vec![0.0_f32; width_px * height_px];
        let mut nearest = Nearest::new(&self.depth_camera, &self.colour_camera);
        for row in 0..height_px {
            for column in 0..width_px {
                let Some(depth_m) = depth.depth_m(column, row) else { continue };
                let Some(ray) = rays.ray(column, row) else { continue };
                let depth_m = f64::from(depth_m);
                let ray = ray.cast::<f64>();
                let point = Point3::new(ray.x * depth_m, ray.y * depth_m, depth_m);
                let in_colour = self.colour_from_depth * point;
                let Some(at) = self.colour_camera.project(&in_colour) else { continue };
                let index = row * width_px + column;
                pixels[index] = pixel_at(&self.colour_camera, &at);
                depths_m[index] = in_colour.z as f32;
                nearest.keep(pixels[index], depths_m[index]);
            }
        }
        for (pixel, depth_m) in pixels.iter_mut().zip(depths_m) {
            if *pixel != none && nearest.hides(*pixel, depth_m) {
                *pixel = none;
            }
        }
        pixels
    }
}

/// The nearest depth that the colour camera sees, in squares as large as what a pixel of the depth image covers there, so that
/// a surface leaves no gaps between its points.
struct Nearest {
    edge_px: usize,
    colour_width_px: usize,
    width: usize,
    depths_m: Vec<f32>,
}

impl Nearest {
    fn new(depth_camera: &CameraModel, colour_camera: &CameraModel) -> Self {
        let covered_px = (colour_camera.fx_px / depth_camera.fx_px).max(1.0).ceil();
        // The cast saturates.
        let edge_px = (covered_px as usize).clamp(1, colour_camera.width_px.max(1));
        let width = colour_camera.width_px.div_ceil(edge_px);
        let height = colour_camera.height_px.div_ceil(edge_px);
        let depths_m = vec![f32::INFINITY; width * height];
        Self { edge_px, colour_width_px: colour_camera.width_px, width, depths_m }
    }

    fn square(&self, pixel: u32) -> usize {
        let (column, row) =
            (pixel as usize % self.colour_width_px, pixel as usize / self.colour_width_px);
        row / self.edge_px * self.width + column / self.edge_px
    }

    fn keep(&mut self, pixel: u32, depth_m: f32) {
        let square = self.square(pixel);
        if let Some(nearest_m) = self.depths_m.get_mut(square) {
            *nearest_m = nearest_m.min(depth_m);
        }
    }

    fn hides(&self, pixel: u32, depth_m: f32) -> bool {
        let nearest_m = self.depths_m.get(self.square(pixel)).copied().unwrap_or(f32::INFINITY);
        depth_m > nearest_m * (1.0 + HIDDEN_SHARE)
    }
}

fn pixels_by_ray(
    depth_camera: &CameraModel,
    colour_camera: &CameraModel,
    colour_from_depth: &Isometry3<f64>,
) -> Vec<u32> {
    let pixels = (0..depth_camera.height_px)
        .flat_map(|row| (0..depth_camera.width_px).map(move |column| (column, row)));
    let of_pixel = |(column, row): (usize, usize)| {
        let ray = depth_camera.ray(&Point2::new(column as f64, row as f64))?;
        let at = colour_camera.project(&(colour_from_depth * Point3::new(ray.x, ray.y, 1.0)))?;
        Some(pixel_at(colour_camera, &at))
    };
    let none = beyond(colour_camera);
    pixels.map(|pixel| of_pixel(pixel).unwrap_or(none)).collect()
}

/// One beyond the last pixel.
fn beyond(camera: &CameraModel) -> u32 {
    (camera.width_px * camera.height_px) as u32
}

/// The pixel nearest to a position on the image.
fn pixel_at(camera: &CameraModel, at: &Point2<f64>) -> u32 {
    // The casts saturate at 0.
    let column = (at.x.round() as usize).min(camera.width_px.saturating_sub(1));
    let row = (at.y.round() as usize).min(camera.height_px.saturating_sub(1));
    (row * camera.width_px + column) as u32
}
