//! The gate that holds data back while a node is not active.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Open while the node works, closed while it does not. It counts its turns: even is open.
#[derive(Clone, Debug, Default)]
pub(crate) struct Gate {
    turns: Arc<AtomicU64>,
}

impl Gate {
    pub(crate) fn is_open(&self) -> bool {
        self.turns().is_multiple_of(2)
    }

    /// Changes whenever it was closed since a former look.
    pub(crate) fn turns(&self) -> u64 {
        self.turns.load(Ordering::Acquire)
    }

    pub(crate) fn open(&self) {
        self.turn(false);
    }

    pub(crate) fn close(&self) {
        self.turn(true);
    }

    fn turn(&self, is_closed: bool) {
        // One task alone turns it: the one that answers the node's services.
        if self.is_open() == is_closed {
            self.turns.fetch_add(1, Ordering::AcqRel);
        }
    }
}
