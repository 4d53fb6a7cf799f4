//! Subscriptions to messages of one type.

use std::collections::{BTreeMap, VecDeque};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use geometry::Stamp;
use msgs::RosMessage;
use rustdds::GUID;

use crate::endpoints::counters::TopicCounters;
use crate::endpoints::gate::Gate;
use crate::endpoints::reader::{self, Outside};
use crate::graph::OpenEndpoint;
use crate::graph::inbox::{self, Queue, Received};
use crate::graph::value::{Arrived, Incoming};
use crate::process::throttle::Throttle;

/// Senders whose last message is remembered: a node that starts again is another one each time. Of more all are forgotten, and what
/// is missing before their next message is not counted.
const MOST_SENDERS: usize = 1024;

/// Receives messages of one type, from its own host and from outside.
///
/// A [`ValueSubscription`] receives values of one type: those of its own host as they were published, those from outside as
/// messages.
pub struct Subscription<I: Incoming> {
    topic: Arc<str>,
    queue: Arc<Queue<I>>,
    endpoint: OpenEndpoint,
    /// None where the host is on no network.
    reader: Option<Outside<I::Message>>,
    counters: Arc<TopicCounters>,
    sequence: Mutex<BTreeMap<GUID, i64>>,
    /// Messages from outside that wait, `depth` of them at most.
    waiting: Mutex<VecDeque<Waiting<I::Message>>>,
    depth: usize,
    /// Whether the newest message alone counts: older ones that it took the place of are no loss.
    newest_alone: bool,
    malformed: Throttle,
    /// Open while the node works.
    gate: Gate,
    /// Its turns at the last look.
    turns_seen: AtomicU64,
}

/// Receives values of one type.
pub type ValueSubscription<T> = Subscription<Arrived<T>>;

/// A message from outside, and how many are missing before it.
struct Waiting<M> {
    received: Received<M>,
    lost_before: u64,
}

impl<I: Incoming> Subscription<I> {
    pub(crate) fn new(
        (topic, depth): (&str, usize),
        queue: Arc<Queue<I>>,
        reader: Option<Outside<I::Message>>,
        endpoint: OpenEndpoint,
        (counters, gate): (Arc<TopicCounters>, Gate),
    ) -> Self {
        Self {
            topic: topic.into(),
            queue,
            endpoint,
            reader,
            counters,
            sequence: Mutex::default(),
            waiting: Mutex::default(),
            depth,
            newest_alone: false,
            malformed: Throttle::for_warnings(),
            turns_seen: AtomicU64::new(gate.turns()),
            gate,
        }
    }

    /// The same for who wants the newest message alone: no older one is counted as lost.
    pub(crate) fn of_newest(self) -> Self {
        Self { newest_alone: true, ..self }
    }

    /// Waits for the next message. May be dropped while waiting: no message is lost by that.
    ///
    /// Messages that cannot be decoded, or of another type, are counted, logged once in a
    /// while, and ignored.
    ///
    /// An inactive node gets nothing; nor, when it is active again, the messages of the meantime.
    pub async fn next(&self) -> Received<I> {
        loop {
            self.skip_what_came_while_closed();
            let received = tokio::select! {
                biased;
                taken = self.queue.next() => self.accept_from_host(taken),
                received = self.next_from_outside() => received,
            };
            if self.gate.is_open() {
                return received;
            }
        }
    }

    /// The next message if it is here already.
    pub fn try_next(&self) -> Option<Received<I>> {
        self.skip_what_came_while_closed();
        self.take_any()
    }

    fn skip_what_came_while_closed(&self) {
        let turns = self.gate.turns();
        if self.turns_seen.swap(turns, Ordering::AcqRel) != turns || !self.gate.is_open() {
            while self.take_any().is_some() {}
        }
    }

    fn take_any(&self) -> Option<Received<I>> {
        if let Some(taken) = self.queue.take() {
            return Some(self.accept_from_host(taken));
        }
        self.take_from_outside(self.reader.as_ref()?)
    }

    /// The topic, by its absolute name.
    #[must_use]
    pub fn topic(&self) -> &str {
        &self.topic
    }

    /// How many publishers there are.
    #[must_use]
    pub fn publisher_count(&self) -> usize {
        self.endpoint.peers()
    }

