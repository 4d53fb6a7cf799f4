//! Where one map lies in another: the places that come into question, each registered, and what speaks for and against it.

use estimation::Executor;
use nalgebra::{Isometry3, Point3};
use registration::{
    CoarseConfig, Method, Registration, RegistrationConfig, RobustKernel, register,
};

use crate::agreement::{Agreement, Compared, agreement};
use crate::error::MergeError;
use crate::heading::yaws_rad;
use crate::height::shifts_m;
use crate::plan::{CELL_M, Plan};
use crate::saved_map::{PreparedMap, SavedMap};
use crate::search::{is_same_place, places, radius_m};
use crate::seen_space::SeenSpace;

/// The least share of the upright surfaces, of those that both maps say something of, that is to be the same. Furniture is a quarter
/// of a room's upright surface; two flats that are laid upon each other share walls by chance: of simulated
/// ones a quarter to two thirds agreed, of one flat with half of its furniture moved nine tenths and more.
const LEAST_AGREEMENT: f64 = 0.8;
/// The least share of the smaller map that the other says something of: one room of four.
const LEAST_OVERLAP: f64 = 0.2;
/// The same where it is not known where both maps looked, so that less contradicts.
const LEAST_OVERLAP_WITHOUT_VIEWS: f64 = 0.5;
/// The least upright surface that is to be the same: two walls of a small room.
pub(crate) const LEAST_SAME_M2: f64 = 6.0;
/// A place is better than another by what the maps share there and not in the other, and by what contradicts there and not here: by as
/// much as two pieces of furniture have upright surface, or by this share of all that is the same, if that is more. In a symmetric room
/// furniture that stayed says which way round it is: that surfaces of it coincide by chance is unlikely.
const BETTER_M2: f64 = 4.0;
const BETTER_SHARE: f64 = 0.03;
/// From so far away a map is drawn to the other: the cell of the plan, what the yaw may be off by, and a step of the floor.
const REACH_M: f64 = 0.5;
/// In the last steps points farther apart than this are not of the same surface: half of a thin wall with its noise.
const LAST_REACH_M: f64 = 0.15;
/// From this distance on a point is doubted, as three standard deviations of the Kinect's noise at 4 m.
const DOUBTED_M: f64 = 0.07;
/// The same of the first steps: the cell of the plan, and as much again for the yaw.
const FIRST_DOUBTED_M: f64 = 0.2;

/// Where a map lies in another.
#[derive(Clone, PartialEq, Debug)]
pub struct Alignment {
    /// Takes points of the second map to the first one.
    pub a_from_b: Isometry3<f64>,
    /// The root of the mean squared distance, across the surface, of surfaces that lie upon each other.
    pub residual_m: f64,
    /// What the maps say of each other there.
    pub agreement: Agreement,
    /// The same of the next best place that is another one, if any was found.
    pub next: Option<Candidate>,
}

/// A place that one map may have in another.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Candidate {
    /// Takes points of the second map to the first one.
    pub a_from_b: Isometry3<f64>,
    /// What the maps say of each other there.
    pub agreement: Agreement,
}

impl Candidate {
    fn is_acceptable(&self, least_overlap: f64) -> bool {
        let Agreement { same_m2, overlap, .. } = self.agreement;
        self.agreement.share() >= LEAST_AGREEMENT
            && overlap >= least_overlap
            && same_m2 >= LEAST_SAME_M2
    }

    /// Whether it is clearly a better place than the other.
    fn is_better_than(&self, other: &Self) -> bool {
        let (own, other) = (&self.agreement, &other.agreement);
        let by_m2 = own.same_m2 - other.same_m2 + other.contradicting_m2 - own.contradicting_m2;
        by_m2 >= BETTER_M2.max(BETTER_SHARE * own.same_m2)
    }

    /// What is the same, less what contradicts, such that an agreement that is just acceptable has none; and the floors, by which heights
    /// differ.
    fn score(&self) -> f64 {
        let Agreement { same_m2, contradicting_m2, level_m2, .. } = self.agreement;
        same_m2 - LEAST_AGREEMENT / (1.0 - LEAST_AGREEMENT) * contradicting_m2 + level_m2
    }
}

/// Two maps that are made ready for each other.
pub(crate) struct Pair<'a> {
    pub(crate) a: Compared<'a>,
    pub(crate) b: Compared<'a>,
}

