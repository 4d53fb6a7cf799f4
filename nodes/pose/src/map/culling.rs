//! The removal of keyframes and landmarks.

use nalgebra::Isometry3;

use super::{Id, KeyframeId, Landmark, LineId, Map, MapError, PointId};

/// A removed keyframe, and its pose relative to one that stays, so that anything tied to
/// it can be tied to the other.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct CulledKeyframe {
    /// Its parent in the spanning tree.
    pub parent: KeyframeId,
    /// Where it was from there.
    pub camera_from_parent: Isometry3<f64>,
    /// Landmarks that no keyframe sees any more and that were removed with it.
    pub landmarks: usize,
}

impl Map {
    /// Removes a keyframe. Landmarks that it alone saw are removed with it; its children in the spanning tree get other parents
    /// and loops that ended there end at its parent.
    ///
    /// # Errors
    /// When it is not there, or is the root.
    pub fn cull_keyframe(&mut self, keyframe: KeyframeId) -> Result<CulledKeyframe, MapError> {
        let going = self.keyframes.get(keyframe).ok_or(MapError::NoKeyframe(keyframe))?;
        let parent = going.parent.ok_or(MapError::Root)?;
        let of_parent = self.keyframes.get(parent).ok_or(MapError::NoKeyframe(parent))?;
        let camera_from_parent = going.camera_from_map * of_parent.camera_from_map.inverse();
        let points: Vec<PointId> = going.points.iter().flatten().copied().collect();
        let lines: Vec<LineId> = going.lines.iter().flatten().copied().collect();
        // First, while the landmarks that the children share with others are still known.
        self.hand_over_children(keyframe);
        self.hand_over_loops(keyframe, parent, &camera_from_parent);
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

    /// Makes the loops that end at a keyframe end at its parent, as far from there as the keyframe is now. A loop that
    /// closes at the parent already says the same; one with the parent itself says nothing any more.
    fn hand_over_loops(
        &mut self,
        keyframe: KeyframeId,
        parent: KeyframeId,
        camera_from_parent: &Isometry3<f64>,
    ) {
        let Some(going) = self.keyframes.get_mut(keyframe) else { return };
        for (other, edge) in std::mem::take(&mut going.loops) {
            if let Some(other) = self.keyframes.get_mut(other) {
                other.loops.remove(&keyframe);
            }
            let is_known =
                self.keyframes.get(parent).is_none_or(|parent| parent.loops.contains_key(&other));
            if other != parent && !is_known {
                let parent_from_other = camera_from_parent.inverse() * edge.camera_from_other;
                self.link(parent, other, &parent_from_other);
            }
        }
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
