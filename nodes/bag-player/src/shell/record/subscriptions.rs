//! The recorder's subscriptions: one for each topic, opened when its first publisher is discovered.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::time::Duration;

use geometry::Stamp;
use msgs::builtin_interfaces::Time;
use msgs::convert::stamp_from_time;
use node_shell::{DiscoveredEndpoint, Node, NodeClock, Qos, RawSubscription, ReceivedBytes, Role};
use tokio::sync::mpsc::{self, UnboundedReceiver, UnboundedSender};
use tokio::sync::watch;
use tokio::task::JoinSet;
use tokio::time::{Instant, sleep};

use super::error::RecordError;
use super::options::RecordOptions;
use super::quality::{Quality, WAITING_SMALL};
use super::queue::{Job, Queue};
use super::summary::RecordedTopic;

/// Topics that are recorded, or refused, at most: a graph has some hundred, and a peer may announce any number.
const MOST_TOPICS: usize = 1000;

/// A subscription is replaced when the new one has matched the publishers, or after this time: one may have ended meanwhile.
const LONGEST_OVERLAP: Duration = Duration::from_secs(5);
/// No more messages are received by both: those that wait in both, and those that come in between.
const REMEMBERED: usize = 4 * WAITING_SMALL;
/// How often that is looked for.
const LOOK: Duration = Duration::from_millis(20);

/// All of them.
pub(super) struct Subscriptions<'a> {
    node: &'a Node,
    wanted: Wanted,
    queue: Queue,
    /// The topics that are recorded, and those that cannot be recorded.
    known: BTreeMap<String, Known>,
    /// Those with publishers of another type, which was logged.
    of_two_types: BTreeSet<String>,
    recorded: usize,
    is_full: bool,
    stop: watch::Sender<bool>,
    listening: JoinSet<RecordedTopic>,
}

/// A topic that was found.
struct Known {
    type_name: String,
    /// What is asked of its publishers, and where a subscription goes that asks for less; `None` if it cannot be recorded.
    recorded: Option<(Qos, UnboundedSender<RawSubscription>)>,
}

/// The topics to record, by their absolute names.
pub(super) enum Wanted {
    Only(BTreeSet<String>),
    AllBut(BTreeSet<String>),
}

impl Wanted {
    pub(super) fn new(node: &Node, options: &RecordOptions) -> Result<Self, RecordError> {
        let resolve = |names: &[String]| -> Result<BTreeSet<String>, RecordError> {
            names.iter().map(|name| Ok(node.resolve(name)?)).collect()
        };
        Ok(if options.topics.is_empty() {
            Self::AllBut(resolve(&options.exclude)?)
        } else {
            Self::Only(resolve(&options.topics)?)
        })
    }

    fn contains(&self, topic: &str) -> bool {
        match self {
            Self::Only(topics) => topics.contains(topic),
            Self::AllBut(topics) => !topics.contains(topic),
        }
    }
}

impl<'a> Subscriptions<'a> {
    pub(super) fn new(node: &'a Node, wanted: Wanted, queue: Queue) -> Self {
        Self {
            node,
            wanted,
            queue,
            known: BTreeMap::new(),
            of_two_types: BTreeSet::new(),
            recorded: 0,
            is_full: false,
            stop: watch::Sender::new(false),
            listening: JoinSet::new(),
        }
    }

    /// Subscribes to new topics.
    pub(super) fn open_more(&mut self, survey: &[DiscoveredEndpoint]) {
        let publishers = || survey.iter().filter(|one| one.role == Role::Publisher);
        for publisher in publishers() {
            let DiscoveredEndpoint { topic, type_name, .. } = publisher;
            let of_topic =
                publishers().filter(|one| one.topic == *topic && one.type_name == *type_name);
            match self.known.get(topic) {
                None if self.known.len() >= MOST_TOPICS => self.refuse_more(),
                None if self.wanted.contains(topic) => {
                    self.open(publisher, Quality::of(type_name, of_topic));
                }
                Some(known) if known.type_name == *type_name => {
                    self.weaken(topic, Quality::of(type_name, of_topic).asked);
                }
                Some(Known { type_name: known, .. }) if self.of_two_types.insert(topic.clone()) => {
                    tracing::warn!(
                        "{topic} is published as {known} and as {type_name}: only {known} is recorded"
                    );
                }
                _ => {}
            }
        }
    }

    fn refuse_more(&mut self) {
        if !std::mem::replace(&mut self.is_full, true) {
            tracing::warn!(
                "there are more than {MOST_TOPICS} topics: further ones are not recorded"
            );
        }
    }