    /// Waits until there are at least `least` publishers.
    pub async fn wait_for_publishers(&self, least: usize) {
        self.endpoint.wait_for_peers(least).await;
    }

    /// How many messages were received so far.
    #[must_use]
    pub fn received_count(&self) -> u64 {
        self.counters.received()
    }

    /// How many messages are missing between those that were received.
    #[must_use]
    pub fn lost_count(&self) -> u64 {
        self.counters.lost()
    }

    /// How many messages were left out so far since newer ones took their places while none was taken: this node is slower than they
    /// come. They are among the lost ones; the others were lost on their way.
    #[must_use]
    pub fn left_out_count(&self) -> u64 {
        if let Some(reader) = &self.reader {
            self.fill(reader, &mut self.lock_waiting());
        }
        self.counters.left_out() + self.queue.missed()
    }

    /// Replaces the reader, as when broken messages have filled the memory.
    #[cfg(test)]
    pub(crate) fn renew_reader(&self) {
        if let Some(link) =
            self.reader.as_ref().and_then(|reader| reader.dds()?.renewal().upgrade())
        {
            link.renew();
        }
    }

    /// Distinguishes readers.
    #[cfg(test)]
    pub(crate) fn reader_in_use(&self) -> Option<usize> {
        self.reader.as_ref()?.dds().map(reader::Reader::in_use)
    }

    async fn next_from_outside(&self) -> Received<I> {
        let Some(reader) = &self.reader else { return std::future::pending().await };
        loop {
            if let Some(received) = self.take_from_outside(reader) {
                return received;
            }
            // Nothing is here, so what is missing before the next message never was.
            // Publishers of this host hand their messages over: the reader is silent however much they publish.
            let taken = reader.next(|| self.endpoint.peers_outside() > 0).await;
            if let Some(waiting) = self.accept(taken) {
                reader.heard(&waiting.received.message, waiting.lost_before);
                self.lock_waiting().push_back(waiting);
            }
        }
    }

    /// The next message from outside if it is here already.
    fn take_from_outside(&self, reader: &Outside<I::Message>) -> Option<Received<I>> {
        let mut waiting = self.lock_waiting();
        self.fill(reader, &mut waiting);
        let next = waiting.pop_front()?;
        self.count_received(next.lost_before);
        let Received { message, sent } = next.received;
        Some(Received { message: I::of_message(message), sent })
    }

    /// Takes all that the library has, and leaves out the oldest where more wait than may. The library's own cache holds one message
    /// more than its setting, and gives the oldest first: a slow reader would always be a period behind.
    fn fill(&self, reader: &Outside<I::Message>, waiting: &mut VecDeque<Waiting<I::Message>>) {
        let waited = waiting.len();
        while let Some(taken) = reader.take() {
            let accepted = self.accept(taken);
            // What is missing before it may have been displaced by it.
            accepted.iter().for_each(|waiting| reader.heard(&waiting.received.message, 0));
            waiting.extend(accepted);
        }
        self.counters.count_left_out(trim(waiting, waited, self.depth));
    }

    fn accept_from_host(&self, taken: inbox::Taken<I>) -> Received<I> {
        self.counters.count_left_out(taken.missed);
        self.count_received(taken.missed);
        taken.received
    }

    fn count_received(&self, missing_before: u64) {
        self.counters.count_received(if self.newest_alone { 0 } else { missing_before });
    }

    fn accept(&self, taken: reader::Taken<I::Message>) -> Option<Waiting<I::Message>> {
        let (message, info) = match taken {
            Ok(taken) => taken,
            Err(error) => {
                self.refuse(&error);
                return None;
            }
        };
        let sender = GUID::from(info.publisher_gid());
        if self.endpoint.is_sibling(sender) {
            // It came through the exchange already.
            return None;
        }
        if self.endpoint.is_foreign(sender) {
            self.counters.count_malformed();
            return None;
        }
        let mut sequence = self.sequence.lock().unwrap_or_else(PoisonError::into_inner);
        let lost_before = missing_before(&mut sequence, sender, info.sequence_number())?;
        drop(sequence);
        let sent = info.source_timestamp().map(|time| Stamp::from_nanos(time.to_nanos()));
        let received = Received { message: Arc::new(message), sent };
        Some(Waiting { received, lost_before })
    }

