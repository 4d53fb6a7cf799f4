//! Lens distortion, and its inverse.

use nalgebra::{Matrix2, Vector2};
use serde::{Deserialize, Serialize};

/// Lens distortion, named as `sensor_msgs/CameraInfo` names it.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize, Deserialize)]
pub enum Distortion {
    /// Rectified already.
    #[default]
    None,
    /// `plumb_bob`: k1, k2, t1, t2, k3.
    PlumbBob([f64; 5]),
    /// `rational_polynomial`: k1, k2, t1, t2, k3, k4, k5, k6.
    Rational([f64; 8]),
    /// `rational_polynomial` with the terms of a thin prism, as OpenCV has them: the eight above, and s1, s2, s3, s4.
    RationalPrism([f64; 12]),
    /// `equidistant`, the fisheye model of OpenCV (Kannala and Brandt): k1, k2, k3, k4 of the angle from the axis. Zeros are the ideal
    /// fisheye lens, which is no pinhole.
    Equidistant([f64; 4]),
}

/// Newton's method doubles the digits with each step: from anywhere near, six steps do.
const MAX_STEPS: usize = 30;
/// Where the search ends, in units of the image plane at 1 m: a millionth of a pixel at most.
const RESIDUAL: f64 = 1e-10;
/// How many points between the axis and a ray are tested for a fold of the lens model.
const FOLD_SAMPLES: u32 = 16;

impl Distortion {
    /// The coefficients in the order of `sensor_msgs/CameraInfo`.
    #[must_use]
    pub fn coefficients(&self) -> &[f64] {
        match self {
            Self::None => &[],
            Self::PlumbBob(coefficients) => coefficients,
            Self::Rational(coefficients) => coefficients,
            Self::RationalPrism(coefficients) => coefficients,
            Self::Equidistant(coefficients) => coefficients,
        }
    }

    /// Whether a ray appears where a lens without distortion would show it.
    #[must_use]
    pub fn is_none(&self) -> bool {
        !matches!(self, Self::Equidistant(_))
            && self.coefficients().iter().all(|&coefficient| coefficient == 0.0)
    }

    /// Where the lens shows a ray; both are positions on the image plane at 1 m, `(x / z, y / z)`.
    ///
    /// `None` where the model folds: the polynomial is fitted to the image and turns back somewhere
    /// outside, so that rays from far off the axis would appear in the image a second time.
    #[must_use]
    pub fn distort(&self, ray: &Vector2<f64>) -> Option<Vector2<f64>> {
        if self.is_none() {
            return Some(*ray);
        }
        let (seen, _) = self.evaluate(ray);
        self.is_unfolded(ray).then_some(seen)
    }

    /// The ray that the lens shows at `seen`: the inverse of [`distort`](Self::distort), found by
    /// Newton's method. `None` where there is none.
    #[must_use]
    pub fn undistort(&self, seen: &Vector2<f64>) -> Option<Vector2<f64>> {
        if self.is_none() {
            return Some(*seen);
        }
        let mut ray = *seen;
        for _ in 0..MAX_STEPS {
            let (shown, slope) = self.evaluate(&ray);
            let residual = shown - seen;
            if residual.norm() < RESIDUAL {
                return self.is_unfolded(&ray).then_some(ray);
            }
            ray -= slope.try_inverse()? * residual;
        }
        None
    }

