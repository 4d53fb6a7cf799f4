//! The scan registered to earlier places: do the upright surfaces fit, and does no other place fit as well?
//!
//! The road fits everywhere, and so says nothing: houses, cars and posts are counted alone.

use estimation::covariance::{propagated, rotation_of_both};
use nalgebra::{Isometry3, Matrix6, Point3};

use super::candidate::Candidate;
use super::correction::LoopEdge;
use super::{LoopCloser, NotALoop};
use crate::registration::{PreparedCloud, Registration, RobustKernel, Surface, register};

/// A surface stands upright when its normal is this near to level: within 30 degrees.
const UPRIGHT: f32 = 0.5;
/// Fewer points of upright surfaces do not distinguish places.
const LEAST_UPRIGHT: usize = 50;

/// A place that the scan was registered to.
struct Fit {
    candidate: Candidate,
    found: Registration,
    /// Where the vehicle would be.
    map_from_vehicle: Isometry3<f64>,
    share: f64,
}

impl LoopCloser {
    /// The loop to the one place that fits. The scan is registered to no further place once `is_aborted` returns true.
    pub(super) fn verified(
        &self,
        candidates: &[Candidate],
        is_aborted: &dyn Fn() -> bool,
    ) -> Result<LoopEdge, NotALoop> {
        let nothing = NotALoop::DoesNotFit { places: candidates.len(), share: 0.0 };
        let now = self.keyframes.back().ok_or(nothing)?;
        let source = PreparedCloud::new(&now.points_m, &self.config.preparation, &*self.executor)
            .map_err(|_| nothing)?;
        let mut fits: Vec<Fit> = Vec::new();
        for candidate in candidates {
            if is_aborted() {
                return Err(NotALoop::GivenUp);
            }
            fits.extend(self.fit(&source, candidate));
        }
        // The first of those alike stays the first.
        fits.sort_by(|a, b| b.share.total_cmp(&a.share));
        let best = fits.first().ok_or(nothing)?;
        if best.share < self.config.min_fit_share {
            return Err(NotALoop::DoesNotFit { places: candidates.len(), share: best.share });
        }
        for other in fits.iter().skip(1) {
            let apart = best.map_from_vehicle.inv_mul(&other.map_from_vehicle);
            let apart_m = apart.translation.vector.norm();
            let is_as_good = other.share >= self.config.ambiguous_share * best.share;
            if is_as_good && apart_m > 0.5 * self.config.distinct_m {
                return Err(NotALoop::Ambiguous { apart_m });
            }
        }
        let place = self.keyframes.get(best.candidate.keyframe).ok_or(nothing)?;
        let gap = now.map_from_vehicle.inv_mul(&best.map_from_vehicle);
        let (gap_m, gap_rad) = (gap.translation.vector.norm(), gap.rotation.angle());
        let travelled_m = now.travelled_m - place.travelled_m;
        let (most_m, most_rad) = self.drift(travelled_m);
        if gap_m > most_m || gap_rad > most_rad {
            return Err(NotALoop::TooFarOff { gap_m, gap_rad, travelled_m });
        }
        let found = self.refined(best).unwrap_or_else(|| best.found.clone());
        let from_to = found.target_from_source;
        Ok(LoopEdge {
            from: self.forgotten + best.candidate.keyframe,
            to: self.forgotten + self.keyframes.len() - 1,
            from_to,
            information: self.information(&found.covariance, &from_to),
            fit_share: best.share,
        })
    }

