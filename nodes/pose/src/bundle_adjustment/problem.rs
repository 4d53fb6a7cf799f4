//! The cost, and its normal equations.

use estimation::chi_square::quantile;
use geometry::CameraModel;
use nalgebra::{Isometry3, Matrix6, Point3, SMatrix, SVector, Vector6};
use pose_graph::blocks::BlockSystem;

use super::Sighting;
use super::landmark::{Chart, Landmark, by_landmark};
use crate::solve::term::{MAX_ROWS, PIXEL_ROWS, Placed, Term};
use crate::solve::{RobustKernel, Verdict};

/// The cost of a sighting that a pose has behind the camera, in squared standard deviations: more than anything should gain
/// by it.
const BEHIND_CHI2: f64 = 1e4;

/// The state: poses and landmarks.
#[derive(Clone, Debug)]
pub(super) struct State {
    pub(super) poses: Vec<Isometry3<f64>>,
    pub(super) points_m: Vec<Point3<f64>>,
    pub(super) lines_m: Vec<[Point3<f64>; 2]>,
}

/// The use of each sighting.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct Uses {
    pub(super) points: Vec<Verdict>,
    pub(super) lines: Vec<Verdict>,
}

/// The largest squared error of an inlier, by how many errors it has.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gates {
    by_rows: [f64; MAX_ROWS + 1],
    of_motions: f64,
}

impl Gates {
    pub(super) fn new(inlier_probability: f64) -> Self {
        let by_rows =
            std::array::from_fn(
                |rows| {
                    if rows == 0 { 0.0 } else { quantile(rows, inlier_probability) }
                },
            );
        Self { by_rows, of_motions: quantile(6, inlier_probability) }
    }

    pub(super) fn of_motions(&self) -> f64 {
        self.of_motions
    }

    fn limit(&self, rows: usize) -> f64 {
        self.by_rows[rows.min(MAX_ROWS)]
    }
}

/// The cameras at their poses.
pub(super) struct Cameras<'a> {
    pub(super) models: &'a [CameraModel],
    pub(super) poses: &'a [Isometry3<f64>],
    pub(super) placed: Vec<Placed>,
}

impl<'a> Cameras<'a> {
    pub(super) fn new(models: &'a [CameraModel], poses: &'a [Isometry3<f64>]) -> Self {
        Self { models, poses, placed: poses.iter().map(Placed::new).collect() }
    }
}

/// The sightings of one kind of landmark, those of each landmark together.
pub(super) struct Kind<const N: usize, L: Landmark<N>> {
    seen: Vec<Seen<L::Term>>,
    /// Where those of each landmark begin in `seen`; one more at the end.
    starts: Vec<usize>,
}

struct Seen<T> {
    /// Its index in the input.
    index: usize,
    pose: usize,
    /// `None` for what cannot be used.
    term: Option<T>,
}

/// The normal equations of one landmark.
pub(super) struct Normal<const N: usize> {
    pub(super) own: SMatrix<f64, N, N>,
    pub(super) pull: SVector<f64, N>,
    /// Where those of the next one begin in the ties.
    pub(super) ties_end: usize,
}

/// All landmarks of a kind, linearised.
pub(super) struct Linearised<const N: usize, C> {
    pub(super) normals: Vec<Normal<N>>,
    pub(super) charts: Vec<Option<C>>,
    /// Which unknown pose is tied to the landmark, and how.
    pub(super) ties: Vec<(usize, SMatrix<f64, 6, N>)>,
}

