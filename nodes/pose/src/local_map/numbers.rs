//! Which landmark each feature of a frame is.

use super::{Associations, LocalMap, Verdicts};
use crate::frame::{Frame, LeftOut};

/// The numbers of the landmarks that a frame's features are, one for each corner and each segment; `None` for a feature that
/// is none. Corners and segments have numbers of their own, and no number is given twice.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct LandmarkNumbers {
    /// Of the corners.
    pub corners: Vec<Option<u64>>,
    /// Of the segments.
    pub lines: Vec<Option<u64>>,
}

impl LandmarkNumbers {
    pub(crate) fn none(frame: &Frame) -> Self {
        Self { corners: vec![None; frame.corners.len()], lines: vec![None; frame.lines.len()] }
    }

    pub(super) fn set_corner(&mut self, corner: usize, number: u64) {
        if let Some(place) = self.corners.get_mut(corner) {
            *place = Some(number);
        }
    }

    pub(super) fn set_line(&mut self, line: usize, number: u64) {
        if let Some(place) = self.lines.get_mut(line) {
            *place = Some(number);
        }
    }

    /// Those of the frame without what is left out.
    pub(crate) fn without(&self, left_out: &LeftOut) -> Self {
        let corners = self.corners.iter().enumerate();
        let corners = corners.filter(|(index, _)| !left_out.has_corner(*index));
        let lines = self.lines.iter().enumerate();
        let lines = lines.filter(|(index, _)| !left_out.has_line(*index));
        Self {
            corners: corners.map(|(_, number)| *number).collect(),
            lines: lines.map(|(_, number)| *number).collect(),
        }
    }
}

impl LocalMap {
    /// The numbers of the landmarks that a frame's features are, by the verdicts.
    pub(crate) fn numbers(
        &self,
        frame: &Frame,
        associations: &Associations,
        verdicts: Verdicts<'_>,
    ) -> LandmarkNumbers {
        let mut numbers = LandmarkNumbers::none(frame);
        for (pair, verdict) in associations.points.iter().zip(verdicts.points) {
            if let Some(point) = self.points.get(pair.landmark).filter(|_| verdict.is_inlier()) {
                numbers.set_corner(pair.feature, point.id);
            }
        }
        for (pair, verdict) in associations.lines.iter().zip(verdicts.lines) {
            if let Some(line) = self.lines.get(pair.landmark).filter(|_| verdict.is_inlier()) {
                numbers.set_line(pair.feature, line.id);
            }
        }
        numbers
    }
}
