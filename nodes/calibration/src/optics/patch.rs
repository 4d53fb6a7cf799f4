//! The plane of the pixels around a point.
//!
//! Along a plane the inverse depth is linear in the rays' `x / z` and `y / z`, whatever the lens; and the error of a
//! camera that triangulates is the same everywhere in inverse depth. So the plane is a linear regression. Squares of both are
//! fitted along: of a column or a curtain, what counts is the plane that touches it.
//!
//! How much noise a plane may have is that of the camera, which the patches of an image show.

use geometry::DepthImage;
use nalgebra::{Matrix5, Point3, Vector3, Vector5};

use super::{DepthOptics, Surface};
use crate::config::CalibrationConfig;

/// Pixels to each side of the middle that are looked at; where the patch is larger, every second or third.
const REACH: usize = 7;
/// The pixels along a side.
const SIDE: usize = 2 * REACH + 1;
/// A patch has at least this share of its pixels, ...
const MIN_SHARE: f64 = 0.8;
/// ... and at least this many.
const MIN_PIXELS: usize = 20;
/// Pixels deviate from their plane by at most this many deviations of the camera's noise, in the mean square.
const MAX_SCATTER: f64 = 2.0;
/// The means of rows and columns scatter by at most this ratio more than single pixels account for (the F test of
/// lack of fit; 0.5 % of true planes have more, with some ten means and a hundred pixels), ...
const MAX_LACK_OF_FIT: f64 = 3.0;
/// ... unless they scatter by less than this share of a depth's deviation, which does no harm.
const HARMLESS_SHARE: f64 = 0.3;
/// Of fewer patches nothing is said of the camera's noise.
const LEAST_PATCHES: usize = 12;
/// A camera with more noise cannot be calibrated by: 9 cm at 3 m, of an eighth of a pixel with a base of 3 cm.
const MOST_NOISE_PER_M: f64 = 0.01;

/// A pixel of the patch.
#[derive(Clone, Copy)]
struct Pixel {
    /// Its place within the patch.
    column: usize,
    row: usize,
    /// Its ray beside that of the point, in halves of the patch: 1, x / z, y / z, and the squares of both.
    regressors: Vector5<f64>,
    inverse_depth_per_m: f64,
}

/// The plane around a point of the camera frame, before it is judged.
#[derive(Clone, Copy)]
pub(crate) struct Patch {
    coefficients: Vector5<f64>,
    inverse: Matrix5<f64>,
    /// The variance of a pixel's inverse depth: what a camera that triangulates has the same everywhere.
    variance_per_m2: f64,
    rows: Unevenness,
    columns: Unevenness,
}

impl Patch {
    /// `None` where too few pixels are measured, or the surface is too far.
    pub(crate) fn around(
        point_in_camera_m: &Point3<f64>,
        image: &DepthImage,
        optics: DepthOptics<'_>,
        config: &CalibrationConfig,
    ) -> Option<Self> {
        let pixels = pixels_around(point_in_camera_m, image, optics, config)?;
        let (coefficients, inverse) = regression(&pixels)?;
        let residuals: Vec<f64> = pixels
            .iter()
            .map(|pixel| pixel.inverse_depth_per_m - pixel.regressors.dot(&coefficients))
            .collect();
        let squares: f64 = residuals.iter().map(|residual| residual * residual).sum();
        let is_within = coefficients.x > 0.0 && 1.0 / coefficients.x <= config.max_depth_m;
        is_within.then(|| Self {
            coefficients,
            inverse,
            variance_per_m2: squares / (pixels.len() - 5) as f64,
            rows: Unevenness::of(&pixels, &residuals, |pixel| pixel.row),
            columns: Unevenness::of(&pixels, &residuals, |pixel| pixel.column),
        })
    }

    /// Whether pixels scatter by more than those of a plane, seen by a camera of this noise.
    pub(crate) fn is_noisy(&self, noise: ImageNoise, config: &CalibrationConfig) -> bool {
        self.variance_per_m2.sqrt() > MAX_SCATTER * self.expected_per_m(noise, config)
    }

