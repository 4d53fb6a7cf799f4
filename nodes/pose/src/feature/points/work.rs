//! Work that threads share.

use std::{
    sync::{Mutex, PoisonError},
    thread,
};

/// Does `work` on all `tasks`, with as many threads as there are `scratches`, and gives the outcomes in the tasks'
/// order: which thread did what changes nothing. The calling thread does `first` before it joins in.
pub(super) fn share<T: Send, S: Send, R: Send>(
    scratches: &mut [S],
    tasks: Vec<T>,
    first: impl FnOnce(),
    work: impl Fn(&mut S, T) -> R + Sync,
) -> Vec<R> {
    let queue = Mutex::new(tasks.into_iter().enumerate());
    let next = || queue.lock().unwrap_or_else(PoisonError::into_inner).next();
    let run = |scratch: &mut S, outcomes: &mut Vec<(usize, R)>| {
        while let Some((index, task)) = next() {
            outcomes.push((index, work(scratch, task)));
        }
    };
    let mut outcomes: Vec<Vec<_>> = scratches.iter().map(|_| Vec::new()).collect();
    let mut workers = scratches.iter_mut().zip(&mut outcomes);
    let own = workers.next();
    thread::scope(|scope| {
        let run = &run;
        for (scratch, outcomes) in workers {
            scope.spawn(move || run(scratch, outcomes));
        }
        first();
        if let Some((scratch, outcomes)) = own {
            run(scratch, outcomes);
        }
    });
    let mut outcomes: Vec<_> = outcomes.into_iter().flatten().collect();
    outcomes.sort_unstable_by_key(|(index, _)| *index);
    outcomes.into_iter().map(|(_, outcome)| outcome).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn outcomes_come_in_the_order_of_the_tasks_whoever_does_them() {
        for threads in 1..5 {
            let mut done = vec![0_usize; threads];
            let outcomes = share(
                &mut done,
                (0..1000).collect(),
                || (),
                |count, task: usize| {
                    *count += 1;
                    task * task
                },
            );
            assert_eq!(outcomes, (0..1000).map(|task| task * task).collect::<Vec<_>>());
            assert_eq!(done.iter().sum::<usize>(), 1000);
        }
    }
}
