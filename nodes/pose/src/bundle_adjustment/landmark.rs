//! Three numbers to correct a point by, four for a line, and what an error changes with them.
//!
//! A line is corrected in the orthonormal representation (Bartoli and Sturm 2005), but about an origin of its own, a metre
//! beside its middle: so no line runs through the origin, where the representation breaks down, and all four numbers say
//! something of the same size: two shifts across the line, and two tilts about its middle.
//!
//! To correct a line moves it as a whole, and a rigid motion of what is seen is the inverse motion of the camera.
//! So the derivative of an error by the line follows from its derivative by the pose.

use estimation::perturbation::left::adjoint;
use nalgebra::{
    Isometry3, Matrix6x4, Point3, SMatrix, SVector, Translation3, Vector3, Vector4, Vector6,
};

use crate::solve::term::{LineTerm, Placed, PointTerm, Term};
use crate::solve::{OrthonormalLine, PluckerLine};

/// How far the origin of a line is from it.
const BESIDE_M: f64 = 1.0;

/// A landmark that is corrected by this many numbers.
pub(super) trait Landmark<const N: usize>: Copy {
    /// The linearisation point of the derivatives.
    type Chart: Chart<N, Place = Self>;
    /// The errors of one sighting.
    type Term: Term + Copy;

    /// The errors of a sighting, were the landmark here.
    fn placed(&self, term: &Self::Term) -> Self::Term;
}

/// The neighbourhood of a landmark.
pub(super) trait Chart<const N: usize>: Sized {
    type Place;

    fn new(place: &Self::Place) -> Option<Self>;

    /// The landmark after a correction; `None` when it is nowhere then.
    fn corrected(&self, correction: &SVector<f64, N>) -> Option<Self::Place>;

    /// How a perturbation of the pose changes with the correction.
    fn as_perturbation(
        &self,
        camera_from_map: &Isometry3<f64>,
        placed: &Placed,
    ) -> SMatrix<f64, 6, N>;
}

/// A point.
pub(super) struct PointChart(Point3<f64>);

impl Landmark<3> for Point3<f64> {
    type Chart = PointChart;
    type Term = PointTerm;

    fn placed(&self, term: &PointTerm) -> PointTerm {
        term.moved(self)
    }
}

impl Chart<3> for PointChart {
    type Place = Point3<f64>;

    fn new(place: &Point3<f64>) -> Option<Self> {
        Some(Self(*place))
    }

    fn corrected(&self, correction: &Vector3<f64>) -> Option<Point3<f64>> {
        let there = self.0 + correction;
        there.iter().all(|value| value.is_finite()).then_some(there)
    }

    fn as_perturbation(&self, _: &Isometry3<f64>, placed: &Placed) -> SMatrix<f64, 6, 3> {
        let mut shift = SMatrix::<f64, 6, 3>::zeros();
        shift.fixed_view_mut::<3, 3>(0, 0).copy_from(placed.rotation());
        shift
    }
}

/// A line about an origin of its own.
pub(super) struct LineChart {
    map_from_beside: Translation3<f64>,
    line: OrthonormalLine,
    ends_m: [Point3<f64>; 2],
    /// The motions that the four numbers are.
    motions: Matrix6x4<f64>,
}

impl Landmark<4> for [Point3<f64>; 2] {
    type Chart = LineChart;
    type Term = LineTerm;

    fn placed(&self, term: &LineTerm) -> LineTerm {
        term.moved(self)
    }
}

impl Chart<4> for LineChart {
    type Place = [Point3<f64>; 2];

    fn new(ends_m: &[Point3<f64>; 2]) -> Option<Self> {
        let along = (ends_m[1] - ends_m[0]).try_normalize(f64::EPSILON)?;
        let mut axis = Vector3::zeros();
        axis[along.iamin()] = 1.0;
        let beside_m = along.cross(&axis).try_normalize(f64::EPSILON)? * BESIDE_M;
        let middle_m = nalgebra::center(&ends_m[0], &ends_m[1]);
        let map_from_beside = Translation3::from(middle_m.coords - beside_m);
        let [start, end] = ends_m.map(|end| map_from_beside.inverse() * end);
        let line = OrthonormalLine::new(&PluckerLine::through(&start, &end)?)?;
        // The first three turn about the origin; the last one brings the line nearer (see `OrthonormalLine::corrected`: the
        // ratio of moment to direction falls by the inverse square of the direction's share).
        let PluckerLine { moment, direction } = line.plucker();
        let first = moment.try_normalize(f64::EPSILON)?;
        let second = direction.try_normalize(f64::EPSILON)?;
        let third = first.cross(&second);
        let mut motions = Matrix6x4::zeros();
        for (column, axis) in [first, second, third].iter().enumerate() {
            motions.fixed_view_mut::<3, 1>(3, column).copy_from(axis);
        }
        motions.fixed_view_mut::<3, 1>(0, 3).copy_from(&(third / direction.norm_squared()));
        Some(Self { map_from_beside, line, ends_m: *ends_m, motions })
    }

