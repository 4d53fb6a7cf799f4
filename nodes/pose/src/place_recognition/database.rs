//! Which keyframes have descriptors like those of a frame, and how much that says.

use std::collections::BTreeMap;
use std::sync::Arc;

use geometry::{ParameterError, parameter};
use serde::{Deserialize, Serialize};

use super::index::{Bits, ENTRY_BYTES, Index, Scratch, distance};
use crate::feature::lines::LineDescriptor;
use crate::feature::points::Descriptor;
use crate::frame::Frame;
use crate::map::KeyframeId;

/// One in this many entries, at most, is of a keyframe that is gone. Beyond that the index is rebuilt: three entries are added
/// again for each that went.
const ONE_STALE_IN: usize = 4;
/// The memory of a descriptor in a database besides itself: its index entries, and its keyframe.
pub(crate) const BYTES_OF_LOOK: usize =
    (ENTRY_BYTES + size_of::<u32>()) * ONE_STALE_IN / (ONE_STALE_IN - 1);

/// Parameters of a [`PlaceDatabase`].
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PlaceConfig {
    /// Descriptors that differ in more bits are not of the same thing.
    pub max_distance: u32,
    /// Of a keyframe's descriptors the nearest is nearer than this share of the distance of the next: it is not only like
    /// many.
    pub max_ratio: f64,
    /// Of all descriptors that have the same value of a word, this many are looked at.
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
            // A tenth of a second for a thousand corners in a map of any size, at 6 ns a comparison, 6 words and 17 values of
            // each.
            max_alike: 150,
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

/// The looks of all keyframes. Their descriptors are those of their frames, which the map has anyway.
#[derive(Clone, Debug)]
pub struct PlaceDatabase {
    config: PlaceConfig,
    index: Index,
    /// Whose each entry of the index is: an index of `looks`.
    owners: Vec<u32>,
    /// By the order they came in; `None` for a keyframe that is gone.
    looks: Vec<Option<Looks>>,
    numbers: BTreeMap<KeyframeId, u32>,
    /// Entries of keyframes that are gone.
    stale: usize,
}

/// The descriptors of a keyframe.
#[derive(Clone, Debug)]
struct Looks {
    keyframe: KeyframeId,
    frame: Arc<Frame>,
    kind: Kind,
    /// The entry of its first feature; those of the others follow.
    first_entry: u32,
}

/// Which features of a frame are meant.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Kind {
    Corners,
    Segments,
}

impl Looks {
    fn len(&self) -> usize {
        match self.kind {
            Kind::Corners => self.frame.corners.len(),
            Kind::Segments => self.frame.lines.len(),
        }
    }

    fn bits(&self, feature: usize) -> Option<&Bits> {
        match self.kind {
            Kind::Corners => self.frame.corners.get(feature).map(|corner| &corner.descriptor.0),
            Kind::Segments => self.frame.lines.get(feature).map(|line| &line.descriptor.0),
        }
    }
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
            looks: Vec::new(),
            numbers: BTreeMap::new(),
            stale: 0,
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

    /// Takes in what the corners of a keyframe look like. One that is there already stays as it is.
    pub fn insert(&mut self, keyframe: KeyframeId, frame: &Arc<Frame>) {
        self.insert_features(keyframe, Arc::clone(frame), Kind::Corners);
    }

    /// The same for the segments of a keyframe: a database holds either corners or segments.
    pub fn insert_lines(&mut self, keyframe: KeyframeId, frame: &Arc<Frame>) {
        self.insert_features(keyframe, Arc::clone(frame), Kind::Segments);
    }

    fn insert_features(&mut self, keyframe: KeyframeId, frame: Arc<Frame>, kind: Kind) {
        let entries = (u32::try_from(self.looks.len()), u32::try_from(self.index.len()));
        let (Ok(number), Ok(first_entry)) = entries else { return };
        if self.numbers.contains_key(&keyframe) {
            return;
        }
        let looks = Looks { keyframe, frame, kind, first_entry };
        for bits in (0..looks.len()).filter_map(|feature| looks.bits(feature)) {
            self.index.insert(bits);
        }
        self.owners.resize(self.index.len(), number);
        self.looks.push(Some(looks));
        self.numbers.insert(keyframe, number);
    }

