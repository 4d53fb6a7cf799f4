//! Which keyframes have descriptors like those of a frame, and how much that says.

use std::collections::BTreeMap;

use geometry::{ParameterError, parameter};
use serde::{Deserialize, Serialize};

use super::index::{Found, Index, Scratch};
use crate::feature::lines::LineDescriptor;
use crate::feature::points::Descriptor;
use crate::map::KeyframeId;

/// Parameters of a [`PlaceDatabase`].
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PlaceConfig {
    /// Descriptors that differ in more bits are not of the same thing.
    pub max_distance: u32,
    /// Of a keyframe's descriptors the nearest is nearer than this share of the distance of the next: it is not only like
    /// many.
    pub max_ratio: f64,
    /// Of all descriptors that share a word, so many are looked at.
    pub max_alike: usize,
}

impl Default for PlaceConfig {
    fn default() -> Self {
        Self {
            // Stricter than for matching (64), where the neighbourhood of the image helps: the strict threshold of Mur-Artal et
            // al. 2015.
            max_distance: 50,
            // As for matching (Lowe 2004, section 7.1). Without it any two images of rooms have hundreds of votes.
            max_ratio: 0.8,
            // A tenth of a second for a thousand corners in a map of any size, at 5 ns a comparison and 16 words.
            max_alike: 1000,
        }
    }
}

impl PlaceConfig {
    /// Checks every parameter.
    ///
    /// # Errors
    /// The first parameter out of its range, with its name, its value and what is accepted.
    pub fn validate(&self) -> Result<(), ParameterError> {
        let distance = f64::from(self.max_distance);
        parameter::check("max_distance", "in 0 .. 256", distance, distance <= 256.0)?;
        parameter::between("max_ratio", self.max_ratio, 0.0, 1.0)?;
        parameter::positive("max_alike", self.max_alike as f64)
    }
}

/// The looks of all keyframes.
#[derive(Clone, Debug)]
pub struct PlaceDatabase {
    config: PlaceConfig,
    index: Index,
    /// Whose the descriptors are; `None` for a keyframe that is gone.
    owners: Vec<Option<KeyframeId>>,
    numbers: BTreeMap<KeyframeId, u32>,
    /// Descriptors of keyframes that are gone.
    stale: usize,
    counts: Vec<usize>,
}

/// How much a keyframe looks like a frame.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Score {
    /// The keyframe.
    pub keyframe: KeyframeId,
    /// How many of the frame's features look like one of the keyframe's.
    pub votes: u32,
    /// The votes, each weighed by how few keyframes have such a feature (inverse document frequency), over the number of
    /// the frame's features: what all are like says nothing.
    pub score: f64,
}

impl PlaceDatabase {
    /// A database of nothing.
    #[must_use]
    pub fn new(config: PlaceConfig) -> Self {
        Self {
            config,
            index: Index::new(),
            owners: Vec::new(),
            numbers: BTreeMap::new(),
            stale: 0,
            counts: Vec::new(),
        }
    }