    fn corrected(&self, correction: &Vector4<f64>) -> Option<[Point3<f64>; 2]> {
        let PluckerLine { moment, direction } = self.line.corrected(correction).plucker();
        let length2 = direction.norm_squared();
        let nearest = direction.cross(&moment) / length2;
        let ends = self.ends_m.map(|end| {
            let beside = self.map_from_beside.inverse() * end;
            let along = (beside.coords - nearest).dot(&direction) / length2;
            self.map_from_beside * Point3::from(nearest + along * direction)
        });
        PluckerLine::through(&ends[0], &ends[1]).map(|_| ends)
    }

    fn as_perturbation(&self, camera_from_map: &Isometry3<f64>, _: &Placed) -> Matrix6x4<f64> {
        adjoint(&(camera_from_map * self.map_from_beside)) * self.motions
    }
}

/// An error's derivatives by the landmark, from those by the pose.
#[inline]
pub(super) fn by_landmark<const N: usize>(
    by_pose: &[f64; 6],
    as_perturbation: &SMatrix<f64, 6, N>,
) -> SVector<f64, N> {
    as_perturbation.tr_mul(&Vector6::from(*by_pose))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::solve::testing::{KINECT_NOISE, NO_DEPTH, Random, View, kinect};

    /// Against differences.
    fn check<const N: usize, L: Landmark<N>>(
        landmark: &L,
        term: &L::Term,
        pose: &Isometry3<f64>,
    ) -> Result<(), TestCaseError>
    where
        L::Chart: Chart<N, Place = L>,
    {
        const SMALL: f64 = 1e-6;
        let (camera, placed) = (kinect(), Placed::new(pose));
        let chart = L::Chart::new(landmark).unwrap();
        let at = |landmark: &L| landmark.placed(term).block(&camera, &placed);
        let Some(block) = at(landmark) else { return Ok(()) };
        let as_perturbation = chart.as_perturbation(pose, &placed);
        for column in 0..N {
            let moved = |step: f64| {
                let mut correction = SVector::<f64, N>::zeros();
                correction[column] = step;
                at(&chart.corrected(&correction).unwrap())
            };
            let (Some(after), Some(before)) = (moved(SMALL), moved(-SMALL)) else { return Ok(()) };
            let rows = block.rows(4).zip(after.rows(4).zip(before.rows(4)));
            for ((_, by_pose), ((after, _), (before, _))) in rows {
                let slope = (after - before) / (2.0 * SMALL);
                let all = by_landmark(by_pose, &as_perturbation);
                prop_assert!(
                    (all[column] - slope).abs() < 1e-5 * (1.0 + all.norm()),
                    "{}: {} {}",
                    column,
                    all[column],
                    slope
                );
            }
        }
        Ok(())
    }

    proptest! {
        #[test]
        fn derivatives_are_those_of_the_errors(seed in any::<u64>(), with_depth in any::<bool>()) {
            let noise = if with_depth { KINECT_NOISE } else { NO_DEPTH };
            let view = View::room(5, 5, noise, seed).noisy(3.0, seed);
            let guess = view.guess(&Random::new(seed).perturbation(0.1, 0.05));
            for point in &view.points {
                check(&point.point_in_map_m, &PointTerm::new(point).unwrap(), &guess)?;
            }
            for line in &view.lines {
                if let Some(term) = LineTerm::new(&kinect(), line) {
                    check(&[line.start_in_map_m, line.end_in_map_m], &term, &guess)?;
                }
            }
        }

        #[test]
        fn a_line_through_the_origin_of_the_map_is_corrected_like_any_other(
            along in prop::array::uniform3(-1.0..1.0_f64),
            correction in prop::array::uniform4(-0.3..0.3_f64),
        ) {
            let along = Vector3::from(along);
            prop_assume!(along.norm() > 0.1);
            let ends = [Point3::from(-along), Point3::from(along)];
            let chart = LineChart::new(&ends).unwrap();
            let same = chart.corrected(&Vector4::zeros()).unwrap();
            prop_assert!((same[0] - ends[0]).norm() + (same[1] - ends[1]).norm() < 1e-12);
            let there = chart.corrected(&Vector4::from(correction)).unwrap();
            // Neither end moves farther than the correction.
            let reach = (1.0 + along.norm()) * 2.5 * Vector4::from(correction).norm();
            prop_assert!((there[0] - ends[0]).norm() < reach + 1e-12);
            // There and back.
            let back = LineChart::new(&there).unwrap();
            prop_assert!(back.corrected(&Vector4::zeros()).is_some());
        }
    }
}
