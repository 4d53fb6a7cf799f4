//! The tokens that came or went and were not looked at yet.

use std::collections::{BTreeMap, VecDeque};
use std::sync::{Arc, Mutex, PoisonError};

use tokio::sync::Notify;

use super::keys::Token;
use crate::process::throttle::Throttle;

/// The most that wait: three times the endpoints of a graph of a hundred nodes.
pub(crate) const MOST_WAITING: usize = 1 << 14;
/// The longest token that is taken: names of ROS 2 have at most 255 characters, and a token has those of the node, the topic and
/// its type, beside some 200 others.
const LONGEST: usize = 2048;

/// A queue between Zenoh's thread and a node. Of each token it has the last state alone, so that one that comes and goes again and
/// again takes one place.
pub(crate) struct TokenChanges {
    waiting: Mutex<Waiting>,
    arrival: Notify,
    refused: Throttle,
}

#[derive(Default)]
struct Waiting {
    is_there: BTreeMap<Arc<str>, bool>,
    order: VecDeque<Arc<str>>,
}

impl TokenChanges {
    pub(crate) fn new() -> Self {
        Self {
            waiting: Mutex::default(),
            arrival: Notify::new(),
            refused: Throttle::for_warnings(),
        }
    }

    /// Notes that a token has come, or gone.
    pub(crate) fn note(&self, key: &str, is_there: bool) {
        if key.len() > LONGEST {
            return self.refuse("has a name of more than 2048 characters");
        }
        let mut waiting = self.waiting.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(state) = waiting.is_there.get_mut(key) {
            *state = is_there;
        } else if waiting.order.len() < MOST_WAITING {
            let key: Arc<str> = key.into();
            waiting.is_there.insert(Arc::clone(&key), is_there);
            waiting.order.push_back(key);
        } else {
            drop(waiting);
            return self.refuse("came while 16384 others waited");
        }
        drop(waiting);
        self.arrival.notify_one();
    }

    /// The token that waits for longest, and whether it has come. What is no token of a ROS 2 is left out.
    pub(crate) async fn next(&self) -> (Token, bool) {
        loop {
            // Made before the look, so that no arrival in between is missed.
            let arrival = self.arrival.notified();
            while let Some((key, is_there)) = self.take() {
                if let Some(token) = Token::parse(&key) {
                    return (token, is_there);
                }
            }
            arrival.await;
        }
    }

    fn take(&self) -> Option<(Arc<str>, bool)> {
        let mut waiting = self.waiting.lock().unwrap_or_else(PoisonError::into_inner);
        let key = waiting.order.pop_front()?;
        waiting.is_there.remove_entry(&key)
    }

    fn refuse(&self, reason: &str) {
        if let Some(held_back) = self.refused.pass() {
            tracing::warn!(
                "an endpoint that was announced on Zenoh {reason} and is not seen ({held_back} more since the last warning)"
            );
        }
    }
}

#[cfg(test)]
mod tests {
    use futures::FutureExt;

    use super::*;

    fn node(name: usize) -> String {
        format!("@ros2_lv/7/aa/{name}/{name}/NN/%/%/node_{name}")
    }

    fn taken(changes: &TokenChanges) -> Vec<(u64, bool)> {
        let next = || changes.next().now_or_never();
        std::iter::from_fn(next).map(|(token, is_there)| (token.entity_id, is_there)).collect()
    }

    #[test]
    fn each_token_is_given_once_with_its_last_state_in_the_order_of_arrival() {
        let changes = TokenChanges::new();
        for (name, is_there) in [(3, true), (1, true), (3, false), (2, true), (3, true), (1, false)]
        {
            changes.note(&node(name), is_there);
        }
        changes.note("@ros2_lv/7/what/is/none", true);
        assert_eq!(taken(&changes), [(3, true), (1, false), (2, true)]);
        changes.note(&node(3), false);
        assert_eq!(taken(&changes), [(3, false)]);
    }

    /// A peer that announces without end must not fill the memory of a node that is busy.
    #[test]
    fn a_flood_of_tokens_waits_within_a_bound() {
        let changes = TokenChanges::new();
        for round in 0..2 {
            for name in 0..MOST_WAITING + 100 {
                changes.note(&node(name), round == 0);
            }
        }
        changes.note(&format!("{}{}", node(0), "x".repeat(LONGEST)), true);
        let taken = taken(&changes);
        assert_eq!(taken.len(), MOST_WAITING);
        assert!(taken.iter().all(|(_, is_there)| !is_there));
    }

    #[tokio::test]
    async fn who_waits_is_woken() {
        let changes = Arc::new(TokenChanges::new());
        let noting = Arc::clone(&changes);
        let note = async move {
            tokio::task::yield_now().await;
            noting.note(&node(5), true);
        };
        let (next, ()) = tokio::join!(changes.next(), note);
        assert_eq!((next.0.entity_id, next.1), (5, true));
    }
}
