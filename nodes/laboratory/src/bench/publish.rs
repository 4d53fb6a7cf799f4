//! `stillmap bench publish`: the sending end.

use std::time::{Duration, Instant};

use clap::Args;
use msgs::sensor_msgs::Image;
use node_shell::{GrantedBuffer, Node, Publisher, RosArguments, Shutdown};
use serde::{Deserialize, Serialize};
use tokio::time::{MissedTickBehavior, interval};

use super::sample::Source;
use super::usage::{Usage, own_cpu};
use super::{DeliveryArgs, seconds};
use robot::{Failure, Outcome};

/// The time for a reader to discover a writer after the writer has discovered the reader: several times the
/// measured time. Without it the first messages of a run would be lost.
const MUTUAL_DISCOVERY: Duration = Duration::from_millis(500);
/// How long the end runs after its last message when only a count is given, so that messages in transit
/// arrive and lost ones are sent again.
const DEFAULT_LINGER: Duration = Duration::from_millis(500);
/// The largest accepted image, more than any camera's: a limit, so that a typing error does not use up the
/// machine's memory.
const LARGEST_BYTES: i64 = 256 << 20;
/// The highest rate of the runtime's timer, which counts in milliseconds.
const FASTEST_HZ: f64 = 1000.0;

/// Arguments of `stillmap bench publish`.
#[derive(Args, Clone, Debug)]
#[command(after_help = "Example:
  stillmap bench publish --topic image --bytes 614400 --hz 30 --seconds 10 --ros-args -r __ns:=/here")]
#[command(group = clap::ArgGroup::new("length").required(true).multiple(true))]
pub struct PublishArgs {
    /// The topic, of type sensor_msgs/msg/Image
    #[arg(long)]
    pub(super) topic: String,
    /// Bytes of data in a message
    #[arg(long, value_parser = clap::value_parser!(u32).range(0..=LARGEST_BYTES))]
    bytes: u32,
    /// Messages per second
    #[arg(long, value_parser = rate)]
    hz: f64,
    /// How long to run; with --count, the time until the end of the process
    #[arg(long, group = "length", value_parser = seconds)]
    seconds: Option<Duration>,
    /// The number of messages to publish
    #[arg(long, group = "length")]
    count: Option<u64>,
    #[command(flatten)]
    pub(super) delivery: DeliveryArgs,
    /// Begin when there is a subscriber; --seconds counts from then
    #[arg(long)]
    wait: bool,
    /// How long to run on after the last message [default: 0.5 with --count alone, 0 otherwise]
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    linger: Option<Duration>,
}

/// The report of the publishing end.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub(super) struct PublishReport {
    /// Messages that the transport accepted.
    pub(super) published: u64,
    /// Messages that it refused.
    pub(super) refused: u64,
    /// Messages that were skipped while the one before was still being sent.
    pub(super) missed_ticks: u64,
    /// The largest number of subscribers at one time.
    pub(super) subscribers_peak: usize,
    /// CPU time on all cores, from the start to the end.
    pub(super) cpu_s: f64,
    /// The duration from the start to the end.
    pub(super) wall_s: f64,
    /// The part of `cpu_s` between the first and the last message.
    pub(super) active_cpu_s: f64,
    /// The duration from the first to the last message.
    pub(super) active_s: f64,
    pub(super) rss_peak_bytes: Option<u64>,
    pub(super) rss_end_bytes: Option<u64>,
    /// The receive buffer that the kernel grants here; absent without a network.
    pub(super) granted_buffer_bytes: Option<usize>,
    /// The size up to which messages arrive completely with that buffer.
    pub(super) largest_safe_bytes: Option<usize>,
}

/// Publishes until it is stopped, and returns the report.
pub(super) fn run(args: &PublishArgs, ros: &RosArguments) -> Result<Outcome, Failure> {
    let report = super::as_node("bench_publisher", ros, async {
        let node = Node::start("bench_publisher", ros).map_err(super::shell_failure)?;
        let report = Sender::new(args, &node)?.run().await;
        node.close().await;
        Ok(report)
    })?;
    super::print_report(&report)
}

/// A running publisher.
pub(super) struct Sender {
    args: PublishArgs,
    publisher: Publisher<Image>,
    source: Source,
    shutdown: Shutdown,
    granted: Option<GrantedBuffer>,
    started: Instant,
    published: u64,
    refused: u64,
    missed_ticks: u64,
    subscribers_peak: usize,
}

impl Sender {
    pub(super) fn new(args: &PublishArgs, node: &Node) -> Result<Self, Failure> {
        let publisher = node
            .publisher::<Image>(&args.topic, &args.delivery.qos())
            .map_err(super::shell_failure)?;
        Ok(Self {
            args: args.clone(),
            publisher,
            source: Source::new(args.bytes),
            shutdown: node.shutdown_signal(),
            granted: node.granted_buffer(),
            started: Instant::now(),
            published: 0,
            refused: 0,
            missed_ticks: 0,
            subscribers_peak: 0,
        })
    }

