//! The participants of one process.

use std::collections::BTreeSet;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use rustdds::GUID;

/// The participants of one host. What one of them sends over DDS has reached the others already.
#[derive(Clone, Default, Debug)]
pub(crate) struct Siblings {
    prefixes: Arc<Mutex<BTreeSet<ParticipantPrefix>>>,
}

/// The first twelve bytes of every name that a participant gives to something of its own.
type ParticipantPrefix = [u8; 12];

impl Siblings {
    /// Enters the participant that `guid` is of.
    pub(crate) fn enter(&self, guid: GUID) {
        self.lock().insert(prefix(guid));
    }

    /// Whether `guid` is of a participant of this host.
    pub(crate) fn contain(&self, guid: GUID) -> bool {
        self.lock().contains(&prefix(guid))
    }

    fn lock(&self) -> MutexGuard<'_, BTreeSet<ParticipantPrefix>> {
        self.prefixes.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn prefix(guid: GUID) -> ParticipantPrefix {
    let mut prefix = ParticipantPrefix::default();
    prefix.copy_from_slice(&guid.to_bytes()[..ParticipantPrefix::default().len()]);
    prefix
}
