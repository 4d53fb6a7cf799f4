//! The tokens of others on Zenoh, applied to the graph.

use rustdds::GUID;

use super::names::ParticipantNodes;
use super::{Endpoint, Graph, Misfit, Role};
use crate::graph::exchange::EndpointId;
use crate::process::throttle::Throttle;
use crate::settings::names::{dds_request_topic_name, dds_response_topic_name};
use crate::wire::rmw_zenoh::keys::{Kind, Token, UNKNOWN_HASH};
use crate::wire::rmw_zenoh::session::Tokens;

/// The most tokens of others that are known; what is announced beyond is not seen.
const MOST_TOKENS: usize = 1 << 14;

static REFUSED: Throttle = Throttle::for_warnings();

impl Graph {
    /// Follows the tokens until `stop` resolves. `is_own` tells those of this process.
    pub(crate) async fn follow_tokens(
        self,
        mut tokens: Tokens,
        is_own: impl Fn(&Token) -> bool,
        stop: impl Future<Output = ()>,
    ) {
        futures::pin_mut!(stop);
        loop {
            tokio::select! {
                () = &mut stop => return,
                change = tokens.next() => match change {
                    (token, true) => {
                        let is_own = is_own(&token);
                        self.token_found(token, is_own);
                    }
                    (token, false) => self.token_gone(&token),
                },
            }
        }
    }

    /// The tokens of other processes.
    pub(super) fn tokens(&self) -> Vec<Token> {
        self.lock_tokens().values().cloned().collect()
    }

    /// Matches a new endpoint of the node with what others have.
    pub(crate) fn match_tokens(&self, id: EndpointId) {
        let tokens = self.tokens();
        for token in &tokens {
            self.match_token(token, |one, _| *one == id);
        }
    }

    pub(super) fn token_found(&self, token: Token, is_own: bool) {
        if !is_own && !self.keep(&token) {
            return;
        }
        let participant = token.node.participant();
        let nodes = ParticipantNodes::of_node(participant, &token.node.namespace, &token.node.name);
        self.lock_names().take(nodes);
        if let (Kind::Server, Some(end)) = (token.kind, &token.end) {
            let guid = GUID::from_bytes(token.guid_bytes());
            let mut servers = self.lock_servers();
            servers.found(&dds_request_topic_name(&end.name), guid);
            servers.found(&dds_response_topic_name(&end.name), guid);
            drop(servers);
            self.exchange.notify();
        }
        // What this process has is matched by the exchange.
        if !is_own {
            self.match_token(&token, |_, _| true);
        }
    }

    /// Whether there is room for the token of another process.
    fn keep(&self, token: &Token) -> bool {
        let mut tokens = self.lock_tokens();
        let key = token.to_string();
        let has_room = tokens.len() < MOST_TOKENS || tokens.contains_key(&key);
        if has_room {
            tokens.insert(key, token.clone());
        } else if let Some(held_back) = REFUSED.pass() {
            tracing::warn!(
                "{MOST_TOKENS} endpoints of others are known, and further ones are not seen ({held_back} more since the last warning)"
            );
        }
        has_room
    }

    pub(super) fn token_gone(&self, token: &Token) {
        self.lock_tokens().remove(&token.to_string());
        if token.kind == Kind::Node {
            self.lock_names().forget(&token.node.participant());
        }
        let guid = GUID::from_bytes(token.guid_bytes());
        self.lost(|peer| *peer == guid);
    }

    /// Every publisher and subscription of one name talk with each other on Zenoh, whatever their quality of service, if their types
    /// are the same to the last field. Who does not know the definition subscribes to any, and publishes to such subscriptions alone.
    fn match_token(&self, token: &Token, is_meant: impl Fn(&EndpointId, &Endpoint) -> bool) {
        let role = match token.kind {
            Kind::Publisher => Role::Subscription,
            Kind::Subscription => Role::Publisher,
            _ => return,
        };
        let Some(end) = &token.end else { return };
        let peer = GUID::from_bytes(token.guid_bytes());
        let ours: Vec<_> = self
            .lock()
            .iter()
            .filter(|(id, one)| one.role == role && one.topic == end.name && is_meant(id, one))
            .filter_map(|(_, one)| Some((one.guid?, one.dds_type.clone(), one.hash.clone())))
            .collect();
        for (own, dds_type, hash) in ours {
            let (publishers, subscriptions) = match role {
                Role::Publisher => (hash.as_str(), end.hash.as_str()),
                Role::Subscription => (end.hash.as_str(), hash.as_str()),
            };
            let is_heard = subscriptions == publishers || subscriptions == UNKNOWN_HASH;
            if dds_type != end.dds_type || is_heard {
                // Another type is found there.
                self.matched(own, peer, Some(end.dds_type.clone()));
                continue;
            }
            let is_known = end.hash != UNKNOWN_HASH;
            self.misfit(own, peer, Misfit::OtherDefinition { is_known });
        }
    }
}

#[cfg(test)]
mod tests;
