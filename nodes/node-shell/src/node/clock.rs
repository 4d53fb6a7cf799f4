//! A node's time: that of the wall clock or, with `use_sim_time`, that of `/clock`.
//!
//! Data keep the stamps that they came with. This is the time by which a node waits and repeats, and which it puts on what
//! it says about itself.

#[cfg(test)]
mod tests;

use std::sync::Arc;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use geometry::Stamp;
use msgs::builtin_interfaces::Time;
use msgs::rosgraph_msgs::Clock;
use tokio::sync::watch;
use tokio::time::Instant;

use crate::endpoints::subscription::Subscription;

/// The topic that simulations and players publish their time on.
pub(crate) const CLOCK_TOPIC: &str = "/clock";

/// The time of a node. Clones share it.
#[derive(Clone, Debug)]
pub struct NodeClock {
    /// None where the node goes by the wall clock.
    simulated: Option<Arc<Simulated>>,
}

/// The readings of `/clock`.
#[derive(Debug)]
struct Simulated {
    reading: watch::Sender<Reading>,
    origin: Instant,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
struct Reading {
    /// None before the first message.
    now: Option<Stamp>,
    /// How far the time has run forward in all. A jump back takes nothing of it away.
    progress: Duration,
    /// How often it has jumped back.
    jumps: u64,
}

impl Reading {
    fn set(&mut self, now: Stamp) {
        let forward_ns =
            self.now.map_or(0, |before| now.as_nanos().saturating_sub(before.as_nanos()));
        match u64::try_from(forward_ns) {
            Ok(nanos) => {
                self.progress = self.progress.saturating_add(Duration::from_nanos(nanos));
            }
            Err(_) => self.jumps += 1,
        }
        self.now = Some(now);
    }
}

impl NodeClock {
    pub(crate) fn new(use_sim_time: bool) -> Self {
        let simulated = || {
            Arc::new(Simulated {
                reading: watch::Sender::new(Reading::default()),
                origin: Instant::now(),
            })
        };
        Self { simulated: use_sim_time.then(simulated) }
    }

    /// Follows the topic until `stop` resolves.
    pub(crate) async fn follow(self, topic: Subscription<Clock>, stop: impl Future<Output = ()>) {
        futures::pin_mut!(stop);
        loop {
            tokio::select! {
                () = &mut stop => return,
                clock = topic.next() => self.set(stamp_of(clock.message.clock)),
            }
        }
    }

    fn set(&self, now: Stamp) {
        if let Some(simulated) = &self.simulated {
            simulated.reading.send_modify(|reading| reading.set(now));
        }
    }

    /// The time; 0 before the first message on `/clock`, as in ROS 2.
    #[must_use]
    pub fn now(&self) -> Time {
        match &self.simulated {
            None => wall_clock(),
            Some(simulated) => {
                let (sec, nanosec) =
                    simulated.reading.borrow().now.unwrap_or_default().secs_nanos();
                Time { sec, nanosec }
            }
        }
    }

    /// The time for measuring how long something takes: it stops while `/clock` does, and runs on after a jump
    /// back.
    #[must_use]
    pub fn instant(&self) -> Instant {
        match &self.simulated {
            None => Instant::now(),
            Some(simulated) => {
                let progress = simulated.reading.borrow().progress;
                simulated.origin.checked_add(progress).unwrap_or(simulated.origin)
            }
        }
    }

    /// Waits for this long.
    pub async fn sleep(&self, duration: Duration) {
        match &self.simulated {
            None => tokio::time::sleep(duration).await,
            Some(simulated) => {
                let mut readings = simulated.reading.subscribe();
                let until = readings.borrow().progress.saturating_add(duration);
                // The sender lives as long as the clock.
                let _ = readings.wait_for(|reading| reading.progress >= until).await;
            }
        }
    }

    /// Jumps back from now on.
    #[must_use]
    pub fn jumps(&self) -> ClockJumps {
        let readings = self.simulated.as_ref().map(|simulated| simulated.reading.subscribe());
        let seen = readings.as_ref().map_or(0, |readings| readings.borrow().jumps);
        ClockJumps { readings, seen }
    }
}

/// Reports when a node's time has jumped back, as it does when a recording starts anew.
#[derive(Debug)]
pub struct ClockJumps {
    readings: Option<watch::Receiver<Reading>>,
    seen: u64,
}

impl ClockJumps {
    /// Waits for a jump back; returns the time after it. The wall clock has none.
    pub async fn next(&mut self) -> Stamp {
        let seen = self.seen;
        if let Some(readings) = &mut self.readings
            && let Ok(reading) = readings.wait_for(|reading| reading.jumps > seen).await
        {
            self.seen = reading.jumps;
            return reading.now.unwrap_or_default();
        }
        std::future::pending().await
    }
}

fn stamp_of(time: Time) -> Stamp {
    Stamp::from_secs_nanos(time.sec, time.nanosec)
}

fn wall_clock() -> Time {
    let since_epoch = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    Time {
        sec: i32::try_from(since_epoch.as_secs()).unwrap_or(i32::MAX),
        nanosec: since_epoch.subsec_nanos(),
    }
}
