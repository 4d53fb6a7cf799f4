//! The sums of the normal equations over the correspondences.

use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};

use super::symmetric::Symmetric3;

/// The sums over correspondences: with the way `e` from the source's point to the target's, its weight matrix `M` and the
/// lever `y` from the source's origin to the point, a small perturbation `[v; w]` shortens `e` by `A [v; w]`,
/// `A = [I, -[y]x]`.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub(super) struct NormalEquations {
    shift_shift: Symmetric3,
    shift_turn: Matrix3<f64>,
    turn_turn: Symmetric3,
    shift_pull: Vector3<f64>,
    turn_pull: Vector3<f64>,
    /// The sum of the weighted squared errors.
    pub(super) squares_m2: f64,
    /// The sum of the squared levers.
    pub(super) levers_m2: f64,
    /// How many correspondences there are.
    pub(super) count: usize,
}

impl NormalEquations {
    /// Adds a correspondence with its error, its weight matrix and its lever.
    #[inline]
    pub(super) fn add(
        &mut self,
        error_m: &Vector3<f64>,
        weight: f64,
        matrix: &Symmetric3,
        lever_m: &Vector3<f64>,
    ) {
        let y = lever_m;
        let pull = weight * matrix.times(error_m);
        self.squares_m2 += error_m.dot(&pull);
        self.levers_m2 += y.norm_squared();
        self.count += 1;
        self.shift_pull += pull;
        self.turn_pull += y.cross(&pull);
        self.shift_shift = self.shift_shift.plus(weight, matrix);
        // -M [y]x, row by row: a row m^T of M gives (y x m)^T.
        let Symmetric3 { xx, xy, xz, yy, yz, zz } = *matrix;
        let first = weight * y.cross(&Vector3::new(xx, xy, xz));
        let second = weight * y.cross(&Vector3::new(xy, yy, yz));
        let third = weight * y.cross(&Vector3::new(xz, yz, zz));
        self.shift_turn.m11 += first.x;
        self.shift_turn.m12 += first.y;
        self.shift_turn.m13 += first.z;
        self.shift_turn.m21 += second.x;
        self.shift_turn.m22 += second.y;
        self.shift_turn.m23 += second.z;
        self.shift_turn.m31 += third.x;
        self.shift_turn.m32 += third.y;
        self.shift_turn.m33 += third.z;
        // [y]x of that, column by column; the lower triangle is the upper one.
        self.turn_turn.xx += y.y * third.x - y.z * second.x;
        self.turn_turn.xy += y.y * third.y - y.z * second.y;
        self.turn_turn.xz += y.y * third.z - y.z * second.z;
        self.turn_turn.yy += y.z * first.y - y.x * third.y;
        self.turn_turn.yz += y.z * first.z - y.x * third.z;
        self.turn_turn.zz += y.x * second.z - y.y * first.z;
    }

    /// Adds the sums of others.
    pub(super) fn add_all(&mut self, others: &Self) {
        self.shift_shift = self.shift_shift.plus(1.0, &others.shift_shift);
        self.shift_turn += others.shift_turn;
        self.turn_turn = self.turn_turn.plus(1.0, &others.turn_turn);
        self.shift_pull += others.shift_pull;
        self.turn_pull += others.turn_pull;
        self.squares_m2 += others.squares_m2;
        self.levers_m2 += others.levers_m2;
        self.count += others.count;
    }

    /// `sum A^T M A`.
    pub(super) fn information(&self) -> Matrix6<f64> {
        let mut information = Matrix6::zeros();
        information.fixed_view_mut::<3, 3>(0, 0).copy_from(&self.shift_shift.matrix());
        information.fixed_view_mut::<3, 3>(0, 3).copy_from(&self.shift_turn);
        information.fixed_view_mut::<3, 3>(3, 0).copy_from(&self.shift_turn.transpose());
        information.fixed_view_mut::<3, 3>(3, 3).copy_from(&self.turn_turn.matrix());
        information
    }

    /// `sum A^T M e`.
    pub(super) fn pull(&self) -> Vector6<f64> {
        let (shift, turn) = (&self.shift_pull, &self.turn_pull);
        Vector6::new(shift.x, shift.y, shift.z, turn.x, turn.y, turn.z)
    }

    /// The root of the mean square of the levers: a turn moves points by so much a radian.
    pub(super) fn lever_m(&self) -> f64 {
        (self.levers_m2 / self.count.max(1) as f64).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix3x6;

    use super::*;
    use crate::registration::motion::perturbed;
    use crate::testing::Random;

    #[test]
    fn the_sums_are_those_of_plain_matrices_whose_jacobian_is_the_numeric_one() {
        const SMALL: f64 = 1e-6;
        let mut random = Random::new(9);
        let pose = random.motion(5.0, 1.0);
        let mut sums = [NormalEquations::default(), NormalEquations::default()];
        let (mut information, mut pull, mut squares) = (Matrix6::zeros(), Vector6::zeros(), 0.0);
        for number in 0..40 {
            let place = 20.0 * random.direction();
            let other = pose * nalgebra::Point3::from(place) + random.direction();
            let matrix = Symmetric3::outer(&random.direction()).plus(0.3, &Symmetric3::IDENTITY);
            let weight = random.between(0.1, 1.0);
            let error =
                |pose: &nalgebra::Isometry3<f64>| other - pose * nalgebra::Point3::from(place);
            let lever = pose.rotation * place;
            sums[number % 2].add(&error(&pose), weight, &matrix, &lever);
            let mut jacobian = Matrix3x6::zeros();
            for column in 0..6 {
                let mut step = Vector6::zeros();
                step[column] = SMALL;
                let slope = (error(&perturbed(&pose, &step)) - error(&perturbed(&pose, &-step)))
                    / (2.0 * SMALL);
                // The error becomes shorter.
                jacobian.set_column(column, &-slope);
            }
            information += weight * jacobian.transpose() * matrix.matrix() * jacobian;
            pull += weight * jacobian.transpose() * matrix.matrix() * error(&pose);
            squares += weight * error(&pose).dot(&(matrix.matrix() * error(&pose)));
        }
        let [mut all, more] = sums;
        all.add_all(&more);
        assert!((all.information() - information).norm() < 1e-6 * information.norm());
        assert!((all.pull() - pull).norm() < 1e-6 * pull.norm());
        assert!((all.squares_m2 - squares).abs() < 1e-9 * squares);
        assert!((all.count, all.lever_m().round()) == (40, 20.0));
    }
}
