//! The library's events about other participants, applied to the graph.

use std::collections::BTreeMap;

use futures::stream::BoxStream;
use futures::{Stream, StreamExt};
use rustdds::{
    DomainParticipant, DomainParticipantStatusEvent, GUID, LostReason, QosPolicies, StatusEvented,
};

use super::names::ParticipantNodes;
use super::{Endpoint, Graph, Misfit, Prefix, TroubleKind};
use crate::graph::exchange::EndpointId;

/// The prefix that ROS 2 puts in front of the names of the topics that a service has on the wire.
const REQUESTS: &str = "rq/";
const RESPONSES: &str = "rr/";

impl Graph {
    /// Follows the participant's events, and what names the nodes `announced`, until `stop` resolves.
    pub(crate) async fn follow(
        self,
        participant: DomainParticipant,
        announced: Option<impl Stream<Item = ParticipantNodes> + Send>,
        stop: impl Future<Output = ()>,
    ) {
        let listener = participant.status_listener();
        let events = listener.as_async_status_stream();
        let mut announced: BoxStream<'_, ParticipantNodes> = match announced {
            Some(announced) => announced.boxed(),
            None => futures::stream::pending().boxed(),
        };
        futures::pin_mut!(events);
        futures::pin_mut!(stop);
        loop {
            tokio::select! {
                () = &mut stop => return,
                event = events.next() => match event {
                    Some(event) => self.take(&event, &participant),
                    None => return,
                },
                Some(nodes) = announced.next() => self.lock_names().take(nodes),
            }
        }
    }

    fn take(&self, event: &DomainParticipantStatusEvent, participant: &DomainParticipant) {
        use DomainParticipantStatusEvent as Event;
        match event {
            Event::RemoteReaderMatched { local_writer, remote_reader } => {
                let data = participant
                    .discovered_readers()
                    .into_iter()
                    .map(|reader| reader.subscription_topic_data)
                    .find(|data| data.key() == *remote_reader);
                if let Some(data) = &data
                    && data.topic_name().starts_with(RESPONSES)
                {
                    let mut clients = self.lock_clients();
                    clients.reader_found(data.topic_name(), *local_writer, *remote_reader);
                    drop(clients);
                    self.exchange.notify();
                    return;
                }
                if let Some(data) = &data
                    && data.topic_name().starts_with(REQUESTS)
                {
                    self.lock_servers().found(data.topic_name(), *remote_reader);
                    self.exchange.notify();
                    return;
                }
                let peer_type = data.map(|data| data.type_name().clone());
                self.matched(*local_writer, *remote_reader, peer_type);
            }
            Event::RemoteWriterMatched { local_reader, remote_writer } => {
                let data = participant
                    .discovered_writers()
                    .into_iter()
                    .map(|writer| writer.publication_topic_data)
                    .find(|data| data.key == *remote_writer);
                if let Some(data) = &data
                    && data.topic_name().starts_with(REQUESTS)
                {
                    self.lock_clients().writer_found(data.topic_name(), *remote_writer);
                    self.exchange.notify();
                    return;
                }
                if let Some(data) = &data
                    && data.topic_name().starts_with(RESPONSES)
                {
                    self.lock_servers().found(data.topic_name(), *remote_writer);
                    self.exchange.notify();
                    return;
                }
                let peer_type = data.map(|data| data.type_name);
                self.matched(*local_reader, *remote_writer, peer_type);
            }
            Event::ReaderLost { guid, .. } | Event::WriterLost { guid, .. } => {
                self.lost(|peer| peer == guid);
            }
            Event::ParticipantLost { id, reason } => {
                let Ok(prefix) = Prefix::try_from(id.as_ref()) else { return };
                self.participant_lost(prefix, reason);
            }
            Event::ParticipantDiscovered { dpd } => {
                let Ok(prefix) = Prefix::try_from(dpd.guid.prefix.as_ref()) else { return };
                self.participant_heard(prefix);
            }
            Event::RemoteReaderQosIncompatible {
                local_writer,
                remote_reader,
                requested_qos,
                offered_qos,
            } => {
                self.incompatible((*local_writer, *remote_reader), offered_qos, requested_qos);
            }
            Event::RemoteWriterQosIncompatible {
                local_reader,
                remote_writer,
                requested_qos,
                offered_qos,
            } => {
                self.incompatible((*local_reader, *remote_writer), offered_qos, requested_qos);
            }
            _ => {}
        }
    }

    /// Notes that a participant has ended, or was not heard for longer than its lease.
    pub(crate) fn participant_lost(&self, prefix: Prefix, reason: &LostReason) {
        let is_of_it = |peer: &GUID| *peer.prefix.as_ref() == prefix;
        match reason {
            LostReason::Timeout { elapsed, .. } => {
                let endpoints = self.lock();
                let has_part = |endpoint: &Endpoint| {
                    endpoint.peers.iter().any(is_of_it) || endpoint.misfits.keys().any(is_of_it)
                };
                let unconcerned = endpoints
                    .iter()
                    .filter(|(_, endpoint)| !has_part(endpoint))
                    .map(|(id, _)| *id)
                    .collect();
                drop(endpoints);
                let dropped = self.lock_broken().fell_silent(prefix, unconcerned);
                tracing::warn!(
                    "{} was not heard for {:.0} s and is dropped until it is heard again",
                    self.lock_names().of_participant(prefix),
                    elapsed.to_nanoseconds() as f64 * 1e-9
                );
                if let Some(dropped) = dropped {
                    self.lock_names().forget(&dropped);
                }
            }
            LostReason::Disposed => {
                self.lock_broken().ended(prefix);
                self.lock_names().forget(&prefix);
            }
        }
        self.lost(is_of_it);
    }

    /// Notes that a participant is heard, perhaps again.
    pub(crate) fn participant_heard(&self, prefix: Prefix) {
        let Some(unconcerned) = self.lock_broken().heard(prefix) else { return };
        tracing::info!("{} is heard again", self.lock_names().of_participant(prefix));
        let renewals: Vec<_> = self
            .lock()
            .iter()
            .filter(|(id, _)| !unconcerned.contains(id))
            .filter_map(|(_, endpoint)| endpoint.renewal.as_ref()?.upgrade())
            .collect();
        for renewal in renewals {
            renewal.renew();
        }
    }

    pub(super) fn matched(&self, own: GUID, peer: GUID, peer_type: Option<String>) {
        let mut endpoints = self.lock();
        let Some(endpoint) = of_guid(&mut endpoints, own) else { return };
        match peer_type {
            Some(other) if other != endpoint.dds_type => {
                drop(endpoints);
                self.misfit(own, peer, Misfit::OtherType(other));
                return;
            }
            _ => {
                // It may have been one that did not fit, and has changed what it offers.
                endpoint.misfits.remove(&peer);
                endpoint.peers.insert(peer);
                tracing::debug!(
                    "{}: {} {}(s)",
                    endpoint.topic,
                    endpoint.peers.len(),
                    endpoint.role.peers()
                );
            }
        }
        drop(endpoints);
        self.exchange.notify();
    }

    pub(super) fn incompatible(
        &self,
        (own, peer): (GUID, GUID),
        offered: &QosPolicies,
        requested: &QosPolicies,
    ) {
        let (offered, requested) = (Box::new(offered.clone()), Box::new(requested.clone()));
        self.misfit(own, peer, Misfit::Incompatible { offered, requested });
    }

    /// Notes a peer that does not fit, and logs it when it is new.
    pub(super) fn misfit(&self, own: GUID, peer: GUID, misfit: Misfit) {
        let who = self.lock_names().of(peer);
        let mut endpoints = self.lock();
        let Some(endpoint) = of_guid(&mut endpoints, own) else { return };
        let trouble = endpoint.trouble(&who, &misfit);
        endpoint.peers.remove(&peer);
        if endpoint.misfits.insert(peer, misfit).is_none() {
            match trouble.kind {
                TroubleKind::OtherType => tracing::error!("{}: {}", trouble.topic, trouble.text),
                TroubleKind::Incompatible => tracing::warn!("{}: {}", trouble.topic, trouble.text),
            }
        }
        drop(endpoints);
        self.exchange.notify();
    }

    pub(super) fn lost(&self, is_lost: impl Fn(&GUID) -> bool) {
        self.lock_clients().lost(&is_lost);
        self.lock_servers().lost(&is_lost);
        for endpoint in self.lock().values_mut() {
            endpoint.peers.retain(|peer| !is_lost(peer));
            endpoint.misfits.retain(|peer, _| !is_lost(peer));
        }
        self.exchange.notify();
    }
}

fn of_guid(endpoints: &mut BTreeMap<EndpointId, Endpoint>, guid: GUID) -> Option<&mut Endpoint> {
    endpoints.values_mut().find(|endpoint| endpoint.guid == Some(guid))
}
