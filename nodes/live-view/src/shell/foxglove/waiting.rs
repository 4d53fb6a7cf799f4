//! The messages that wait for a viewer: it is sent what is new, however slow its link is.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use tokio::sync::Notify;

/// Which messages of a topic wait for a viewer that takes too little.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Keep {
    /// The newest so many, in order. They keep the places of those that they replace, so that a topic that is published faster than
    /// the viewer takes messages gets its turn.
    Newest(usize),
    /// The first and the last: each replaces the one before, and the last one reaches the viewer whatever comes. It has its
    /// place behind all that came before it: an update that is older does not follow it.
    FirstAndLast,
}

/// A message for a subscription of a viewer.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Delivery {
    pub(super) subscription: u32,
    pub(super) at_ns: u64,
    pub(super) encoded: Arc<[u8]>,
}

/// The messages that wait for one viewer, of all its subscriptions.
#[derive(Default)]
pub(super) struct Waiting {
    queue: Mutex<Queue>,
    changed: Notify,
}

#[derive(Default)]
struct Queue {
    next_key: u64,
    /// In the order in which they are sent, each with the key of its subscription.
    messages: VecDeque<(u64, Delivery)>,
}

/// The end of a subscription at which its messages come in.
pub(super) struct Inlet {
    waiting: Arc<Waiting>,
    key: u64,
    subscription: u32,
    keep: Keep,
}

impl Waiting {
    /// Lets messages of a subscription in.
    pub(super) fn inlet(self: &Arc<Self>, subscription: u32, keep: Keep) -> Inlet {
        let mut queue = self.queue();
        let key = queue.next_key;
        queue.next_key += 1;
        drop(queue);
        Inlet { waiting: Arc::clone(self), key, subscription, keep }
    }

    /// The next message, when there is one. May be dropped while it waits.
    pub(super) async fn next(&self) -> Delivery {
        loop {
            // A permit is kept where the message came before this waits.
            let changed = self.changed.notified();
            if let Some(delivery) = self.take() {
                return delivery;
            }
            changed.await;
        }
    }

    /// The next message, if there is one.
    pub(super) fn take(&self) -> Option<Delivery> {
        self.queue().messages.pop_front().map(|(_, delivery)| delivery)
    }

    fn queue(&self) -> MutexGuard<'_, Queue> {
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Inlet {
    /// Lets a message wait, in place of another where enough of them do.
    pub(super) fn push(&self, at_ns: u64, encoded: Arc<[u8]>) {
        let delivery = Delivery { subscription: self.subscription, at_ns, encoded };
        self.waiting.queue().push(self.key, self.keep, delivery);
        self.waiting.changed.notify_one();
    }
}

impl Drop for Inlet {
    fn drop(&mut self) {
        self.waiting.queue().messages.retain(|(key, _)| *key != self.key);
    }
}

impl Queue {
    fn push(&mut self, key: u64, keep: Keep, delivery: Delivery) {
        let places = self.messages.iter().enumerate().filter(|(_, (of, _))| *of == key);
        let places: Vec<usize> = places.map(|(place, _)| place).collect();
        match (keep, places.as_slice()) {
            (Keep::Newest(most), [.., last]) if places.len() >= most => {
                for pair in places.windows(2) {
                    if let [earlier, later] = *pair {
                        self.messages.swap(earlier, later);
                    }
                }
                if let Some((_, oldest)) = self.messages.get_mut(*last) {
                    *oldest = delivery;
                }
            }
            (Keep::FirstAndLast, [_, last, ..]) => {
                self.messages.remove(*last);
                self.messages.push_back((key, delivery));
            }
            _ => self.messages.push_back((key, delivery)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a viewer is sent that takes nothing before all has come, as pairs of subscription and content.
    fn taken(waiting: &Waiting) -> Vec<(u32, u8)> {
        std::iter::from_fn(|| waiting.take())
            .map(|one| (one.subscription, one.encoded[0]))
            .collect()
    }

    fn message(content: u8) -> Arc<[u8]> {
        [content].into()
    }

    /// Regression: a viewer on a slow link saw everything ten seconds late, behind the images that waited.
    #[test]
    fn of_images_the_newest_waits_in_the_place_of_the_first() {
        let waiting = Arc::new(Waiting::default());
        let images = waiting.inlet(1, Keep::Newest(1));
        let transforms = waiting.inlet(2, Keep::Newest(3));
        for content in 0..5 {
            images.push(0, message(content));
            transforms.push(0, message(10 + content));
        }
        assert_eq!(taken(&waiting), [(1, 4), (2, 12), (2, 13), (2, 14)]);
        images.push(0, message(5));
        assert_eq!(taken(&waiting), [(1, 5)]);
    }

    /// Regression: a map or a static transform that found a hundred messages waiting was dropped for good.
    #[test]
    fn the_last_latched_message_always_waits_and_behind_older_updates() {
        let waiting = Arc::new(Waiting::default());
        let map = waiting.inlet(1, Keep::FirstAndLast);
        let updates = waiting.inlet(2, Keep::Newest(20));
        for content in 0..4 {
            map.push(0, message(content));
            updates.push(0, message(10 + content));
        }
        let expected = [(1, 0), (2, 10), (2, 11), (2, 12), (1, 3), (2, 13)];
        assert_eq!(taken(&waiting), expected);
    }

    #[test]
    fn nothing_of_a_subscription_that_has_ended_is_sent() {
        let waiting = Arc::new(Waiting::default());
        let (ended, other) =
            (waiting.inlet(1, Keep::Newest(9)), waiting.inlet(1, Keep::FirstAndLast));
        ended.push(0, message(0));
        other.push(0, message(1));
        drop(ended);
        assert_eq!(taken(&waiting), [(1, 1)]);
    }

    #[test]
    fn a_viewer_that_waits_gets_what_comes() {
        let waiting = Arc::new(Waiting::default());
        let inlet = waiting.inlet(7, Keep::Newest(1));
        let runtime = tokio::runtime::Builder::new_current_thread().build().unwrap();
        let (delivery, ()) = runtime.block_on(async {
            futures::future::join(waiting.next(), async { inlet.push(3, message(4)) }).await
        });
        assert_eq!(delivery, Delivery { subscription: 7, at_ns: 3, encoded: message(4) });
    }
}
