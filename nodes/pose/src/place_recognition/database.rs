//! Which keyframes have descriptors like those of a frame, and how much that says.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::index::{Index, Scratch};
use crate::feature::lines::LineDescriptor;
use crate::feature::points::Descriptor;
use crate::map::KeyframeId;
use crate::solve::ConfigError;

/// Parameters of a [`PlaceDatabase`].
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PlaceConfig {
    /// Descriptors that differ in more bits are not of the same thing.
    pub max_distance: u32,
    /// Of all descriptors that share a word, so many are looked at.
    pub max_alike: usize,
}

impl Default for PlaceConfig {
    fn default() -> Self {
        Self {
            // Stricter than for matching (64), where the neighbourhood of the image helps: the strict threshold of Mur-Artal et
            // al. 2015.
            max_distance: 50,
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
    pub fn validate(&self) -> Result<(), ConfigError> {
        let distance = f64::from(self.max_distance);
        ConfigError::unless(distance <= 256.0, "max_distance", "in 0 .. 256", distance)?;
        ConfigError::unless_positive("max_alike", self.max_alike as f64)
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
        let keyframes = self.numbers.len() as f64;
        let mut sums = vec![(0_u32, 0.0_f64); self.owners.len()];
        let (mut scratch, mut found) = (Scratch::default(), Vec::new());
        let mut like = Vec::new();
        for bits in all {
            let PlaceConfig { max_distance, max_alike } = self.config;
            self.index.search(&bits, max_distance, max_alike, &mut scratch, &mut found);
            like.clear();
            like.extend(found.iter().map(|found| found.owner));
            // Each keyframe has one vote of a feature.
            like.sort_unstable();
            like.dedup();
            like.retain(|owner| self.owners[*owner as usize].is_some());
            let weight = ((keyframes + 1.0) / like.len().max(1) as f64).ln();
            for owner in &like {
                let (votes, score) = &mut sums[*owner as usize];
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
}