impl<const N: usize, L: Landmark<N>> Kind<N, L>
where
    L::Chart: Chart<N, Place = L>,
{
    pub(super) fn new<O>(
        sightings: &[Sighting<O>],
        landmarks: usize,
        term: impl Fn(&Sighting<O>) -> Option<L::Term>,
    ) -> Self {
        let mut order: Vec<usize> = (0..sightings.len()).collect();
        order.sort_by_key(|index| (sightings[*index].landmark, sightings[*index].pose));
        let mut starts = vec![0; landmarks + 1];
        for sighting in sightings {
            starts[sighting.landmark + 1] += 1;
        }
        for landmark in 0..landmarks {
            starts[landmark + 1] += starts[landmark];
        }
        let seen = order.into_iter().map(|index| {
            let sighting = &sightings[index];
            Seen { index, pose: sighting.pose, term: term(sighting) }
        });
        Self { seen: seen.collect(), starts }
    }

    /// The poses that see each landmark.
    pub(super) fn seen_from(&self) -> impl Iterator<Item = impl Iterator<Item = usize> + Clone> {
        self.starts.windows(2).map(|ends| {
            let usable = self.seen[ends[0]..ends[1]].iter().filter(|seen| seen.term.is_some());
            usable.map(|seen| seen.pose)
        })
    }

    /// Everything that can be used.
    pub(super) fn usable(&self) -> Vec<Verdict> {
        let mut verdicts = vec![Verdict::Unusable; self.seen.len()];
        for seen in self.seen.iter().filter(|seen| seen.term.is_some()) {
            verdicts[seen.index] = Verdict::Fits;
        }
        verdicts
    }

    /// The inliers at the current state.
    pub(super) fn judged(
        &self,
        places: &[L],
        cameras: &Cameras<'_>,
        gates: &Gates,
        keep_without_depth: bool,
    ) -> Vec<Verdict> {
        let mut verdicts = vec![Verdict::Unusable; self.seen.len()];
        for (place, ends) in places.iter().zip(self.starts.windows(2)) {
            for seen in &self.seen[ends[0]..ends[1]] {
                let Some(term) = &seen.term else { continue };
                let term = place.placed(term);
                let errors = term.errors(&cameras.models[seen.pose], &cameras.placed[seen.pose]);
                verdicts[seen.index] = match errors {
                    Some(errors) if errors.chi2 < gates.limit(term.rows()) => Verdict::Fits,
                    Some(errors)
                        if keep_without_depth && errors.pixel_chi2 < gates.limit(PIXEL_ROWS) =>
                    {
                        Verdict::FitsWithoutDepth
                    }
                    _ => Verdict::Outlier,
                };
            }
        }
        verdicts
    }

    pub(super) fn cost(
        &self,
        places: &[L],
        cameras: &Cameras<'_>,
        verdicts: &[Verdict],
        (kernel, gates): (RobustKernel, &Gates),
    ) -> f64 {
        let mut cost = 0.0;
        for (place, ends) in places.iter().zip(self.starts.windows(2)) {
            for seen in &self.seen[ends[0]..ends[1]] {
                let Some((term, most)) = used(seen, verdicts) else { continue };
                let term = place.placed(term);
                let kernel_limit = gates.limit(term.rows().min(most));
                // By the block, as the descent has it: a line that is used does not come and go with every step.
                let block = term.block(&cameras.models[seen.pose], &cameras.placed[seen.pose]);
                let chi2 = block.map_or(BEHIND_CHI2, |block| block.chi2(most));
                cost += kernel
                    .loss_and_weight(
                        if chi2.is_finite() { chi2 } else { BEHIND_CHI2 },
                        kernel_limit,
                    )
                    .0;
            }
        }
        cost
    }

    /// The normal equations of all landmarks; the parts of the poses are added to the system.
    pub(super) fn linearised(
        &self,
        places: &[L],
        cameras: &Cameras<'_>,
        verdicts: &[Verdict],
        (kernel, gates): (RobustKernel, &Gates),
        unknowns: &[Option<usize>],
        system: &mut BlockSystem,
    ) -> Linearised<N, L::Chart> {
        let mut all = Linearised {
            normals: Vec::with_capacity(places.len()),
            charts: Vec::with_capacity(places.len()),
            ties: Vec::with_capacity(self.seen.len()),
        };
        for (place, ends) in places.iter().zip(self.starts.windows(2)) {
            let chart = L::Chart::new(place);
            let (mut own, mut pull) = (SMatrix::<f64, N, N>::zeros(), SVector::<f64, N>::zeros());
            for seen in &self.seen[ends[0]..ends[1]] {
                let Some((term, most)) = used(seen, verdicts) else { continue };
                let (camera, placed) = (&cameras.models[seen.pose], &cameras.placed[seen.pose]);
                let term = place.placed(term);
                let Some(block) = term.block(camera, placed) else { continue };
                let chi2 = block.chi2(most);
                if !chi2.is_finite() {
                    continue;
                }
                let kernel_limit = gates.limit(term.rows().min(most));
                let (_, weight) = kernel.loss_and_weight(chi2, kernel_limit);
                let as_perturbation = chart
                    .as_ref()
                    .map(|chart| chart.as_perturbation(&cameras.poses[seen.pose], placed));
                let (mut of_pose, mut right) = (Matrix6::zeros(), Vector6::zeros());
                for (error, by_pose) in block.rows(most) {
                    let by_pose = Vector6::from(*by_pose);
                    of_pose += (weight * by_pose) * by_pose.transpose();
                    right -= (weight * error) * by_pose;
                }
                if let Some(unknown) = unknowns[seen.pose] {
                    system.add(unknown, unknown, &of_pose);
                    system.add_right(unknown, &right);
                }
                if let Some(as_perturbation) = as_perturbation {
                    // All follows from what there is by the pose.
                    let tie = of_pose * as_perturbation;
                    own += as_perturbation.tr_mul(&tie);
                    pull += by_landmark(&right.into(), &as_perturbation);
                    if let Some(unknown) = unknowns[seen.pose] {
                        all.ties.push((unknown, tie));
                    }
                }
            }
            all.normals.push(Normal { own, pull, ties_end: all.ties.len() });
            all.charts.push(chart);
        }
        all
    }
}

/// A sighting that is used, with how many of its errors.
fn used<'a, T>(seen: &'a Seen<T>, verdicts: &[Verdict]) -> Option<(&'a T, usize)> {
    let most = match verdicts.get(seen.index)? {
        Verdict::Fits => MAX_ROWS,
        Verdict::FitsWithoutDepth => PIXEL_ROWS,
        Verdict::Outlier | Verdict::Unusable => return None,
    };
    Some((seen.term.as_ref()?, most))
}
