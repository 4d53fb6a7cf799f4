//! A raw topic with the two that are made of it.

use std::collections::VecDeque;
use std::sync::Arc;

use geometry::Stamp;
use msgs::RosMessage;
use msgs::convert::{ConvertError, stamp_from_time};
use msgs::sensor_msgs::{Image, LaserScan, PointCloud2};
use msgs::std_msgs::Header;
use node_shell::{Node, Publisher, Qos, ShellError};

use super::raw_topic::RawTopic;

/// A stamp so much before the last one is the start of another run, not a late message.
const ANOTHER_RUN_S: f64 = 1.0;

/// A message of a sensor.
pub(super) trait Stamped: RosMessage {
    fn header(&self) -> &Header;
}

impl Stamped for LaserScan {
    fn header(&self) -> &Header {
        &self.header
    }
}

impl Stamped for Image {
    fn header(&self) -> &Header {
        &self.header
    }
}

impl Stamped for PointCloud2 {
    fn header(&self) -> &Header {
        &self.header
    }
}

/// When a message was measured.
pub(super) fn stamp_of(message: &impl Stamped) -> Stamp {
    stamp_from_time(message.header().stamp)
}

/// How long and how many messages wait for the cycle that decides them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wait {
    /// By the stamps of later messages.
    pub(super) longest_s: f64,
    pub(super) most: usize,
}

/// A raw topic, subscribed to while one of its filtered topics is wanted.
pub(super) struct Lane<M: Stamped> {
    pub(super) raw: RawTopic<M>,
    statics: Publisher<M>,
    dynamics: Publisher<M>,
    wait: Wait,
    waiting: VecDeque<(Stamp, Arc<M>)>,
    newest: Option<Stamp>,
}

impl<M: Stamped> Lane<M> {
    /// With the names of the raw topic, of what is static in it, and of what moves.
    pub(super) fn new(
        node: &Node,
        [raw_name, statics, dynamics]: [&'static str; 3],
        qos: &Qos,
        wait: Wait,
    ) -> Result<Self, ShellError> {
        Ok(Self {
            raw: RawTopic::new(raw_name),
            statics: node.publisher(statics, qos)?,
            dynamics: node.publisher(dynamics, qos)?,
            wait,
            waiting: VecDeque::new(),
            newest: None,
        })
    }

    /// `is_needed` says that something else is made of the raw topic, too.
    pub(super) fn follow_subscribers(
        &mut self,
        node: &Node,
        qos: &Qos,
        is_needed: bool,
    ) -> Result<(), ShellError> {
        let is_wanted = is_needed || self.is_static_wanted() || self.is_dynamic_wanted();
        if self.raw.is_subscribed() && !is_wanted {
            self.clear();
        }
        self.raw.follow(node, qos, is_wanted)
    }

    pub(super) fn is_static_wanted(&self) -> bool {
        self.statics.subscriber_count() > 0
    }

    pub(super) fn is_dynamic_wanted(&self) -> bool {
        self.dynamics.subscriber_count() > 0
    }

    /// Whether a message waits for its cycle.
    pub(super) fn is_waiting(&self) -> bool {
        !self.waiting.is_empty()
    }

    /// Whether what waits is of another run than a message that has come: the time has jumped back.
    pub(super) fn is_before(&self, message: &M) -> bool {
        let stamp = stamp_of(message);
        self.newest.is_some_and(|newest| newest.seconds_since(stamp) > ANOTHER_RUN_S)
    }

    pub(super) fn push(&mut self, message: Arc<M>) {
        let stamp = stamp_of(&*message);
        // Of another run nothing waits any more.
        self.newest = self.newest.filter(|_| !self.is_before(&message)).max(Some(stamp));
        self.waiting.push_back((stamp, message));
    }

    /// The oldest message, if more of them wait than may; every one where there is no more input.
    pub(super) fn pop_beyond_room(&mut self, at_all: bool) -> Option<Arc<M>> {
        let is_due = at_all || self.waiting.len() > self.wait.most;
        is_due.then(|| self.waiting.pop_front())?.map(|(_, message)| message)
    }

    /// The next message that is decided or has waited for too long, or the next one at all.
    pub(super) fn pop(
        &mut self,
        at_all: bool,
        is_decided: impl Fn(Stamp) -> bool,
    ) -> Option<Arc<M>> {
        let (stamp, _) = self.waiting.front()?;
        let waited_s = self.newest?.seconds_since(*stamp);
        let is_due = at_all
            || waited_s >= self.wait.longest_s
            || self.waiting.len() > self.wait.most
            || is_decided(*stamp);
        if !is_due {
            return None;
        }
        self.waiting.pop_front().map(|(_, message)| message)
    }

    pub(super) fn clear(&mut self) {
        self.waiting.clear();
        self.newest = None;
    }

    /// Sends what is made of a message, as far as it is wanted. What has nothing that moves goes on as the very message.
    pub(super) fn publish(
        &self,
        message: &Arc<M>,
        is_untouched: bool,
        make_static: impl FnOnce() -> Result<M, ConvertError>,
        make_dynamic: impl FnOnce() -> Result<M, ConvertError>,
    ) -> Result<(), ConvertError> {
        // What fails goes out once, as it is.
        let of_dynamic = self.is_dynamic_wanted().then(make_dynamic).transpose()?;
        if self.is_static_wanted() {
            let of_static =
                if is_untouched { Arc::clone(message) } else { Arc::new(make_static()?) };
            self.statics.publish_or_warn(of_static);
        }
        if let Some(of_dynamic) = of_dynamic {
            self.dynamics.publish_or_warn(of_dynamic);
        }
        Ok(())
    }

    /// Sends a message that cannot be filtered as it is, on the static topic.
    pub(super) fn pass_on(&self, message: Arc<M>) {
        if self.is_static_wanted() {
            self.statics.publish_or_warn(message);
        }
    }
}