    /// `None` where the scan does not lie on the place.
    fn fit(&self, source: &PreparedCloud, candidate: &Candidate) -> Option<Fit> {
        let target_m = self.place_m(candidate.keyframe)?;
        let target =
            PreparedCloud::new(&target_m, &self.config.preparation, &*self.executor).ok()?;
        let guess = &candidate.place_from_vehicle;
        let found =
            register(source, &target, guess, &self.config.registration, &*self.executor).ok()?;
        // In an unobservable direction the guess is kept, and it is no measurement.
        if !found.converged || found.observability.weak().next().is_some() {
            return None;
        }
        let share = self.upright_share(source, &target, &found.target_from_source)?;
        let place = self.keyframes.get(candidate.keyframe)?;
        let map_from_vehicle = place.map_from_vehicle * found.target_from_source;
        Some(Fit { candidate: *candidate, found, map_from_vehicle, share })
    }

    /// The points of the last keyframes together, registered to the place: a single scan of few rays determines its tilt to some tenths of a
    /// degree only, and the whole drive would be bent by that.
    fn refined(&self, fit: &Fit) -> Option<Registration> {
        let last = self.keyframes.len().checked_sub(1)?;
        let prepared = |keyframe| {
            let points_m = self.place_m(keyframe)?;
            PreparedCloud::new(&points_m, &self.config.preparation, &*self.executor).ok()
        };
        let (source, target) = (prepared(last)?, prepared(fit.candidate.keyframe)?);
        let mut rules = self.config.registration;
        rules.coarse.every = 0;
        // Surfaces that have been moved since, or are seen from one side only.
        rules.kernel = RobustKernel::GemanMcClure;
        rules.kernel_width_m = self.config.fit_distance_m;
        let guess = &fit.found.target_from_source;
        let refined = register(&source, &target, guess, &rules, &*self.executor).ok()?;
        let moved_m = guess.inv_mul(&refined.target_from_source).translation.vector.norm();
        (refined.converged && moved_m < self.config.fit_distance_m).then_some(refined)
    }

    /// The points of the keyframes about a place, in the frame of the vehicle there.
    fn place_m(&self, keyframe: usize) -> Option<Vec<Point3<f32>>> {
        let vehicle_from_odom = self.keyframes.get(keyframe)?.odom_from_vehicle.inverse();
        let first = keyframe.saturating_sub(self.config.neighbours);
        let last = keyframe.saturating_add(self.config.neighbours).min(self.keyframes.len() - 1);
        let mut points_m = Vec::new();
        for other in self.keyframes.range(first..=last) {
            let motion = (vehicle_from_odom * other.odom_from_vehicle).cast::<f32>();
            points_m.extend(other.points_m.iter().map(|point_m| motion * point_m));
        }
        Some(points_m)
    }

    /// The share of the upright points of the source that have one of the target beside them. `None` where they are too few.
    fn upright_share(
        &self,
        source: &PreparedCloud,
        target: &PreparedCloud,
        target_from_source: &Isometry3<f64>,
    ) -> Option<f64> {
        let (mut upright, mut fitting) = (0_usize, 0_usize);
        for (point_m, normal) in source.points_m() {
            if normal.is_some_and(|normal| normal.z.abs() > UPRIGHT) {
                continue;
            }
            upright += 1;
            let place_m = target_from_source * point_m.cast::<f64>();
            let distance_m = self.config.fit_distance_m;
            fitting +=
                usize::from(target.corresponding(&place_m.coords, distance_m, None).is_some());
        }
        (upright >= LEAST_UPRIGHT).then(|| fitting as f64 / upright as f64)
    }

    /// Of a loop, along the axes of the vehicle as it is now.
    fn information(
        &self,
        covariance: &Matrix6<f64>,
        place_from_vehicle: &Isometry3<f64>,
    ) -> Matrix6<f64> {
        let turn = place_from_vehicle.rotation.inverse().to_rotation_matrix().into_inner();
        let more = propagated(&rotation_of_both(&turn), covariance);
        let (shift, turn) =
            (self.config.loop_deviation_m, self.config.loop_deviation_deg.to_radians());
        let least = pose_graph::information(shift, turn);
        let whole = least.try_inverse().map(|least| least + more);
        whole.and_then(|whole| whole.try_inverse()).unwrap_or(least)
    }
}
