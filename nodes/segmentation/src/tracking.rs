//! Objects tracked over the cycles: each keeps its id while it crosses others, is hidden by them or pauses.
//!
//! An object is a point with nearly constant velocity, and a size. The point is a fixed one of the body: the centre of the
//! visible surface as long as all of it is seen, and where the view's border or a nearer object cuts it, the same point
//! computed from the end that is not cut. So the velocity does not follow the centroid's drift at the edges of the view,
//! while [`Track::position_m`] is the centre of the surface that is visible in the cycle, each pixel counting the same, or
//! the predicted one while nothing is visible.

mod clusters;
mod footprint;
mod hinge;
mod kalman;
mod left_behind;
mod observation;
#[cfg(test)]
mod tests;
mod tracked_object;

use estimation::assignment::assign;
use geometry::{Stamp, Track};
use nalgebra::{Point3, Vector3};

pub use self::observation::CycleView;

use self::clusters::clusters;
use self::left_behind::{Pair, find_left, was_with};
use self::observation::{Observation, is_hidden};
use self::tracked_object::{GATE, MotionEvidence, TrackedObject};
use crate::FreeSpaceConfig;

/// A group of fewer points starts no track: it may be noise, or the rest of an object that leaves the view.
pub(crate) const MIN_BIRTH_POINTS: usize = 4;
/// A hidden object is tracked for this long.
const MAX_HIDDEN_S: f64 = 4.0;
/// An object that nothing shows to move, neither a zone, nor, if it has moved, that it goes on or is in a place that was empty, is
/// dropped so soon.
const MAX_UNCONFIRMED_S: f64 = 1.0;
/// Cycles in which a new object must be seen often enough, or it was none.
const TRIAL_CYCLES: u32 = 3;

/// A group of points that move, as the growth found it.
#[derive(Clone, PartialEq, Debug)]
pub struct MovingGroup {
    /// Its points, ascending.
    pub points: Vec<usize>,
    /// Whether a zone of this cycle covers part of it.
    pub in_zone: bool,
    /// Whether at least half of it is in observed free space, beside no surface.
    pub in_free_space: bool,
    /// Whether any of it was not there before.
    pub is_newly_occupied: bool,
    /// Whether any of it was found to move in its place.
    pub moves_in_place: bool,
    /// Whether in at least half of its places something that moves has been for so long that it is static.
    pub has_stayed: bool,
}

/// Where a tracked object is predicted to be.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Prediction {
    /// The middle of its visible surface's box, in the map.
    pub centre_m: Point3<f64>,
    /// Half its edge lengths along the axes of the map, at most those of the largest object: a box that what the object uncovers may
    /// widen would take in more of it in each cycle.
    pub half_extent_m: Vector3<f64>,
    /// Whether it was seen in the last cycle.
    pub was_seen: bool,
}

/// What a cycle does to the tracks.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct TrackerOutput {
    /// The objects, by rising number.
    pub tracks: Vec<Track>,
    /// Points of objects that have stopped for good, and of what objects that are none had: they are background from now on.
    pub settled: Vec<usize>,
    /// Points of things that were left by who moved them.
    pub left: Vec<usize>,
}

/// Follows the objects.
#[derive(Clone, Debug)]
pub struct Tracker {
    config: FreeSpaceConfig,
    objects: Vec<TrackedObject>,
    /// Objects that were one, and of which neither has gone from the other.
    pairs: Vec<Pair>,
    next_key: u32,
    next_id: u32,
    last: Option<Stamp>,
    now_s: f64,
}

impl Tracker {
    /// A tracker that has seen nothing.
    #[must_use]
    pub fn new(config: FreeSpaceConfig) -> Self {
        Self {
            config,
            objects: Vec::new(),
            pairs: Vec::new(),
            next_key: 0,
            next_id: 0,
            last: None,
            now_s: 0.0,
        }
    }

    /// Forgets every object. Ids continue: none is used again.
    pub fn forget(&mut self) {
        *self = Self { next_id: self.next_id, ..Self::new(self.config) };
    }

