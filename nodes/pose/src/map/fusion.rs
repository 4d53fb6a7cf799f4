//! Two landmarks that were one all along.

use super::{Id, KeyframeId, Landmark, Map, MapError};

/// The result of a fusion.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Fused {
    /// Keyframes that saw the dropped landmark and see the other now.
    pub moved: usize,
    /// Keyframes that saw both: their feature that was the dropped one is no landmark now.
    pub freed: usize,
}

impl Map {
    /// Takes two landmarks for one: what was known of `dropped` goes to `kept`.
    ///
    /// # Errors
    /// When one is not there, or both are one.
    pub fn fuse<L: Landmark>(&mut self, kept: Id<L>, dropped: Id<L>) -> Result<Fused, MapError> {
        if kept == dropped {
            return Err(MapError::WithItself);
        }
        L::arena(self).get(kept).ok_or(MapError::NoLandmark)?;
        let going = L::arena(self).get(dropped).ok_or(MapError::NoLandmark)?.sightings();
        let (times, born) = (going.times, going.born);
        let seen_by: Vec<(KeyframeId, usize)> = going.iter().collect();
        let mut fused = Fused::default();
        for (keyframe, feature) in seen_by {
            self.unobserve(keyframe, dropped)?;
            match self.observe(keyframe, feature, kept) {
                Ok(()) => fused.moved += 1,
                Err(MapError::SeenAlready { .. }) => fused.freed += 1,
                Err(error) => return Err(error),
            }
        }
        if let Some(kept) = L::arena_mut(self).get_mut(kept) {
            let sightings = kept.sightings_mut();
            sightings.times.add(times);
            sightings.born = sightings.born.min(born);
        }
        Ok(fused)
    }
}
