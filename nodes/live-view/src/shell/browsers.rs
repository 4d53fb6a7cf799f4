//! A browser at its connection: it gets what it lacks as fast as it takes it, and its commands are carried out.

use std::sync::Arc;
use std::time::Duration;

use axum::body::Bytes;
use axum::extract::ws::{Message, WebSocket};
use tokio::task::JoinSet;
use tokio::time::Instant;

use super::shared::Shared;
use crate::Browser;

/// Messages that the browser need not have shown yet: one is on its way while it shows the other.
const MOST_UNSHOWN: usize = 2;
/// A browser that shows nothing for so long is dropped; its page connects again when it wakes.
const LONGEST_PAUSE: Duration = Duration::from_secs(20);
/// Commands of one browser that may be under way at once.
const MOST_COMMANDS: usize = 4;
/// What the page answers when it has shown a message.
const SHOWN: &str = "shown";
/// With these it begins and ends to ask for triangles.
const MESH_ON: &str = "mesh on";
const MESH_OFF: &str = "mesh off";

/// Serves one browser until it has gone or shows nothing any more.
pub(super) async fn attend(mut socket: WebSocket, shared: &Arc<Shared>) {
    let mut browser = Browser::default();
    let mut changes = shared.changes();
    let (mut unshown, mut last_shown) = (0, Instant::now());
    // They end with the browser that gave them.
    let mut commands = JoinSet::new();
    let mut wants_mesh = None;
    loop {
        if unshown < MOST_UNSHOWN {
            changes.mark_unchanged();
            // The lock is released before anything is sent.
            let message = browser.next_message(&shared.state());
            if let Some(message) = message {
                if unshown == 0 {
                    last_shown = Instant::now();
                }
                unshown += 1;
                if !send(&mut socket, Message::Binary(Bytes::from_owner(message))).await {
                    return;
                }
                continue;
            }
        }
        tokio::select! {
            received = socket.recv() => match received {
                Some(Ok(Message::Text(text))) if text == SHOWN => {
                    unshown = unshown.saturating_sub(1);
                    last_shown = Instant::now();
                }
                Some(Ok(Message::Text(text))) if text == MESH_ON => {
                    wants_mesh.get_or_insert_with(|| shared.want_mesh());
                    browser.want_mesh(true);
                }
                Some(Ok(Message::Text(text))) if text == MESH_OFF => {
                    wants_mesh = None;
                    browser.want_mesh(false);
                }
                Some(Ok(Message::Text(text))) if commands.len() < MOST_COMMANDS => {
                    let shared = Arc::clone(shared);
                    commands.spawn(async move { shared.commands.carry_out(&text).await });
                }
                Some(Ok(Message::Close(_)) | Err(_)) | None => return,
                Some(Ok(_)) => {}
            },
            Some(Ok(answer)) = commands.join_next() => {
                if !send(&mut socket, Message::text(answer)).await {
                    return;
                }
            }
            _ = changes.changed(), if unshown < MOST_UNSHOWN => {}
            () = tokio::time::sleep_until(last_shown + LONGEST_PAUSE), if unshown > 0 => return,
        }
    }
}

/// Sends a message; whether it was taken in time.
async fn send(socket: &mut WebSocket, message: Message) -> bool {
    matches!(tokio::time::timeout(LONGEST_PAUSE, socket.send(message)).await, Ok(Ok(())))
}
