//! Where a node is in its life, as its publishers and subscriptions see it.

pub(crate) mod states;

use std::sync::{Arc, Mutex, PoisonError};

use crate::endpoints::gate::Gate;
pub use states::LifecycleState;

/// Where a node is in its life. Clones share it. An unmanaged node has no state, and is always active.
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

    /// The gate that data have to pass.
    pub(crate) fn gate(&self) -> Gate {
        self.gate.clone()
    }

    /// The node is in another state. While it shuts down it continues as before: waiting messages are still processed.
    pub(crate) fn enter(&self, state: LifecycleState) {
        match state {
            LifecycleState::Active => self.gate.open(),
            LifecycleState::ShuttingDown | LifecycleState::Finalized => {}
            _ => self.gate.close(),
        }
        self.set(state);
    }

    /// The node has started by itself, and was never closed to messages in between.
    pub(crate) fn has_started(&self) {
        self.set(LifecycleState::Active);
    }

    fn set(&self, state: LifecycleState) {
        *self.state.lock().unwrap_or_else(PoisonError::into_inner) = Some(state);
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
