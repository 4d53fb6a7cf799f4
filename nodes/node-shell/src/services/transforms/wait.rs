//! Data that wait for their transform, which may be published later than they arrive.

use std::collections::VecDeque;

use geometry::Stamp;

/// Data that wait for their transform, in the order in which they came, for a bounded time and in a bounded number.
#[derive(Clone, Debug)]
pub struct TransformWait<T> {
    waiting: VecDeque<(Stamp, T)>,
    newest: Option<Stamp>,
    longest_s: f64,
    most: usize,
}

impl<T> TransformWait<T> {
    /// Data wait until others have come that are later by `longest_s`, or `most` of them.
    #[must_use]
    pub fn new(longest_s: f64, most: usize) -> Self {
        Self { waiting: VecDeque::new(), newest: None, longest_s, most }
    }

    /// Lets data of a moment wait.
    pub fn push(&mut self, stamp: Stamp, data: T) {
        self.newest = Some(self.newest.map_or(stamp, |newest| newest.max(stamp)));
        self.waiting.push_back((stamp, data));
    }

    /// The data that came first of those that wait.
    pub fn pop(&mut self) -> Option<(Stamp, T)> {
        self.waiting.pop_front()
    }

    /// Lets the data that were taken last wait on, before the others; gives them back where their time is up.
    ///
    /// # Errors
    /// With the data, when there is no more time or room for them.
    pub fn wait_on(&mut self, stamp: Stamp, data: T) -> Result<(), T> {
        let is_late =
            self.newest.is_some_and(|newest| newest.seconds_since(stamp) > self.longest_s);
        if is_late || self.waiting.len() >= self.most {
            return Err(data);
        }
        self.waiting.push_front((stamp, data));
        Ok(())
    }

    /// What waits, in its order.
    pub fn iter(&self) -> impl Iterator<Item = &T> {
        self.waiting.iter().map(|(_, data)| data)
    }

    /// Whether anything waits.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.waiting.is_empty()
    }

    /// Drops and returns all waiting data: the stamps begin anew.
    pub fn start_anew(&mut self) -> Vec<T> {
        self.newest = None;
        std::mem::take(&mut self.waiting).into_iter().map(|(_, data)| data).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(milliseconds: i64) -> Stamp {
        Stamp::from_nanos(milliseconds * 1_000_000)
    }

    #[test]
    fn data_wait_until_others_are_later_by_this_much() {
        let mut wait = TransformWait::new(0.5, 10);
        for milliseconds in [0, 300, 600] {
            wait.push(at(milliseconds), milliseconds);
        }
        let (stamp, data) = wait.pop().unwrap();
        assert_eq!(wait.wait_on(stamp, data), Err(0), "600 ms are too long");
        let (stamp, data) = wait.pop().unwrap();
        assert_eq!(wait.wait_on(stamp, data), Ok(()));
        assert_eq!(wait.pop(), Some((at(300), 300)), "it stays before the others");
        assert_eq!(wait.pop(), Some((at(600), 600)));
        assert!(wait.is_empty() && wait.pop().is_none());
    }

    #[test]
    fn no_more_wait_than_there_is_room_for() {
        let mut wait = TransformWait::new(10.0, 2);
        (0..3).for_each(|index| wait.push(at(index), index));
        let (stamp, data) = wait.pop().unwrap();
        assert_eq!(wait.wait_on(stamp, data), Err(0));
        let (stamp, data) = wait.pop().unwrap();
        assert_eq!(wait.wait_on(stamp, data), Ok(()));
    }

    #[test]
    fn after_a_jump_of_the_clock_earlier_moments_wait_as_well() {
        let mut wait = TransformWait::new(0.5, 10);
        wait.push(at(100_000), 1);
        assert_eq!(wait.start_anew(), [1]);
        wait.push(at(5), 2);
        let (stamp, data) = wait.pop().unwrap();
        assert_eq!(wait.wait_on(stamp, data), Ok(()));
    }
}
