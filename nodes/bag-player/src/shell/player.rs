//! The loop of the player: the schedule, the network, the clock and the keys.

use std::time::{Duration, Instant};

use geometry::Stamp;
use node_shell::{Node, RawPublisher, Shutdown};
use tokio::time::{sleep, timeout};

use crate::bag::Bag;
use crate::message::{BagMessage, bare};
use crate::messages::Messages;
use crate::schedule::{Decision, Schedule};
use crate::shell::clock::BagClock;
use crate::shell::compress::{CompressError, Compression};
use crate::shell::keys::{Key, Keys};
use crate::shell::offers::Offers;
use crate::shell::options::PlayOptions;
use crate::shell::pace::Pace;
use crate::shell::play::PlayError;
use crate::shell::read_ahead::{Ahead, PassEnd, ReadAhead};
use crate::shell::status::StatusLine;
use crate::shell::summary::{Ending, TopicSummary};

/// A match is known here before it is known to the subscriber, which drops messages until then.
const SETTLE: Duration = Duration::from_millis(200);

/// How often a node that is behind is checked.
const LOOK_AGAIN: Duration = Duration::from_millis(5);

/// The number of publish failures that are logged; all are counted.
const MAX_FAILURES_REPORTED: u64 = 5;

/// A bag that is being played.
pub(super) struct Player {
    schedule: Schedule,
    offers: Offers,
    clock: Option<BagClock>,
    pace: Pace,
    /// When it was last held back.
    held_at: Option<Duration>,
    keys: Keys,
    status: StatusLine,
    shutdown: Shutdown,
    late_above: Duration,
    /// The origin of the schedule's time.
    origin: Instant,
    failures_reported: u64,
    /// Messages of before the played part that were published.
    earlier: u64,
}

/// The result of playback.
pub(super) struct Played {
    pub(super) ending: Ending,
    pub(super) passes: u64,
    /// Published messages that are latched from before the played part.
    pub(super) earlier: u64,
    /// The reader's result of the last completed pass.
    pub(super) reader: PassEnd,
}

impl Player {
    /// A player of the part `span` of a bag. From now on it reads the keys.
    pub(super) fn new(
        schedule: Schedule,
        offers: Offers,
        (clock, pace): (Option<BagClock>, Pace),
        span: (Stamp, Stamp),
        late_above: Duration,
        shutdown: Shutdown,
    ) -> Self {
        let keys = Keys::listen();
        let status = StatusLine::new(span, keys.are_there());
        let origin = Instant::now();
        Self {
            schedule,
            offers,
            clock,
            pace,
            held_at: None,
            keys,
            status,
            shutdown,
            late_above,
            origin,
            failures_reported: 0,
            earlier: 0,
        }
    }

    /// The counts of published messages; ends the publishers.
    pub(super) fn into_summaries(self) -> Vec<TopicSummary> {
        self.offers.into_summaries()
    }

    fn now(&self) -> Duration {
        self.origin.elapsed()
    }

    /// Waits until each of `topics` has a subscriber.
    pub(super) async fn wait_for_subscribers(
        &self,
        node: &Node,
        topics: &[String],
        patience: Duration,
    ) -> Result<(), PlayError> {
        let mut awaited: Vec<&RawPublisher> = Vec::new();
        for topic in topics {
            let name = node.resolve(topic)?;
            // Names in a bag are usually absolute, and users leave the slash out.
            let publisher = self
                .offers
                .publisher(&name)
                .or_else(|| self.offers.publisher(&format!("/{}", bare(topic))));
            awaited.push(publisher.ok_or_else(|| PlayError::WaitForUnplayed {
                topic: topic.clone(),
                available: self.offers.published_names().join(", "),
            })?);
        }
        tracing::info!("waiting for subscribers of {}", topics.join(", "));
        let all = async {
            for publisher in &awaited {
                publisher.wait_for_subscribers(1).await;
            }
            sleep(SETTLE).await;
        };
        tokio::select! {
            () = self.shutdown.wait() => Ok(()),
            waited = timeout(patience, all) => waited.map_err(|_| {
                let without = awaited.iter().filter(|publisher| publisher.subscriber_count() == 0);
                let names: Vec<&str> = without.map(|publisher| publisher.topic()).collect();
                PlayError::NoSubscriber {
                    topics: names.join(", "),
                    seconds: patience.as_secs_f64(),
                }
            }),
        }
    }

    /// Waits until the reports of --pace have publishers.
    pub(super) async fn wait_for_reports(&self, patience: Duration) -> Result<(), PlayError> {
        let all = async {
            while !self.pace.unreported().is_empty() {
                sleep(LOOK_AGAIN).await;
            }
        };
        tokio::select! {
            () = self.shutdown.wait() => Ok(()),
            waited = timeout(patience, all) => waited.map_err(|_| PlayError::NoReports {
                topics: self.pace.unreported().join(", "),
                seconds: patience.as_secs_f64(),
            }),
        }
    }

    /// Plays until the end of the bag, a key or a signal.
    pub(super) async fn run(
        &mut self,
        bag: &Bag,
        options: &PlayOptions,
        compression: &Compression,
        messages: Messages,
    ) -> Result<Played, PlayError> {
        let result = self.play_passes(bag, options, compression, messages).await;
        self.status.clear();
        result
    }

