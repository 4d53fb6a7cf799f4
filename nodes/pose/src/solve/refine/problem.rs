//! The observations, and what they come to at a pose.

use estimation::NormalEquations;
use geometry::CameraModel;
use nalgebra::{Isometry3, Matrix6, Vector6};

use super::noise::Gates;
use crate::solve::config::{RefineConfig, RobustKernel};
use crate::solve::observation::{LineObservation, PointObservation, Verdict};
use crate::solve::term::{Errors, LineTerm, MAX_ROWS, PIXEL_ROWS, Placed, PointTerm, Term};

/// The cost of an observation that a pose has behind the camera, in squared standard deviations: more than any pose should
/// gain by it.
const BEHIND_CHI2: f64 = 1e4;

/// The observations that a pose is to explain.
pub(crate) struct Problem<'a> {
    pub(super) camera: &'a CameraModel,
    pub(super) config: &'a RefineConfig,
    pub(super) gates: Gates,
    /// `None` for what cannot be used.
    points: Vec<Option<PointTerm>>,
    lines: Vec<Option<LineTerm>>,
}

/// The use of each observation.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Uses {
    pub(crate) points: Vec<Verdict>,
    pub(crate) lines: Vec<Verdict>,
}

impl Uses {
    pub(crate) fn inliers(&self) -> usize {
        self.points.iter().chain(&self.lines).filter(|verdict| verdict.is_inlier()).count()
    }

    pub(crate) fn lengths(&self) -> (usize, usize) {
        (self.points.len(), self.lines.len())
    }
}

/// The problem at a pose: its cost, and what it is in a small neighbourhood.
pub(super) struct Linearised {
    pub(super) information: NormalEquations,
    pub(super) cost: f64,
}

impl<'a> Problem<'a> {
    pub(crate) fn new(
        camera: &'a CameraModel,
        points: &[PointObservation],
        lines: &[LineObservation],
        config: &'a RefineConfig,
    ) -> Self {
        Self {
            camera,
            config,
            gates: Gates::new(config.inlier_probability),
            points: points.iter().map(PointTerm::new).collect(),
            lines: lines.iter().map(|line| LineTerm::new(camera, line)).collect(),
        }
    }

    /// The problem of some of the points alone.
    pub(crate) fn of_points(&self, indices: &[usize]) -> Self {
        let term = |index: &usize| self.points.get(*index).copied().flatten();
        Self {
            camera: self.camera,
            config: self.config,
            gates: self.gates,
            points: indices.iter().map(term).collect(),
            lines: Vec::new(),
        }
    }

    /// The problem without the observations that `left` has for outliers.
    pub(crate) fn only(&self, left: &Uses) -> Self {
        fn kept<T: Copy>(terms: &[Option<T>], left: &[Verdict]) -> Vec<Option<T>> {
            let keep =
                |(term, verdict): (&Option<T>, &Verdict)| term.filter(|_| verdict.is_inlier());
            terms.iter().zip(left).map(keep).collect()
        }
        let points = kept(&self.points, &left.points);
        let lines = kept(&self.lines, &left.lines);
        Self { camera: self.camera, config: self.config, gates: self.gates, points, lines }
    }

    /// Everything that can be used.
    pub(crate) fn usable(&self) -> Uses {
        fn all<T>(terms: &[Option<T>]) -> Vec<Verdict> {
            let verdict = |usable| if usable { Verdict::Fits } else { Verdict::Unusable };
            terms.iter().map(|term| verdict(term.is_some())).collect()
        }
        Uses { points: all(&self.points), lines: all(&self.lines) }
    }

    /// The inliers of a pose when all variances are multiplied by `noise`.
    pub(crate) fn judged(&self, pose: &Isometry3<f64>, noise: f64) -> Uses {
        let placed = Placed::new(pose);
        Uses {
            points: self.judged_each(&self.points, &placed, noise),
            lines: self.judged_each(&self.lines, &placed, noise),
        }
    }

    fn judged_each<T: Term>(
        &self,
        terms: &[Option<T>],
        placed: &Placed,
        noise: f64,
    ) -> Vec<Verdict> {
        let judge = |term: &Option<T>| {
            let Some(term) = term else { return Verdict::Unusable };
            let Some(errors) = term.errors(self.camera, placed) else { return Verdict::Outlier };
            let Errors { pixel_chi2, chi2 } = errors;
            if chi2 < noise * self.gates.limit(term.rows()) {
                Verdict::Fits
            } else if self.config.keep_without_depth
                && pixel_chi2 < noise * self.gates.limit(PIXEL_ROWS)
            {
                Verdict::FitsWithoutDepth
            } else {
                Verdict::Outlier
            }
        };
        terms.iter().map(judge).collect()
    }

    /// The cost of the used observations under a kernel, and its neighbourhood.
    pub(super) fn linearised(
        &self,
        pose: &Isometry3<f64>,
        uses: &Uses,
        kernel: RobustKernel,
        noise: f64,
    ) -> Linearised {
        let placed = Placed::new(pose);
        let mut sums = Linearised { information: NormalEquations::default(), cost: 0.0 };
        self.add_each(&self.points, &uses.points, &placed, (kernel, noise), &mut sums);
        self.add_each(&self.lines, &uses.lines, &placed, (kernel, noise), &mut sums);
        sums
    }

