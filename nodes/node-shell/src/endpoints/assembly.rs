//! How much memory the DDS library may hold for messages that will never be whole.
//!
//! It assembles a message out of its fragments, keeps up to 128 begun ones for each writer, and lets one go
//! ten seconds after its last fragment: of clouds of 4.9 MB that are 600 MB. Nothing of its interface bounds
//! this, but a reader that is dropped takes all of it along. So each best effort subscription watches what
//! it lost, and its reader is replaced by a new one when that is too much.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// The memory that a reader may hold in incomplete messages before it is replaced. It is checked every 100 ms at best, so
/// that messages that arrive in between add to it: a node that receives clouds of 4.9 MB peaks below 200 MB on an idle machine, at 216 MB
/// on a busy one (measured). The bound that always holds is the library's: 128 messages of each writer.
const MOST_BYTES: u64 = 64 << 20;

/// The same where not one message comes through. What is begun before the next look, and until the library
/// has let go of the last reader, comes on top.
const MOST_BYTES_IN_SILENCE: u64 = 24 << 20;

/// The library lets a begun message go ten seconds after its last fragment, and looks every two.
const KEPT: Duration = Duration::from_secs(12);

/// How long a topic must have been silent before its reader is held to be the cause of growing memory: some
/// periods of a camera. Clouds of 4.9 MB that never become whole fill 150 MB a second.
const SILENCE: Duration = Duration::from_millis(250);

/// Watches one reader.
#[derive(Debug)]
pub(crate) struct AssemblyWatch {
    /// Whether messages may have megabytes.
    is_bulk: bool,
    /// Messages that were lost of late: when they were missed, and how many bytes they may have left.
    lost: VecDeque<(Instant, u64)>,
    last_heard: Instant,
    /// The least memory of the process that was seen in this silence.
    least_in_silence: Option<u64>,
}

impl AssemblyWatch {
    /// A watch over a new reader, in a process with this much resident memory.
    pub(crate) fn new(is_bulk: bool, now: Instant, resident_bytes: Option<u64>) -> Self {
        let (lost, least_in_silence) = (VecDeque::new(), resident_bytes);
        Self { is_bulk, lost, last_heard: now, least_in_silence }
    }

    /// The same over the reader that replaces this one's.
    pub(crate) fn anew(&self, now: Instant, resident_bytes: Option<u64>) -> Self {
        Self::new(self.is_bulk, now, resident_bytes)
    }

    /// Notes messages that were lost.
    pub(crate) fn lost(&mut self, now: Instant, messages: u64, bytes_each: u64) {
        self.lost.push_back((now, messages.saturating_mul(bytes_each)));
    }

    /// Notes that a message came.
    pub(crate) fn heard(&mut self, now: Instant) {
        self.last_heard = now;
        self.least_in_silence = None;
    }

    /// Whether what was lost of late may hold too much.
    pub(crate) fn lost_too_much(&mut self, now: Instant) -> bool {
        while self.lost.front().is_some_and(|(when, _)| now.duration_since(*when) > KEPT) {
            self.lost.pop_front();
        }
        self.lost.iter().fold(0_u64, |sum, (_, bytes)| sum.saturating_add(*bytes)) > MOST_BYTES
    }

    /// Whether no message is completed while memory grows: messages that are never complete
    /// leave no complete one in between. Where there is no publisher, or 128 messages are small, it is other memory that
    /// grows.
    pub(crate) fn grows_in_silence(
        &mut self,
        now: Instant,
        resident_bytes: u64,
        has_publishers: bool,
    ) -> bool {
        if !self.is_bulk || !has_publishers {
            self.least_in_silence = None;
            return false;
        }
        // What the last reader held is given back only a while after it is dropped.
        let before =
            self.least_in_silence.map_or(resident_bytes, |least| least.min(resident_bytes));
        self.least_in_silence = Some(before);
        now.duration_since(self.last_heard) > SILENCE
            && resident_bytes.saturating_sub(before) > MOST_BYTES_IN_SILENCE
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MB: u64 = 1_000_000;

    #[test]
    fn what_was_lost_of_late_adds_up_and_is_forgotten() {
        let start = Instant::now();
        let at = |seconds| start + Duration::from_secs(seconds);
        let mut watch = AssemblyWatch::new(true, start, None);
        watch.lost(at(0), 6, 5 * MB);
        watch.lost(at(6), 7, 5 * MB);
        assert!(!watch.lost_too_much(at(6)));
        watch.lost(at(7), 1, 5 * MB);
        assert!(watch.lost_too_much(at(7)));
        assert!(!watch.lost_too_much(at(13)));
    }

    #[test]
    fn small_messages_never_cost_a_reader() {
        let start = Instant::now();
        let mut watch = AssemblyWatch::new(false, start, None);
        for _ in 0..1000 {
            watch.lost(start, 10, 5_000);
        }
        assert!(!watch.lost_too_much(start));
    }

    #[test]
    fn memory_that_grows_while_nothing_comes_is_the_readers() {
        let start = Instant::now();
        let at = |seconds| start + Duration::from_secs(seconds);
        let mut watch = AssemblyWatch::new(true, start, Some(50 * MB));
        assert!(!watch.grows_in_silence(start, 500 * MB, true), "too early");
        assert!(!watch.grows_in_silence(at(5), 70 * MB, true), "too little");
        assert!(watch.grows_in_silence(at(5), 500 * MB, true));
        watch.heard(at(5));
        assert!(!watch.grows_in_silence(at(9), 510 * MB, true), "it did not grow since");
        assert!(watch.grows_in_silence(at(10), 700 * MB, true));
    }

    /// The bound was once raised by each reader that was replaced.
    #[test]
    fn memory_that_is_given_back_later_does_not_raise_the_bound() {
        let start = Instant::now();
        let at = |seconds| start + Duration::from_secs(seconds);
        let mut watch = AssemblyWatch::new(true, start, Some(150 * MB));
        assert!(!watch.grows_in_silence(at(1), 50 * MB, true));
        assert!(watch.grows_in_silence(at(2), 130 * MB, true));
    }

    /// Regression: while one topic's broken messages filled the memory, another topic without a publisher was reported to
    /// suffer and its reader was created again.
    #[test]
    fn memory_that_grows_without_a_publisher_is_not_the_readers() {
        let start = Instant::now();
        let at = |ms| start + Duration::from_millis(ms);
        let mut watch = AssemblyWatch::new(true, start, Some(50 * MB));
        assert!(!watch.grows_in_silence(at(400), 500 * MB, false));
        assert!(!watch.grows_in_silence(at(500), 500 * MB, true), "what was there before counts");
        assert!(watch.grows_in_silence(at(600), 600 * MB, true));
    }
    /// Regression: a node that had grown in a second without a pose created its reader of poses again, and lost some poses.
    #[test]
    fn memory_that_grows_is_never_that_of_small_messages() {
        let start = Instant::now();
        let at = |ms| start + Duration::from_millis(ms);
        let mut watch = AssemblyWatch::new(false, start, Some(50 * MB));
        assert!(!watch.grows_in_silence(at(600), 500 * MB, true));
        let mut next = watch.anew(at(600), Some(50 * MB));
        assert!(!next.grows_in_silence(at(1200), 500 * MB, true));
    }
}