    async fn play_passes(
        &mut self,
        bag: &Bag,
        options: &PlayOptions,
        compression: &Compression,
        messages: Messages,
    ) -> Result<Played, PlayError> {
        let latched = self.offers.latched();
        let earlier = latched.before(bag, &options.selection())?;
        let mut ahead =
            ReadAhead::start(earlier, messages, compression).map_err(PlayError::Thread)?;
        let mut passes = 1;
        // Until a pass has read the whole bag, the losses that are known without reading.
        let mut reader = PassEnd { losses: bag.losses().to_vec(), ..PassEnd::default() };
        let mut next = ahead.next().await?;
        loop {
            let mut ending = self.shutdown.is_triggered().then_some(Ending::Interrupted);
            while let Some(key) = self.keys.try_next() {
                ending = ending.or(self.press(key));
            }
            let now = self.now();
            if let Some(held_at) = self.held_at.take() {
                self.schedule.stand(now.saturating_sub(held_at));
            }
            let time = self.schedule.bag_time(now);
            self.status.update(time, self.schedule.is_paused());
            if let Some(clock) = &mut self.clock {
                clock.update(time);
            }
            let stamp = next.as_ref().map(|next| next.message.log_time);
            if ending.is_none() && next.as_ref().is_some_and(|next| next.is_earlier) {
                if let Some(next) = next.take() {
                    self.publish_earlier(next)?;
                }
                next = ahead.next().await?;
            } else if ending.is_none() && self.is_held(next.as_ref(), time) {
                self.held_at = Some(now);
                ending = self.idle(Some(LOOK_AGAIN)).await;
            } else if ending.is_none() {
                ending = match self.schedule.decide(now, stamp) {
                    Decision::Publish { late } => {
                        match next.take() {
                            Some(Ahead { fault: Some(fault), message, .. }) => {
                                self.refuse(&message, &fault)?;
                            }
                            Some(Ahead { message, .. }) => self.publish(&message, late),
                            None => {}
                        }
                        next = ahead.next().await?;
                        None
                    }
                    Decision::Wait(wait) => self.idle(Some(wait)).await,
                    Decision::Paused => self.idle(None).await,
                    Decision::Rewind => {
                        passes += 1;
                        reader = ahead.take_end();
                        let messages = bag.messages(&options.selection())?;
                        let earlier = latched.before(bag, &options.selection())?;
                        ahead = ReadAhead::start(earlier, messages, compression)
                            .map_err(PlayError::Thread)?;
                        next = ahead.next().await?;
                        None
                    }
                    Decision::Finished => {
                        reader = ahead.take_end();
                        Some(Ending::Finished)
                    }
                };
            }
            if let Some(ending) = ending {
                return Ok(Played { ending, passes, earlier: self.earlier, reader });
            }
        }
    }

    /// Whether the next message is due, and a node is behind with earlier messages.
    fn is_held(&mut self, next: Option<&Ahead>, time: Option<Stamp>) -> bool {
        let due = next.filter(|next| time.is_some_and(|time| time >= next.message.log_time));
        !self.schedule.is_paused()
            && due.is_some_and(|next| self.pace.holds_or_drops(&next.message, Instant::now()))
    }

    /// Waits until the next message is due, or for a key, the clock or the shutdown.
    async fn idle(&mut self, wait: Option<Duration>) -> Option<Ending> {
        let clock_due = self.clock.as_ref().map(BagClock::due_in);
        let status_due = self.status.is_watched().then(|| self.status.due_in());
        let shortest = [wait, clock_due, status_due].into_iter().flatten().min();
        tokio::select! {
            () = self.shutdown.wait() => Some(Ending::Interrupted),
            key = self.keys.next() => self.press(key),
            () = sleep_or_never(shortest) => None,
        }
    }

    fn press(&mut self, key: Key) -> Option<Ending> {
        let now = self.now();
        match key {
            Key::Pause if self.schedule.is_paused() => self.schedule.resume(now),
            Key::Pause => self.schedule.pause(now),
            Key::Step => self.schedule.step(),
            Key::Quit => return Some(Ending::Quit),
        }
        None
    }

    fn publish(&mut self, message: &BagMessage, late: Duration) {
        self.pace.published(message);
        match self.offers.publish(message) {
            Some(Ok(())) if late > self.late_above => {
                self.offers.count_late(&message.topic, late.as_secs_f64());
            }
            Some(Err(error)) => self.report(&error),
            _ => {}
        }
    }

    /// Publishes a message that is latched from before the played part: it is neither late nor held back.
    fn publish_earlier(&mut self, Ahead { message, fault, .. }: Ahead) -> Result<(), PlayError> {
        if let Some(fault) = fault {
            return self.refuse(&message, &fault);
        }
        match self.offers.publish(&message) {
            Some(Ok(())) => self.earlier += 1,
            Some(Err(error)) => self.report(&error),
            None => {}
        }
        Ok(())
    }

    /// Counts a message that could not be compressed; a topic of images of another kind is an error.
    fn refuse(&mut self, message: &BagMessage, fault: &CompressError) -> Result<(), PlayError> {
        if fault.is_of_topic() {
            return Err(PlayError::CompressOtherImages(fault.to_string()));
        }
        self.offers.count_failed(&message.topic);
        self.report(fault);
        Ok(())
    }

    fn report(&mut self, failure: &dyn std::fmt::Display) {
        self.failures_reported += 1;
        if self.failures_reported <= MAX_FAILURES_REPORTED {
            tracing::error!("{failure}");
        }
    }
}

async fn sleep_or_never(wait: Option<Duration>) {
    match wait {
        Some(wait) => sleep(wait).await,
        None => std::future::pending().await,
    }
}
