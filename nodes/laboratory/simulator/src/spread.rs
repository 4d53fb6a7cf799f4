//! Work on independent items, spread over threads.

use std::num::NonZeroUsize;

/// Does `work` on every item. Items go round the threads in turn; since they do not depend on each other, the
/// result does not depend on the number of threads.
pub(crate) fn spread<T: Send>(
    threads: NonZeroUsize,
    items: impl IntoIterator<Item = T>,
    work: impl Fn(T) + Sync,
) {
    let mut shares: Vec<Vec<T>> = (0..threads.get()).map(|_| Vec::new()).collect();
    for (index, item) in items.into_iter().enumerate() {
        if let Some(share) = shares.get_mut(index % threads.get()) {
            share.push(item);
        }
    }
    let Some(own) = shares.pop() else { return };
    std::thread::scope(|scope| {
        let work = &work;
        for share in shares.into_iter().filter(|share| !share.is_empty()) {
            scope.spawn(move || share.into_iter().for_each(work));
        }
        own.into_iter().for_each(work);
    });
}
