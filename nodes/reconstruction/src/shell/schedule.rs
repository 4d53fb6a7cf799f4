//! The schedule of the publication of the map.

#[cfg(test)]
mod tests;

use std::time::Duration;

use tokio::time::Instant;

/// When no cloud has arrived for so long, the input has paused, and the map is published as it
/// is then. More than twice the time between two cycles of a slow scanner (5.5 Hz).
const INPUT_PAUSE: Duration = Duration::from_millis(500);

/// Two whole maps have at least this time between them, for whatever reason.
const SHORTEST_BETWEEN_MAPS: Duration = Duration::from_millis(500);

/// A subscriber of the whole map alone sees a removal only with the next map, which is then due after
/// this share of its period: 2.5 s by default.
const SHARE_AFTER_REMOVALS: u32 = 4;

/// The periods of the parameters.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Periods {
    /// Of the whole map.
    pub(super) map: Duration,
    /// Of its updates.
    pub(super) updates: Duration,
}

/// The numbers of subscribers.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(super) struct Subscribers {
    /// Of the whole map.
    pub(super) map: usize,
    /// Of its updates.
    pub(super) updates: usize,
}

/// A change of whether the updates have subscribers.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Following {
    /// The first subscriber.
    Starts,
    /// No more subscribers.
    Ends,
}

/// What is due.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(super) struct Due {
    /// To be done before the others.
    pub(super) following: Option<Following>,
    /// The whole map.
    pub(super) map: bool,
    /// An update.
    pub(super) update: bool,
}

/// Decides when the map and its updates are published. The caller passes the time.
#[derive(Clone, Debug)]
pub(super) struct Schedule {
    periods: Periods,
    subscribers: Subscribers,
    /// The time of the last cloud since the last whole map, even if it changed no point: it changes
    /// the stamp of the map.
    last_cloud: Option<Instant>,
    /// A new subscriber may not have a whole map yet, or an update was lost.
    is_needed: bool,
    /// Voxels were removed since the last whole map.
    has_removals: bool,
    last_map: Option<Instant>,
    last_update: Option<Instant>,
}

impl Schedule {
    pub(super) fn new(periods: Periods) -> Self {
        Self {
            periods,
            subscribers: Subscribers::default(),
            last_cloud: None,
            is_needed: false,
            has_removals: false,
            last_map: None,
            last_update: None,
        }
    }

    /// Applies changed periods.
    pub(super) fn set_periods(&mut self, periods: Periods) {
        self.periods = periods;
    }

    /// Notes that a cloud was added to the map.
    pub(super) fn cloud_added(&mut self, now: Instant) {
        self.last_cloud = Some(now);
    }

    /// Notes that voxels were removed from the map.
    pub(super) fn voxels_removed(&mut self) {
        self.has_removals = true;
    }

    /// Notes that the map was replaced: subscribers need a whole map.
    pub(super) fn map_replaced(&mut self, now: Instant) {
        self.last_cloud = Some(now);
        self.is_needed = true;
    }

    /// Notes that an update was not published: subscribers need a whole map.
    pub(super) fn update_failed(&mut self) {
        self.is_needed = true;
    }

    /// Notes that a whole map was published, or that it failed and is not to be tried again at once.
    pub(super) fn map_tried(&mut self, now: Instant, is_published: bool) {
        self.last_map = Some(now);
        if is_published {
            self.last_cloud = None;
            self.is_needed = false;
            self.has_removals = false;
        }
    }

    /// What is due now.
    pub(super) fn look(&mut self, now: Instant, subscribers: Subscribers) -> Due {
        let before = std::mem::replace(&mut self.subscribers, subscribers);
        if subscribers.map > before.map || subscribers.updates > before.updates {
            self.is_needed = true;
        }
        let following = match (before.updates > 0, subscribers.updates > 0) {
            (false, true) => Some(Following::Starts),
            (true, false) => Some(Following::Ends),
            _ => None,
        };
        let update =
            subscribers.updates > 0 && has_passed(self.periods.updates, self.last_update, now);
        if update {
            self.last_update = Some(now);
        }
        Due { following, map: subscribers.map > 0 && self.is_map_due(now), update }
    }

    fn is_map_due(&self, now: Instant) -> bool {
        // Before the first cloud there is nothing to publish.
        let is_there = self.last_cloud.is_some() || self.last_map.is_some();
        let share = if self.has_removals { SHARE_AFTER_REMOVALS } else { 1 };
        has_passed(SHORTEST_BETWEEN_MAPS, self.last_map, now)
            && (self.is_needed && is_there
                || self.last_cloud.is_some_and(|last_cloud| {
                    has_passed(self.periods.map / share, self.last_map, now)
                        || has_passed(INPUT_PAUSE, Some(last_cloud), now)
                }))
    }
}

/// Whether a time has passed since `last`; true without one.
fn has_passed(time: Duration, last: Option<Instant>, now: Instant) -> bool {
    last.is_none_or(|last| now.saturating_duration_since(last) >= time)
}
