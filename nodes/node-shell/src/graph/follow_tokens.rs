//! The tokens of others on Zenoh, applied to the graph.

use rustdds::GUID;

use super::names::ParticipantNodes;
use super::{Endpoint, Graph, Misfit, Role};
use crate::graph::exchange::EndpointId;
use crate::settings::names::{dds_request_topic_name, dds_response_topic_name, ros_type_name};
use crate::wire::rmw_zenoh::keys::{Kind, Token, UNKNOWN_HASH};
use crate::wire::rmw_zenoh::session::Tokens;

/// The most tokens of others that are kept.
const MOST_TOKENS: usize = 1 << 16;

/// What follows the name of a type whose definition is another one.
const OTHER_DEFINITION: &str = " of another definition";

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
                    Some((token, true)) => {
                        let is_own = is_own(&token);
                        self.token_found(token, is_own);
                    }
                    Some((token, false)) => self.token_gone(&token),
                    None => return,
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
        if is_own {
            return;
        }
        self.match_token(&token, |_, _| true);
        let mut tokens = self.lock_tokens();
        if tokens.len() < MOST_TOKENS {
            tokens.insert(token.to_string(), token);
        }
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
    /// are the same to the last field.
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
            let is_any = [hash.as_str(), end.hash.as_str()].contains(&UNKNOWN_HASH);
            if dds_type == end.dds_type && hash != end.hash && !is_any {
                let other = format!("{}{OTHER_DEFINITION}", ros_type_name(&dds_type));
                self.misfit(own, peer, Misfit::OtherType(other));
            } else {
                self.matched(own, peer, Some(end.dds_type.clone()));
            }
        }
    }
}

#[cfg(test)]
mod tests;