    /// Where the lens shows a ray, and how that changes with the ray (the Jacobian).
    fn evaluate(&self, ray: &Vector2<f64>) -> (Vector2<f64>, Matrix2<f64>) {
        const NO_PRISM: [f64; 4] = [0.0; 4];
        let ([k1, k2, t1, t2, k3, k4, k5, k6], [s1, s2, s3, s4]) = match *self {
            Self::None => ([0.0; 8], NO_PRISM),
            Self::PlumbBob([k1, k2, t1, t2, k3]) => ([k1, k2, t1, t2, k3, 0.0, 0.0, 0.0], NO_PRISM),
            Self::Rational(coefficients) => (coefficients, NO_PRISM),
            Self::RationalPrism([k1, k2, t1, t2, k3, k4, k5, k6, prism @ ..]) => {
                ([k1, k2, t1, t2, k3, k4, k5, k6], prism)
            }
            Self::Equidistant(coefficients) => return evaluate_fisheye(&coefficients, ray),
        };
        let (x, y) = (ray.x, ray.y);
        let r2 = x * x + y * y;
        let numerator = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        let denominator = 1.0 + r2 * (k4 + r2 * (k5 + r2 * k6));
        let radial = numerator / denominator;
        // The derivative of `radial` by r2.
        let numerator_slope = k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3);
        let denominator_slope = k4 + r2 * (2.0 * k5 + r2 * 3.0 * k6);
        let radial_slope = (numerator_slope - radial * denominator_slope) / denominator;

        let seen = Vector2::new(
            x * radial + 2.0 * t1 * x * y + t2 * (r2 + 2.0 * x * x) + r2 * (s1 + r2 * s2),
            y * radial + t1 * (r2 + 2.0 * y * y) + 2.0 * t2 * x * y + r2 * (s3 + r2 * s4),
        );
        let mixed = 2.0 * x * y * radial_slope + 2.0 * t1 * x + 2.0 * t2 * y;
        // The derivatives of the prism's terms by r2.
        let (prism_x, prism_y) = (s1 + 2.0 * r2 * s2, s3 + 2.0 * r2 * s4);
        let slope = Matrix2::new(
            radial + 2.0 * x * x * radial_slope + 2.0 * t1 * y + 6.0 * t2 * x + 2.0 * x * prism_x,
            mixed + 2.0 * y * prism_x,
            mixed + 2.0 * x * prism_y,
            radial + 2.0 * y * y * radial_slope + 6.0 * t1 * y + 2.0 * t2 * x + 2.0 * y * prism_y,
        );
        (seen, slope)
    }

    /// Whether the lens keeps the order of rays all the way from the axis to `ray`.
    fn is_unfolded(&self, ray: &Vector2<f64>) -> bool {
        if *ray == Vector2::zeros() {
            return true;
        }
        (1..=FOLD_SAMPLES).all(|sample| {
            let nearer = ray * (f64::from(sample) / f64::from(FOLD_SAMPLES));
            let (seen, slope) = self.evaluate(&nearer);
            // A positive determinant alone would accept a plane that is turned through the axis.
            slope.determinant() > 0.0 && seen.dot(&nearer) > 0.0
        })
    }
}

/// Below this square of a slope the angle is the slope, to the last digit.
const ON_THE_AXIS: f64 = 1e-16;

/// [`Distortion::evaluate`] of a fisheye lens, which shows a ray at a distance from the middle that is a polynomial of its angle from the
/// axis.
fn evaluate_fisheye(
    &[k1, k2, k3, k4]: &[f64; 4],
    ray: &Vector2<f64>,
) -> (Vector2<f64>, Matrix2<f64>) {
    let r2 = ray.norm_squared();
    if r2 < ON_THE_AXIS {
        return (*ray, Matrix2::identity());
    }
    let r = r2.sqrt();
    let angle_rad = r.atan();
    let a2 = angle_rad * angle_rad;
    let shown = angle_rad * (1.0 + a2 * (k1 + a2 * (k2 + a2 * (k3 + a2 * k4))));
    let by_angle = 1.0 + a2 * (3.0 * k1 + a2 * (5.0 * k2 + a2 * (7.0 * k3 + a2 * 9.0 * k4)));
    let radial = shown / r;
    // The derivative of `radial` by r2.
    let radial_slope = (by_angle / (1.0 + r2) - radial) / (2.0 * r2);
    let slope = Matrix2::identity() * radial + ray * ray.transpose() * (2.0 * radial_slope);
    (ray * radial, slope)
}
