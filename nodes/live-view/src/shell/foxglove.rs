//! The node `foxglove` with its server: the topics of the suite for viewers that speak Foxglove's websocket protocol.
//!
//! A topic is subscribed to while a viewer subscribes to it, and encoded once for all of them. A viewer that takes too little gets
//! fewer messages, and what it gets is new; nothing waits for it.

mod channels;
mod retained;
mod viewers;
mod waiting;

use std::net::SocketAddr;
use std::sync::Arc;

use axum::Router;
use axum::extract::State;
use axum::extract::ws::WebSocketUpgrade;
use axum::extract::ws::rejection::WebSocketUpgradeRejection;
use axum::http::header::{HOST, ORIGIN};
use axum::http::{HeaderMap, StatusCode, Uri};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use node_shell::{Node, NodeFailure, Throttle};

use self::channels::Channels;
use super::connection::Limited;
use super::own_thread::{OwnServer, on_own_thread};
use super::server::{text, token};
use super::status::cut;
use super::{GraphOf, ViewError};
use crate::ViewerAccess;
use crate::foxglove::SUBPROTOCOLS;

/// The name of the node.
pub const FOXGLOVE_NODE: &str = "foxglove";

/// Where viewers connect by default: this machine alone, at the port that Foxglove proposes.
pub const FOXGLOVE_ADDRESS: &str = "127.0.0.1:8765";

/// A viewer sends short requests.
const LONGEST_REQUEST_BYTES: usize = 64 * 1024;

/// A server for viewers that listens, and does not answer yet.
pub struct FoxgloveServer {
    listener: std::net::TcpListener,
    shown: SocketAddr,
    access: ViewerAccess,
}

/// What the connections share.
struct Served {
    access: ViewerAccess,
    session: String,
    channels: Channels,
    refused: Throttle,
}

impl FoxgloveServer {
    /// Listens on an address; port 0 is one that is free.
    ///
    /// # Errors
    /// When the address cannot be listened on.
    pub fn bind(address: SocketAddr) -> Result<Self, ViewError> {
        let OwnServer { listener, address, shown, random } = OwnServer::bind(address)?;
        Ok(Self { listener, shown, access: ViewerAccess::on(address.ip(), random) })
    }

    /// The address for viewers, with the token where they need it.
    #[must_use]
    pub fn url(&self) -> String {
        match &self.access {
            ViewerAccess { is_local: true, .. } => format!("ws://{}/", self.shown),
            ViewerAccess { .. } => self.url_with_token(),
        }
    }

    /// The address with the token, which on this machine only pages of other sites than Foxglove's need.
    #[must_use]
    pub fn url_with_token(&self) -> String {
        format!("ws://{}/?token={}", self.shown, self.access.token.text())
    }

    /// Serves as `node` until the process is to end, on a thread of its own, and leaves the network.
    ///
    /// # Errors
    /// When a topic cannot be had, or the server fails.
    pub async fn serve(self, node: Node, graph: GraphOf) -> Result<(), NodeFailure> {
        on_own_thread(FOXGLOVE_NODE, node, move |node| self.run(node, graph)).await
    }

    fn run(self, node: &Arc<Node>, graph: GraphOf) -> Result<(), NodeFailure> {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
        let (channels, feeds) = channels::of(node, graph);
        let session = std::process::id().to_string();
        let Self { listener, access, .. } = self;
        let refused = Throttle::for_warnings();
        let served = Arc::new(Served { access, session, channels, refused });
        let shutdown = node.shutdown_signal();
        runtime.block_on(async {
            let listener = Limited::new(tokio::net::TcpListener::from_std(listener)?);
            let routes = Router::new().route("/", get(connect)).with_state(served);
            tokio::select! {
                served = axum::serve(listener, routes) => Ok(served?),
                fed = futures::future::try_join_all(feeds) => fed.map(|_| ()),
                () = shutdown.wait() => Ok(()),
            }
        })
    }
}

async fn connect(
    State(served): State<Arc<Served>>,
    uri: Uri,
    headers: HeaderMap,
    upgrade: Result<WebSocketUpgrade, WebSocketUpgradeRejection>,
) -> Response {
    let (host, origin) = (text(&headers, HOST), text(&headers, ORIGIN));
    if let Err(refusal) = served.access.check(host, origin, token(&uri)) {
        // The log is read by others: it has no token, and whoever asks again and again does not fill it.
        if let Some(held_back) = served.refused.pass() {
            tracing::warn!(
                "a viewer of the page {:?} is refused: {refusal}; the address that was printed at the start lets it in ({held_back} more since the last warning)",
                cut(origin.unwrap_or("none"))
            );
        }
        return (StatusCode::FORBIDDEN, format!("{refusal}\n")).into_response();
    }
    let upgrade = match upgrade {
        Ok(upgrade) => upgrade.protocols(SUBPROTOCOLS),
        Err(_) => {
            let says = "open this address in Foxglove: Open connection, Foxglove WebSocket\n";
            return (StatusCode::UPGRADE_REQUIRED, says).into_response();
        }
    };
    if upgrade.selected_protocol().is_none() {
        let says =
            format!("a viewer must offer one of the protocols {}\n", SUBPROTOCOLS.join(", "));
        return (StatusCode::BAD_REQUEST, says).into_response();
    }
    upgrade
        .max_message_size(LONGEST_REQUEST_BYTES)
        .max_frame_size(LONGEST_REQUEST_BYTES)
        .write_buffer_size(0)
        .on_upgrade(async move |socket| {
            viewers::attend(socket, &served.session, &served.channels).await;
        })
}
