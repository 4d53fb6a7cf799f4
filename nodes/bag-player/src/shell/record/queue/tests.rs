use std::pin::{Pin, pin};

use super::*;

fn message(bytes: usize) -> Job {
    let (log_time, publish_time) = (Stamp::default(), Stamp::default());
    Job::Message { number: 0, log_time, publish_time, encoded: vec![0; bytes] }
}

/// Whether a job goes in without waiting.
async fn is_in<F: Future<Output = bool>>(mut put: Pin<&mut F>) -> bool {
    tokio::select! {
        biased;
        is_put = &mut put => is_put,
        () = std::future::ready(()) => false,
    }
}

const CLOUD_BYTES: usize = 4_900_000;

#[tokio::test]
async fn what_waits_is_bounded_by_its_bytes_and_more_waits_until_there_is_room() {
    let (queue, mut taken) = Queue::new(WAITING_BYTES);
    let fit = WAITING_BYTES / (CLOUD_BYTES.div_ceil(UNIT_BYTES) * UNIT_BYTES);
    assert!(fit >= 50, "five seconds at 10 Hz: {fit}");
    for index in 0..fit {
        assert!(is_in(pin!(queue.put(message(CLOUD_BYTES)))).await, "{index}");
    }
    assert!(queue.is_full());
    let mut next = pin!(queue.put(message(CLOUD_BYTES)));
    assert!(!is_in(next.as_mut()).await, "there is no room");
    // It stands in the room until it is written, and not only until it is taken.
    let first = taken.recv().await.unwrap();
    assert!(!is_in(next.as_mut()).await);
    drop(first);
    assert!(is_in(next.as_mut()).await, "nothing is lost: it goes in");
    let mut left = 0;
    while taken.try_recv().is_ok() {
        left += 1;
    }
    assert_eq!(left, fit);
    assert!(!queue.is_full());
}

#[tokio::test]
async fn a_message_larger_than_all_the_room_waits_until_it_is_alone() {
    let (queue, mut taken) = Queue::new(10 * UNIT_BYTES);
    assert!(is_in(pin!(queue.put(message(0)))).await);
    let mut large = pin!(queue.put(message(1_000 * UNIT_BYTES)));
    assert!(!is_in(large.as_mut()).await);
    drop(taken.recv().await);
    assert!(is_in(large.as_mut()).await);
}

#[tokio::test]
async fn who_waits_hears_when_nothing_is_written_any_more() {
    let (queue, taken) = Queue::new(UNIT_BYTES);
    assert!(is_in(pin!(queue.put(message(UNIT_BYTES)))).await);
    let mut waits = pin!(queue.put(message(UNIT_BYTES)));
    assert!(!is_in(waits.as_mut()).await);
    drop(taken);
    assert!(!waits.await);
    queue.closed().await;
}