    /// Predicts the objects to a moment, and says where they are expected.
    pub fn predict(&mut self, stamp: Stamp) -> Vec<Prediction> {
        /// Beyond this gap a constant velocity predicts nothing.
        const MAX_STEP_S: f64 = 2.0;
        let dt_s = self.last.map_or(0.0, |last| stamp.seconds_since(last)).clamp(0.0, MAX_STEP_S);
        self.last = Some(stamp);
        self.now_s += dt_s;
        for object in &mut self.objects {
            object.predict(dt_s, self.config.acceleration_m_per_s2);
        }
        self.objects.iter().map(|object| object.expected(&self.config)).collect()
    }

    /// Gives the groups of a cycle to the objects expected in it. Of a point it is asked, where an object begins, whether it is beside
    /// what has stopped for good.
    pub fn update(
        &mut self,
        cycle: &CycleView<'_>,
        groups: &[MovingGroup],
        is_beside_stopped: &dyn Fn(usize) -> bool,
    ) -> TrackerOutput {
        let mut group_of = vec![None; cycle.points.count()];
        for group in groups {
            for &point in &group.points {
                group_of[point] = Some(group);
            }
        }
        let evidence_of = |points: &[usize]| {
            let count = |is_it: fn(&MovingGroup) -> bool| {
                points.iter().filter(|&&point| group_of[point].is_some_and(is_it)).count()
            };
            MotionEvidence {
                in_free_space: 2 * count(|group| group.in_free_space) >= points.len(),
                in_zone: 2 * count(|group| group.in_zone) >= points.len(),
                is_newly_occupied: count(|group| group.is_newly_occupied) > 0,
                moves_in_place: 2 * count(|group| group.moves_in_place) >= points.len(),
                has_stayed: 2 * count(|group| group.has_stayed) >= points.len(),
            }
        };
        let observations = self.observations(cycle, groups);
        let before = self.objects.clone();
        let given = assign(self.objects.len(), observations.len(), GATE, |row, column| {
            self.objects[row].distance2(&observations[column])
        });
        let mut is_taken = vec![false; observations.len()];
        for (object, given) in self.objects.iter_mut().zip(&given) {
            let seen = given.map(|index| {
                is_taken[index] = true;
                &observations[index]
            });
            match seen {
                Some(observation) => {
                    object.see(observation, self.now_s, cycle.cell_m);
                    object.add_motion_evidence(evidence_of(&observation.points), self.now_s);
                }
                None => object.miss(
                    is_hidden(cycle, &object.visible_centre_m()),
                    self.now_s,
                    cycle.view.has_bearing_of(cycle.points, &object.visible_centre_m()),
                ),
            }
        }
        self.join_parts(&observations, &given);
        find_left(&mut self.pairs, &mut self.objects);
        let left = self.left(&observations, &given);
        let settled = self.settle(&observations, &given, |points| evidence_of(points).has_stayed);
        self.end();
        for (observation, _) in observations.iter().zip(&is_taken).filter(|(_, taken)| !**taken) {
            let evidence = evidence_of(&observation.points);
            self.begin(observation, cycle.cell_m, evidence, (&before, is_beside_stopped));
        }
        self.number();
        let mut tracks: Vec<Track> =
            self.objects.iter().filter_map(|object| object.track(self.now_s)).collect();
        tracks.sort_by_key(|track| track.id);
        TrackerOutput { tracks, settled, left }
    }

    /// The groups as objects: fragments joined, crossing objects parted by where they are expected.
    fn observations(&self, cycle: &CycleView<'_>, groups: &[MovingGroup]) -> Vec<Observation> {
        let expected: Vec<Point3<f64>> = self
            .objects
            .iter()
            .filter(|object| object.is_confirmed() && !object.is_lost())
            .map(TrackedObject::visible_centre_m)
            .collect();
        let groups: Vec<&[usize]> = groups.iter().map(|group| &*group.points).collect();
        let mut observations: Vec<Observation> = clusters(cycle, &groups, &expected)
            .into_iter()
            .filter_map(|cluster| Observation::of(cycle, cluster.points, cluster.is_split))
            .collect();
        for index in 0..observations.len() {
            for other in 0..observations.len() {
                if let Ok([behind, before]) = observations.get_disjoint_mut([index, other]) {
                    behind.hide_behind(before, cycle.cell_m);
                }
            }
        }
        observations
    }

