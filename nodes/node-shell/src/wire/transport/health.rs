//! How well the participant receives: what buffer it has, and how many datagrams the kernel dropped.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Mutex, PoisonError};

use super::buffer::GrantedBuffer;
use super::datagram_filter::DatagramFilter;
use super::sockets::{self, UdpSocketEntry};
use crate::process::throttle::Throttle;

/// How well one participant receives.
#[derive(Debug)]
pub struct ReceiveHealth {
    granted: GrantedBuffer,
    filter: DatagramFilter,
    /// The drops of each of the participant's sockets, by inode; `None` where the kernel does not list
    /// them.
    dropped: Option<Mutex<BTreeMap<u64, u64>>>,
    /// Warnings that name the topics that suffer.
    named: Throttle,
    /// Warnings of losses of which no topic is known to suffer.
    unnamed: Throttle,
}

impl ReceiveHealth {
    pub(super) fn new(
        granted: GrantedBuffer,
        inodes: Option<BTreeSet<u64>>,
        filter: DatagramFilter,
    ) -> Self {
        let dropped =
            inodes.map(|inodes| Mutex::new(inodes.into_iter().map(|one| (one, 0)).collect()));
        Self {
            granted,
            filter,
            dropped,
            named: Throttle::for_warnings(),
            unnamed: Throttle::for_warnings(),
        }
    }

    /// The receive buffer, and so what size of message arrives whole.
    #[must_use]
    pub fn granted_buffer(&self) -> GrantedBuffer {
        self.granted
    }

    /// Whether what arrives is judged before the DDS library gets it.
    #[must_use]
    pub fn filter(&self) -> &DatagramFilter {
        &self.filter
    }

    /// How many datagrams the kernel dropped so far because a receive buffer was full, or because the filter refused them;
    /// `None` where the kernel does not report it.
    #[must_use]
    pub fn dropped_datagrams(&self) -> Option<u64> {
        let mut dropped = self.dropped.as_ref()?.lock().unwrap_or_else(PoisonError::into_inner);
        take(&mut dropped, &sockets::one_reading().ok()?);
        Some(dropped.values().sum())
    }

    /// Lets one warning in a while through. Those that name topics are not held back by those that do
    /// not.
    pub(crate) fn warnings(&self, name_topics: bool) -> &Throttle {
        if name_topics { &self.named } else { &self.unnamed }
    }
}

/// Takes a reading. The kernel's list is no snapshot: while sockets come and go, it may name one twice or
/// leave one out.
fn take(dropped: &mut BTreeMap<u64, u64>, listed: &[UdpSocketEntry]) {
    for entry in listed {
        if let Some(known) = dropped.get_mut(&entry.inode) {
            *known = entry.dropped.max(*known);
        }
    }
}

#[cfg(test)]
impl ReceiveHealth {
    /// Of sockets that the kernel does not list.
    pub(crate) fn unseen(granted: GrantedBuffer) -> Self {
        Self::new(granted, None, DatagramFilter::Off("a test".to_owned()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_socket_listed_twice_or_not_at_all_changes_nothing() {
        let entry = |inode, dropped| UdpSocketEntry { port: 7411, inode, dropped };
        let mut dropped = BTreeMap::from([(1, 0), (2, 0)]);
        let mut sum_after = |listed: &[UdpSocketEntry]| {
            take(&mut dropped, listed);
            dropped.values().sum::<u64>()
        };
        assert_eq!(sum_after(&[entry(1, 5), entry(2, 3), entry(1, 5), entry(9, 100)]), 8);
        assert_eq!(sum_after(&[entry(2, 4)]), 9);
        assert_eq!(sum_after(&[entry(1, 5), entry(2, 4)]), 9);
    }
}
