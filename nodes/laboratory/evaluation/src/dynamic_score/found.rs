//! When an object was found first.

use serde::{Deserialize, Serialize};

use super::ObjectCycleScore;

/// The first cycle in which an object was found.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct FirstFound {
    /// The cycle's number.
    pub cycle: u32,
    /// Which of the cycles in which the object is in view it is: 1 is the first, found at once.
    pub nth_in_view: usize,
}

impl FirstFound {
    /// Of an object's cycles in their order; none of an object that was never found.
    pub(super) fn of(cycles: &[ObjectCycleScore]) -> Option<Self> {
        let mut in_view = cycles.iter().filter(|cycle| cycle.in_view);
        let before = in_view.clone().take_while(|cycle| !cycle.is_found_or_removed()).count();
        let first = in_view.nth(before)?;
        Some(Self { cycle: first.index, nth_in_view: before + 1 })
    }
}

impl ObjectCycleScore {
    /// Whether it was in view, and a zone held it or it was removed.
    #[must_use]
    pub fn is_found_or_removed(&self) -> bool {
        self.found || self.removed
    }
}
