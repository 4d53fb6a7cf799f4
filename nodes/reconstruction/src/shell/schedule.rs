//! When what of the map is due.

#[cfg(test)]
mod tests;

use std::time::Duration;

use tokio::time::Instant;

/// When no cloud has come for so long, the input pauses, and whoever looks at the map wants to see it as it
/// then is. More than twice the time between two cycles of a slow scanner (5.5 Hz).
const INPUT_PAUSE: Duration = Duration::from_millis(500);

/// Two whole maps have at least this time between them, whatever the reasons for them.
const SHORTEST_BETWEEN_MAPS: Duration = Duration::from_millis(500);

/// A listener to the whole map alone sees a voxel that has gone only by the next map, which then is due after
/// this share of its period: 2.5 s of the default.
const SHARE_AFTER_REMOVALS: u32 = 4;

/// The periods that users set.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Periods {
    /// Of the whole map.
    pub(super) map: Duration,
    /// Of its updates.
    pub(super) updates: Duration,
}

/// How many listen.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(super) struct Subscribers {
    /// To the whole map.
    pub(super) map: usize,
    /// To its updates.
    pub(super) updates: usize,
}

/// Whether somebody listens to the updates.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Following {
    /// From now on.
    Starts,
    /// Not any more.
    Ends,
}

/// What is due.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(super) struct Due {
    /// Comes before the others.
    pub(super) following: Option<Following>,
    /// The whole map.
    pub(super) map: bool,
    /// An update.
    pub(super) update: bool,
}

/// Decides when what of the map is published. The time is told to it.
#[derive(Clone, Debug)]
pub(super) struct Schedule {
    periods: Periods,
    subscribers: Subscribers,
    /// When the last cloud came, if that was after the last whole map, even when it changed nothing: the
    /// map's stamp tells how far it has come.
    news: Option<Instant>,
    /// Somebody has come who may not have seen a whole map yet, or has missed an update.
    is_awaited: bool,
    /// Voxels have gone since the last whole map.
    is_outdated: bool,
    last_map: Option<Instant>,
    last_update: Option<Instant>,
}

impl Schedule {
    pub(super) fn new(periods: Periods) -> Self {
        Self {
            periods,
            subscribers: Subscribers::default(),
            news: None,
            is_awaited: false,
            is_outdated: false,
            last_map: None,
            last_update: None,
        }
    }

    /// Goes on with other periods.
    pub(super) fn set_periods(&mut self, periods: Periods) {
        self.periods = periods;
    }

    /// A cloud has come into the map.
    pub(super) fn cloud_came(&mut self, now: Instant) {
        self.news = Some(now);
    }

    /// Voxels have gone from the map.
    pub(super) fn voxels_went(&mut self) {
        self.is_outdated = true;
    }

    /// Another map has taken the map's place: only a whole map can tell.
    pub(super) fn map_replaced(&mut self, now: Instant) {
        self.news = Some(now);
        self.is_awaited = true;
    }

    /// Some update did not go out: only a whole map can make up for it.
    pub(super) fn update_failed(&mut self) {
        self.is_awaited = true;
    }

    /// A whole map was published, or that was tried and is not to be tried again at once.
    pub(super) fn map_tried(&mut self, now: Instant, is_published: bool) {
        self.last_map = Some(now);
        if is_published {
            self.news = None;
            self.is_awaited = false;
            self.is_outdated = false;
        }
    }

    /// What is due now.
    pub(super) fn look(&mut self, now: Instant, subscribers: Subscribers) -> Due {
        let before = std::mem::replace(&mut self.subscribers, subscribers);
        if subscribers.map > before.map || subscribers.updates > before.updates {
            self.is_awaited = true;
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
        let Some(last_cloud) = self.news else { return false };
        let share = if self.is_outdated { SHARE_AFTER_REMOVALS } else { 1 };
        has_passed(SHORTEST_BETWEEN_MAPS, self.last_map, now)
            && (self.is_awaited
                || has_passed(self.periods.map / share, self.last_map, now)
                || has_passed(INPUT_PAUSE, Some(last_cloud), now))
    }
}

/// Whether a time has passed since `last`, or there was none.
fn has_passed(time: Duration, last: Option<Instant>, now: Instant) -> bool {
    last.is_none_or(|last| now.saturating_duration_since(last) >= time)
}
