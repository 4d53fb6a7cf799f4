//! The camera of the depth images that are made of clouds, from one cloud to the next.

use std::sync::Arc;

use super::pinhole_fit::{PinholeFit, PinholeFitError};
use super::points_in_view::{BLIND, Pitch, PointsInView, Rendered};
use super::{DepthFrame, millimetres};
use crate::{CameraModel, Cloud, DepthImage, OrganisedCloud, RayTable};

/// Surfaces have no holes when this share of the neighbours of pixels with a depth have a depth too: in Kinect images it is
/// 0.95, at every third pixel as at all of them. Where pixels are finer than the points are apart by a third it is 0.5.
const FILLED: f64 = 0.85;
/// The pitch of the cloud before is too fine when the share is less than this. The gap to [`FILLED`] keeps the pitch from
/// changing with the noise of the share.
const HAS_HOLES: f64 = 0.5;
/// The pitch of the cloud before may be too coarse when pixels hold so many times the points that they held when it was chosen:
/// the points are closer together by a fifth in each axis.
const CROWDED: f64 = 1.5;

/// Makes a depth image of each cloud of a sensor.
///
/// An organised cloud that was computed with a pinhole camera gives the image that it was computed from. Any other cloud is
/// rendered into the image of a pinhole camera along the optical axis, and loses some information:
/// - Points more than 60 degrees off the axis, horizontally or vertically, are left out: the field of view is at most 120 degrees.
/// - Each pixel has the depth of the nearest of its points.
/// - A point is taken to be at its pixel's centre, which is up to half a pixel beside it in each axis.
///
/// A rendered image covers its own cloud. The pitch, from one pixel to the next, is the finest at which the surfaces of the cloud
/// have no holes. It is kept from cloud to cloud until it is too fine or too coarse.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct CloudCamera {
    fitted: Option<CameraModel>,
    chosen: Option<Chosen>,
}

/// The pitch of rendered images.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Chosen {
    pitch: Pitch,
    /// [`Rendered::points_per_pixel`] of the cloud that it was chosen by.
    points_per_pixel: f64,
}

impl CloudCamera {
    /// The depth image that an organised cloud, in the camera's optical frame, was computed from. It takes one pass over the points
    /// to find the camera, or to find that there is none, and one to fill the image.
    ///
    /// # Errors
    /// When the cloud was not computed with a pinhole camera, or has too few points to know. [`CloudCamera::frame_of_points`] renders
    /// it.
    pub fn frame_of_organised(
        &mut self,
        cloud: &OrganisedCloud,
    ) -> Result<DepthFrame, PinholeFitError> {
        let fit = PinholeFit::of(cloud);
        let camera = match self.fitted.filter(|known| fit.fits(known)) {
            Some(known) => known,
            None => fit.camera()?,
        };
        self.fitted = Some(camera);
        let mut depths_mm = vec![0; camera.width_px * camera.height_px];
        for (point_m, [column, row]) in cloud.with_pixels() {
            if let Some(depth_mm) = depths_mm.get_mut(row * camera.width_px + column) {
                *depth_mm = millimetres(point_m.z);
            }
        }
        Ok(frame_of(cloud.cloud(), camera, depths_mm))
    }

    /// The depth image that a cloud, in the camera's optical frame, is rendered into. Without points in view it is one pixel in
    /// which nothing was measured.
    #[must_use]
    pub fn frame_of_points(&mut self, cloud: &Cloud) -> DepthFrame {
        let Some(points) = PointsInView::of(&cloud.points_m) else {
            return frame_of(cloud, BLIND, vec![0; BLIND.width_px * BLIND.height_px]);
        };
        let Rendered { camera, depths_mm, .. } = self.render(&points);
        frame_of(cloud, camera, depths_mm)
    }

    fn render(&mut self, points: &PointsInView) -> Rendered {
        let finest = points.finest_pitch();
        if let Some(Chosen { pitch, points_per_pixel }) = self.chosen {
            let pitch = pitch.max(finest);
            let rendered = points.render(pitch);
            if rendered.filled < HAS_HOLES {
                return self.choose(points, pitch);
            }
            let is_crowded = rendered.points_per_pixel > CROWDED * points_per_pixel;
            if !is_crowded || pitch == finest {
                return rendered;
            }
        }
        self.choose(points, finest)
    }

    /// Renders at the finest pitch, of this one and the coarser ones, at which surfaces have no holes. Where they have some at
    /// each, it is the pitch with the fewest.
    fn choose(&mut self, points: &PointsInView, first: Pitch) -> Rendered {
        let (mut pitch, mut rendered) = (first, points.render(first));
        let mut next = first;
        while rendered.filled < FILLED
            && let Some(coarser) = next.coarser()
        {
            next = coarser;
            let candidate = points.render(next);
            if candidate.filled >= rendered.filled {
                (pitch, rendered) = (next, candidate);
            }
        }
        let points_per_pixel = rendered.points_per_pixel;
        // The finest pitch that the size of the image allows says nothing of the points: a smaller image may have a finer one.
        let is_of_points = pitch > points.finest_pitch();
        self.chosen = is_of_points.then_some(Chosen { pitch, points_per_pixel });
        rendered
    }
}

/// The frame of as many pixels as the camera has.
fn frame_of(cloud: &Cloud, camera: CameraModel, depths_mm: Vec<u16>) -> DepthFrame {
    let size_px = (camera.width_px, camera.height_px);
    let image = DepthImage::of_millimetres(cloud.stamp, cloud.frame_id.clone(), size_px, depths_mm);
    DepthFrame::of_its_size(Arc::new(image), RayTable::of_valid(camera))
}
