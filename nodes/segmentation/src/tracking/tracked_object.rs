//! One tracked object.

use geometry::Track;
use nalgebra::{Matrix2, Matrix3, Point3, Vector3};

use super::Prediction;
use super::hinge::Hinge;
use super::kalman::Filter;
use super::observation::{Observation, Reach};
use crate::FreeSpaceConfig;

/// The squared Mahalanobis distance beyond which an observation is of another object: 99.9 % of two degrees
/// of freedom.
pub(super) const GATE: f64 = 13.8;
/// How much of its shape a body shows differs from cycle to cycle: limbs swing. The centre's deviation.
const SHAPE_NOISE_M: f64 = 0.02;
/// The same for one end of it, which a swinging arm or foot moves more.
const END_NOISE_M: f64 = 0.08;
/// The centre of an object with both ends cut, or parted from another, may be anywhere in it.
const CUT_NOISE_M: f64 = 0.25;
/// Points beyond which the mean gets no better: their errors are not independent.
const INDEPENDENT_POINTS: usize = 16;
/// What the visible centre may jump by when other parts come into view, for the association.
const APPEARANCE_NOISE_M: f64 = 0.12;
/// The share of a new size that the estimate takes over.
const SIZE_GAIN: f64 = 0.2;
/// An object that remains within this of a place has not left it.
const STAY_M: f64 = 0.3;
/// A group so near to an object, beyond its size, is a part of it that the cloud has torn off.
const FRAGMENT_M: f64 = 0.2;

/// What a cycle says of the motion of an observation.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct MotionEvidence {
    /// Most of it is in observed free space.
    pub(super) in_free_space: bool,
    /// Most of it is of groups that a zone covers.
    pub(super) in_zone: bool,
    /// Some of it was not there before.
    pub(super) is_newly_occupied: bool,
    /// Most of it is of groups that were found to move in their place.
    pub(super) moves_in_place: bool,
    /// Most of it is of groups that have stayed in their places.
    pub(super) has_stayed: bool,
}

#[derive(Clone, Debug)]
pub(super) struct TrackedObject {
    /// Which it is among all that there were.
    pub(super) key: u32,
    /// Its number, once it has passed its trial.
    pub(super) id: Option<u32>,
    /// The body's fixed point.
    filter: Filter,
    /// The centre of what was visible last.
    seen_at_m: Point3<f64>,
    /// From the fixed point to the centre of what is visible.
    visible_offset_m: Vector3<f64>,
    extent_m: Vector3<f64>,
    /// From the centre of what is visible to the ends of it along the axes of the map.
    reach_m: Reach,
    /// From each end to the fixed point, along the direction across the view; as far as known.
    from_left_m: Option<f64>,
    from_right_m: Option<f64>,
    /// Whether all of it was in view at once, so that the fixed point is the centre.
    was_whole: bool,
    born_s: f64,
    seen_s: f64,
    cycles: u32,
    seen_cycles: u32,
    unseen_cycles: u32,
    /// Unseen cycles in which it should have been seen.
    missed_cycles: u32,
    is_in_view: bool,
    hidden_s: f64,
    first_position_m: Point3<f64>,
    /// The place that it has not left since `stopped_since_s`.
    stopped_at_m: Point3<f64>,
    stopped_since_s: f64,
    /// Whether it turns about its hinges.
    hinge: Hinge,
    /// Whether who moved it has left it.
    is_left: bool,
    /// Something shows that it moves, or moved.
    has_moved: bool,
    /// When it was last seen to move, or in a place that was empty before.
    confirmed_s: f64,
    is_ended: bool,
}

