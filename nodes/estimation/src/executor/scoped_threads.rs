//! Threads that live as long as the tasks that they are given.

use std::num::NonZeroUsize;
use std::sync::Mutex;
use std::thread;

use super::{Executor, Task, next};

/// Does tasks on a number of threads, that of the caller among them, which are made for each run. For programs and shells:
/// a core does not make one.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct ScopedThreads {
    threads: NonZeroUsize,
}

impl ScopedThreads {
    /// The number of threads.
    #[must_use]
    pub fn new(threads: NonZeroUsize) -> Self {
        Self { threads }
    }

    /// As many threads as the machine runs at the same time.
    #[must_use]
    pub fn of_machine() -> Self {
        Self::new(thread::available_parallelism().unwrap_or(NonZeroUsize::MIN))
    }
}

impl Executor for ScopedThreads {
    fn threads(&self) -> NonZeroUsize {
        self.threads
    }

    fn run(&self, tasks: Vec<Task<'_>>) {
        let others = self.threads.get().min(tasks.len()).saturating_sub(1);
        if others == 0 {
            return tasks.into_iter().for_each(|task| task());
        }
        let queue = Mutex::new(tasks.into_iter());
        let take_all = || {
            while let Some(task) = next(&queue) {
                task();
            }
        };
        thread::scope(|scope| {
            for _ in 0..others {
                scope.spawn(take_all);
            }
            take_all();
        });
    }
}
