//! Messages that have been read but not returned yet.

use std::cmp::{Ordering, Reverse};
use std::collections::BinaryHeap;
use std::sync::Arc;

use crate::catalogue::Channel;

/// A message that has been read.
pub(super) struct Queued {
    pub(super) log_time_ns: u64,
    /// File, segment and place in it: the order of the bag.
    pub(super) place: (usize, usize, usize),
    pub(super) publish_time_ns: u64,
    pub(super) channel: Arc<Channel>,
    pub(super) data: Vec<u8>,
}

impl Queued {
    fn key(&self) -> (u64, (usize, usize, usize)) {
        (self.log_time_ns, self.place)
    }

    fn size_bytes(&self) -> u64 {
        (self.data.len() + size_of::<Self>()) as u64
    }
}

impl PartialEq for Queued {
    fn eq(&self, other: &Self) -> bool {
        self.key() == other.key()
    }
}

impl Eq for Queued {}

impl PartialOrd for Queued {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Queued {
    fn cmp(&self, other: &Self) -> Ordering {
        self.key().cmp(&other.key())
    }
}

/// A priority queue by log time that tracks its size in memory.
#[derive(Default)]
pub(super) struct Queue {
    heap: BinaryHeap<Reverse<Queued>>,
    size_bytes: u64,
}

impl Queue {
    pub(super) fn push(&mut self, message: Queued) {
        self.size_bytes += message.size_bytes();
        self.heap.push(Reverse(message));
    }

    pub(super) fn pop(&mut self) -> Option<Queued> {
        let Reverse(message) = self.heap.pop()?;
        self.size_bytes -= message.size_bytes();
        Some(message)
    }

    /// Log time of the earliest message.
    pub(super) fn first_ns(&self) -> Option<u64> {
        self.heap.peek().map(|Reverse(message)| message.log_time_ns)
    }

    pub(super) fn size_bytes(&self) -> u64 {
        self.size_bytes
    }
}
