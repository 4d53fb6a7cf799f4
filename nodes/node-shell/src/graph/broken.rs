//! Peers whose link was down for so long that the match has ended.
//!
//! When such a peer is heard again, the library recognises its endpoints but does not match them with those
//! of ours that were there before (RustDDS 0.15). New endpoints it does match, so ours are created again.

use std::collections::{BTreeSet, VecDeque};

use crate::graph::exchange::EndpointId;

/// An endpoint on the network that can be created again.
pub(crate) trait Renew: Send + Sync {
    /// Replaces the end on the network. Latched messages are offered again.
    fn renew(&self);
}

/// The first twelve bytes of a participant's identity.
pub(crate) type Prefix = [u8; 12];

/// How many participants that fell silent are remembered.
const MOST: usize = 256;

/// The participants that fell silent, the latest at the end.
#[derive(Default)]
pub(super) struct Broken {
    silent: VecDeque<Silent>,
}

struct Silent {
    prefix: Prefix,
    /// The endpoints that had no part in it.
    unconcerned: BTreeSet<EndpointId>,
}

impl Broken {
    /// Notes that a participant was dropped, and which endpoints did not concern it. Returned is a participant
    /// that is not waited for any more.
    pub(super) fn fell_silent(
        &mut self,
        prefix: Prefix,
        unconcerned: BTreeSet<EndpointId>,
    ) -> Option<Prefix> {
        self.ended(prefix);
        self.silent.push_back(Silent { prefix, unconcerned });
        if self.silent.len() > MOST { self.silent.pop_front().map(|one| one.prefix) } else { None }
    }

    /// A participant ended; it will not come back under this identity.
    pub(super) fn ended(&mut self, prefix: Prefix) {
        self.silent.retain(|one| one.prefix != prefix);
    }

    /// A participant is heard. Where it had been dropped: which endpoints need not be created again. An endpoint
    /// that was opened in between needs to, as the library did not know the peer then.
    pub(super) fn heard(&mut self, prefix: Prefix) -> Option<BTreeSet<EndpointId>> {
        let place = self.silent.iter().position(|one| one.prefix == prefix)?;
        self.silent.remove(place).map(|one| one.unconcerned)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn those_that_fell_silent_last_are_remembered() {
        let mut broken = Broken::default();
        let prefix = |number: u16| {
            let mut prefix = [0; 12];
            prefix[..2].copy_from_slice(&number.to_le_bytes());
            prefix
        };
        for number in 0..1000_u16 {
            let forgotten = broken.fell_silent(prefix(number), BTreeSet::new());
            assert_eq!(forgotten, number.checked_sub(MOST as u16).map(prefix));
        }
        assert_eq!(broken.silent.len(), MOST);
        assert!(broken.heard(prefix(0)).is_none() && broken.heard(prefix(999)).is_some());
    }
}
