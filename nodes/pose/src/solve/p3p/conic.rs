//! Two quadratic forms in three numbers, and where both are zero.

use nalgebra::{Matrix3, Vector2, Vector3};

/// Newton steps that sharpen a root of the cubic.
const POLISHING_STEPS: usize = 4;
/// Coefficients below this share of the largest are rounding.
const ROUNDING: f64 = 1e-13;

/// A combination of two forms that is the product of two planes through the origin, and one of the forms that is none: where
/// both forms are zero, one of the planes and that form are.
///
/// `None` when there is no such combination in real numbers: the forms have no common zero then.
pub(super) fn plane_pair(
    first: &Matrix3<f64>,
    second: &Matrix3<f64>,
) -> Option<([Vector3<f64>; 2], Matrix3<f64>)> {
    // det(first + g * second) = 0: a cubic, of which a real root is enough (Lambda Twist, section 3.1).
    let mixed = |one: &Matrix3<f64>, other: &Matrix3<f64>| -> f64 {
        (0..3)
            .map(|axis| {
                let mut columns = *one;
                columns.set_column(axis, &other.column(axis));
                columns.determinant()
            })
            .sum()
    };
    let cubic =
        [first.determinant(), mixed(first, second), mixed(second, first), second.determinant()];
    let size = cubic.iter().fold(0.0, |size: f64, value| size.max(value.abs()));
    let (degenerate, other) = if cubic[3].abs() <= ROUNDING * size {
        (*second, *first)
    } else {
        let root = real_root(cubic[2] / cubic[3], cubic[1] / cubic[3], cubic[0] / cubic[3])?;
        (first + root * second, *second)
    };
    Some((factors(&degenerate)?, other))
}

/// The best separated real root of `x^3 + b x^2 + c x + d`.
fn real_root(b: f64, c: f64, d: f64) -> Option<f64> {
    // Without the square: x = y - b / 3 (Press et al. 2007, section 5.6).
    let q = (b * b - 3.0 * c) / 9.0;
    let r = (2.0 * b * b * b - 9.0 * b * c + 27.0 * d) / 54.0;
    let slope = |x: f64| (3.0 * x + 2.0 * b) * x + c;
    let mut root = if r * r < q * q * q {
        let angle = (r / (q * q * q).sqrt()).clamp(-1.0, 1.0).acos();
        let of = |turn: f64| {
            -2.0 * q.sqrt() * ((angle + turn * std::f64::consts::TAU) / 3.0).cos() - b / 3.0
        };
        let roots = [of(0.0), of(1.0), of(-1.0)];
        let steeper =
            |best: f64, next: f64| if slope(next).abs() > slope(best).abs() { next } else { best };
        roots.into_iter().fold(roots[0], steeper)
    } else {
        let one = -r.signum() * (r.abs() + (r * r - q * q * q).max(0.0).sqrt()).cbrt();
        let other = if one == 0.0 { 0.0 } else { q / one };
        one + other - b / 3.0
    };
    for _ in 0..POLISHING_STEPS {
        let step = (((root + b) * root + c) * root + d) / slope(root);
        if step.is_finite() {
            root -= step;
        }
    }
    root.is_finite().then_some(root)
}

/// The two planes whose product a form of rank 2 is. `None` when they are not real.
fn factors(form: &Matrix3<f64>) -> Option<[Vector3<f64>; 2]> {
    // One eigenvalue is zero; the others have the trace for their sum and the minors for their product.
    let trace = form.trace();
    let minor = |a: usize, b: usize| form[(a, a)] * form[(b, b)] - form[(a, b)] * form[(b, a)];
    let product = (minor(0, 1) + minor(0, 2) + minor(1, 2)).min(0.0);
    let root = (0.25 * trace * trace - product).sqrt();
    let larger = 0.5 * trace + root.copysign(trace);
    if larger == 0.0 || !larger.is_finite() {
        return None;
    }
    let smaller = product / larger;
    let (first, second) = (eigenvector(form, larger)?, eigenvector(form, smaller)?);
    let ratio = (-smaller / larger).max(0.0).sqrt();
    Some([first + ratio * second, first - ratio * second])
}

/// The eigenvector of an eigenvalue that is not repeated.
fn eigenvector(form: &Matrix3<f64>, eigenvalue: f64) -> Option<Vector3<f64>> {
    let shifted = form - eigenvalue * Matrix3::identity();
    let row = |index: usize| shifted.row(index).transpose();
    let crosses = [row(0).cross(&row(1)), row(0).cross(&row(2)), row(1).cross(&row(2))];
    let longer = |best: Vector3<f64>, next: Vector3<f64>| {
        if next.norm_squared() > best.norm_squared() { next } else { best }
    };
    crosses.into_iter().fold(Vector3::zeros(), longer).try_normalize(f64::MIN_POSITIVE)
}

/// The directions of a plane in which a form is zero: none, one or two.
pub(super) fn in_plane(
    normal: &Vector3<f64>,
    form: &Matrix3<f64>,
) -> impl Iterator<Item = Vector3<f64>> {
    // Two directions that span the plane, by the axis that is farthest from its normal.
    let axis = Vector3::ith(normal.iamin(), 1.0);
    let one = normal.cross(&axis).normalize();
    let two = normal.cross(&one).normalize();
    let (a, b, c) = (one.dot(&(form * one)), one.dot(&(form * two)), two.dot(&(form * two)));
    // a x^2 + 2 b x y + c y^2 = 0, both roots without cancellation. A slight negative is a double root.
    let discriminant = b * b - a * c;
    let negligible = ROUNDING.sqrt() * (b * b + (a * c).abs());
    let real = discriminant > -negligible;
    let half = -(b + discriminant.max(0.0).sqrt().copysign(b));
    let roots = [Vector2::new(half, a), Vector2::new(c, half)];
    roots
        .into_iter()
        .filter(move |root| real && root.norm_squared() > 0.0)
        .map(move |root| (root.x * one + root.y * two).normalize())
}
