//! A tracked object with its history.

use super::super::zones::ObjectZone;
use super::motion_evidence::{is_under_way, travels};
use super::sighting::{History, MEMORY_MS, Sighting, Space};

/// A tracked object.
#[derive(Clone, Debug)]
pub(crate) struct TrackedObject {
    history: History,
    /// Since when it is in observed free space.
    in_free_space_since_ms: Option<u32>,
    /// When it was last in observed free space.
    last_in_free_space_ms: Option<u32>,
    /// When it last had travelled.
    travelled_ms: Option<u32>,
    is_under_way: bool,
    /// Whether it is not visible in the last scan.
    is_lost: bool,
    /// Its zone, measured or held.
    pub(crate) zone: Option<ObjectZone>,
}

impl TrackedObject {
    pub(crate) fn new(sighting: Sighting) -> Self {
        let mut object = Self {
            history: History::new(sighting),
            in_free_space_since_ms: None,
            last_in_free_space_ms: None,
            travelled_ms: None,
            is_under_way: false,
            is_lost: false,
            zone: None,
        };
        object.note_free_space();
        object
    }

    /// Adds a sighting.
    pub(crate) fn see(&mut self, sighting: Sighting, platform_moves: bool) {
        self.history.push(sighting);
        self.is_lost = false;
        self.note_free_space();
        if travels(&self.history, platform_moves) {
            self.travelled_ms = Some(sighting.now_ms);
        }
        self.is_under_way = is_under_way(&self.history, platform_moves);
    }

    /// Notes that it is not visible in a scan. Returns whether it may be associated again: only if it was in free space, since
    /// in unknown space other objects may become visible.
    pub(crate) fn lose(&mut self, now_ms: u32) -> bool {
        self.is_lost = true;
        let is_recent = now_ms.saturating_sub(self.last().now_ms) <= MEMORY_MS;
        self.zone.is_some() || (is_recent && self.last().space == Space::Free)
    }

    fn note_free_space(&mut self) {
        let now_ms = self.last().now_ms;
        if self.last().space == Space::Free {
            let is_interrupted = self
                .last_in_free_space_ms
                .is_none_or(|then_ms| now_ms.saturating_sub(then_ms) > MEMORY_MS);
            if is_interrupted {
                self.in_free_space_since_ms = Some(now_ms);
            }
            self.last_in_free_space_ms = Some(now_ms);
        }
    }

    pub(crate) fn history(&self) -> &History {
        &self.history
    }

    pub(crate) fn last(&self) -> &Sighting {
        self.history.last()
    }

    pub(crate) fn is_lost(&self) -> bool {
        self.is_lost
    }

    /// For how long it has been in free space, with pauses of no more than [`MEMORY_MS`].
    pub(crate) fn in_free_space_ms(&self) -> u32 {
        let since_ms = self.in_free_space_since_ms.unwrap_or(self.last().now_ms);
        self.last().now_ms.saturating_sub(since_ms)
    }

    /// Whether it has ever travelled.
    pub(crate) fn has_travelled(&self) -> bool {
        self.travelled_ms.is_some()
    }

    /// Whether it travels, or rests between two steps.
    pub(crate) fn travels_now(&self) -> bool {
        let then = |then_ms: u32| self.last().now_ms.saturating_sub(then_ms) <= MEMORY_MS;
        self.travelled_ms.is_some_and(then)
    }

    /// Whether it was displaced, and may travel.
    pub(crate) fn is_under_way(&self) -> bool {
        self.is_under_way
    }
}