    /// How many keyframes there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.numbers.len()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.numbers.is_empty()
    }

    /// Takes in what a keyframe looks like. One that is there already stays as it is.
    pub fn insert(&mut self, keyframe: KeyframeId, corners: impl IntoIterator<Item = Descriptor>) {
        self.insert_bits(keyframe, corners.into_iter().map(|descriptor| descriptor.0));
    }

    /// The same for the segments of a keyframe: a database holds either corners or segments.
    pub fn insert_lines(
        &mut self,
        keyframe: KeyframeId,
        segments: impl IntoIterator<Item = LineDescriptor>,
    ) {
        self.insert_bits(keyframe, segments.into_iter().map(|descriptor| descriptor.0));
    }

    fn insert_bits(&mut self, keyframe: KeyframeId, all: impl Iterator<Item = [u64; 4]>) {
        let Ok(number) = u32::try_from(self.owners.len()) else { return };
        if self.numbers.contains_key(&keyframe) {
            return;
        }
        let before = self.index.len();
        for bits in all {
            self.index.insert(&bits, number);
        }
        self.owners.push(Some(keyframe));
        self.counts.push(self.index.len() - before);
        self.numbers.insert(keyframe, number);
    }

    /// Forgets a keyframe.
    pub fn remove(&mut self, keyframe: KeyframeId) {
        let Some(number) = self.numbers.remove(&keyframe) else { return };
        self.owners[number as usize] = None;
        self.stale += self.counts[number as usize];
        // Half of it is of no use: it is built anew, as seldom as it was filled.
        if 2 * self.stale > self.index.len() {
            let owners = &self.owners;
            self.index.retain(|owner| owners[owner as usize].is_some());
            self.stale = 0;
        }
    }

    /// How much the keyframes look like a frame with these corners: the most alike first, of equal ones the newest.
    /// Keyframes that have nothing alike are left out.
    #[must_use]
    pub fn query(&self, corners: &[Descriptor]) -> Vec<Score> {
        self.query_bits(corners.iter().map(|descriptor| descriptor.0))
    }

    /// The same by segments.
    #[must_use]
    pub fn query_lines(&self, segments: &[LineDescriptor]) -> Vec<Score> {
        self.query_bits(segments.iter().map(|descriptor| descriptor.0))
    }

    fn query_bits(&self, all: impl ExactSizeIterator<Item = [u64; 4]>) -> Vec<Score> {
        let features = all.len().max(1) as f64;
        let mut votes = self.votes(all);
        // Each of the keyframes' features is one of the frame's only: the most alike, of equal ones the first.
        votes.sort_unstable_by_key(|vote| (vote.entry, vote.distance, vote.feature));
        votes.dedup_by_key(|vote| vote.entry);
        votes.sort_unstable_by_key(|vote| (vote.feature, vote.owner));
        let keyframes = self.numbers.len() as f64;
        let mut sums = vec![(0_u32, 0.0_f64); self.owners.len()];
        for like in votes.chunk_by(|one, other| one.feature == other.feature) {
            let weight = ((keyframes + 1.0) / like.len() as f64).ln();
            for vote in like {
                let (votes, score) = &mut sums[vote.owner as usize];
                *votes += 1;
                *score += weight / features;
            }
        }
        let scores = self.owners.iter().zip(sums).filter(|(_, (votes, _))| *votes > 0);
        let mut scores: Vec<Score> = scores
            .filter_map(|(owner, (votes, score))| Some(Score { keyframe: (*owner)?, votes, score }))
            .collect();
        // Newest first, and then stably by score.
        scores.reverse();
        scores.sort_by(|one, other| other.score.total_cmp(&one.score));
        scores
    }
    /// Which keyframe has what looks like which feature, and like no other of its own.
    fn votes(&self, all: impl Iterator<Item = [u64; 4]>) -> Vec<Vote> {
        let PlaceConfig { max_distance, max_ratio, max_alike } = self.config;
        let (mut scratch, mut found, mut votes) = (Scratch::default(), Vec::new(), Vec::new());
        // The next nearest must be looked for farther off.
        let reach = (f64::from(max_distance) / max_ratio.max(0.5)).ceil() as u32;
        for (feature, bits) in (0_u32..).zip(all) {
            self.index.search(&bits, reach, max_alike, &mut scratch, &mut found);
            found.retain(|found| self.owners[found.owner as usize].is_some());
            found.sort_unstable_by_key(|found| (found.owner, found.distance, found.entry));
            for of_owner in found.chunk_by(|one, other| one.owner == other.owner) {
                let Some((nearest, others)) = of_owner.split_first() else { continue };
                let is_clear = others.first().is_none_or(|next| {
                    f64::from(nearest.distance) < max_ratio * f64::from(next.distance)
                });
                if nearest.distance <= max_distance && is_clear {
                    let Found { owner, entry, distance } = *nearest;
                    votes.push(Vote { feature, owner, entry, distance });
                }
            }
        }
        votes
    }
}

/// A keyframe has what looks like a feature.
#[derive(Clone, Copy, Debug)]
struct Vote {
    feature: u32,
    owner: u32,
    entry: u32,
    distance: u32,
}
