use super::*;

fn at(seconds: f64) -> Stamp {
    Stamp::default().plus_seconds(seconds)
}

/// Whether a future is not done yet.
async fn waits(future: impl Future<Output = ()>) -> bool {
    tokio::time::timeout(Duration::from_millis(20), future).await.is_err()
}

#[tokio::test]
async fn the_time_is_that_of_the_topic() {
    let clock = NodeClock::new(true);
    assert_eq!(clock.now(), Time::default());
    clock.set(at(100.0));
    clock.set(at(100.5));
    assert_eq!(clock.now(), Time { sec: 100, nanosec: 500_000_000 });
    let wall = NodeClock::new(false);
    wall.set(at(100.0));
    assert!(wall.now().sec > 1_600_000_000);
}

#[tokio::test]
async fn who_waits_goes_by_the_topic() {
    let clock = NodeClock::new(true);
    clock.set(at(100.0));
    let second = clock.sleep(Duration::from_secs(1));
    tokio::pin!(second);
    assert!(waits(&mut second).await, "the time has stopped");
    clock.set(at(100.9));
    assert!(waits(&mut second).await);
    clock.set(at(101.0));
    assert!(!waits(&mut second).await);
}

/// The first message is no time that has passed.
#[tokio::test]
async fn the_first_reading_ends_no_wait() {
    let clock = NodeClock::new(true);
    let second = clock.sleep(Duration::from_secs(1));
    tokio::pin!(second);
    assert!(waits(&mut second).await);
    clock.set(at(1e6));
    assert!(waits(&mut second).await);
}

#[tokio::test]
async fn a_jump_back_is_reported_once_and_takes_no_time_away() {
    let clock = NodeClock::new(true);
    let mut jumps = clock.jumps();
    let origin = clock.instant();
    for seconds in [10.0, 13.0, 2.0, 2.0, 4.0] {
        clock.set(at(seconds));
    }
    assert_eq!(clock.instant() - origin, Duration::from_secs(5));
    assert_eq!(clock.now(), Time { sec: 4, nanosec: 0 });
    let jump = tokio::time::timeout(Duration::from_secs(5), jumps.next()).await;
    assert_eq!(jump, Ok(at(4.0)));
    assert!(waits(async { _ = jumps.next().await }).await, "there was one jump");
    clock.set(at(1.0));
    assert!(!waits(async { _ = jumps.next().await }).await);
    assert!(waits(async { _ = NodeClock::new(false).jumps().next().await }).await);
}

#[tokio::test]
async fn the_wall_clock_goes_by_itself() {
    let clock = NodeClock::new(false);
    let start = clock.instant();
    clock.sleep(Duration::from_millis(5)).await;
    assert!(clock.instant() - start >= Duration::from_millis(5));
}