    fn lock_waiting(&self) -> MutexGuard<'_, VecDeque<Waiting<I::Message>>> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn refuse(&self, error: &ros2_client::ReadError) {
        self.counters.count_malformed();
        if let Some(held_back) = self.malformed.pass() {
            tracing::warn!(
                "{}: a message is no valid {} and is ignored ({held_back} more since the last \
                 warning): {error}",
                self.topic,
                I::Message::TYPE_NAME
            );
        }
    }
}

/// Leaves out the oldest where more wait than may, of which the first `waited` did so before the others came together. Returns how many
/// messages were left out, with those that the library left out for as many others as it may hold.
fn trim<M>(waiting: &mut VecDeque<Waiting<M>>, waited: usize, depth: usize) -> u64 {
    let was_full = waiting.len() - waited.min(waiting.len()) >= depth;
    let by_library =
        waiting.get(waited).filter(|_| was_full).map_or(0, |oldest| oldest.lost_before);
    let too_many = waiting.len().saturating_sub(depth);
    let lost: u64 = waiting.drain(..too_many).map(|displaced| displaced.lost_before + 1).sum();
    if let Some(next) = waiting.front_mut() {
        next.lost_before += lost;
    }
    by_library + too_many as u64
}

/// How many messages are missing between this one and the last one of the same sender; none for a message that was there
/// before, which a new reader finds once more.
fn missing_before(last: &mut BTreeMap<GUID, i64>, sender: GUID, number: i64) -> Option<u64> {
    let before = last.get(&sender).copied();
    if before.is_some_and(|before| number <= before) {
        return None;
    }
    if before.is_none() && last.len() >= MOST_SENDERS {
        last.clear();
    }
    last.insert(sender, number);
    let missing = before.map_or(0, |before| number.saturating_sub(before).saturating_sub(1));
    Some(u64::try_from(missing).unwrap_or(0))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sender(number: u32) -> GUID {
        let mut bytes = [0; 16];
        bytes[..4].copy_from_slice(&number.to_le_bytes());
        GUID::from_bytes(bytes)
    }

    #[test]
    fn what_is_missing_is_counted_by_sender_and_what_comes_twice_is_none() {
        let mut last = BTreeMap::new();
        assert_eq!(missing_before(&mut last, sender(1), 5), Some(0));
        assert_eq!(missing_before(&mut last, sender(2), 1), Some(0));
        assert_eq!(missing_before(&mut last, sender(1), 8), Some(2));
        assert_eq!(missing_before(&mut last, sender(1), 8), None);
        assert_eq!(missing_before(&mut last, sender(1), i64::MAX), Some(i64::MAX as u64 - 9));
    }

    /// A sender was remembered as long as the node ran, and each start of a node is another one.
    #[test]
    fn senders_that_come_and_go_take_no_more_memory() {
        let mut last = BTreeMap::new();
        for number in 0..10_000 {
            assert_eq!(missing_before(&mut last, sender(number), 1), Some(0));
            assert!(last.len() <= MOST_SENDERS);
        }
    }

    /// What waits, each with how many are missing before it.
    fn waiting(lost_before: &[u64]) -> VecDeque<Waiting<u32>> {
        let one = |(number, lost_before): (usize, &u64)| Waiting {
            received: Received { message: Arc::new(number as u32), sent: None },
            lost_before: *lost_before,
        };
        lost_before.iter().enumerate().map(one).collect()
    }

    #[test]
    fn what_gave_way_to_newer_messages_is_told_from_what_was_lost_on_its_way() {
        // Two are missing in a queue with room: lost on their way.
        let mut some = waiting(&[0, 2]);
        assert_eq!((trim(&mut some, 0, 3), some.len()), (0, 2));
        // As many as the library holds came together: what is missing before them gave way to them.
        let mut full = waiting(&[7, 0, 1]);
        assert_eq!((trim(&mut full, 0, 3), full.front().unwrap().lost_before), (7, 7));
        // One waited, and gives way to the last; what is missing is known of the next.
        let mut more = waiting(&[1, 0, 0, 0]);
        assert_eq!((trim(&mut more, 2, 3), more.front().unwrap().lost_before), (1, 2));
    }
}