    pub(super) async fn run(mut self) -> PublishReport {
        if self.args.wait {
            self.wait_for_subscriber().await;
        }
        let (cpu_before, begun) = (own_cpu(), Instant::now());
        let deadline = self.args.seconds.map(|seconds| begun + seconds);
        self.publish_all(deadline).await;
        let active = begun.elapsed();
        let active_cpu = own_cpu().saturating_sub(cpu_before);
        self.stay(deadline).await;
        let (usage, granted) = (Usage::of_this_process(), self.granted);
        PublishReport {
            published: self.published,
            refused: self.refused,
            missed_ticks: self.missed_ticks,
            subscribers_peak: self.subscribers_peak,
            cpu_s: usage.cpu_s,
            wall_s: self.started.elapsed().as_secs_f64(),
            active_cpu_s: active_cpu.as_secs_f64(),
            active_s: active.as_secs_f64(),
            rss_peak_bytes: usage.rss_peak_bytes,
            rss_end_bytes: usage.rss_bytes,
            granted_buffer_bytes: granted.map(|granted| granted.bytes()),
            largest_safe_bytes: granted.map(|granted| granted.largest_safe_message()),
        }
    }

    async fn wait_for_subscriber(&mut self) {
        tokio::select! {
            () = self.shutdown.wait() => return,
            () = self.publisher.wait_for_subscribers(1) => {}
        }
        self.look_for_subscribers();
        tokio::select! {
            () = self.shutdown.wait() => {}
            () = tokio::time::sleep(MUTUAL_DISCOVERY) => {}
        }
    }

    async fn publish_all(&mut self, deadline: Option<Instant>) {
        let period = Duration::from_secs_f64(1.0 / self.args.hz);
        let mut ticks = interval(period);
        // Missed messages are not sent in a burst afterwards, as with a driver.
        ticks.set_missed_tick_behavior(MissedTickBehavior::Skip);
        let mut attempts = 0;
        let mut last_tick: Option<tokio::time::Instant> = None;
        while self.args.count.is_none_or(|count| attempts < count) {
            let tick = tokio::select! {
                biased;
                () = self.shutdown.wait() => return,
                () = until(deadline) => return,
                () = self.publisher.wait_for_subscribers(1), if self.subscribers_peak == 0 => {
                    self.look_for_subscribers();
                    continue;
                }
                tick = ticks.tick() => tick,
            };
            if let Some(last) = last_tick.replace(tick) {
                let periods = (tick - last).as_secs_f64() / period.as_secs_f64();
                self.missed_ticks += (periods.round() as u64).saturating_sub(1);
            }
            attempts += 1;
            self.publish_one();
            self.look_for_subscribers();
        }
    }

    fn publish_one(&mut self) {
        if self.publisher.publish_or_warn(self.source.next()) {
            self.published += 1;
        } else {
            self.refused += 1;
        }
    }

    fn look_for_subscribers(&mut self) {
        let subscribers = self.publisher.subscriber_count();
        if self.subscribers_peak == 0 && subscribers > 0 {
            super::tell_matched();
        }
        self.subscribers_peak = self.subscribers_peak.max(subscribers);
    }

    /// Waits for late subscribers and for retransmissions.
    async fn stay(&mut self, deadline: Option<Instant>) {
        let linger = self.args.linger.unwrap_or(if deadline.is_none() {
            DEFAULT_LINGER
        } else {
            Duration::ZERO
        });
        let end = deadline.unwrap_or_else(Instant::now).max(Instant::now()) + linger;
        loop {
            tokio::select! {
                () = self.shutdown.wait() => return,
                () = until(Some(end)) => return,
                () = self.publisher.wait_for_subscribers(self.subscribers_peak + 1) => {
                    self.look_for_subscribers();
                }
            }
        }
    }
}

/// Waits until a time; without one forever.
pub(super) async fn until(deadline: Option<Instant>) {
    match deadline {
        Some(deadline) => tokio::time::sleep_until(deadline.into()).await,
        None => std::future::pending().await,
    }
}

/// Parses a rate on the command line.
pub(super) fn rate(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(hz) if hz > 0.0 && hz <= FASTEST_HZ => Ok(hz),
        _ => Err(format!("accepted are rates above 0, up to {FASTEST_HZ} a second")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_are_positive_and_within_what_the_timer_can() {
        assert_eq!(rate("7.5"), Ok(7.5));
        for bad in ["0", "-1", "nan", "inf", "1001", ""] {
            assert!(rate(bad).is_err(), "{bad}");
        }
    }
}
