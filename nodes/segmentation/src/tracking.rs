//! Objects followed over the cycles: each keeps its number while it crosses others, stands behind them or
//! pauses.
//!
//! An object is a point with nearly constant velocity, and a size. The point is a fixed one of the body: the
//! centre of the visible surface as long as all of it is seen, and where the view's border or a nearer object
//! cuts it, the same point told by the end that is not cut. So the velocity does not follow the centroid's
//! drift at the edges of the view, while [`Track::position_m`] is the centre of the surface that is visible in
//! the cycle, each pixel counting the same, or where the filter expects it while nothing is.

mod clusters;
mod followed;
mod kalman;
mod observation;
#[cfg(test)]
mod tests;

use estimation::assignment::assign;
use geometry::{Stamp, Track};
use nalgebra::{Point3, Vector3};

pub use self::observation::CycleCloud;

use self::clusters::clusters;
use self::followed::{Followed, GATE};
use self::observation::{Observation, is_hidden};
use crate::FreeSpaceConfig;
use crate::view::has_bearing_of;

/// A group of fewer points starts no track: it may be noise, or the rest of an object that goes.
const MIN_BIRTH_POINTS: usize = 4;
/// What moves is followed through a shadow for this long.
const MAX_HIDDEN_S: f64 = 4.0;
/// An object that nothing shows to have moved, neither a zone on it where free space was seen nor a way that
/// it went, is given up so soon after its last zone.
const MAX_DOUBT_S: f64 = 1.0;
/// Cycles in which a new object must be seen often enough, or it was none.
const TRIAL_CYCLES: u32 = 3;

/// A group of points that move, as the growth found it.
#[derive(Clone, PartialEq, Debug)]
pub struct MovingGroup {
    /// Its points, ascending.
    pub points: Vec<usize>,
    /// Whether a zone of this cycle lies on it.
    pub in_zone: bool,
    /// Whether at least half of it stands where free space was seen, beside no surface.
    pub came: bool,
}

/// Where a followed object is expected.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Expected {
    /// The middle of its visible surface's box, in the map.
    pub centre_m: Point3<f64>,
    /// Half its edge lengths along the axes of the map.
    pub half_extent_m: Vector3<f64>,
    /// Whether points in places of which nothing is known may belong to it.
    pub may_be_new: bool,
}

/// What a cycle does to the tracks.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Followings {
    /// The objects, by rising number.
    pub tracks: Vec<Track>,
    /// Points of objects that have stopped for good: they are background from now on.
    pub settled: Vec<usize>,
}

/// Follows the objects.
#[derive(Clone, Debug)]
pub struct Tracker {
    config: FreeSpaceConfig,
    followed: Vec<Followed>,
    next_id: u32,
    last: Option<Stamp>,
    now_s: f64,
}

impl Tracker {
    /// A tracker that has seen nothing.
    #[must_use]
    pub fn new(config: FreeSpaceConfig) -> Self {
        Self { config, followed: Vec::new(), next_id: 0, last: None, now_s: 0.0 }
    }

    /// Forgets every object. Numbers go on: none is used again.
    pub fn forget(&mut self) {
        *self = Self { next_id: self.next_id, ..Self::new(self.config) };
    }

    /// Predicts the objects to a moment, and says where they are expected.
    pub fn expect(&mut self, stamp: Stamp) -> Vec<Expected> {
        /// A gap beyond this ends what a constant velocity can tell.
        const MAX_STEP_S: f64 = 2.0;
        let dt_s = self.last.map_or(0.0, |last| stamp.seconds_since(last)).clamp(0.0, MAX_STEP_S);
        self.last = Some(stamp);
        self.now_s += dt_s;
        for followed in &mut self.followed {
            followed.predict(dt_s, self.config.acceleration_m_per_s2);
        }
        self.followed.iter().map(Followed::expected).collect()
    }

