//! The work on a depth image, in parts: a signal ends a node within one of them, and not after a cycle that takes seconds since
//! `map_edge_m` is too fine.

use std::num::NonZeroUsize;

use estimation::executor::{Executor, Task};
use node_shell::{Node, Shutdown};

/// The most blocks of one image take seconds; a part of them takes a tenth of a second at most.
const PARTS: NonZeroUsize = NonZeroUsize::new(64).unwrap();

/// Does one task after another in the thread of the caller, and none of those that are left when the node is to end.
#[derive(Debug)]
pub(super) struct UntilShutdown {
    /// `None` where each cycle counts: then they are worked off as a whole.
    shutdown: Option<Shutdown>,
}

impl UntilShutdown {
    pub(super) fn of(node: &Node) -> Self {
        Self { shutdown: (!node.takes_every_cycle()).then(|| node.shutdown_signal()) }
    }
}

impl Executor for UntilShutdown {
    fn threads(&self) -> NonZeroUsize {
        PARTS
    }

    fn run(&self, tasks: Vec<Task<'_>>) {
        for task in tasks {
            if self.shutdown.as_ref().is_some_and(Shutdown::is_triggered) {
                return;
            }
            task();
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;

    #[test]
    fn tasks_that_have_not_begun_are_left_out_when_the_node_is_to_end() {
        for (shutdown, wanted) in [(Some(Shutdown::new()), 3), (None, 10)] {
            let executor = UntilShutdown { shutdown };
            let done = AtomicUsize::new(0);
            let task = || {
                if done.fetch_add(1, Ordering::Relaxed) == 2
                    && let Some(shutdown) = &executor.shutdown
                {
                    shutdown.trigger();
                }
            };
            executor.run((0..10).map(|_| Box::new(task) as Task<'_>).collect());
            assert_eq!(done.into_inner(), wanted);
        }
    }
}
