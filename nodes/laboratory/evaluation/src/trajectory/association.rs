//! The association of the poses of the estimate with those of the reference.

use geometry::Stamp;
use serde::{Deserialize, Serialize};

use super::path::{Times, Trajectory};

/// The parameters of the association.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AssociationConfig {
    /// The largest difference of the stamps of a pair.
    pub max_difference_s: f64,
    /// Offset added to the stamps of the estimate, when its clock differs.
    pub offset_s: f64,
}

impl Default for AssociationConfig {
    fn default() -> Self {
        Self {
            // evo's; the TUM benchmark's own tools take 0.02 s.
            max_difference_s: 0.01,
            offset_s: 0.0,
        }
    }
}

/// The result of the association.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct AssociationSummary {
    /// The largest difference of the stamps of a pair that was allowed; absent for trajectories of frames.
    pub max_difference_s: Option<f64>,
    /// Pairs of poses.
    pub matched: usize,
    /// Poses of the estimate without a partner.
    pub estimate_left_out: usize,
    /// Poses of the reference without a partner: many where it is denser.
    pub reference_left_out: usize,
    /// The mean difference of the stamps of a pair; absent for trajectories of frames.
    pub mean_difference_s: Option<f64>,
    /// The largest one.
    pub largest_difference_s: Option<f64>,
}

/// A pose of the estimate and its pose of the reference.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Pair {
    pub(super) estimate: usize,
    pub(super) reference: usize,
}

/// One trajectory has stamps, the other frame numbers.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct TimesDiffer;

/// The pairs, in the order of time. Each pose of the trajectory with fewer poses (the estimate, where both have
/// as many) takes the nearest of the other within the tolerance, the earlier of two that are as near; so one of
/// the other may serve two, which a tolerance below half of its interval rules out. Frames belong together by
/// their number.
pub(super) fn associate(
    estimate: &Trajectory,
    reference: &Trajectory,
    config: &AssociationConfig,
) -> Result<Vec<Pair>, TimesDiffer> {
    match (estimate.times(), reference.times()) {
        (Times::Stamps(estimate), Times::Stamps(reference)) => {
            let shifted: Vec<Stamp> =
                estimate.iter().map(|stamp| stamp.plus_seconds(config.offset_s)).collect();
            let tolerance_ns = nanos(config.max_difference_s);
            let pair = |(estimate, reference)| Pair { estimate, reference };
            Ok(if shifted.len() <= reference.len() {
                nearest(&shifted, reference, tolerance_ns).map(pair).collect()
            } else {
                let turned = nearest(reference, &shifted, tolerance_ns);
                turned.map(|(reference, estimate)| pair((estimate, reference))).collect()
            })
        }
        (Times::Frames(estimate), Times::Frames(reference)) => {
            let pair = |(index, frame): (usize, &usize)| {
                let reference = reference.binary_search(frame).ok()?;
                Some(Pair { estimate: index, reference })
            };
            Ok(estimate.iter().enumerate().filter_map(pair).collect())
        }
        _ => Err(TimesDiffer),
    }
}

/// The statistics of the pairs of two trajectories.
pub(super) fn summary(
    pairs: &[Pair],
    estimate: &Trajectory,
    reference: &Trajectory,
    config: &AssociationConfig,
) -> AssociationSummary {
    let without_partner = |count: usize, of: fn(&Pair) -> usize| {
        let mut partners: Vec<usize> = pairs.iter().map(of).collect();
        partners.dedup();
        count - partners.len()
    };
    let (mut max_difference_s, mut mean_difference_s, mut largest_difference_s) =
        (None, None, None);
    if let (Times::Stamps(of_estimate), Times::Stamps(of_reference)) =
        (estimate.times(), reference.times())
    {
        let difference_s = |pair: &Pair| {
            let shifted = of_estimate[pair.estimate].plus_seconds(config.offset_s);
            shifted.seconds_since(of_reference[pair.reference]).abs()
        };
        let differences_s: Vec<f64> = pairs.iter().map(difference_s).collect();
        max_difference_s = Some(config.max_difference_s);
        largest_difference_s = differences_s.iter().copied().reduce(f64::max);
        mean_difference_s = largest_difference_s
            .map(|_| differences_s.iter().sum::<f64>() / differences_s.len() as f64);
    }
    AssociationSummary {
        max_difference_s,
        matched: pairs.len(),
        estimate_left_out: without_partner(estimate.len(), |pair| pair.estimate),
        reference_left_out: without_partner(reference.len(), |pair| pair.reference),
        mean_difference_s,
        largest_difference_s,
    }
}

