//! Independent jobs on all cores, with the results in the order of the jobs.

use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc;
use std::thread;

/// The number of threads that the machine runs in parallel.
pub(crate) fn threads_of_machine() -> NonZeroUsize {
    thread::available_parallelism().unwrap_or(NonZeroUsize::MIN)
}

/// The results of `work` on each of `jobs`, in their order, independent of the threads. `done` is called after each. No
/// job is begun after one has failed; the result is then the first error in the order of the jobs.
pub(crate) fn in_order<J, R, E>(
    jobs: &[J],
    threads: NonZeroUsize,
    work: impl Fn(&J) -> Result<R, E> + Sync,
    mut done: impl FnMut(),
) -> Result<Vec<R>, E>
where
    J: Sync,
    R: Send,
    E: Send,
{
    let next = AtomicUsize::new(0);
    let mut results: Vec<Option<R>> = jobs.iter().map(|_| None).collect();
    let mut failed: Option<(usize, E)> = None;
    thread::scope(|scope| {
        let (sender, receiver) = mpsc::channel();
        for _ in 0..threads.get().min(jobs.len()) {
            let (sender, next, work) = (sender.clone(), &next, &work);
            scope.spawn(move || {
                while let Some((index, job)) = take(jobs, next) {
                    let result = work(job);
                    let is_error = result.is_err();
                    if sender.send((index, result)).is_err() || is_error {
                        // The other threads begin no further job either.
                        next.store(jobs.len(), Ordering::Relaxed);
                        return;
                    }
                }
            });
        }
        drop(sender);
        for (index, result) in receiver {
            match result {
                Ok(result) => results[index] = Some(result),
                Err(error) if failed.as_ref().is_none_or(|(first, _)| index < *first) => {
                    failed = Some((index, error));
                }
                Err(_) => {}
            }
            done();
        }
    });
    match failed {
        Some((_, error)) => Err(error),
        None => Ok(results.into_iter().flatten().collect()),
    }
}

fn take<'j, J>(jobs: &'j [J], next: &AtomicUsize) -> Option<(usize, &'j J)> {
    // Beyond the last job it only counts on: wrapping around would take more jobs than memory holds.
    let index = next.fetch_add(1, Ordering::Relaxed);
    jobs.get(index).map(|job| (index, job))
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use super::*;

    fn threads(count: usize) -> NonZeroUsize {
        NonZeroUsize::new(count).unwrap()
    }

    #[test]
    fn results_come_in_the_order_of_the_jobs() {
        let jobs: Vec<u64> = (0..50).collect();
        let mut done = 0;
        for count in [1, 3, 100] {
            let squares = in_order(
                &jobs,
                threads(count),
                |job| {
                    // The first jobs end last.
                    thread::sleep(std::time::Duration::from_micros(50 * (50 - job)));
                    Ok::<_, Infallible>(job * job)
                },
                || done += 1,
            );
            assert_eq!(squares.unwrap(), jobs.iter().map(|job| job * job).collect::<Vec<_>>());
        }
        assert_eq!(done, 150);
    }

    #[test]
    fn an_error_ends_it() {
        let begun = AtomicUsize::new(0);
        let jobs: Vec<usize> = (0..1000).collect();
        let work = |job: &usize| {
            begun.fetch_add(1, Ordering::Relaxed);
            if *job == 3 { Err("three") } else { Ok(*job) }
        };
        assert_eq!(in_order(&jobs, threads(1), work, || ()), Err("three"));
        assert_eq!(begun.load(Ordering::Relaxed), 4);
        assert_eq!(in_order(&[] as &[usize], threads(2), work, || ()), Ok(Vec::new()));
    }
}