impl TrackedObject {
    pub(super) fn new(key: u32, observation: &Observation, now_s: f64, cell_m: f64) -> Self {
        let centre_m = observation.centre_m;
        let centre_along_m = observation.across.dot(&centre_m.coords);
        let is_whole = !observation.left.is_cut && !observation.right.is_cut;
        Self {
            key,
            id: None,
            filter: Filter::at(&centre_m, &noise_m2(observation, cell_m)),
            seen_at_m: centre_m,
            visible_offset_m: Vector3::zeros(),
            extent_m: observation.extent_m,
            reach_m: observation.reach_m,
            from_left_m: (!observation.left.is_cut)
                .then_some(centre_along_m - observation.left.along_m),
            from_right_m: (!observation.right.is_cut)
                .then_some(centre_along_m - observation.right.along_m),
            was_whole: is_whole,
            born_s: now_s,
            seen_s: now_s,
            cycles: 1,
            seen_cycles: 1,
            unseen_cycles: 0,
            missed_cycles: 0,
            is_in_view: true,
            hidden_s: 0.0,
            first_position_m: centre_m,
            stopped_at_m: centre_m,
            stopped_since_s: now_s,
            hinge: Hinge::default(),
            is_left: false,
            has_moved: false,
            confirmed_s: now_s,
            is_ended: false,
        }
    }

    pub(super) fn predict(&mut self, dt_s: f64, acceleration_m_per_s2: f64) {
        self.filter.predict(dt_s, acceleration_m_per_s2);
        self.cycles = self.cycles.saturating_add(1);
    }

    pub(super) fn visible_centre_m(&self) -> Point3<f64> {
        self.filter.position_m() + self.visible_offset_m
    }

    pub(super) fn expected(&self, config: &FreeSpaceConfig) -> Prediction {
        let Reach { down_m, up_m } = self.reach_m;
        let (width_m, height_m) = (config.max_object_width_m, config.max_object_height_m);
        let largest_m = Vector3::new(width_m, width_m, height_m);
        Prediction {
            centre_m: self.visible_centre_m() + (down_m + up_m) / 2.0,
            half_extent_m: (up_m - down_m).inf(&largest_m) / 2.0,
            was_seen: self.unseen_cycles == 0,
        }
    }

    /// The squared Mahalanobis distance of an observation in the horizontal plane. Heights are left out: legs
    /// go behind a table and come back.
    pub(super) fn distance2(&self, observation: &Observation) -> f64 {
        let innovation_m = (observation.centre_m - self.visible_centre_m()).xy();
        let covariance_m2: Matrix2<f64> =
            self.filter.position_covariance_m2().fixed_view::<2, 2>(0, 0)
                + Matrix2::identity() * APPEARANCE_NOISE_M.powi(2);
        covariance_m2
            .try_inverse()
            .map_or(f64::INFINITY, |inverse| (inverse * innovation_m).dot(&innovation_m))
    }

    /// Takes what a cycle shows of it.
    pub(super) fn see(&mut self, observation: &Observation, now_s: f64, cell_m: f64) {
        let across = observation.across;
        let centre_m = observation.centre_m;
        let centre_along_m = across.dot(&centre_m.coords);
        let (left, right) = (observation.left, observation.right);
        let by_left_m = self.from_left_m.map(|from_m| left.along_m + from_m);
        let by_right_m = self.from_right_m.map(|from_m| right.along_m + from_m);
        let along_m = match (left.is_cut, right.is_cut) {
            (false, false) if !observation.is_split => {
                self.become_whole(observation, by_left_m.or(by_right_m));
                Some(centre_along_m)
            }
            (true, false) => by_right_m,
            (false, true) => by_left_m,
            _ => None,
        };
        let is_sure = !left.is_cut && !right.is_cut && !observation.is_split;
        // Without any end to go by it is the visible centre, as unsure as that is.
        let fixed_m = centre_m + across * (along_m.unwrap_or(centre_along_m) - centre_along_m);
        let mut noise_m2 = noise_m2(observation, cell_m);
        if !is_sure && along_m.is_some() && !observation.is_split {
            let end_m2 = END_NOISE_M.powi(2) - CUT_NOISE_M.powi(2);
            noise_m2 += across * across.transpose() * end_m2;
        }
        self.filter.update(&fixed_m, &noise_m2);
        self.visible_offset_m = centre_m - fixed_m;
        self.seen_at_m = centre_m;
        if !is_sure && !observation.is_split {
            // From now on the end that is seen gives the fixed point, if it did not yet.
            let fixed_along_m = across.dot(&self.filter.position_m().coords);
            if !left.is_cut {
                self.from_left_m.get_or_insert(fixed_along_m - left.along_m);
            }
            if !right.is_cut {
                self.from_right_m.get_or_insert(fixed_along_m - right.along_m);
            }
        }
        self.take_size(observation, is_sure);
        self.seen_s = now_s;
        self.seen_cycles = self.seen_cycles.saturating_add(1);
        (self.unseen_cycles, self.missed_cycles, self.hidden_s) = (0, 0, 0.0);
        self.is_in_view = true;
        if (self.filter.position_m() - self.stopped_at_m).xy().norm() > STAY_M {
            (self.stopped_at_m, self.stopped_since_s) = (self.filter.position_m(), now_s);
            self.is_left = false;
        }
        self.hinge.see(observation.footprint, now_s);
    }

