//! Independent tasks on as many threads as the caller gives.
//!
//! A core has no threads of its own: it takes an [`Executor`] from its caller, and gives it tasks that do not depend on
//! each other. Each task writes a result of its own, and results are put together in the order of the tasks: so the number
//! of threads changes no bit.

mod scoped_threads;
#[cfg(test)]
mod tests;

use std::fmt::Debug;
use std::num::NonZeroUsize;
use std::sync::{Mutex, PoisonError};

pub use scoped_threads::ScopedThreads;

/// A task that may borrow from the caller that waits for it.
pub type Task<'a> = Box<dyn FnOnce() + Send + 'a>;

/// Does tasks that do not depend on each other.
pub trait Executor: Debug + Send + Sync {
    /// How many tasks it does at the same time.
    fn threads(&self) -> NonZeroUsize;

    /// Does all tasks, and returns when the last one is done. Panics of a task are passed on.
    ///
    /// The executor of an owner that is to end may leave out tasks that have not begun: only where the caller's docs say what that leaves
    /// undone.
    fn run(&self, tasks: Vec<Task<'_>>);
}

/// Does one task after another in the thread of the caller.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Serial;

impl Executor for Serial {
    fn threads(&self) -> NonZeroUsize {
        NonZeroUsize::MIN
    }

    fn run(&self, tasks: Vec<Task<'_>>) {
        for task in tasks {
            task();
        }
    }
}

/// Does `work` on every item. A thread takes the next item when it is done with one; since no item depends on another,
/// what comes out does not depend on the number of threads.
pub fn for_each<T: Send>(executor: &dyn Executor, items: &mut [T], work: impl Fn(&mut T) + Sync) {
    let workers = executor.threads().get().min(items.len());
    if workers < 2 {
        return items.iter_mut().for_each(work);
    }
    let queue = Mutex::new(items.iter_mut());
    let take_all = || {
        while let Some(item) = next(&queue) {
            work(item);
        }
    };
    executor.run((0..workers).map(|_| Box::new(take_all) as Task<'_>).collect());
}

/// The results of `work` on each item, in the order of the items.
pub fn map<T: Send, R: Send>(
    executor: &dyn Executor,
    items: Vec<T>,
    work: impl Fn(T) -> R + Sync,
) -> Vec<R> {
    let mut nothing = vec![(); executor.threads().get()];
    map_with(executor, &mut nothing, items, |(), item| work(item))
}

/// The same; each thread has one of the `scratches` to work with. There are no more threads than these.
pub fn map_with<S: Send, T: Send, R: Send>(
    executor: &dyn Executor,
    scratches: &mut [S],
    items: Vec<T>,
    work: impl Fn(&mut S, T) -> R + Sync,
) -> Vec<R> {
    let workers = executor.threads().get().min(items.len());
    let queue = Mutex::new(items.into_iter().enumerate());
    let mut shares: Vec<(&mut S, Vec<(usize, R)>)> =
        scratches.iter_mut().take(workers).map(|scratch| (scratch, Vec::new())).collect();
    let take_all = |scratch: &mut S, results: &mut Vec<(usize, R)>| {
        while let Some((index, item)) = next(&queue) {
            results.push((index, work(scratch, item)));
        }
    };
    let take_all = &take_all;
    let tasks = shares
        .iter_mut()
        .map(|(scratch, results)| Box::new(|| take_all(scratch, results)) as Task<'_>);
    executor.run(tasks.collect());
    let mut results: Vec<(usize, R)> = shares.into_iter().flat_map(|(_, share)| share).collect();
    results.sort_unstable_by_key(|(index, _)| *index);
    results.into_iter().map(|(_, result)| result).collect()
}

/// The results of two tasks, at the same time where there are two threads.
pub fn join<A: Default + Send, B: Default + Send>(
    executor: &dyn Executor,
    first: impl FnOnce() -> A + Send,
    second: impl FnOnce() -> B + Send,
) -> (A, B) {
    let (mut of_first, mut of_second) = (A::default(), B::default());
    executor.run(vec![Box::new(|| of_first = first()), Box::new(|| of_second = second())]);
    (of_first, of_second)
}

/// The next item of a queue.
fn next<I: Iterator>(queue: &Mutex<I>) -> Option<I::Item> {
    // A panic of a task ends the run with that panic; the queue itself is never left half done.
    queue.lock().unwrap_or_else(PoisonError::into_inner).next()
}