    /// The deviation of a pixel's inverse depth: d(1 / z) = -dz / z^2.
    fn expected_per_m(&self, noise: ImageNoise, config: &CalibrationConfig) -> f64 {
        let inverse_depth = self.coefficients.x;
        let usual = config.depth_std_dev_m(1.0 / inverse_depth) * inverse_depth * inverse_depth;
        usual.max(noise.per_m)
    }

    /// The surface; `None` where it is none, or is seen at too large an angle.
    pub(crate) fn surface(
        &self,
        point_in_camera_m: &Point3<f64>,
        noise: ImageNoise,
        config: &CalibrationConfig,
    ) -> Option<Surface> {
        let expected = self.expected_per_m(noise, config);
        if self.is_noisy(noise, config)
            || self.columns.is_one(expected)
            || self.rows.is_one(expected)
        {
            return None;
        }
        // 1 / z = a x/z + b y/z + c  is the plane  a x + b y + c z = 1.
        let (inverse_depth, variance) = (self.coefficients.x, self.variance_per_m2);
        let ray = point_in_camera_m.xy().coords / point_in_camera_m.z;
        let half = config.patch_half_angle_rad;
        let (along_x, along_y) = (self.coefficients.y / half, self.coefficients.z / half);
        let plane =
            Vector3::new(along_x, along_y, inverse_depth - along_x * ray.x - along_y * ray.y);
        let steepness_per_m = plane.norm();
        let normal = plane / steepness_per_m;
        let viewing = Vector3::new(ray.x, ray.y, 1.0).normalize();
        if normal.dot(&viewing) < config.max_incidence_rad.cos() {
            return None;
        }
        let inverse = &self.inverse;
        let slope_variance = variance * inverse[(1, 1)].max(inverse[(2, 2)]) / (half * half);
        Some(Surface {
            normal,
            offset_m: 1.0 / steepness_per_m,
            std_dev_m: point_in_camera_m.z * (variance * inverse[(0, 0)]).sqrt() / steepness_per_m,
            normal_std_dev_rad: slope_variance.sqrt() / steepness_per_m,
        })
    }
}

/// The noise of a depth camera where it is larger than a Kinect's: the standard deviation of its inverse depth.
#[derive(Clone, Copy, PartialEq, Default, Debug)]
pub(crate) struct ImageNoise {
    per_m: f64,
}

impl ImageNoise {
    /// By how much the pixels of patches scatter. A quarter of them are plane in any room; what is not scatters by more.
    pub(crate) fn of(patches: &[Patch]) -> Self {
        let mut deviations: Vec<f64> =
            patches.iter().map(|patch| patch.variance_per_m2.sqrt()).collect();
        if deviations.len() < LEAST_PATCHES {
            return Self::default();
        }
        deviations.sort_by(f64::total_cmp);
        let per_m = deviations.get(deviations.len() / 4).copied().unwrap_or(0.0);
        Self { per_m: per_m.min(MOST_NOISE_PER_M) }
    }
}

/// The measured pixels around a point; `None` where too few are.
fn pixels_around(
    point_in_camera_m: &Point3<f64>,
    image: &DepthImage,
    optics: DepthOptics<'_>,
    config: &CalibrationConfig,
) -> Option<Vec<Pixel>> {
    let middle = optics.camera.project(point_in_camera_m)?;
    let ray = point_in_camera_m.xy().coords / point_in_camera_m.z;
    let columns = Lattice::of(middle.x, config.patch_half_angle_rad * optics.camera.fx_px);
    let rows = Lattice::of(middle.y, config.patch_half_angle_rad * optics.camera.fy_px);
    let mut pixels = Vec::with_capacity(SIDE * SIDE);
    for (row, row_px) in rows.places() {
        for (column, column_px) in columns.places() {
            let seen = || {
                let depth_m = f64::from(image.depth_m(column_px?, row_px?)?);
                let pixel_ray = optics.rays.ray(column_px?, row_px?)?;
                let aside = (pixel_ray.cast::<f64>() - ray) / config.patch_half_angle_rad;
                let regressors =
                    Vector5::new(1.0, aside.x, aside.y, aside.x * aside.x, aside.y * aside.y);
                Some(Pixel { column, row, regressors, inverse_depth_per_m: 1.0 / depth_m })
            };
            pixels.extend(seen());
        }
    }
    let asked = columns.count() * rows.count();
    let enough = pixels.len() >= MIN_PIXELS && pixels.len() as f64 >= MIN_SHARE * asked as f64;
    enough.then_some(pixels)
}

