//! The invariants of a map.

use std::collections::BTreeMap;

use super::{Id, Keyframe, KeyframeId, Landmark, Map, MapLine, MapPoint, Shared};

/// Something that cannot be in a map.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
pub enum Inconsistency {
    /// A feature is a landmark that does not know of it.
    #[error("a feature of keyframe {0:?} is a landmark that is not there, or does not refer to it")]
    OneSidedFeature(KeyframeId),
    /// A landmark is seen by a keyframe that does not know of it.
    #[error("a landmark is seen by keyframe {0:?}, which is not there, or does not refer to it")]
    OneSidedSighting(KeyframeId),
    /// No keyframe sees a landmark.
    #[error("a landmark is seen by no keyframe")]
    Unseen,
    /// The count of shared landmarks of two keyframes is wrong.
    #[error("keyframe {0:?} has the wrong count of what it sees with others")]
    Covisibility(KeyframeId),
    /// There is not one root, or it is not the one that is remembered.
    #[error("there are {0} keyframes without a parent, or not the right one")]
    Roots(usize),
    /// Parent and child do not know of each other.
    #[error("keyframe {0:?} and its parent or a child do not refer to each other")]
    OneSidedBranch(KeyframeId),
    /// A keyframe is not connected to the root.
    #[error("{reached} of {keyframes} keyframes are connected to the root: there is a cycle")]
    Cycle {
        /// Keyframes that do.
        reached: usize,
        /// All keyframes.
        keyframes: usize,
    },
    /// A loop ends nowhere, or its ends do not know of each other.
    #[error("a loop of keyframe {0:?} ends nowhere, or on one side only")]
    OneSidedLoop(KeyframeId),
    /// The newest keyframe is not the one that is remembered.
    #[error("another keyframe is the newest")]
    Newest,
}

impl Map {
    /// Checks all that must hold: every sighting is mutual, covisibility is what is seen in common, the spanning tree is
    /// one. Takes time in proportion to the whole map: for tests, and for a map that comes from a file.
    ///
    /// # Errors
    /// The first thing that does not hold.
    pub fn check(&self) -> Result<(), Inconsistency> {
        let mut shared = BTreeMap::<KeyframeId, BTreeMap<KeyframeId, Shared>>::new();
        self.check_landmarks::<MapPoint>(&mut shared)?;
        self.check_landmarks::<MapLine>(&mut shared)?;
        for (id, keyframe) in self.keyframes.iter() {
            self.check_features::<MapPoint>(id, keyframe)?;
            self.check_features::<MapLine>(id, keyframe)?;
            if shared.remove(&id).unwrap_or_default() != keyframe.covisible {
                return Err(Inconsistency::Covisibility(id));
            }
            let is_mutual = keyframe.loops.keys().all(|other| {
                self.keyframes.get(*other).is_some_and(|other| other.loops.contains_key(&id))
            });
            if !is_mutual {
                return Err(Inconsistency::OneSidedLoop(id));
            }
        }
        self.check_tree()
    }

    fn check_landmarks<L: Landmark>(
        &self,
        shared: &mut BTreeMap<KeyframeId, BTreeMap<KeyframeId, Shared>>,
    ) -> Result<(), Inconsistency> {
        for (id, landmark) in L::arena(self).iter() {
            let sightings = landmark.sightings();
            if sightings.count() == 0 {
                return Err(Inconsistency::Unseen);
            }
            for (keyframe, feature) in sightings.iter() {
                let found = self.keyframes.get(keyframe);
                let found = found.and_then(|found| L::features(found).get(feature).copied());
                if found.flatten() != Some(id) {
                    return Err(Inconsistency::OneSidedSighting(keyframe));
                }
                for (other, _) in sightings.iter().filter(|(other, _)| *other != keyframe) {
                    let with = shared.entry(keyframe).or_default().entry(other).or_default();
                    *L::shared(with) += 1;
                }
            }
        }
        Ok(())
    }

    fn check_features<L: Landmark>(
        &self,
        id: KeyframeId,
        keyframe: &Keyframe,
    ) -> Result<(), Inconsistency> {
        let is_known = |(feature, landmark): (usize, &Option<Id<L>>)| {
            landmark.is_none_or(|landmark| {
                let found = L::arena(self).get(landmark);
                found.is_some_and(|found| found.sightings().feature_in(id) == Some(feature))
            })
        };
        let holds = L::features(keyframe).iter().enumerate().all(is_known);
        if holds { Ok(()) } else { Err(Inconsistency::OneSidedFeature(id)) }
    }

    fn check_tree(&self) -> Result<(), Inconsistency> {
        let roots = self.keyframes.iter().filter(|(_, keyframe)| keyframe.parent.is_none());
        let roots: Vec<KeyframeId> = roots.map(|(id, _)| id).collect();
        if roots.as_slice() != self.root.as_slice() {
            return Err(Inconsistency::Roots(roots.len()));
        }
        let newest = self.keyframes.iter().max_by_key(|(_, keyframe)| keyframe.number);
        if newest.map(|(id, _)| id) != self.newest {
            return Err(Inconsistency::Newest);
        }
        for (id, keyframe) in self.keyframes.iter() {
            let parent = keyframe.parent.map(|parent| self.keyframes.get(parent));
            let is_connected =
                parent.is_none_or(|parent| parent.is_some_and(|p| p.children.contains(&id)));
            let holds = keyframe.children.iter().all(|child| {
                self.keyframes.get(*child).is_some_and(|child| child.parent == Some(id))
            });
            if !(is_connected && holds) {
                return Err(Inconsistency::OneSidedBranch(id));
            }
        }
        let (mut reached, mut ahead) = (0, roots);
        while let Some(id) = ahead.pop() {
            reached += 1;
            if let Some(keyframe) = self.keyframes.get(id) {
                ahead.extend(&keyframe.children);
            }
        }
        let keyframes = self.keyframes.len();
        if reached == keyframes { Ok(()) } else { Err(Inconsistency::Cycle { reached, keyframes }) }
    }
}
