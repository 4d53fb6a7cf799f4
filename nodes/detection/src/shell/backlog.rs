//! Which complete cycles wait for a node that is slower than its input, and how many of them are dropped for newer ones.

/// The complete cycles that wait, oldest first, by their number.
///
/// Live the newest count: a few may wait. Several become complete at once where the pose or the image that they share comes more seldom
/// than scans do; these are not too many.
#[derive(Clone, Debug)]
pub(super) struct Backlog {
    /// May wait at least.
    most: usize,
    complete: usize,
    dropped: u64,
}

impl Backlog {
    /// None waits, and `most` may.
    pub(super) fn new(most: usize) -> Self {
        Self { most, complete: 0, dropped: 0 }
    }

    /// How many wait.
    pub(super) fn complete(&self) -> usize {
        self.complete
    }

    /// How many were dropped so far.
    pub(super) fn dropped(&self) -> u64 {
        self.dropped
    }

    /// Notes that so many more have become complete at once. Returns how many of all that wait, the oldest, are to be dropped.
    #[must_use]
    pub(super) fn completed(&mut self, more: usize) -> usize {
        let all = self.complete + more;
        self.complete = all.min(self.most.max(more));
        let dropped = all - self.complete;
        self.dropped += dropped as u64;
        dropped
    }

    /// Notes that the oldest one was taken.
    pub(super) fn taken(&mut self) {
        self.complete = self.complete.saturating_sub(1);
    }

    /// Notes that the one that was taken waits again: as many wait as before.
    pub(super) fn put_back(&mut self, complete: usize) {
        self.complete = complete;
    }

    /// Notes that none waits any more.
    pub(super) fn clear(&mut self) {
        self.complete = 0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_oldest_are_dropped_for_newer_ones() {
        let mut backlog = Backlog::new(2);
        let dropped = [1, 1, 1, 1].map(|more| backlog.completed(more));
        assert_eq!((dropped, backlog.complete(), backlog.dropped()), ([0, 0, 1, 1], 2, 2));
        backlog.taken();
        assert_eq!((backlog.completed(1), backlog.complete()), (0, 2));
        backlog.clear();
        assert_eq!((backlog.completed(2), backlog.complete(), backlog.dropped()), (0, 2, 2));
    }

    /// Scans of 40 Hz with poses of 5 Hz: eight cycles become complete at once.
    #[test]
    fn those_that_become_complete_at_once_are_not_too_many() {
        let mut backlog = Backlog::new(2);
        assert_eq!(backlog.completed(8), 0);
        (0..8).for_each(|_| backlog.taken());
        assert_eq!(backlog.completed(8), 0);
        (0..5).for_each(|_| backlog.taken());
        assert_eq!((backlog.completed(8), backlog.complete()), (3, 8));
    }
}