    /// Subscribes anew to a topic with a later publisher that offers less than is asked for: it would not match.
    fn weaken(&mut self, topic: &str, offered: Qos) {
        let Some(Known { type_name, recorded: Some((asked, replace)) }) = self.known.get_mut(topic)
        else {
            return;
        };
        let is_reliable = asked.is_reliable() && offered.is_reliable();
        let is_latched = asked.is_transient_local() && offered.is_transient_local();
        if (is_reliable, is_latched) == (asked.is_reliable(), asked.is_transient_local()) {
            return;
        }
        *asked = Qos::new(is_reliable, is_latched, asked.depth());
        let what = if is_reliable { "not latched" } else { "best effort" };
        match self.node.raw_subscription(topic, type_name, asked) {
            Ok(subscription) => {
                tracing::warn!(
                    "{topic} has a further publisher, which is {what}: all are recorded as such"
                );
                // It has ended only when the recording ends.
                let _ended = replace.send(subscription);
            }
            Err(error) => tracing::warn!(
                "{topic} has a further publisher, which is {what} and is not recorded: {error}"
            ),
        }
    }

    fn open(&mut self, publisher: &DiscoveredEndpoint, quality: Quality) {
        let DiscoveredEndpoint { topic, type_name, type_hash, .. } = publisher;
        let (replace, replacements) = mpsc::unbounded_channel();
        let known = Known { type_name: type_name.clone(), recorded: None };
        self.known.insert(topic.clone(), known);
        // A peer that is not a ROS 2 node may have other names; and a remapping may apply to this one.
        if self.node.resolve(topic).as_ref().ok() != Some(topic) {
            tracing::warn!("{topic} is not a valid name of a ROS 2 topic: it is not recorded");
            return;
        }
        let subscription = match self.node.raw_subscription(topic, type_name, &quality.asked) {
            Ok(subscription) => subscription,
            Err(error) => {
                tracing::warn!("{topic} is not recorded: {error}");
                return;
            }
        };
        let definition = msgs::schema_of(type_name);
        let is_defined = definition.is_some();
        if is_defined {
            tracing::info!("recording {topic} ({type_name})");
        } else {
            tracing::warn!(
                "recording {topic} ({type_name}), whose definition is not known here: it can be played, and viewers \
                 must know the type"
            );
        }
        let number = self.recorded;
        let announced = Job::Topic {
            number,
            topic: topic.clone(),
            type_name: type_name.clone(),
            definition: definition.unwrap_or_default(),
            type_hash: type_hash.clone(),
            offered: quality.offered,
        };
        if let Some(known) = self.known.get_mut(topic) {
            known.recorded = Some((quality.asked, replace));
        }
        let ear = Ear {
            subscription,
            replacements,
            written: VecDeque::new(),
            replaced: BTreeSet::new(),
            type_name: type_name.clone(),
            is_defined,
            number,
            clock: self.node.clock(),
            queue: self.queue.clone(),
        };
        self.recorded += 1;
        self.listening.spawn(ear.listen(announced, self.stop.subscribe()));
    }

    /// Takes the messages that have arrived, and ends the subscriptions. Returns the result of each, by name, and the requested
    /// topics without a subscription.
    pub(super) async fn close(self) -> (Vec<RecordedTopic>, Vec<String>) {
        let Self { stop, listening, wanted, .. } = self;
        stop.send_replace(true);
        let mut topics = listening.join_all().await;
        topics.sort_by(|one, other| one.topic.cmp(&other.topic));
        let is_recorded = |name: &String| topics.iter().any(|one| one.topic == *name);
        let not_recorded = match wanted {
            Wanted::AllBut(_) => Vec::new(),
            Wanted::Only(names) => names.into_iter().filter(|name| !is_recorded(name)).collect(),
        };
        (topics, not_recorded)
    }
}

/// One topic that is recorded.
struct Ear {
    subscription: RawSubscription,
    /// Subscriptions that ask for less, each in place of the one before.
    replacements: UnboundedReceiver<RawSubscription>,
    /// When the last messages were sent that were written: a subscription that replaces another receives some of them again, those that
    /// came while there were two, and what the participant still has of before.
    written: VecDeque<Stamp>,
    /// Those that are not to be written again.
    replaced: BTreeSet<Stamp>,
    type_name: String,
    is_defined: bool,
    /// The number of the topic in write jobs.
    number: usize,
    clock: NodeClock,
    queue: Queue,
}

/// What an ear hears next.
enum Next {
    /// A subscription that is to replace its own.
    Newer(Box<RawSubscription>),
    Message(ReceivedBytes),
    /// Whether that has matched the publishers.
    Look,
}