/// For each of `few` the nearest of `many`, both in order.
fn nearest(
    few: &[Stamp],
    many: &[Stamp],
    tolerance_ns: u64,
) -> impl Iterator<Item = (usize, usize)> {
    let apart_ns = |one: Stamp, other: Stamp| one.as_nanos().abs_diff(other.as_nanos());
    few.iter().enumerate().filter_map(move |(index, &stamp)| {
        let after = many.partition_point(|other| *other < stamp);
        let candidates = [after.checked_sub(1), Some(after)];
        let found = candidates
            .into_iter()
            .flatten()
            .filter_map(|at| Some((apart_ns(stamp, *many.get(at)?), at)))
            .min()?;
        (found.0 <= tolerance_ns).then_some((index, found.1))
    })
}

/// Seconds as nanoseconds; the cast saturates.
fn nanos(seconds: f64) -> u64 {
    (seconds * 1e9).round() as u64
}

#[cfg(test)]
mod tests {
    use nalgebra::Isometry3;
    use proptest::prelude::*;

    use super::super::path::RawPose;
    use super::super::testing::raw;
    use super::*;

    fn stamped(millis: &[i64]) -> Trajectory {
        let raw: RawPose = raw(&Isometry3::identity());
        Trajectory::stamped(
            millis.iter().map(|&millis| (Stamp::from_nanos(millis * 1_000_000), raw)),
        )
    }

    fn pairs(
        estimate: &[i64],
        reference: &[i64],
        config: AssociationConfig,
    ) -> Vec<(usize, usize)> {
        let pairs = associate(&stamped(estimate), &stamped(reference), &config).unwrap();
        pairs.iter().map(|pair| (pair.estimate, pair.reference)).collect()
    }

    #[test]
    fn each_of_the_fewer_takes_the_nearest() {
        let config = AssociationConfig::default();
        assert_eq!(
            pairs(&[1, 4, 21, 50], &[0, 10, 20, 30, 40], config),
            [(0, 0), (1, 0), (2, 2), (3, 4)]
        );
        assert_eq!(
            pairs(&[1, 4, 21, 32, 33, 34, 60], &[0, 10, 20, 30, 40], config),
            [(0, 0), (1, 1), (2, 2), (3, 3), (5, 4)]
        );
        let strict = AssociationConfig { max_difference_s: 0.001, ..config };
        assert_eq!(pairs(&[1, 4, 22, 50], &[0, 10, 20, 30, 40], strict), [(0, 0)]);
        let late = AssociationConfig { offset_s: -0.1, ..strict };
        assert_eq!(pairs(&[100, 120], &[0, 10, 20], late), [(0, 0), (1, 2)]);
    }

    #[test]
    fn what_has_no_partner_is_counted() {
        let (estimate, reference) = (stamped(&[1, 4, 21, 90]), stamped(&[0, 10, 20, 30, 40]));
        let config = AssociationConfig::default();
        let pairs = associate(&estimate, &reference, &config).unwrap();
        let summary = summary(&pairs, &estimate, &reference, &config);
        assert_eq!(summary.matched, 3);
        assert_eq!((summary.estimate_left_out, summary.reference_left_out), (1, 3));
        assert_eq!(summary.largest_difference_s, Some(0.004));
        assert_eq!(summary.mean_difference_s, Some(0.002));
    }

    #[test]
    fn frames_belong_together_by_their_number() {
        let good = raw(&Isometry3::identity());
        let lost = RawPose { position_m: [f64::NAN; 3], ..good };
        let estimate = Trajectory::numbered([good, lost, good]);
        let reference = Trajectory::numbered([good; 5]);
        let config = AssociationConfig::default();
        let pairs = associate(&estimate, &reference, &config).unwrap();
        assert_eq!(pairs, [Pair { estimate: 0, reference: 0 }, Pair { estimate: 1, reference: 2 }]);
        assert!(associate(&estimate, &stamped(&[1]), &config).is_err());
    }

    proptest! {
        #[test]
        fn the_pairs_are_those_of_a_search_over_all(
            mut estimate in proptest::collection::vec(0_i64..400, 1..20),
            mut reference in proptest::collection::vec(0_i64..400, 20..40),
            tolerance_ms in 0_i64..40,
        ) {
            for stamps in [&mut estimate, &mut reference] {
                stamps.sort_unstable();
                stamps.dedup();
            }
            prop_assume!(estimate.len() <= reference.len());
            let config =
                AssociationConfig { max_difference_s: tolerance_ms as f64 * 1e-3, offset_s: 0.0 };
            let plain: Vec<(usize, usize)> = estimate
                .iter()
                .enumerate()
                .filter_map(|(index, stamp)| {
                    let (at, apart) = reference
                        .iter()
                        .map(|other| (other - stamp).abs())
                        .enumerate()
                        .min_by_key(|(at, apart)| (*apart, *at))?;
                    (apart <= tolerance_ms).then_some((index, at))
                })
                .collect();
            prop_assert_eq!(pairs(&estimate, &reference, config), plain);
        }
    }
}