impl<'a> Pair<'a> {
    pub(crate) fn new(
        maps: [&SavedMap; 2],
        prepared: [&'a PreparedMap; 2],
        executor: &dyn Executor,
    ) -> Result<Self, MergeError> {
        let edge_m = prepared[0].edge_m.max(prepared[1].edge_m);
        let is_sided = prepared.iter().all(|map| map.is_sided);
        let compared = |index: usize| {
            let map = prepared[index];
            let plan = Plan::of(map)
                .map_err(|wide| MergeError::TooWide { map: index, extent_m: wide.extent_m })?;
            let seen = SeenSpace::of(map, &maps[index].views, executor);
            Compared::new(map, plan, seen, edge_m, is_sided).ok_or(MergeError::Edge { edge_m })
        };
        Ok(Self { a: compared(0)?, b: compared(1)? })
    }

    /// In the frames of the files.
    fn of_level(&self, level: &Isometry3<f64>) -> Isometry3<f64> {
        self.a.map.level_from_map.inverse() * level * self.b.map.level_from_map
    }

    pub(crate) fn level(&self, a_from_b: &Isometry3<f64>) -> Isometry3<f64> {
        self.a.map.level_from_map * a_from_b * self.b.map.level_from_map.inverse()
    }

    /// The guesses: each place as seen from above at each height, and the frames of both files, which are one where the second run began
    /// with the map of the first.
    fn guesses(&self, is_over: &dyn Fn() -> bool) -> Option<Vec<Isometry3<f64>>> {
        let (a, b) = (self.a.map, self.b.map);
        let step_rad = CELL_M / radius_m(b).max(CELL_M);
        let found = places(&self.a.plan, b, &yaws_rad(a, b, step_rad), is_over)?;
        let heights_m = shifts_m(a, b);
        let of_place = |place| heights_m.iter().map(move |up_m| (place, *up_m));
        let guesses = found.places.iter().flat_map(of_place);
        let guesses = guesses.map(|(place, up_m)| self.of_level(&found.a_from_b(place, up_m)));
        Some(std::iter::once(Isometry3::identity()).chain(guesses).collect())
    }

    /// Where the registration leads to from a guess.
    fn candidate(&self, guess: &Isometry3<f64>, executor: &dyn Executor) -> Option<Candidate> {
        let config = RegistrationConfig {
            max_correspondence_m: REACH_M,
            kernel_width_m: FIRST_DOUBTED_M,
            coarse: CoarseConfig { every: 0, ..CoarseConfig::default() },
            max_iterations: 30,
            // A fifth of what surfaces may be apart that agree.
            settled_m: 0.01,
            ..rules()
        };
        let found = register(
            &self.b.map.coarse,
            &self.a.map.cloud,
            &self.middles(guess),
            &config,
            executor,
        )
        .ok()?;
        let a_from_b = self.of_middles(&found.target_from_source);
        let agreement = agreement(&self.a, &self.b, &self.level(&a_from_b));
        Some(Candidate { a_from_b, agreement })
    }

    fn refined(
        &self,
        guess: &Isometry3<f64>,
        executor: &dyn Executor,
    ) -> Result<Registration, MergeError> {
        let coarse = CoarseConfig { every: 0, ..CoarseConfig::default() };
        let config = RegistrationConfig { max_correspondence_m: LAST_REACH_M, coarse, ..rules() };
        Ok(register(&self.b.map.cloud, &self.a.map.cloud, &self.middles(guess), &config, executor)?)
    }

    /// Aligns the second map with the first.
    pub(crate) fn align(
        &self,
        guess: Option<&Isometry3<f64>>,
        executor: &dyn Executor,
        is_over: &dyn Fn() -> bool,
    ) -> Result<Alignment, MergeError> {
        let guesses = match guess {
            Some(guess) => vec![*guess],
            None => self.guesses(is_over).ok_or(MergeError::Interrupted)?,
        };
        let mut candidates: Vec<Candidate> = Vec::new();
        for guess in &guesses {
            if is_over() {
                return Err(MergeError::Interrupted);
            }
            candidates.extend(self.candidate(guess, executor));
        }
        candidates.sort_by(|one, other| other.score().total_cmp(&one.score()));
        let middle_m = self.middle_of_b();
        let best = *candidates.first().ok_or(MergeError::NoOverlap)?;
        let next = candidates
            .iter()
            .find(|other| !is_same_place(&other.a_from_b, &best.a_from_b, &middle_m))
            .copied();
        let is_blind = self.a.seen.is_empty() || self.b.seen.is_empty();
        let least_overlap = if is_blind { LEAST_OVERLAP_WITHOUT_VIEWS } else { LEAST_OVERLAP };
        if !best.is_acceptable(least_overlap) {
            return Err(MergeError::NoAgreement {
                best: Box::new(best),
                least: LEAST_AGREEMENT,
                least_overlap,
                least_m2: LEAST_SAME_M2,
            });
        }
        if let Some(next) =
            next.filter(|next| next.is_acceptable(least_overlap) && !best.is_better_than(next))
        {
            return Err(MergeError::Ambiguous { best: Box::new(best), next: Box::new(next) });
        }
        let registration = self.refined(&best.a_from_b, executor)?;
        if let Some(weak) = registration.observability.weak().next() {
            let shift = weak.shift().map(|axis| [axis.x, axis.y, axis.z]);
            return Err(MergeError::Undetermined { shift });
        }
        let a_from_b = self.of_middles(&registration.target_from_source);
        let agreement = agreement(&self.a, &self.b, &self.level(&a_from_b));
        Ok(Alignment { a_from_b, residual_m: registration.residual_rms_m, agreement, next })
    }

    /// In the second map's frame.
    fn middle_of_b(&self) -> Point3<f64> {
        self.b.map.middle_from_map.inverse() * Point3::origin()
    }

    /// Between the middles of both maps, about which they are registered.
    fn middles(&self, a_from_b: &Isometry3<f64>) -> Isometry3<f64> {
        self.a.map.middle_from_map * a_from_b * self.b.map.middle_from_map.inverse()
    }

    fn of_middles(&self, middles: &Isometry3<f64>) -> Isometry3<f64> {
        self.a.map.middle_from_map.inverse() * middles * self.b.map.middle_from_map
    }
}

/// What all registrations of maps have in common.
fn rules() -> RegistrationConfig {
    RegistrationConfig {
        // Surfaces are dense and have normals.
        method: Method::PointToPlane,
        // What has moved does not pull.
        kernel: RobustKernel::GemanMcClure,
        kernel_width_m: DOUBTED_M,
        ..RegistrationConfig::default()
    }
}