    /// Whether it is a leaf on hinges that has been at rest for so long.
    pub(super) fn is_leaf_at_rest(&self, now_s: f64, for_s: f64) -> bool {
        self.hinge.rested_s(now_s).is_some_and(|rested_s| rested_s >= for_s)
    }

    /// Whether who moved it has left it, and it has not moved since.
    pub(super) fn is_left(&self) -> bool {
        self.is_left
    }

    /// Who moved it has left it.
    pub(super) fn leave(&mut self) {
        self.is_left = true;
    }

    /// Since when it has been in the place where it is.
    pub(super) fn stopped_since_s(&self) -> f64 {
        self.stopped_since_s
    }

    /// How far, from above, a place is outside of the box of what is seen of it.
    pub(super) fn gap_m(&self, place_m: &Point3<f64>) -> f64 {
        let offset_m = place_m - self.visible_centre_m();
        let Reach { down_m, up_m } = self.reach_m;
        (offset_m - up_m).sup(&(down_m - offset_m)).sup(&Vector3::zeros()).xy().norm()
    }

    /// All of it is in view: the fixed point becomes the centre, and the ends learn where it is.
    fn become_whole(&mut self, observation: &Observation, by_end_m: Option<f64>) {
        let across = observation.across;
        let centre_along_m = across.dot(&observation.centre_m.coords);
        if !self.was_whole {
            // Until now the fixed point was where the centre of the first sliver was.
            let former_m = by_end_m.unwrap_or_else(|| across.dot(&self.filter.position_m().coords));
            self.filter.shift(&(across * (centre_along_m - former_m)));
            self.stopped_at_m += across * (centre_along_m - former_m);
            self.first_position_m += across * (centre_along_m - former_m);
            (self.from_left_m, self.from_right_m) = (None, None);
            self.was_whole = true;
        }
        let learn = |known_m: Option<f64>, new_m: f64| {
            Some(known_m.map_or(new_m, |known_m| known_m + SIZE_GAIN * (new_m - known_m)))
        };
        self.from_left_m = learn(self.from_left_m, centre_along_m - observation.left.along_m);
        self.from_right_m = learn(self.from_right_m, centre_along_m - observation.right.along_m);
    }

    /// An object that is seen whole gives the size; a part of it only a lower bound.
    fn take_size(&mut self, observation: &Observation, is_sure: bool) {
        let Reach { down_m, up_m } = observation.reach_m;
        if is_sure {
            self.extent_m += SIZE_GAIN * (observation.extent_m - self.extent_m);
            self.reach_m.down_m += SIZE_GAIN * (down_m - self.reach_m.down_m);
            self.reach_m.up_m += SIZE_GAIN * (up_m - self.reach_m.up_m);
        } else if !observation.is_split {
            self.extent_m = self.extent_m.sup(&observation.extent_m);
            self.reach_m = Reach {
                down_m: self.reach_m.down_m.inf(&down_m),
                up_m: self.reach_m.up_m.sup(&up_m),
            };
        }
    }

    /// Nothing of it was seen.
    pub(super) fn miss(&mut self, is_hidden: bool, now_s: f64, is_in_view: bool) {
        self.unseen_cycles = self.unseen_cycles.saturating_add(1);
        if self.has_moved {
            // What is not seen is not seen to stand.
            self.confirmed_s = now_s;
        }
        self.is_in_view = is_in_view;
        if is_hidden {
            self.hidden_s = now_s - self.seen_s;
        } else {
            self.missed_cycles = self.missed_cycles.saturating_add(1);
        }
    }

