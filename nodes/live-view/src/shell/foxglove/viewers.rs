//! A viewer at its connection: the channels that it subscribes to, and their messages as it takes them.

use std::collections::HashMap;
use std::sync::Arc;
use std::time::Duration;

use axum::body::Bytes;
use axum::extract::ws::{Message, WebSocket};
use tokio::time::MissedTickBehavior;

use super::channels::{Channels, Subscribed};
use super::waiting::{Delivery, Waiting};
use crate::foxglove::{Request, advertise, message, request, server_info, warning};

/// Subscriptions of one viewer.
const MOST_SUBSCRIPTIONS: usize = 256;
/// A viewer is asked for a sign of life once in this time: it need not say anything by itself.
const PING_PERIOD: Duration = Duration::from_secs(10);
/// A viewer that takes no message for so long is dropped.
const LONGEST_PAUSE: Duration = Duration::from_secs(20);

/// Serves one viewer until it has gone or takes nothing any more.
pub(super) async fn attend(mut socket: WebSocket, session: &str, channels: &Channels) {
    let hello = [server_info(session), advertise(&channels.advertised())];
    for text in hello {
        if !send(&mut socket, Message::text(text)).await {
            return;
        }
    }
    let waiting = Arc::new(Waiting::default());
    let mut subscriptions: HashMap<u32, Subscribed> = HashMap::new();
    let mut ping = tokio::time::interval(PING_PERIOD);
    ping.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        let to_send = tokio::select! {
            received = socket.recv() => match received {
                Some(Ok(Message::Text(text))) => {
                    match take(&text, &mut subscriptions, channels, &waiting) {
                        Ok(()) => continue,
                        Err(problem) => Message::text(warning(&problem)),
                    }
                }
                Some(Ok(Message::Close(_)) | Err(_)) | None => return,
                Some(Ok(_)) => continue,
            },
            Delivery { subscription, at_ns, encoded } = waiting.next() => {
                Message::Binary(Bytes::from(message(subscription, at_ns, &encoded)))
            }
            _ = ping.tick() => Message::Ping(Bytes::new()),
        };
        if !send(&mut socket, to_send).await {
            return;
        }
    }
}

/// Does what a viewer asks for, or says why not.
fn take(
    text: &str,
    subscriptions: &mut HashMap<u32, Subscribed>,
    channels: &Channels,
    waiting: &Arc<Waiting>,
) -> Result<(), String> {
    match request(text) {
        Some(Request::Subscribe(pairs)) => {
            for (id, channel) in pairs {
                if subscriptions.len() >= MOST_SUBSCRIPTIONS {
                    return Err(format!("a viewer may have {MOST_SUBSCRIPTIONS} subscriptions"));
                }
                let subscribed = channels
                    .subscribe(channel, id, waiting)
                    .ok_or_else(|| format!("there is no channel {channel}"))?;
                subscriptions.insert(id, subscribed);
            }
            Ok(())
        }
        Some(Request::Unsubscribe(ids)) => {
            ids.iter().for_each(|id| drop(subscriptions.remove(id)));
            Ok(())
        }
        Some(Request::Other(operation)) => Err(format!("stillmap has no {operation} for viewers")),
        None => Err("this request is not of Foxglove's protocol".to_owned()),
    }
}

/// Sends a message; whether it was taken in time.
async fn send(socket: &mut WebSocket, message: Message) -> bool {
    matches!(tokio::time::timeout(LONGEST_PAUSE, socket.send(message)).await, Ok(Ok(())))
}