    #[inline]
    fn add_each<T: Term>(
        &self,
        terms: &[Option<T>],
        verdicts: &[Verdict],
        placed: &Placed,
        (kernel, noise): (RobustKernel, f64),
        sums: &mut Linearised,
    ) {
        for (term, most) in used(terms, verdicts) {
            let kernel_limit = noise * self.gates.limit(term.rows().min(most));
            let block = term.block(self.camera, placed);
            let finite = block.map(|block| (block, block.chi2(most)));
            let Some((block, chi2)) = finite.filter(|(_, chi2)| *chi2 < f64::INFINITY) else {
                sums.cost += kernel.loss_and_weight(BEHIND_CHI2, kernel_limit).0;
                continue;
            };
            let (loss, weight) = kernel.loss_and_weight(chi2, kernel_limit);
            sums.cost += loss;
            for (error, jacobian) in block.rows(most) {
                sums.information.add(error, jacobian, weight);
            }
        }
    }

    /// The information of the inliers about the pose, by the stated variances.
    pub(super) fn information_of_inliers(
        &self,
        pose: &Isometry3<f64>,
        uses: &Uses,
    ) -> Matrix6<f64> {
        let first = self.information_by(pose, uses, &Matrix6::zeros());
        match first.cholesky() {
            Some(first) => self.information_by(pose, uses, &first.inverse()),
            None => first,
        }
    }

    /// The same, with the leverages that belong to a covariance.
    fn information_by(
        &self,
        pose: &Isometry3<f64>,
        uses: &Uses,
        covariance: &Matrix6<f64>,
    ) -> Matrix6<f64> {
        let placed = Placed::new(pose);
        let mut information = NormalEquations::default();
        self.inform_each(&self.points, &uses.points, (&placed, covariance), &mut information);
        self.inform_each(&self.lines, &uses.lines, (&placed, covariance), &mut information);
        information.information()
    }

    fn inform_each<T: Term>(
        &self,
        terms: &[Option<T>],
        verdicts: &[Verdict],
        (placed, covariance): (&Placed, &Matrix6<f64>),
        information: &mut NormalEquations,
    ) {
        for (term, most) in used(terms, verdicts) {
            let rows = term.rows().min(most);
            let Some(block) = term.block(self.camera, placed) else { continue };
            let followed: f64 = block
                .rows(most)
                .map(|(_, jacobian)| {
                    let jacobian = Vector6::from(*jacobian);
                    jacobian.dot(&(covariance * jacobian))
                })
                .sum();
            let worth = self.gates.variance(rows, followed / rows as f64);
            for (error, jacobian) in block.rows(most) {
                information.add(error, jacobian, worth);
            }
        }
    }

    /// The squared error of every used observation that is in front of the camera, and how many errors are in it.
    pub(super) fn squares(&self, pose: &Isometry3<f64>, uses: &Uses) -> Vec<(f64, usize)> {
        let placed = Placed::new(pose);
        let mut squares = Vec::with_capacity(uses.points.len() + uses.lines.len());
        self.square_each(&self.points, &uses.points, &placed, &mut squares);
        self.square_each(&self.lines, &uses.lines, &placed, &mut squares);
        squares
    }

    fn square_each<T: Term>(
        &self,
        terms: &[Option<T>],
        verdicts: &[Verdict],
        placed: &Placed,
        squares: &mut Vec<(f64, usize)>,
    ) {
        for (term, most) in used(terms, verdicts) {
            let Some(errors) = term.errors(self.camera, placed) else { continue };
            let Errors { pixel_chi2, chi2 } = errors;
            let chi2 = if most == PIXEL_ROWS { pixel_chi2 } else { chi2 };
            squares.push((chi2, term.rows().min(most)));
        }
    }

    /// The sum of the squared errors of what is used, and how many there are.
    pub(super) fn left_over(&self, pose: &Isometry3<f64>, uses: &Uses) -> (f64, usize) {
        let squares = self.squares(pose, uses);
        let sum = |(chi2, errors), (more, rows)| (chi2 + more, errors + rows);
        squares.into_iter().fold((0.0, 0), sum)
    }

    /// The truncated cost of a pose: the squared errors of the points among `uses`, each no more than its limit. Stops where the
    /// sum reaches `least`. With the number of points below their limits.
    pub(crate) fn truncated_cost(
        &self,
        pose: &Isometry3<f64>,
        uses: &Uses,
        least: f64,
    ) -> Option<(f64, usize)> {
        let placed = Placed::new(pose);
        let (mut cost, mut inliers) = (0.0, 0);
        for (term, most) in used(&self.points, &uses.points) {
            let limit = self.gates.limit(term.rows().min(most));
            let missed = term.errors(self.camera, &placed).map_or(limit, |errors| errors.chi2);
            if missed < limit {
                inliers += 1;
                cost += missed;
            } else {
                cost += limit;
            }
            if cost >= least {
                return None;
            }
        }
        Some((cost, inliers))
    }
}

/// The observations that are used, each with how many of its errors.
#[inline]
fn used<'a, T>(
    terms: &'a [Option<T>],
    verdicts: &'a [Verdict],
) -> impl Iterator<Item = (&'a T, usize)> {
    terms.iter().zip(verdicts).filter_map(|(term, verdict)| {
        let most = match verdict {
            Verdict::Fits => MAX_ROWS,
            Verdict::FitsWithoutDepth => PIXEL_ROWS,
            Verdict::Outlier | Verdict::Unusable => return None,
        };
        Some((term.as_ref()?, most))
    })
}
