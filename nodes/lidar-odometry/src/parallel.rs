//! Work on independent items, spread over threads.

use std::num::NonZeroUsize;
use std::sync::Mutex;

/// Does `work` on every item. A thread takes the next item when it is done with one; since no item depends on another,
/// and each holds its own result, what comes out does not depend on the number of threads.
pub(crate) fn for_each<T: Send>(
    threads: NonZeroUsize,
    items: &mut [T],
    work: impl Fn(&mut T) + Sync,
) {
    let others = threads.get().min(items.len()).saturating_sub(1);
    if others == 0 {
        return items.iter_mut().for_each(work);
    }
    let queue = Mutex::new(items.iter_mut());
    // A panic of another thread ends the scope with that panic; the queue itself is never left half done.
    let next = || queue.lock().unwrap_or_else(std::sync::PoisonError::into_inner).next();
    let take_all = || {
        while let Some(item) = next() {
            work(item);
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..others {
            scope.spawn(take_all);
        }
        take_all();
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_item_is_worked_on_once() {
        for threads in [1, 2, 7] {
            for count in [0, 1, 3, 100] {
                let mut items: Vec<usize> = (0..count).collect();
                for_each(NonZeroUsize::new(threads).unwrap(), &mut items, |item| *item += 1000);
                assert_eq!(items, (1000..1000 + count).collect::<Vec<_>>());
            }
        }
    }
}
