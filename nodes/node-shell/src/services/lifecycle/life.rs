//! Where a node is in its life, as its publishers and subscriptions see it.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use super::states::LifecycleState;

/// Where a node is in its life. Clones share it. A node that nobody manages has no state, and works.
#[derive(Clone, Debug, Default)]
pub(crate) struct Life {
    state: Arc<Mutex<Option<LifecycleState>>>,
    gate: Gate,
}

impl Life {
    /// The state, where the node is managed.
    pub(crate) fn state(&self) -> Option<LifecycleState> {
        *self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// What data have to pass.
    pub(crate) fn gate(&self) -> Gate {
        self.gate.clone()
    }

    /// The node is in another state. While it ends it goes on as it was: what waits is still worked off.
    pub(super) fn enter(&self, state: LifecycleState) {
        match state {
            LifecycleState::Active => self.gate.open(),
            LifecycleState::ShuttingDown | LifecycleState::Finalized => {}
            _ => self.gate.close(),
        }
        self.set(state);
    }

    /// The node has started by itself, and was never closed to what came meanwhile.
    pub(super) fn has_started(&self) {
        self.set(LifecycleState::Active);
    }

    fn set(&self, state: LifecycleState) {
        *self.state.lock().unwrap_or_else(PoisonError::into_inner) = Some(state);
    }
}

/// Open while the node works, closed while it does not. It counts its turns: even is open.
#[derive(Clone, Debug, Default)]
pub(crate) struct Gate {
    turns: Arc<AtomicU64>,
}

impl Gate {
    pub(crate) fn is_open(&self) -> bool {
        self.turns().is_multiple_of(2)
    }

    /// Tells whether it was closed since a former look.
    pub(crate) fn turns(&self) -> u64 {
        self.turns.load(Ordering::Acquire)
    }

    fn open(&self) {
        self.turn(false);
    }

    fn close(&self) {
        self.turn(true);
    }

    fn turn(&self, is_closed: bool) {
        // One task alone turns it: the one that answers the node's services.
        if self.is_open() == is_closed {
            self.turns.fetch_add(1, Ordering::AcqRel);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_gate_follows_the_state_and_stays_as_it_was_at_the_end() {
        let life = Life::default();
        assert!(life.state().is_none() && life.gate().is_open());
        let turns = life.gate().turns();
        life.has_started();
        assert_eq!(life.gate().turns(), turns, "nothing was missed");
        for (state, is_open) in [
            (LifecycleState::Deactivating, false),
            (LifecycleState::Inactive, false),
            (LifecycleState::Activating, false),
            (LifecycleState::Active, true),
            (LifecycleState::ShuttingDown, true),
            (LifecycleState::Finalized, true),
        ] {
            life.enter(state);
            assert_eq!((life.state(), life.gate().is_open()), (Some(state), is_open));
        }
        assert_ne!(life.gate().turns(), turns);
    }
}
