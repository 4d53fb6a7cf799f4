//! The pinhole camera that an organised cloud was computed with.

use crate::{CameraModel, CameraModelError, Distortion, OrganisedCloud};

/// Fewer points do not determine a camera.
const LEAST_POINTS: usize = 100;
/// A cloud was computed with a pinhole camera when its points lie so near their pixels, as root mean square. Drivers compute the
/// points from the pixels, so that nothing but rounding is left; a lens whose distortion was not removed leaves several pixels.
const MOST_RESIDUAL_PX: f64 = 0.5;

/// Why no pinhole camera is known that an organised cloud was computed with.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum PinholeFitError {
    /// Too few points are in front of the camera.
    #[error(
        "the cloud has {points} points in front of the camera, and a camera is fitted to {LEAST_POINTS} or more"
    )]
    TooFewPoints {
        /// How many there are.
        points: usize,
    },
    /// The points do not lie where their pixels look.
    #[error(
        "the points of the cloud lie {residual_px:.2} px from their pixels, more than {MOST_RESIDUAL_PX}: it was not computed \
         with a pinhole camera, or its frame is not the camera's optical frame"
    )]
    Residual {
        /// The root mean square of the distances.
        residual_px: f64,
    },
    /// The numbers that fit the points best do not describe a camera.
    #[error(transparent)]
    Camera(#[from] CameraModelError),
}

/// Sums over the points of an organised cloud, taken in one pass: by them a camera is fitted, and any camera is compared with all
/// points.
pub(super) struct PinholeFit {
    across: Line,
    down: Line,
    size_px: [usize; 2],
}

impl PinholeFit {
    /// `cloud` is in the camera's optical frame.
    pub(super) fn of(cloud: &OrganisedCloud) -> Self {
        let (mut across, mut down) = (Line::default(), Line::default());
        for (slopes, pixel_px) in slopes(cloud) {
            across.take(slopes[0], pixel_px[0]);
            down.take(slopes[1], pixel_px[1]);
        }
        Self { across, down, size_px: [cloud.width_px(), cloud.height_px()] }
    }

    /// The pinhole camera that the cloud was computed with: its focal lengths and principal point by least squares over all
    /// points, `x / z` against the column and `y / z` against the row.
    ///
    /// # Errors
    /// When there are too few points, they do not determine a camera, or they lie more than half a pixel from their pixels.
    pub(super) fn camera(&self) -> Result<CameraModel, PinholeFitError> {
        let points = self.across.points as usize;
        if points < LEAST_POINTS {
            return Err(PinholeFitError::TooFewPoints { points });
        }
        let ((fx_px, cx_px), (fy_px, cy_px)) = (self.across.fitted(), self.down.fitted());
        let [width_px, height_px] = self.size_px;
        let distortion = Distortion::None;
        let camera = CameraModel { width_px, height_px, fx_px, fy_px, cx_px, cy_px, distortion };
        let validated = camera.validate();
        // Points of another frame may fit a view that no lens has: how far off they are says more.
        let is_camera = matches!(validated, Ok(()) | Err(CameraModelError::View { .. }));
        if is_camera && !self.fits(&camera) {
            let residual_px = (self.squares_px(&camera) / self.across.points).sqrt();
            return Err(PinholeFitError::Residual { residual_px });
        }
        validated?;
        Ok(camera)
    }

    /// Whether the cloud may have been computed with this camera: the sizes are the same, and the points lie no more than half a
    /// pixel from their pixels. A cloud without points may.
    pub(super) fn fits(&self, camera: &CameraModel) -> bool {
        let most_px = MOST_RESIDUAL_PX * MOST_RESIDUAL_PX * self.across.points;
        self.size_px == [camera.width_px, camera.height_px] && self.squares_px(camera) <= most_px
    }

    fn squares_px(&self, camera: &CameraModel) -> f64 {
        self.across.squares_px(camera.fx_px, camera.cx_px)
            + self.down.squares_px(camera.fy_px, camera.cy_px)
    }
}

/// `x / z` and `y / z` of the points in front of the camera, with column and row. Some drivers send the origin where nothing was
/// measured.
fn slopes(cloud: &OrganisedCloud) -> impl Iterator<Item = ([f64; 2], [f64; 2])> {
    let before = cloud.with_pixels().filter(|(point_m, _)| point_m.z > 0.0);
    before.map(|(point_m, [column, row])| {
        let point_m = point_m.cast::<f64>();
        ([point_m.x / point_m.z, point_m.y / point_m.z], [column as f64, row as f64])
    })
}

/// The sums of a straight line through pixels by slopes.
#[derive(Clone, Copy, Default)]
struct Line {
    points: f64,
    slopes: f64,
    pixels_px: f64,
    slope_squares: f64,
    products_px: f64,
    pixel_squares_px: f64,
}

impl Line {
    fn take(&mut self, slope: f64, pixel_px: f64) {
        self.points += 1.0;
        self.slopes += slope;
        self.pixels_px += pixel_px;
        self.slope_squares += slope * slope;
        self.products_px += slope * pixel_px;
        self.pixel_squares_px += pixel_px * pixel_px;
    }

    /// Focal length and principal point; not finite where all points have one slope.
    fn fitted(&self) -> (f64, f64) {
        let Self { points, slopes, pixels_px, slope_squares, products_px, .. } = *self;
        let focal_px = (points * products_px - slopes * pixels_px)
            / (points * slope_squares - slopes * slopes);
        (focal_px, (pixels_px - focal_px * slopes) / points)
    }

    /// The sum of the squared distances from the line: of `focal_px * slope + centre_px - pixel_px`, multiplied out.
    fn squares_px(&self, focal_px: f64, centre_px: f64) -> f64 {
        let of_slopes = focal_px * focal_px * self.slope_squares;
        let of_pixels = self.pixel_squares_px + self.points * centre_px * centre_px;
        let mixed =
            focal_px * (centre_px * self.slopes - self.products_px) - centre_px * self.pixels_px;
        of_slopes + of_pixels + 2.0 * mixed
    }
}
