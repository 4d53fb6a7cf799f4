use std::sync::atomic::{AtomicUsize, Ordering};

use super::*;

/// One thread and several, the serial executor among them.
fn executors() -> Vec<Box<dyn Executor>> {
    let mut all: Vec<Box<dyn Executor>> = vec![Box::new(Serial)];
    for threads in [1, 2, 3, 7] {
        all.push(Box::new(ScopedThreads::new(NonZeroUsize::new(threads).unwrap())));
    }
    all
}

#[test]
fn every_item_is_worked_on_once() {
    for executor in executors() {
        for count in [0, 1, 3, 100] {
            let mut items: Vec<usize> = (0..count).collect();
            for_each(&*executor, &mut items, |item| *item += 1000);
            assert_eq!(items, (1000..1000 + count).collect::<Vec<_>>(), "{executor:?}");
        }
    }
}

#[test]
fn results_come_in_the_order_of_the_items_whichever_thread_does_them() {
    for executor in executors() {
        let mut done = vec![0_usize; executor.threads().get()];
        let work = |count: &mut usize, item: usize| {
            *count += 1;
            item * item
        };
        let squares = map_with(&*executor, &mut done, (0..1000).collect(), work);
        assert_eq!(squares, (0..1000).map(|item| item * item).collect::<Vec<_>>());
        assert_eq!(done.iter().sum::<usize>(), 1000);
        let halves = map(&*executor, vec![4, 8, 6], |item: usize| item / 2);
        assert_eq!(halves, [2, 4, 3]);
        assert_eq!(map(&*executor, Vec::new(), |item: usize| item), []);
    }
}

#[test]
fn two_tasks_are_both_done() {
    for executor in executors() {
        assert_eq!(join(&*executor, || 2, || "three".to_owned()), (2, "three".to_owned()));
    }
}

#[test]
fn a_task_may_have_tasks_of_its_own() {
    for executor in executors() {
        let sum = AtomicUsize::new(0);
        let mut outer = [(); 5];
        for_each(&*executor, &mut outer, |()| {
            let mut inner = [1_usize; 4];
            for_each(&*executor, &mut inner, |item| {
                sum.fetch_add(*item, Ordering::Relaxed);
            });
        });
        assert_eq!(sum.into_inner(), 20);
    }
}