    /// Gives the groups of a cycle to the objects expected in it.
    pub fn follow(&mut self, cloud: &CycleCloud<'_>, groups: &[MovingGroup]) -> Followings {
        let (mut in_zone, mut came) = (vec![false; cloud.points_in_map.len()], Vec::new());
        came.resize(in_zone.len(), false);
        for group in groups {
            for &point in &group.points {
                in_zone[point] = group.in_zone;
                came[point] = group.came;
            }
        }
        let most = |of: &[bool], points: &[usize]| {
            2 * points.iter().filter(|&&point| of[point]).count() >= points.len()
        };
        let observations = self.observations(cloud, groups);
        let given = assign(self.followed.len(), observations.len(), GATE, |row, column| {
            self.followed[row].distance2(&observations[column])
        });
        let mut is_taken = vec![false; observations.len()];
        for (followed, given) in self.followed.iter_mut().zip(&given) {
            let seen = given.map(|index| {
                is_taken[index] = true;
                &observations[index]
            });
            match seen {
                Some(observation) => {
                    let points = &observation.points;
                    let (came, in_zone) = (most(&came, points), most(&in_zone, points));
                    followed.see(observation, self.now_s, cloud.cell_m);
                    followed.believe(came, in_zone, self.now_s);
                }
                None => followed.miss(
                    is_hidden(cloud, &followed.visible_centre_m()),
                    self.now_s,
                    has_bearing_of(&cloud.view, cloud.cycle, &followed.visible_centre_m()),
                ),
            }
        }
        self.join_parts(&observations, &given);
        let settled = self.settle(&observations, &given);
        self.end();
        for (observation, _) in observations.iter().zip(&is_taken).filter(|(_, taken)| !**taken) {
            let (came, in_zone) =
                (most(&came, &observation.points), most(&in_zone, &observation.points));
            self.begin(observation, cloud.cell_m, came, in_zone);
        }
        self.number();
        let mut tracks: Vec<Track> =
            self.followed.iter().filter_map(|followed| followed.track(self.now_s)).collect();
        tracks.sort_by_key(|track| track.id);
        Followings { tracks, settled }
    }

    /// The groups as objects: fragments joined, crossing objects parted by where they are expected.
    fn observations(&self, cloud: &CycleCloud<'_>, groups: &[MovingGroup]) -> Vec<Observation> {
        let expected: Vec<Point3<f64>> = self
            .followed
            .iter()
            .filter(|followed| followed.is_confirmed() && !followed.is_lost())
            .map(Followed::visible_centre_m)
            .collect();
        let groups: Vec<&[usize]> = groups.iter().map(|group| &*group.points).collect();
        let mut observations: Vec<Observation> = clusters(cloud, &groups, &expected)
            .into_iter()
            .filter_map(|cluster| Observation::of(cloud, cluster.points, cluster.is_split))
            .collect();
        for index in 0..observations.len() {
            for other in 0..observations.len() {
                if let Ok([behind, before]) = observations.get_disjoint_mut([index, other]) {
                    behind.hide_behind(before, cloud.cell_m);
                }
            }
        }
        observations
    }

    /// Gives up new objects that turn out to be parts of others: the first that a cycle shows of a body may be a hand and a
    /// foot, far apart, and the next one all of it. Two objects expected in one body would part it for ever.
    fn join_parts(&mut self, observations: &[Observation], given: &[Option<usize>]) {
        for (followed, own) in self.followed.iter_mut().zip(given) {
            let is_new = !followed.is_confirmed() && own.is_none();
            let mut of_others = given.iter().flatten();
            if is_new && of_others.any(|&index| followed.lies_within(&observations[index])) {
                followed.end();
            }
        }
    }

    /// Gives up the objects that stay in their places for too long, and says which points they had.
    fn settle(&mut self, observations: &[Observation], given: &[Option<usize>]) -> Vec<usize> {
        let mut settled = Vec::new();
        for (followed, given) in self.followed.iter_mut().zip(given) {
            let stays = followed.stayed_s(self.now_s) > self.config.max_stop_s;
            if stays || followed.doubted_s(self.now_s) > MAX_DOUBT_S {
                followed.end();
                if let Some(index) = given {
                    settled.extend(&observations[*index].points);
                }
            }
        }
        settled
    }

    fn end(&mut self) {
        let FreeSpaceConfig { max_unseen_cycles, min_seen_cycles, .. } = self.config;
        self.followed.retain(|followed| {
            followed.lives(max_unseen_cycles, MAX_HIDDEN_S, (TRIAL_CYCLES, min_seen_cycles))
        });
    }

    fn begin(&mut self, observation: &Observation, cell_m: f64, came: bool, in_zone: bool) {
        let fragment = observation.is_split
            || observation.points.len() < MIN_BIRTH_POINTS
            || self.followed.iter().any(|followed| followed.covers(observation));
        if !fragment && self.followed.len() < self.config.max_tracks {
            let mut followed = Followed::new(observation, self.now_s, cell_m);
            followed.believe(came, in_zone, self.now_s);
            self.followed.push(followed);
        }
    }

    /// Numbers the objects that have passed their trial.
    fn number(&mut self) {
        for followed in &mut self.followed {
            if followed.earns_number(self.config.min_seen_cycles) {
                followed.id = Some(self.next_id);
                self.next_id = self.next_id.wrapping_add(1);
            }
        }
    }
}
