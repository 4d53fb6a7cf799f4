//! The bag's time on `/clock`.

use std::time::{Duration, Instant};

use geometry::Stamp;
use msgs::builtin_interfaces::Time;
use msgs::rosgraph_msgs::Clock;
use node_shell::{Node, Publisher, Qos, ShellError};

/// The topic that nodes with `use_sim_time` take their time from.
pub(super) const CLOCK_TOPIC: &str = "/clock";

/// Publishes the time at a constant rate.
pub(super) struct BagClock {
    publisher: Publisher<Clock>,
    period: Duration,
    next: Instant,
}

impl BagClock {
    /// A clock with `period` between its messages.
    pub(super) fn start(node: &Node, period: Duration) -> Result<Self, ShellError> {
        let publisher = node.publisher(CLOCK_TOPIC, &Qos::reliable(1))?;
        Ok(Self { publisher, period, next: Instant::now() })
    }

    /// The time until the next publication.
    pub(super) fn due_in(&self) -> Duration {
        self.next.saturating_duration_since(Instant::now())
    }

    /// Publishes the time, if there is one yet, when it is due.
    pub(super) fn update(&mut self, time: Option<Stamp>) {
        if !self.due_in().is_zero() {
            return;
        }
        // Missed ticks are skipped: a past time is of no use.
        let now = Instant::now();
        let steady = self.next.checked_add(self.period).filter(|next| *next > now);
        self.next = steady.or(now.checked_add(self.period)).unwrap_or(now);
        let Some(time) = time else { return };
        let (sec, nanosec) = time.secs_nanos();
        // The next tick has a newer time: a failure needs no report.
        if let Err(error) = self.publisher.publish(Clock { clock: Time { sec, nanosec } }) {
            tracing::debug!("{error}");
        }
    }
}
