//! The keyframes that a loop may be closed with, or a lost camera may be at.
//!
//! After Mur-Artal and Tardos 2014, "Fast relocalisation and loop closing in keyframe-based SLAM": what looks alike in one
//! place only by chance does so in one keyframe; the right place does so in several that see the same landmarks, and
//! again in the next keyframe.

use std::collections::{BTreeMap, BTreeSet};

use geometry::{ParameterError, parameter};
use serde::{Deserialize, Serialize};

use super::{PlaceDatabase, Score};
use crate::feature::points::Descriptor;
use crate::map::{KeyframeId, Map};

/// Parameters of the choice of candidates.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CandidateConfig {
    /// A keyframe with fewer votes is no candidate.
    pub least_votes: u32,
    /// A candidate has at least this share of the most votes.
    pub votes_share: f64,
    /// The sum over those that see the same landmarks is at least this share of the largest sum.
    pub group_share: f64,
    /// This many of those that see most of the same landmarks make a group.
    pub group_size: usize,
    /// Keyframes that see at least this many of the same landmarks are the same place: no loop.
    pub neighbour_shared: u32,
    /// This many keyframes in a row must have candidates that belong together.
    pub consistent: u32,
}

impl Default for CandidateConfig {
    fn default() -> Self {
        Self {
            // Images of other places have up to 48 votes of a thousand corners, by the example `place_recognition`.
            least_votes: 50,
            // ORB-SLAM: the most common words times 0.8, the best sum times 0.75, ten neighbours, edges of 15, three in a row.
            votes_share: 0.8,
            group_share: 0.75,
            group_size: 10,
            neighbour_shared: 15,
            consistent: 3,
        }
    }
}

impl CandidateConfig {
    /// Checks every parameter.
    ///
    /// # Errors
    /// The first parameter out of its range, with its name, its value and what is accepted.
    pub fn validate(&self) -> Result<(), ParameterError> {
        parameter::between("votes_share", self.votes_share, 0.0, 1.0)?;
        parameter::between("group_share", self.group_share, 0.0, 1.0)?;
        parameter::positive("consistent", f64::from(self.consistent))
    }
}

/// A keyframe that may show the same place.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Candidate {
    /// The one of its group that looks most alike.
    pub keyframe: KeyframeId,
    /// Its own score.
    pub score: f64,
    /// The sum of the scores of its group.
    pub group_score: f64,
}

/// The keyframes that a keyframe of the map may close a loop with: not those that see the same landmarks, and none that
/// looks less alike than the least alike of these. The best first.
#[must_use]
pub fn loop_candidates(
    database: &PlaceDatabase,
    map: &Map,
    keyframe: KeyframeId,
    config: &CandidateConfig,
) -> Vec<Candidate> {
    let Some(of_keyframe) = map.keyframes().get(keyframe) else { return Vec::new() };
    let corners: Vec<Descriptor> =
        of_keyframe.frame().corners.iter().map(|corner| corner.descriptor).collect();
    let scores = database.query(&corners);
    // A keyframe that sees any of the same landmarks is no other place; one that sees enough of them shows how alike the same place looks.
    let is_same = |id: KeyframeId| id == keyframe || of_keyframe.covisible().contains_key(&id);
    let near = |id: KeyframeId| {
        let shared = of_keyframe.covisible().get(&id);
        shared.is_some_and(|shared| shared.landmarks() >= config.neighbour_shared)
    };
    let least = scores.iter().filter(|score| near(score.keyframe)).map(|score| score.score);
    let least = least.fold(f64::INFINITY, f64::min);
    let least = if least.is_finite() { least } else { 0.0 };
    let scores = scores.into_iter();
    let scores = scores.filter(|score| !is_same(score.keyframe) && score.score >= least);
    grouped(scores.collect(), map, config)
}

/// The keyframes that a lost camera with these corners may be at. The best first.
#[must_use]
pub fn lost_candidates(
    database: &PlaceDatabase,
    map: &Map,
    corners: &[Descriptor],
    config: &CandidateConfig,
) -> Vec<Candidate> {
    grouped(database.query(corners), map, config)
}

/// One keyframe of each group that has enough in sum.
fn grouped(mut scores: Vec<Score>, map: &Map, config: &CandidateConfig) -> Vec<Candidate> {
    let most = scores.iter().map(|score| score.votes).max().unwrap_or_default();
    let least = config.votes_share * f64::from(most);
    scores.retain(|score| {
        score.votes >= config.least_votes
            && f64::from(score.votes) >= least
            && map.keyframes().contains(score.keyframe)
    });
    let by_id: BTreeMap<KeyframeId, Score> =
        scores.iter().map(|score| (score.keyframe, *score)).collect();
    let mut groups: Vec<Candidate> = Vec::new();
    for score in &scores {
        let near = map.neighbours(score.keyframe, 1).into_iter().take(config.group_size);
        let near = near.filter_map(|(id, _)| by_id.get(&id));
        let (mut best, mut sum) = (*score, score.score);
        for other in near {
            sum += other.score;
            if other.score > best.score {
                best = *other;
            }
        }
        groups.push(Candidate { keyframe: best.keyframe, score: best.score, group_score: sum });
    }
    let largest = groups.iter().map(|group| group.group_score).fold(0.0, f64::max);
    groups.retain(|group| group.group_score >= config.group_share * largest);
    groups.sort_by(|one, other| other.group_score.total_cmp(&one.group_score));
    let mut seen = BTreeSet::new();
    groups.retain(|group| seen.insert(group.keyframe));
    groups
}

/// Which candidates have been so in the keyframes before, too.
#[derive(Clone, Debug, Default)]
pub struct Consistency {
    /// The groups of the last keyframe's candidates, and for how many keyframes in a row.
    groups: Vec<(BTreeSet<KeyframeId>, u32)>,
}

impl Consistency {
    /// Of a keyframe's candidates those whose group shares one of the group of a candidate of the keyframe before, and so
    /// on, for long enough.
    pub fn filter(
        &mut self,
        candidates: &[Candidate],
        map: &Map,
        config: &CandidateConfig,
    ) -> Vec<Candidate> {
        let mut consistent = Vec::new();
        let mut groups = Vec::new();
        for candidate in candidates {
            let near = map.neighbours(candidate.keyframe, 1);
            let group: BTreeSet<KeyframeId> =
                near.into_iter().map(|(id, _)| id).chain([candidate.keyframe]).collect();
            let before = self.groups.iter().filter(|(before, _)| !before.is_disjoint(&group));
            let row = 1 + before.map(|(_, row)| *row).max().unwrap_or_default();
            if row >= config.consistent {
                consistent.push(*candidate);
            }
            groups.push((group, row));
        }
        self.groups = groups;
        consistent
    }
}
