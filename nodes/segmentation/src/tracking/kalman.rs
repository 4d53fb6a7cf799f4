//! A point that moves with nearly constant velocity (Bar-Shalom, Li and Kirubarajan, "Estimation with
//! Applications to Tracking and Navigation", 2001, section 6.3.2: discrete white noise acceleration).

use nalgebra::{Matrix3, Matrix3x6, Matrix6, Point3, Vector3, Vector6};

/// Nothing walks faster than this at first sight: the deviation of an unknown velocity.
const FIRST_SPEED_M_PER_S: f64 = 1.5;

/// Position and velocity in the map with their covariance, in the order x, y, z, vx, vy, vz.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Filter {
    state: Vector6<f64>,
    pub(super) covariance: Matrix6<f64>,
}

impl Filter {
    /// At a place, with a velocity that nobody knows.
    pub(super) fn at(position_m: &Point3<f64>, noise_m2: &Matrix3<f64>) -> Self {
        let mut state = Vector6::zeros();
        state.fixed_rows_mut::<3>(0).copy_from(&position_m.coords);
        let mut covariance = Matrix6::zeros();
        covariance.fixed_view_mut::<3, 3>(0, 0).copy_from(noise_m2);
        let speed_m2_per_s2 = Matrix3::identity() * FIRST_SPEED_M_PER_S.powi(2);
        covariance.fixed_view_mut::<3, 3>(3, 3).copy_from(&speed_m2_per_s2);
        Self { state, covariance }
    }

    pub(super) fn position_m(&self) -> Point3<f64> {
        Point3::from(self.state.fixed_rows::<3>(0).into_owned())
    }

    pub(super) fn velocity_m_per_s(&self) -> Vector3<f64> {
        self.state.fixed_rows::<3>(3).into_owned()
    }

    pub(super) fn position_covariance_m2(&self) -> Matrix3<f64> {
        self.covariance.fixed_view::<3, 3>(0, 0).into_owned()
    }

    /// The state `dt_s` later.
    pub(super) fn predict(&mut self, dt_s: f64, acceleration_m_per_s2: f64) {
        let mut transition = Matrix6::identity();
        let mut noise = Matrix6::zeros();
        let variance = acceleration_m_per_s2.powi(2);
        for axis in 0..3 {
            transition[(axis, axis + 3)] = dt_s;
            noise[(axis, axis)] = variance * dt_s.powi(4) / 4.0;
            noise[(axis, axis + 3)] = variance * dt_s.powi(3) / 2.0;
            noise[(axis + 3, axis)] = variance * dt_s.powi(3) / 2.0;
            noise[(axis + 3, axis + 3)] = variance * dt_s.powi(2);
        }
        self.state = transition * self.state;
        self.covariance = transition * self.covariance * transition.transpose() + noise;
    }

    /// Takes a measured position; the covariance by Joseph's form, which stays symmetric and positive.
    pub(super) fn update(&mut self, measured_m: &Point3<f64>, noise_m2: &Matrix3<f64>) {
        let mut measures = Matrix3x6::zeros();
        measures.fixed_view_mut::<3, 3>(0, 0).copy_from(&Matrix3::identity());
        let innovation_m2 = self.position_covariance_m2() + noise_m2;
        // Not to be inverted only where both are zero or not finite: then nothing can be learned.
        let Some(inverse) = innovation_m2.try_inverse() else { return };
        let gain = self.covariance * measures.transpose() * inverse;
        self.state += gain * (measured_m - self.position_m());
        let kept = Matrix6::identity() - gain * measures;
        let covariance =
            kept * self.covariance * kept.transpose() + gain * noise_m2 * gain.transpose();
        self.covariance = (covariance + covariance.transpose()) / 2.0;
    }

    /// The same body, described by another point of it.
    pub(super) fn shift(&mut self, by_m: &Vector3<f64>) {
        let moved = self.position_m() + by_m;
        self.state.fixed_rows_mut::<3>(0).copy_from(&moved.coords);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_finds_the_velocity_and_its_covariance_says_how_well() {
        let noise_m2 = Matrix3::identity() * 0.02_f64.powi(2);
        let velocity = Vector3::new(0.3, -1.4, 0.0);
        let truth = |time_s: f64| Point3::new(2.0, 1.0, -0.5) + velocity * time_s;
        let mut filter = Filter::at(&truth(0.0), &noise_m2);
        let mut least_eigenvalue = f64::INFINITY;
        for cycle in 1..40 {
            filter.predict(0.14, 2.8);
            // Alternating errors of the stated deviation.
            let error_m = if cycle % 2 == 0 { 0.02 } else { -0.02 };
            filter.update(&(truth(0.14 * f64::from(cycle)) + Vector3::repeat(error_m)), &noise_m2);
            least_eigenvalue =
                least_eigenvalue.min(filter.covariance.symmetric_eigenvalues().min());
        }
        assert!((filter.velocity_m_per_s() - velocity).norm() < 0.4);
        assert!((filter.position_m() - truth(0.14 * 39.0)).norm() < 0.04);
        assert!(filter.position_covariance_m2()[(0, 0)].sqrt() < 0.02);
        assert!(least_eigenvalue > 0.0);
        let before = filter.position_covariance_m2().trace();
        filter.predict(1.0, 2.8);
        assert!(filter.position_covariance_m2().trace() > 4.0 * before);
    }

    #[test]
    fn a_shift_moves_the_place_and_nothing_else() {
        let mut filter = Filter::at(&Point3::new(1.0, 2.0, 3.0), &Matrix3::identity());
        let before = filter;
        filter.shift(&Vector3::new(0.5, 0.0, -1.0));
        assert_eq!(filter.position_m(), Point3::new(1.5, 2.0, 2.0));
        assert_eq!(filter.covariance, before.covariance);
        assert_eq!(filter.velocity_m_per_s(), before.velocity_m_per_s());
    }
}
