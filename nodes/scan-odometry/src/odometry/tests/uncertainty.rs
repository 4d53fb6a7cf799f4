//! Whether the covariances are of the size of the errors.

use nalgebra::{Matrix3, Vector3};

use super::*;
use crate::testing::{Scanner, World, follow};
use crate::twist::increment;

type Path<'a> = &'a dyn Fn(f64) -> Isometry2<f64>;

/// The normalised squared error: 3 on average where the covariance is right (Bar-Shalom et al. 2001, 5.4.2).
fn squared(error: &Vector3<f64>, covariance: &Matrix3<f64>) -> f64 {
    error.dot(&(covariance.try_inverse().unwrap() * error))
}

/// Means over runs of several seeds: of the steps, and of the last poses.
fn mean_squared_errors(world: &World, path: Path<'_>) -> (f64, f64) {
    const SEEDS: u64 = 12;
    const SCANS: usize = 60;
    let (mut of_steps, mut of_ends) = (0.0, 0.0);
    for seed in 0..SEEDS {
        let found = follow(
            &Scanner {
                beams: 384,
                step_rad: 2.0 * Scanner::default().step_rad,
                ..Scanner::default()
            },
            world,
            path,
            SCANS,
            seed,
        );
        for pair in found.windows(2).skip(1) {
            let step = |of: fn(&Found) -> Isometry2<f64>| of(&pair[0]).inv_mul(&of(&pair[1]));
            let error = step(|one| one.truth).inv_mul(&step(|one| one.pose.odom_from_lidar));
            of_steps += squared(&increment(&error), &pair[1].pose.step_covariance);
        }
        let last = found.last().unwrap();
        let (found, truth) = (last.pose.odom_from_lidar, last.truth);
        let shift = found.translation.vector - truth.translation.vector;
        let error = Vector3::new(shift.x, shift.y, truth.rotation.angle_to(&found.rotation));
        of_ends += squared(&error, &last.pose.covariance);
    }
    (of_steps / (SEEDS as f64 * (SCANS - 2) as f64), of_ends / SEEDS as f64)
}

#[test]
fn the_errors_are_as_large_as_the_covariances_say() {
    let world = World::furnished();
    let paths: [(&str, Path<'_>); 2] = [("standing", &standing), ("circling", &circling)];
    for (name, path) in paths {
        let (of_steps, of_ends) = mean_squared_errors(&world, path);
        println!("{name}: steps {of_steps:.2}, ends {of_ends:.2}, 3 expected");
        assert!((1.0..5.0).contains(&of_steps), "{name}: {of_steps}");
        assert!((0.6..9.0).contains(&of_ends), "{name}: {of_ends}");
    }
}
