//! Points without pixels, rendered into the depth image of a camera that looks along the optical axis.

use nalgebra::Point3;

use super::millimetres;
use crate::{CameraModel, Distortion};

/// Points with a larger slope, `x / z` or `y / z`, are left out: the field of view is 120 degrees. The size of a pinhole image
/// grows without bound towards 180 degrees.
const MOST_SLOPE: f64 = 1.732;
/// The image ends at multiples of this slope, so that noise of the outermost points does not change its size.
const EXTENT_STEP: f64 = 0.05;
/// Pixels are no finer than this, as slope: a depth image of 2,000 columns over 53 degrees.
const FINEST_PITCH: f64 = 5e-4;
/// The image has no more pixels than this.
pub(super) const MOST_PIXELS: usize = 1 << 20;

/// The camera where no points are in view: one pixel that looks ahead.
pub(super) const BLIND: CameraModel = CameraModel {
    width_px: 1,
    height_px: 1,
    fx_px: 1.0,
    fy_px: 1.0,
    cx_px: 0.0,
    cy_px: 0.0,
    distortion: Distortion::None,
};

/// The distance from one pixel to the next, as slope: [`FINEST_PITCH`] times a power of the fourth root of two. As only these occur,
/// the same points give the same camera again.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(super) struct Pitch(u8);

impl Pitch {
    const FINEST: Self = Self(0);
    /// 0.064: 3.7 degrees, 6 cm at a metre.
    const COARSEST: Self = Self(28);

    fn slope(self) -> f64 {
        FINEST_PITCH * (f64::from(self.0) / 4.0).exp2()
    }

    pub(super) fn coarser(self) -> Option<Self> {
        (self < Self::COARSEST).then_some(Self(self.0 + 1))
    }
}

/// The points of a cloud that are in view, and the camera that sees them at each pitch.
pub(super) struct PointsInView {
    points: Vec<PointInView>,
    extent: Extent,
}

struct PointInView {
    slopes: [f64; 2],
    depth_mm: u16,
}

/// The slopes between which the points lie.
#[derive(Clone, Copy)]
struct Extent {
    least: [f64; 2],
    most: [f64; 2],
}

/// The depths that a camera sees.
pub(super) struct Rendered {
    pub(super) camera: CameraModel,
    /// Of the nearest point in each pixel; 0 where there is none.
    pub(super) depths_mm: Vec<u16>,
    /// The share of the neighbours, right and below, of pixels with a depth that have a depth too; beyond the image there is none.
    pub(super) filled: f64,
    /// The mean number of points in the pixels with a depth.
    pub(super) points_per_pixel: f64,
}

impl PointsInView {
    /// `None` where no point is in view. The points are in the camera's optical frame.
    pub(super) fn of(points_in_camera_m: &[Point3<f32>]) -> Option<Self> {
        let mut extent = Extent { least: [MOST_SLOPE; 2], most: [-MOST_SLOPE; 2] };
        let mut points = Vec::with_capacity(points_in_camera_m.len());
        for point_m in points_in_camera_m {
            let depth_mm = millimetres(point_m.z);
            let point_m = point_m.cast::<f64>();
            let slopes = [point_m.x / point_m.z, point_m.y / point_m.z];
            // NaN is not within.
            if depth_mm > 0 && slopes.iter().all(|slope| slope.abs() <= MOST_SLOPE) {
                for (axis, slope) in slopes.into_iter().enumerate() {
                    extent.least[axis] = extent.least[axis].min(slope);
                    extent.most[axis] = extent.most[axis].max(slope);
                }
                points.push(PointInView { slopes, depth_mm });
            }
        }
        (!points.is_empty()).then(|| Self { points, extent: extent.snapped() })
    }

    /// The finest pitch at which the image has no more than [`MOST_PIXELS`].
    pub(super) fn finest_pitch(&self) -> Pitch {
        let mut pitch = Pitch::FINEST;
        let pixels = |camera: CameraModel| camera.width_px * camera.height_px;
        while pixels(self.extent.camera(pitch)) > MOST_PIXELS
            && let Some(coarser) = pitch.coarser()
        {
            pitch = coarser;
        }
        pitch
    }

    pub(super) fn render(&self, pitch: Pitch) -> Rendered {
        let camera = self.extent.camera(pitch);
        let CameraModel { width_px, height_px, fx_px, fy_px, cx_px, cy_px, .. } = camera;
        let mut depths_mm = vec![0_u16; width_px * height_px];
        for PointInView { slopes: [x, y], depth_mm } in &self.points {
            // Within the extent, and so not negative and not beyond the last pixel. Rounded by the casts.
            let (column, row) = (fx_px * x + cx_px + 0.5, fy_px * y + cy_px + 0.5);
            let pixel = row as u32 as usize * width_px + column as u32 as usize;
            if let Some(nearest_mm) = depths_mm.get_mut(pixel)
                && (*nearest_mm == 0 || depth_mm < nearest_mm)
            {
                *nearest_mm = *depth_mm;
            }
        }
        let with_depth: u32 = depths_mm.iter().map(|depth_mm| u32::from(*depth_mm > 0)).sum();
        let with_depth = f64::from(with_depth);
        let filled = f64::from(neighbours_with_depth(&depths_mm, width_px)) / (2.0 * with_depth);
        let points_per_pixel = self.points.len() as f64 / with_depth;
        Rendered { camera, depths_mm, filled, points_per_pixel }
    }
}

impl Extent {
    /// Moved outwards to multiples of the step.
    fn snapped(self) -> Self {
        let at = |steps: f64| (steps * EXTENT_STEP).clamp(-MOST_SLOPE, MOST_SLOPE);
        Self {
            least: self.least.map(|slope| at((slope / EXTENT_STEP).floor())),
            most: self.most.map(|slope| at((slope / EXTENT_STEP).ceil())),
        }
    }

    fn camera(&self, pitch: Pitch) -> CameraModel {
        let pitch = pitch.slope();
        // From the centre of the first pixel to that of the last.
        let pixels =
            |axis: usize| ((self.most[axis] - self.least[axis]) / pitch).ceil() as usize + 1;
        CameraModel {
            width_px: pixels(0),
            height_px: pixels(1),
            fx_px: 1.0 / pitch,
            fy_px: 1.0 / pitch,
            cx_px: -self.least[0] / pitch,
            cy_px: -self.least[1] / pitch,
            distortion: Distortion::None,
        }
    }
}

/// How many pixels with a depth have one with a depth beside them to the right, and how many have one below.
fn neighbours_with_depth(depths_mm: &[u16], width_px: usize) -> u32 {
    let count = |depths_mm: &[u16], neighbours_mm: &[u16]| -> u32 {
        let pairs = depths_mm.iter().zip(neighbours_mm);
        pairs.map(|(one_mm, other_mm)| u32::from((*one_mm > 0) & (*other_mm > 0))).sum()
    };
    let to_the_right = |row: &[u16]| count(row, row.get(1..).unwrap_or_default());
    let below = depths_mm.get(width_px..).unwrap_or_default();
    depths_mm.chunks_exact(width_px).map(to_the_right).sum::<u32>() + count(depths_mm, below)
}
