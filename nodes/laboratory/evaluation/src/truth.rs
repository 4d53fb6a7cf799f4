//! The ground truth of one stamp: the points of a depth image, each with the label of its pixel.

use geometry::{DepthImage, DepthLimits, LabelImage, RayTable};
use nalgebra::{Isometry3, Point3};

/// A true point and its object.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct LabelledPoint {
    /// The position in the rig frame.
    pub point_in_rig: Point3<f32>,
    /// 0 for the static scene, any other number for an object.
    pub object_id: u16,
}

/// The labelled points of one image.
#[derive(Clone, PartialEq, Debug)]
pub struct TruthFrame {
    image_size_px: (usize, usize),
    points: Vec<LabelledPoint>,
}

/// The images and the camera of a ground truth do not have the same size.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
#[error(
    "the truth's depth image has {depth_px:?} pixels, its label image {labels_px:?} and its camera \
     {camera_px:?}: all three must be of one size"
)]
pub struct TruthFrameError {
    /// Columns and rows of the depth image.
    pub depth_px: (usize, usize),
    /// Columns and rows of the label image.
    pub labels_px: (usize, usize),
    /// Columns and rows of the camera.
    pub camera_px: (usize, usize),
}

impl TruthFrame {
    /// The ground truth of a depth image and the labels of its pixels. A pixel without a depth within `limits`, which
    /// should be the pipeline's own, has no point: the run had none either.
    ///
    /// # Errors
    /// When the images and the camera do not have the same size.
    pub fn from_images(
        depth: &DepthImage,
        labels: &LabelImage,
        rays: &RayTable,
        limits: &DepthLimits,
        rig_from_camera: &Isometry3<f64>,
    ) -> Result<Self, TruthFrameError> {
        let image_size_px = (depth.width_px(), depth.height_px());
        let labels_px = (labels.width_px(), labels.height_px());
        let camera_px = (rays.width_px(), rays.height_px());
        if labels_px != image_size_px || camera_px != image_size_px {
            return Err(TruthFrameError { depth_px: image_size_px, labels_px, camera_px });
        }
        let rig_from_camera: Isometry3<f32> = rig_from_camera.cast();
        let point_of = |column_px, row_px| {
            let depth_m = depth.depth_m(column_px, row_px)?;
            if depth_m < limits.min_m || depth_m > limits.max_m {
                return None;
            }
            let ray = rays.ray(column_px, row_px)?;
            let point_in_camera = Point3::new(ray.x * depth_m, ray.y * depth_m, depth_m);
            let object_id = labels.object_id(column_px, row_px)?;
            Some(LabelledPoint { point_in_rig: rig_from_camera * point_in_camera, object_id })
        };
        let (columns, rows) = image_size_px;
        let points = (0..rows)
            .flat_map(|row_px| {
                (0..columns).filter_map(move |column_px| point_of(column_px, row_px))
            })
            .collect();
        Ok(Self { image_size_px, points })
    }

    /// A truth from points that are known without an image; `image_size_px` sets the scale of the threshold of
    /// view, see [`DynamicScoreRules`](report::DynamicScoreRules).
    #[must_use]
    pub fn from_points(image_size_px: (usize, usize), points: Vec<LabelledPoint>) -> Self {
        Self { image_size_px, points }
    }

    /// Columns and rows of the image.
    #[must_use]
    pub fn image_size_px(&self) -> (usize, usize) {
        self.image_size_px
    }

    /// The points, row by row.
    #[must_use]
    pub fn points(&self) -> &[LabelledPoint] {
        &self.points
    }
}

#[cfg(test)]
mod tests {
    use geometry::{CameraModel, DepthPixels, Distortion, Stamp, pose_from_vector};
    use std::f64::consts::FRAC_PI_2;

    use super::*;

    const LIMITS: DepthLimits = DepthLimits { min_m: 0.5, max_m: 8.0 };

    fn rays(width_px: usize) -> RayTable {
        RayTable::new(&CameraModel {
            width_px,
            height_px: 2,
            fx_px: 2.0,
            fy_px: 2.0,
            cx_px: 1.0,
            cy_px: 0.0,
            distortion: Distortion::None,
        })
        .unwrap()
    }

    fn depth() -> DepthImage {
        // Row by row: too near, good, too far; hole, good, good.
        let pixels = DepthPixels::Millimetres(vec![400, 2000, 9000, 0, 4000, 4000]);
        DepthImage::new(Stamp::default(), "camera".to_owned(), (3, 2), pixels).unwrap()
    }

    fn labels(size_px: (usize, usize)) -> LabelImage {
        let labels = (0..(size_px.0 * size_px.1) as u16).collect();
        LabelImage::new(Stamp::default(), "camera".to_owned(), size_px, labels).unwrap()
    }

    #[test]
    fn points_lie_where_their_pixels_look_and_keep_their_labels() {
        // x right, y down, z forward becomes x forward, y left, z up.
        let rig_from_camera = pose_from_vector(&[0.0, 0.0, 0.0, -FRAC_PI_2, 0.0, -FRAC_PI_2]);
        let truth =
            TruthFrame::from_images(&depth(), &labels((3, 2)), &rays(3), &LIMITS, &rig_from_camera)
                .unwrap();
        assert_eq!(truth.image_size_px(), (3, 2));
        // Pixel (1, 0) looks straight ahead, (1, 1) down, (2, 1) right and down.
        let expected = [(1, [2.0, 0.0, 0.0]), (4, [4.0, 0.0, -2.0]), (5, [4.0, -2.0, -2.0])];
        assert_eq!(truth.points().len(), expected.len());
        for (point, (label, [x, y, z])) in truth.points().iter().zip(expected) {
            assert_eq!(point.object_id, label);
            assert!((point.point_in_rig - Point3::new(x, y, z)).norm() < 1e-5, "{point:?}");
        }
    }

    #[test]
    fn images_of_different_sizes_are_refused_with_their_sizes() {
        let identity = Isometry3::identity();
        let error =
            TruthFrame::from_images(&depth(), &labels((2, 3)), &rays(3), &LIMITS, &identity)
                .unwrap_err();
        assert_eq!((error.depth_px, error.labels_px, error.camera_px), ((3, 2), (2, 3), (3, 2)));
        let camera =
            TruthFrame::from_images(&depth(), &labels((3, 2)), &rays(4), &LIMITS, &identity);
        assert_eq!(camera.unwrap_err().camera_px, (4, 2));
    }
}