impl Ear {
    async fn listen(mut self, announced: Job, mut stop: watch::Receiver<bool>) -> RecordedTopic {
        let mut topic =
            RecordedTopic::new(self.subscription.topic(), &self.type_name, self.is_defined);
        let mut goes_on = self.queue.put(announced).await;
        let mut newer: Option<(RawSubscription, Instant)> = None;
        while goes_on {
            let next = tokio::select! {
                biased;
                // A dropped sender of the stop signal ends the recording, too.
                _ = stop.wait_for(|stop| *stop) => break,
                Some(newer) = self.replacements.recv(), if newer.is_none() => Next::Newer(Box::new(newer)),
                received = self.subscription.next() => Next::Message(received),
                () = sleep(LOOK), if newer.is_some() => Next::Look,
            };
            match next {
                Next::Newer(subscription) => newer = Some((*subscription, Instant::now())),
                Next::Message(received) => goes_on = self.write(received, &mut topic).await,
                Next::Look => {}
            }
            let before = self.subscription.publisher_count();
            let has_matched = |(newer, since): &mut (RawSubscription, Instant)| {
                newer.publisher_count() > before || since.elapsed() > LONGEST_OVERLAP
            };
            if let Some((newer, _)) = newer.take_if(has_matched) {
                goes_on = goes_on && self.replace(newer, &mut topic).await;
            }
        }
        if let Some((newer, _)) = newer {
            goes_on = goes_on && self.replace(newer, &mut topic).await;
        }
        self.write_rest(goes_on, &mut topic).await;
        // All subscriptions to a topic count together.
        topic.lost = self.subscription.lost_count();
        topic
    }

    /// Goes on with another subscription, after what this one has received; `false` where the writer has ended.
    async fn replace(&mut self, newer: RawSubscription, topic: &mut RecordedTopic) -> bool {
        let mut goes_on = true;
        while goes_on && let Some(received) = self.subscription.try_next() {
            goes_on = self.write(received, topic).await;
        }
        self.subscription = newer;
        self.replaced.extend(self.written.iter().copied());
        goes_on
    }

    /// Messages that arrived before the end are written, however long the disk takes; later ones are not.
    async fn write_rest(&mut self, mut goes_on: bool, topic: &mut RecordedTopic) {
        let mut rest = Vec::new();
        while rest.len() < WAITING_SMALL
            && let Some(received) = self.subscription.try_next()
        {
            rest.push(received);
        }
        for received in rest {
            goes_on = goes_on && self.write(received, topic).await;
        }
    }

    /// Passes a message to the writer, unless the subscription before has; `false` where the writer has ended.
    async fn write(&mut self, received: ReceivedBytes, topic: &mut RecordedTopic) -> bool {
        if received.sent.is_some_and(|sent| self.replaced.remove(&sent)) {
            return true;
        }
        self.written.extend(received.sent);
        if self.written.len() > REMEMBERED {
            self.written.pop_front();
        }
        let now = self.clock.now();
        if now == Time::default() {
            topic.before_clock += 1;
            return true;
        }
        let log_time = stamp_from_time(now);
        // The publisher's clock may have any time; a bag has no times before 1970.
        let publish_time = received.sent.filter(|sent| *sent >= Stamp::default());
        let job = Job::Message {
            number: self.number,
            log_time,
            publish_time: publish_time.unwrap_or(log_time),
            encoded: received.encoded,
        };
        topic.recorded += 1;
        self.queue.put(job).await
    }
}

#[cfg(test)]
mod tests {
    use node_shell::{DiscoveredQos, Host, ParticipantId, Qos, RosArguments};

    use super::super::queue::WAITING_BYTES;
    use super::*;

    /// Each topic that a peer announced was subscribed to, however many.
    #[tokio::test]
    async fn a_peer_with_any_number_of_topics_costs_no_more_than_a_thousand() {
        let arguments = RosArguments::parse(Vec::<String>::new()).unwrap();
        let node = Host::in_process().node("recorder", &arguments).unwrap();
        let (queue, _taken) = Queue::new(WAITING_BYTES);
        let wanted = Wanted::AllBut(BTreeSet::new());
        let mut subscriptions = Subscriptions::new(&node, wanted, queue);
        // Names that are none are remembered like others, and cost the test nothing.
        let topic = |number: u32| DiscoveredEndpoint {
            role: Role::Publisher,
            topic: format!("no name {number}"),
            type_name: "std_msgs/msg/String".to_owned(),
            type_hash: None,
            qos: DiscoveredQos::of_publisher(&Qos::reliable(1)),
            node: None,
            is_before_iron: false,
            participant: ParticipantId([0; 12]),
            addresses: BTreeSet::new(),
        };
        for number in 0..2 * MOST_TOPICS as u32 {
            subscriptions.open_more(&[topic(number)]);
        }
        assert_eq!(subscriptions.known.len(), MOST_TOPICS);
        assert!(subscriptions.is_full);
    }
}