    /// Gives up new objects that turn out to be parts of others: the first that a cycle shows of a body may be a hand and a
    /// foot, far apart, and the next one all of it. Two objects expected in one body would part it for ever.
    fn join_parts(&mut self, observations: &[Observation], given: &[Option<usize>]) {
        for (object, own) in self.objects.iter_mut().zip(given) {
            let is_new = !object.is_confirmed() && own.is_none();
            let mut of_others = given.iter().flatten();
            if is_new && of_others.any(|&index| object.is_within(&observations[index])) {
                object.end();
            }
        }
    }

    /// The points of what was left by who moved it.
    fn left(&self, observations: &[Observation], given: &[Option<usize>]) -> Vec<usize> {
        let seen = self.objects.iter().zip(given).filter(|(object, _)| object.is_left());
        let seen = seen.filter_map(|(_, given)| observations.get((*given)?));
        seen.filter(|seen| seen.is_no_person()).flat_map(|seen| &seen.points).copied().collect()
    }

    /// Drops the objects that have stopped for good, or that nothing shows to move, and returns which points they had.
    fn settle(
        &mut self,
        observations: &[Observation],
        given: &[Option<usize>],
        has_stayed: impl Fn(&[usize]) -> bool,
    ) -> Vec<usize> {
        let mut settled = Vec::new();
        for (object, given) in self.objects.iter_mut().zip(given) {
            let points = given.map_or(&[][..], |index| &observations[index].points);
            let rests = object.is_leaf_at_rest(self.now_s, self.config.min_background_s);
            let stays = !points.is_empty() && (rests || has_stayed(points));
            if stays || object.unconfirmed_s(self.now_s) > MAX_UNCONFIRMED_S {
                object.end();
                settled.extend(points);
            }
        }
        settled
    }

    fn end(&mut self) {
        let FreeSpaceConfig { max_unseen_cycles, min_seen_cycles, .. } = self.config;
        self.objects.retain(|object| {
            object.is_kept(max_unseen_cycles, MAX_HIDDEN_S, (TRIAL_CYCLES, min_seen_cycles))
        });
    }

    fn begin(
        &mut self,
        observation: &Observation,
        cell_m: f64,
        evidence: MotionEvidence,
        (before, is_beside_stopped): (&[TrackedObject], &dyn Fn(usize) -> bool),
    ) {
        // Else only the expectation of another object claims it: what that uncovers is none.
        let shows_motion = evidence.is_newly_occupied || evidence.in_zone;
        let fragment = observation.is_split
            || observation.points.len() < MIN_BIRTH_POINTS
            || self.objects.iter().any(|object| object.covers(observation));
        if shows_motion && !fragment && self.objects.len() < self.config.max_tracks {
            let key = self.next_key;
            self.next_key = key.wrapping_add(1);
            let companions = before.iter().filter(|object| was_with(object, &observation.centre_m));
            self.pairs.extend(companions.map(|object| Pair([object.key, key])));
            let mut object = TrackedObject::new(key, observation, self.now_s, cell_m);
            object.add_motion_evidence(evidence, self.now_s);
            if observation.points.iter().any(|point| is_beside_stopped(*point)) {
                // Another side of a thing that was left, which comes into view.
                object.leave();
            }
            self.objects.push(object);
        }
    }

    /// Numbers the objects that have passed their trial.
    fn number(&mut self) {
        for object in &mut self.objects {
            if object.gets_id(self.config.min_seen_cycles) {
                object.id = Some(self.next_id);
                self.next_id = self.next_id.wrapping_add(1);
            }
        }
    }
}
