//! `stillmap bench subscribe`: the receiving end.

use std::time::{Duration, Instant};

use clap::Args;
use msgs::sensor_msgs::Image;
use node_shell::{GrantedBuffer, Node, RosArguments, Shutdown, Subscription};
use serde::{Deserialize, Serialize};

use super::latency::{Ages, Latencies, LatencyMs};
use super::publish::{PublishArgs, until};
use super::reception::Reception;
use super::sample::{Number, now, sent};
use super::usage::{Usage, own_cpu};
use super::{DeliveryArgs, seconds};
use robot::{Failure, Outcome};

/// How often the number of publishers is checked while no message arrives.
const LOOK_AGAIN: Duration = Duration::from_millis(100);

/// Arguments of `stillmap bench subscribe`.
#[derive(Args, Clone, Debug)]
#[command(after_help = "Example:
  stillmap bench subscribe --topic image --seconds 10 --ros-args -r __ns:=/here")]
#[command(group = clap::ArgGroup::new("length").required(true).multiple(true))]
pub struct SubscribeArgs {
    /// The topic, of type sensor_msgs/msg/Image
    #[arg(long)]
    topic: String,
    /// How long to run
    #[arg(long, group = "length", value_parser = seconds)]
    seconds: Option<Duration>,
    /// The number of messages to receive
    #[arg(long, group = "length")]
    count: Option<u64>,
    #[command(flatten)]
    delivery: DeliveryArgs,
    /// The simulated processing time of each message, in milliseconds
    #[arg(long, value_name = "MILLISECONDS", default_value_t = 0)]
    slow_ms: u32,
}

impl SubscribeArgs {
    /// The receiving end for a publisher in the same process, until it is stopped.
    pub(super) fn beside(publisher: &PublishArgs) -> Self {
        Self {
            topic: publisher.topic.clone(),
            seconds: None,
            count: None,
            delivery: publisher.delivery,
            slow_ms: 0,
        }
    }
}

/// The report of the receiving end.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub(super) struct SubscribeReport {
    /// Received messages.
    pub(super) received: u64,
    /// Messages missing between the first and the last one; absent if the sender does not number them.
    pub(super) lost: Option<u64>,
    /// Messages received after a later one, or twice.
    pub(super) out_of_order: u64,
    /// The time from the start to the first message.
    pub(super) first_s: Option<f64>,
    /// The time from the stamp to when the message was taken.
    pub(super) latency_ms: Option<LatencyMs>,
    /// The greatest age of a message when it was taken, except for the last one.
    pub(super) oldest_age_ms: Option<f64>,
    /// The largest number of publishers at one time.
    pub(super) publishers_peak: usize,
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

/// Receives until it is stopped, and returns the report.
pub(super) fn run(args: &SubscribeArgs, ros: &RosArguments) -> Result<Outcome, Failure> {
    let report = super::as_node("bench_subscriber", ros, async {
        let started = Instant::now();
        let node = Node::start("bench_subscriber", ros).map_err(super::shell_failure)?;
        let report = Receiver::new(args, &node, started)?.run().await;
        node.close().await;
        Ok(report)
    })?;
    super::print_report(&report)
}

/// A running subscription.
pub(super) struct Receiver {
    args: SubscribeArgs,
    subscription: Subscription<Image>,
    shutdown: Shutdown,
    enough: Shutdown,
    granted: Option<GrantedBuffer>,
    started: Instant,
    reception: Reception,
    latencies: Latencies,
    ages: Ages,
    publishers_peak: usize,
    first: Option<Moment>,
    last: Option<Moment>,
}

/// A point in time with the CPU time until then.
#[derive(Clone, Copy)]
struct Moment {
    at: Instant,
    cpu: Duration,
}

impl Moment {
    fn now() -> Self {
        Self { at: Instant::now(), cpu: own_cpu() }
    }
}

impl Receiver {
    pub(super) fn new(
        args: &SubscribeArgs,
        node: &Node,
        started: Instant,
    ) -> Result<Self, Failure> {
        let subscription = node
            .subscription::<Image>(&args.topic, &args.delivery.qos())
            .map_err(super::shell_failure)?;
        Ok(Self {
            args: args.clone(),
            subscription,
            shutdown: node.shutdown_signal(),
            enough: Shutdown::new(),
            granted: node.granted_buffer(),
            started,
            reception: Reception::default(),
            latencies: Latencies::new()?,
            ages: Ages::default(),
            publishers_peak: 0,
            first: None,
            last: None,
        })
    }

    /// Ends the reception when triggered.
    pub(super) fn enough(&self) -> Shutdown {
        self.enough.clone()
    }

    pub(super) async fn run(mut self) -> SubscribeReport {
        self.receive_all().await;
        let (usage, granted) = (Usage::of_this_process(), self.granted);
        let active = self.first.zip(self.last);
        let quantiles = self.latencies.quantiles();
        SubscribeReport {
            received: self.reception.received(),
            lost: self.reception.lost(),
            out_of_order: self.reception.out_of_order(),
            first_s: self.first.map(|first| (first.at - self.started).as_secs_f64()),
            latency_ms: quantiles,
            oldest_age_ms: self.ages.oldest_ms(),
            publishers_peak: self.publishers_peak,
            cpu_s: usage.cpu_s,
            wall_s: self.started.elapsed().as_secs_f64(),
            active_cpu_s: active.map_or(0.0, |(first, last)| (last.cpu - first.cpu).as_secs_f64()),
            active_s: active.map_or(0.0, |(first, last)| (last.at - first.at).as_secs_f64()),
            rss_peak_bytes: usage.rss_peak_bytes,
            rss_end_bytes: usage.rss_bytes,
            granted_buffer_bytes: granted.map(|granted| granted.bytes()),
            largest_safe_bytes: granted.map(|granted| granted.largest_safe_message()),
        }
    }

    async fn receive_all(&mut self) {
        let deadline = self.args.seconds.map(|seconds| self.started + seconds);
        let mut looks = tokio::time::interval(LOOK_AGAIN);
        while self.args.count.is_none_or(|count| self.reception.received() < count) {
            tokio::select! {
                () = self.shutdown.wait() => return,
                () = self.enough.wait() => return,
                () = until(deadline) => return,
                _ = looks.tick() => self.look_for_publishers(),
                received = self.subscription.next() => {
                    self.take(&received.message);
                    self.work(deadline).await;
                }
            }
        }
    }

    fn take(&mut self, image: &Image) {
        let age_s = now().seconds_since(sent(image));
        self.latencies.note(age_s);
        self.ages.note(age_s);
        self.reception.note(Number::of(image));
        let moment = Moment::now();
        self.first.get_or_insert(moment);
        self.last = Some(moment);
        self.look_for_publishers();
    }

    /// Simulates a slow node by a wait, which the stop signal ends.
    async fn work(&self, deadline: Option<Instant>) {
        if self.args.slow_ms > 0 {
            tokio::select! {
                () = self.shutdown.wait() => {}
                () = until(deadline) => {}
                () = tokio::time::sleep(Duration::from_millis(self.args.slow_ms.into())) => {}
            }
        }
    }

    fn look_for_publishers(&mut self) {
        let publishers = self.subscription.publisher_count();
        if self.publishers_peak == 0 && publishers > 0 {
            super::tell_matched();
        }
        self.publishers_peak = self.publishers_peak.max(publishers);
    }
}
