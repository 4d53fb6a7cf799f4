//! How often frames show the landmarks that they should.

use std::collections::{BTreeMap, BTreeSet};

use crate::loop_closing::Located;
use crate::map::{FoundTimes, Id, LineId, PointId};

/// How often frames should have seen landmarks, and how often they have: as many numbers as there are landmarks, however
/// long the camera is static.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Predicted {
    /// Points.
    pub points: BTreeMap<PointId, FoundTimes>,
    /// Lines.
    pub lines: BTreeMap<LineId, FoundTimes>,
}

impl Predicted {
    /// Counts what a frame should have shown.
    pub(super) fn count(&mut self, located: &Located) {
        let Located { points, lines, predicted_points, predicted_lines, .. } = located;
        count_in(&mut self.points, predicted_points, points);
        count_in(&mut self.lines, predicted_lines, lines);
    }

    /// Landmarks whose sightings are remembered.
    #[cfg(test)]
    pub(super) fn landmarks(&self) -> usize {
        self.points.len() + self.lines.len()
    }
}

fn count_in<L>(
    times: &mut BTreeMap<Id<L>, FoundTimes>,
    predicted: &[Id<L>],
    found: &[(usize, Id<L>)],
) {
    let found: BTreeSet<Id<L>> = found.iter().map(|(_, id)| *id).collect();
    for id in predicted {
        times.entry(*id).or_default().add(FoundTimes::once(found.contains(id)));
    }
}
