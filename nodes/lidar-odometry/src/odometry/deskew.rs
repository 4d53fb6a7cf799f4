//! The points of a scan as if all had been measured at once.

use estimation::Twist;
use geometry::{LidarCloud, span_without_strays};
use nalgebra::{Isometry3, Matrix3, Point3, Vector3};

use crate::revolution::LONGEST_S;

/// The scan is cut into this many stretches of time, whose points are moved alike: at 30 m/s and ten turns a second the
/// sensor moves by 3 mm within one.
const STRETCHES: usize = 1024;

/// When the points of a scan were measured, in seconds since its stamp.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Span {
    first_s: f64,
    last_s: f64,
}

impl Span {
    /// From the first to the last of the times within [`LONGEST_S`] of the stamp, without strays; `None` without any.
    pub(super) fn of(times_s: &[f32]) -> Option<Self> {
        let times_s = times_s.iter().map(|time_s| f64::from(*time_s));
        let near = times_s.filter(|time_s| time_s.abs() <= LONGEST_S);
        let (first_s, last_s) = span_without_strays(near)?.into_inner();
        Some(Self { first_s, last_s })
    }

    /// The middle: to it the points are moved.
    pub(super) fn middle_s(&self) -> f64 {
        0.5 * (self.first_s + self.last_s)
    }
}

/// The points in the sensor's frame of the middle of the scan, while it moved with this velocity. A point without a time
/// within the span becomes not a number.
pub(super) fn deskewed(
    points_m: &[Point3<f32>],
    times_s: &[f32],
    span: &Span,
    velocity: &Twist,
) -> Vec<Point3<f32>> {
    let length_s = (span.last_s - span.first_s).max(f64::MIN_POSITIVE);
    let motions: Vec<(Matrix3<f32>, Vector3<f32>)> = (0..STRETCHES)
        .map(|stretch| {
            let share = (stretch as f64 + 0.5) / STRETCHES as f64 - 0.5;
            single(&velocity.displacement(share * length_s))
        })
        .collect();
    let to_stretch = STRETCHES as f64 / length_s;
    let moved = |(point, time_s): (&Point3<f32>, &f32)| {
        let time_s = f64::from(*time_s);
        let since_s = time_s - span.first_s;
        if !(span.first_s..=span.last_s).contains(&time_s) {
            return Point3::new(f32::NAN, f32::NAN, f32::NAN);
        }
        let stretch = ((since_s * to_stretch) as usize).min(STRETCHES - 1);
        let (rotation, shift_m) = &motions[stretch];
        Point3::from(rotation * point.coords + shift_m)
    };
    points_m.iter().zip(times_s).map(moved).collect()
}

/// The points of a cloud as if all had been measured at the middle of its times, while the scanner moved as from the pose
/// before: by `last_from_now` in `passed_s`. Those of a cloud without times stay, and points without a time, or with a stray one,
/// become not a number.
#[must_use]
pub fn deskewed_cloud(
    cloud: &LidarCloud,
    last_from_now: &Isometry3<f64>,
    passed_s: f64,
) -> Vec<Point3<f32>> {
    let times_s = cloud.times_s.as_deref().filter(|_| passed_s > 0.0);
    let velocity = Twist::between(last_from_now, passed_s);
    let timed = times_s.and_then(|times_s| Some((times_s, Span::of(times_s)?, velocity?)));
    let Some((times_s, span, velocity)) = timed else { return cloud.points_m.clone() };
    deskewed(&cloud.points_m, times_s, &span, &velocity)
}

fn single(pose: &Isometry3<f64>) -> (Matrix3<f32>, Vector3<f32>) {
    (pose.rotation.to_rotation_matrix().into_inner().cast(), pose.translation.vector.cast())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Random;

    #[test]
    fn points_that_a_moving_sensor_saw_come_to_where_they_are() {
        let mut random = Random::new(2);
        let velocity = Twist::between(&random.motion(1.5, 0.08), 0.1).unwrap();
        let places: Vec<Point3<f64>> =
            (0..500).map(|_| Point3::from(30.0 * random.direction())).collect();
        let times_s: Vec<f32> = (0..500).map(|_| random.between(0.02, 0.12) as f32).collect();
        let seen: Vec<Point3<f32>> = places
            .iter()
            .zip(&times_s)
            .map(|(place, time_s)| {
                (velocity.displacement(f64::from(*time_s) - 0.07).inverse() * place).cast()
            })
            .collect();
        let span = Span { first_s: 0.02, last_s: 0.12 };
        assert!((span.middle_s() - 0.07).abs() < 1e-12);
        for (point, place) in deskewed(&seen, &times_s, &span, &velocity).iter().zip(&places) {
            // Half the motion of a stretch, and of its rotation at 30 m.
            assert!((point.cast() - place).norm() < 0.0025, "{point} {place}");
        }
    }

    #[test]
    fn times_of_no_use_are_left_out() {
        assert_eq!(Span::of(&[]), None);
        assert_eq!(Span::of(&[f32::NAN]), None);
        let span = Span::of(&[0.5, f32::NAN, 0.0, f32::INFINITY, 1e30]).unwrap();
        assert_eq!(span, Span { first_s: 0.0, last_s: 0.5 });
        let velocity = Twist::between(&Isometry3::translation(1.0, 0.0, 0.0), 1.0).unwrap();
        let times_s = [0.0, f32::NAN, 0.5, 1e30];
        let points = deskewed(&[Point3::origin(); 4], &times_s, &span, &velocity);
        assert!(points[1].x.is_nan() && points[0].x < -0.24 && points[2].x > 0.24);
        assert!(points[3].x.is_nan());
    }
}