/// The columns (or rows) of a patch.
struct Lattice {
    middle_px: f64,
    reach: usize,
    step_px: usize,
}

impl Lattice {
    /// Of the pixels within `half_px` of the middle, as many as are looked at.
    fn of(middle_px: f64, half_px: f64) -> Self {
        // The cast saturates.
        let half_px = (half_px.round() as usize).max(1);
        let reach = half_px.min(REACH);
        let step_px = (half_px + reach / 2) / reach;
        Self { middle_px: middle_px.round(), reach, step_px }
    }

    fn count(&self) -> usize {
        2 * self.reach + 1
    }

    /// Each place within the patch with its pixel, if that is not left or above of the image.
    fn places(&self) -> impl Iterator<Item = (usize, Option<usize>)> + '_ {
        (0..self.count()).map(move |place| {
            let aside_px = (place as f64 - self.reach as f64) * self.step_px as f64;
            let pixel = self.middle_px + aside_px;
            (place, (pixel >= 0.0).then_some(pixel as usize))
        })
    }
}

/// Inverse depth at the point, its slopes and curvatures, and the inverse of the normal matrix.
fn regression(pixels: &[Pixel]) -> Option<(Vector5<f64>, Matrix5<f64>)> {
    let (mut matrix, mut right) = (Matrix5::zeros(), Vector5::zeros());
    for pixel in pixels {
        matrix += pixel.regressors * pixel.regressors.transpose();
        right += pixel.regressors * pixel.inverse_depth_per_m;
    }
    let inverse = matrix.try_inverse()?;
    Some((inverse * right, inverse))
}

/// How far the means of rows, or of columns, are from the plane.
#[derive(Clone, Copy)]
struct Unevenness {
    pixels: usize,
    lines: usize,
    /// The sum of squares among the means of lines ...
    among: f64,
    /// ... and that of single pixels beside the means.
    within: f64,
}

impl Unevenness {
    fn of(pixels: &[Pixel], residuals: &[f64], line_of: impl Fn(&Pixel) -> usize) -> Self {
        let (mut sums, mut counts) = ([0.0; SIDE], [0.0_f64; SIDE]);
        for (pixel, residual) in pixels.iter().zip(residuals) {
            let line = line_of(pixel).min(SIDE - 1);
            sums[line] += residual;
            counts[line] += 1.0;
        }
        let among: f64 = sums
            .iter()
            .zip(&counts)
            .filter(|(_, count)| **count > 0.0)
            .map(|(sum, count)| sum * sum / count)
            .sum();
        let all: f64 = residuals.iter().map(|residual| residual * residual).sum();
        let lines = counts.iter().filter(|count| **count > 0.0).count();
        Self { pixels: pixels.len(), lines, among, within: (all - among).max(0.0) }
    }

    /// Whether the means say that this is no plane: an edge, a step, a curve.
    fn is_one(&self, expected: f64) -> bool {
        let Self { pixels, lines, among, within } = *self;
        if lines < 4 || pixels <= lines {
            return false;
        }
        let within = within / (pixels - lines) as f64;
        let harmless = (HARMLESS_SHARE * expected).powi(2) * pixels as f64;
        among > harmless && among / (lines - 3) as f64 > MAX_LACK_OF_FIT * within
    }
}