    /// Forgets a keyframe.
    pub fn remove(&mut self, keyframe: KeyframeId) {
        let Some(number) = self.numbers.remove(&keyframe) else { return };
        let gone = self.looks.get_mut(number as usize).and_then(Option::take);
        self.stale += gone.map_or(0, |gone| gone.len());
        if ONE_STALE_IN * self.stale > self.index.len() {
            self.rebuild();
        }
    }

    fn rebuild(&mut self) {
        let looks = std::mem::take(&mut self.looks);
        self.index.clear();
        self.owners.clear();
        self.numbers.clear();
        self.stale = 0;
        for Looks { keyframe, frame, kind, .. } in looks.into_iter().flatten() {
            self.insert_features(keyframe, frame, kind);
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

    fn query_bits(&self, all: impl ExactSizeIterator<Item = Bits>) -> Vec<Score> {
        let features = all.len().max(1) as f64;
        let mut votes = self.votes(all);
        // Each of the keyframes' features is one of the frame's only: the most alike, of equal ones the first.
        votes.sort_unstable_by_key(|vote| (vote.entry, vote.distance, vote.feature));
        votes.dedup_by_key(|vote| vote.entry);
        votes.sort_unstable_by_key(|vote| (vote.feature, vote.owner));
        let keyframes = self.numbers.len() as f64;
        let mut sums = vec![(0_u32, 0.0_f64); self.looks.len()];
        for like in votes.chunk_by(|one, other| one.feature == other.feature) {
            let weight = ((keyframes + 1.0) / like.len() as f64).ln();
            for vote in like {
                let (votes, score) = &mut sums[vote.owner as usize];
                *votes += 1;
                *score += weight / features;
            }
        }
        let scores = self.looks.iter().zip(sums).filter(|(_, (votes, _))| *votes > 0);
        let mut scores: Vec<Score> = scores
            .filter_map(|(looks, (votes, score))| {
                Some(Score { keyframe: looks.as_ref()?.keyframe, votes, score })
            })
            .collect();
        // Newest first, and then stably by score.
        scores.reverse();
        scores.sort_by(|one, other| other.score.total_cmp(&one.score));
        scores
    }

    /// Which keyframe has what looks like which feature, and like no other of its own.
    fn votes(&self, all: impl Iterator<Item = Bits>) -> Vec<Vote> {
        let PlaceConfig { max_distance, max_ratio, max_alike } = self.config;
        let (mut scratch, mut found, mut votes) = (Scratch::default(), Vec::new(), Vec::new());
        // The next nearest must be looked for farther off.
        let reach = (f64::from(max_distance) / max_ratio.max(0.5)).ceil() as u32;
        for (feature, bits) in (0_u32..).zip(all) {
            found.clear();
            self.index.search(&bits, max_alike, &mut scratch, |entry| {
                found.extend(self.compared(&bits, entry).filter(|found| found.distance <= reach));
            });
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

    /// How near an entry is; `None` when its keyframe is gone.
    fn compared(&self, bits: &Bits, entry: u32) -> Option<Found> {
        let owner = *self.owners.get(entry as usize)?;
        let looks = self.looks.get(owner as usize)?.as_ref()?;
        let other = looks.bits((entry - looks.first_entry) as usize)?;
        Some(Found { owner, entry, distance: distance(bits, other) })
    }
}

/// A descriptor of a keyframe that may be nearly the same as one that was looked for.
#[derive(Clone, Copy, Debug)]
struct Found {
    owner: u32,
    entry: u32,
    distance: u32,
}

/// A keyframe has what looks like a feature.
#[derive(Clone, Copy, Debug)]
struct Vote {
    feature: u32,
    owner: u32,
    entry: u32,
    distance: u32,
}
