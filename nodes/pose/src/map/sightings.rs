//! A keyframe sees a landmark, or no longer does: the two steps that all others are made of.
//!
//! Each keeps feature, landmark and covisibility together, so that whatever is made of them does, too.

use super::{Id, KeyframeId, Landmark, Map, MapError};

impl Map {
    /// A keyframe sees a landmark as this feature (a corner for a point, a segment for a line).
    ///
    /// # Errors
    /// When one of the three is not there, the feature is another landmark, or the landmark another feature.
    pub fn observe<L: Landmark>(
        &mut self,
        keyframe: KeyframeId,
        feature: usize,
        landmark: Id<L>,
    ) -> Result<(), MapError> {
        let found = L::arena(self).get(landmark).ok_or(MapError::NoLandmark)?;
        if let Some(feature) = found.sightings().feature_in(keyframe) {
            return Err(MapError::SeenAlready { feature });
        }
        let others: Vec<KeyframeId> = found.sightings().by_keyframe.keys().copied().collect();
        *self.free_feature::<L>(keyframe, feature)? = Some(landmark);
        if let Some(found) = L::arena_mut(self).get_mut(landmark) {
            // An index of a `Vec` of features: far below 2^32.
            found.sightings_mut().by_keyframe.insert(keyframe, feature as u32);
        }
        for other in others {
            self.count_shared::<L>(keyframe, other, |count| count.saturating_add(1));
            self.count_shared::<L>(other, keyframe, |count| count.saturating_add(1));
        }
        Ok(())
    }

    /// A keyframe does not see a landmark after all. A landmark that no keyframe sees is dropped; returns whether it was.
    ///
    /// # Errors
    /// When the landmark is not there.
    pub fn unobserve<L: Landmark>(
        &mut self,
        keyframe: KeyframeId,
        landmark: Id<L>,
    ) -> Result<bool, MapError> {
        let found = L::arena_mut(self).get_mut(landmark).ok_or(MapError::NoLandmark)?;
        let sightings = &mut found.sightings_mut().by_keyframe;
        let Some(feature) = sightings.remove(&keyframe) else { return Ok(false) };
        let others: Vec<KeyframeId> = sightings.keys().copied().collect();
        let is_lonely = others.is_empty();
        if let Some(keyframe) = self.keyframes.get_mut(keyframe)
            && let Some(feature) = L::features_mut(keyframe).get_mut(feature as usize)
        {
            *feature = None;
        }
        for other in others {
            self.count_shared::<L>(keyframe, other, |count| count.saturating_sub(1));
            self.count_shared::<L>(other, keyframe, |count| count.saturating_sub(1));
        }
        if is_lonely {
            L::arena_mut(self).remove(landmark);
        }
        Ok(is_lonely)
    }

    /// A feature of a keyframe that is no landmark yet.
    pub(super) fn free_feature<L: Landmark>(
        &mut self,
        keyframe: KeyframeId,
        feature: usize,
    ) -> Result<&mut Option<Id<L>>, MapError> {
        let keyframe = self.keyframes.get_mut(keyframe).ok_or(MapError::NoKeyframe(keyframe))?;
        let slots = L::features_mut(keyframe);
        let features = slots.len();
        let slot = slots.get_mut(feature).ok_or(MapError::NoFeature { feature, features })?;
        if slot.is_some() { Err(MapError::FeatureTaken { feature }) } else { Ok(slot) }
    }

    fn count_shared<L: Landmark>(
        &mut self,
        keyframe: KeyframeId,
        other: KeyframeId,
        change: impl Fn(u32) -> u32,
    ) {
        let Some(keyframe) = self.keyframes.get_mut(keyframe) else { return };
        let shared = keyframe.covisible.entry(other).or_default();
        let count = L::shared(shared);
        *count = change(*count);
        if shared.landmarks() == 0 {
            keyframe.covisible.remove(&other);
        }
    }
}
