//! What the map lets go.

use nalgebra::Isometry3;

use super::{Id, KeyframeId, Landmark, LineId, Map, MapError, PointId};

/// A keyframe that is gone, and what is left of it: where it was from one that stays, so that whoever has tied something to
/// it can tie that to the other.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct CulledKeyframe {
    /// The keyframe that it hung on.
    pub parent: KeyframeId,
    /// Where it was from there.
    pub camera_from_parent: Isometry3<f64>,
    /// Landmarks that nobody sees any more and that went with it.
    pub landmarks: usize,
}

impl Map {
    /// Lets a keyframe go. Landmarks that it alone saw go with it; what hung on it in the spanning tree hangs on others
    /// afterwards.
    ///
    /// # Errors
    /// When it is not there, is the root, or is an end of a loop.
    pub fn cull_keyframe(&mut self, keyframe: KeyframeId) -> Result<CulledKeyframe, MapError> {
        let going = self.keyframes.get(keyframe).ok_or(MapError::NoKeyframe(keyframe))?;
        if !going.loops.is_empty() {
            return Err(MapError::EndOfLoop);
        }
        let parent = going.parent.ok_or(MapError::Root)?;
        let of_parent = self.keyframes.get(parent).ok_or(MapError::NoKeyframe(parent))?;
        let camera_from_parent = going.camera_from_map * of_parent.camera_from_map.inverse();
        let points: Vec<PointId> = going.points.iter().flatten().copied().collect();
        let lines: Vec<LineId> = going.lines.iter().flatten().copied().collect();
        // First, while it is still known what the children see with others.
        self.hand_over_children(keyframe);
        let mut landmarks = 0;
        for point in points {
            landmarks += usize::from(self.unobserve(keyframe, point)?);
        }
        for line in lines {
            landmarks += usize::from(self.unobserve(keyframe, line)?);
        }
        self.keyframes.remove(keyframe);
        if self.newest == Some(keyframe) {
            let newest = self.keyframes.iter().max_by_key(|(_, keyframe)| keyframe.number);
            self.newest = newest.map(|(id, _)| id);
        }
        Ok(CulledKeyframe { parent, camera_from_parent, landmarks })
    }

    /// Lets a landmark go.
    ///
    /// # Errors
    /// When it is not there.
    pub fn cull_landmark<L: Landmark>(&mut self, landmark: Id<L>) -> Result<(), MapError> {
        let found = L::arena(self).get(landmark).ok_or(MapError::NoLandmark)?;
        let seen_by: Vec<KeyframeId> = found.sightings().by_keyframe.keys().copied().collect();
        for keyframe in seen_by {
            // The last one takes the landmark along.
            self.unobserve(keyframe, landmark)?;
        }
        Ok(())
    }
}
