//! The spanning tree.

use std::collections::BTreeSet;

use super::{KeyframeId, Map};

impl Map {
    /// Sets the parent of a keyframe, in place of its former parent.
    pub(super) fn set_parent(&mut self, keyframe: KeyframeId, parent: KeyframeId) {
        let before = self.keyframes.get(keyframe).and_then(|keyframe| keyframe.parent);
        if let Some(before) = before.and_then(|before| self.keyframes.get_mut(before)) {
            before.children.remove(&keyframe);
        }
        if let Some(parent) = self.keyframes.get_mut(parent) {
            parent.children.insert(keyframe);
        }
        if let Some(keyframe) = self.keyframes.get_mut(keyframe) {
            keyframe.parent = Some(parent);
        }
    }

    /// Gives the children of a removed keyframe other parents: each time the child that sees most with one of those that
    /// may be its parent, which are the parent of the removed one and the children that have a new parent already. So no
    /// cycle can arise, and neighbours in the tree see the same (Mur-Artal et al. 2015, section III-D; the rule when a keyframe
    /// is removed is ours).
    pub(super) fn hand_over_children(&mut self, keyframe: KeyframeId) {
        let Some(going) = self.keyframes.get(keyframe) else { return };
        let Some(grandparent) = going.parent else { return };
        let mut homeless = going.children.clone();
        let mut homes = BTreeSet::from([grandparent]);
        while !homeless.is_empty() {
            let mut best: Option<(u32, KeyframeId, KeyframeId)> = None;
            for child in &homeless {
                let Some(covisible) = self.keyframes.get(*child).map(|child| &child.covisible)
                else {
                    continue;
                };
                for home in &homes {
                    let count = covisible.get(home).map_or(0, |shared| shared.landmarks());
                    if count > 0 && best.is_none_or(|(most, ..)| count > most) {
                        best = Some((count, *child, *home));
                    }
                }
            }
            let Some((_, child, home)) = best else { break };
            self.set_parent(child, home);
            homeless.remove(&child);
            homes.insert(child);
        }
        for child in homeless {
            self.set_parent(child, grandparent);
        }
        if let Some(grandparent) = self.keyframes.get_mut(grandparent) {
            grandparent.children.remove(&keyframe);
        }
    }
}