    /// Takes the evidence that it moves: its own motion in its place, a zone on it while most of it is in observed free space, or a
    /// distance that it travelled. Free space alone may be a pose that jumped.
    pub(super) fn add_motion_evidence(&mut self, evidence: MotionEvidence, now_s: f64) {
        let MotionEvidence { in_free_space, in_zone, is_newly_occupied, moves_in_place, .. } =
            evidence;
        let travelled_m = (self.filter.position_m() - self.first_position_m).xy().norm();
        self.has_moved |= moves_in_place || (in_free_space && in_zone) || travelled_m > STAY_M;
        let leaves_its_place = self.stopped_since_s >= now_s;
        if in_zone || (self.has_moved && (is_newly_occupied || leaves_its_place)) {
            self.confirmed_s = now_s;
        }
    }

    /// For how long nothing has shown that it moves. Of one that has moved nothing may be left but what it uncovered, which stands
    /// in places of which nothing is known.
    pub(super) fn unconfirmed_s(&self, now_s: f64) -> f64 {
        now_s - self.confirmed_s
    }

    pub(super) fn end(&mut self) {
        self.is_ended = true;
    }

    pub(super) fn is_confirmed(&self) -> bool {
        self.id.is_some()
    }

    /// Whether it has not been seen of late, so that what is near is more likely another.
    pub(super) fn is_lost(&self) -> bool {
        const LOST_CYCLES: u32 = 3;
        self.unseen_cycles > LOST_CYCLES
    }

    pub(super) fn gets_id(&self, min_seen_cycles: u32) -> bool {
        self.id.is_none() && self.seen_cycles >= min_seen_cycles && !self.is_ended
    }

    /// Whether it is still tracked.
    pub(super) fn is_kept(
        &self,
        max_unseen_cycles: u32,
        max_hidden_s: f64,
        (trial_cycles, min_seen_cycles): (u32, u32),
    ) -> bool {
        let failed =
            self.id.is_none() && self.cycles >= trial_cycles && self.seen_cycles < min_seen_cycles;
        let has_left = self.unseen_cycles > 0 && !self.is_in_view;
        let is_gone = self.missed_cycles > max_unseen_cycles || self.hidden_s > max_hidden_s;
        !(self.is_ended || failed || has_left || is_gone)
    }

    /// Whether an observation is within it, or right beside.
    pub(super) fn covers(&self, observation: &Observation) -> bool {
        let offset_m = (observation.centre_m - self.visible_centre_m()).abs();
        let reach_m = self.extent_m / 2.0 + Vector3::repeat(FRAGMENT_M);
        offset_m.x <= reach_m.x && offset_m.y <= reach_m.y && self.unseen_cycles == 0
    }

    /// Whether it is expected within what is seen, or right beside.
    pub(super) fn is_within(&self, observation: &Observation) -> bool {
        let offset_m = self.visible_centre_m() - observation.centre_m;
        let Reach { down_m, up_m } = observation.reach_m;
        let is_within = |axis: usize| {
            (down_m[axis] - FRAGMENT_M..=up_m[axis] + FRAGMENT_M).contains(&offset_m[axis])
        };
        is_within(0) && is_within(1)
    }

    pub(super) fn track(&self, now_s: f64) -> Option<Track> {
        self.id.map(|id| Track {
            id,
            // What is seen is known better than the fixed point, the more so where an end is cut.
            position_m: if self.unseen_cycles == 0 {
                self.seen_at_m
            } else {
                self.visible_centre_m()
            },
            velocity_m_per_s: self.filter.velocity_m_per_s(),
            extent_m: self.extent_m,
            covariance: self.filter.covariance,
            age_s: now_s - self.born_s,
            unseen_cycles: self.unseen_cycles,
        })
    }
}

/// The measurement's covariance in the map: a mean over voxels of an edge, each uniform within it, and the
/// shape's own change; across the view far more where an end is cut.
fn noise_m2(observation: &Observation, cell_m: f64) -> Matrix3<f64> {
    let independent = observation.points.len().clamp(1, INDEPENDENT_POINTS) as f64;
    let mean_m2 = cell_m.powi(2) / 12.0 / independent + SHAPE_NOISE_M.powi(2);
    let mut noise_m2 = Matrix3::identity() * mean_m2;
    if observation.left.is_cut || observation.right.is_cut || observation.is_split {
        noise_m2 += observation.across * observation.across.transpose() * CUT_NOISE_M.powi(2);
    }
    noise_m2
}
