//! The server: the page at `/`, its data at `/live`, and nothing else.

use std::sync::{Arc, LazyLock};

use axum::Router;
use axum::extract::State;
use axum::extract::ws::WebSocketUpgrade;
use axum::http::header::{
    CACHE_CONTROL, CONTENT_SECURITY_POLICY, CONTENT_TYPE, HOST, ORIGIN, REFERRER_POLICY,
    X_CONTENT_TYPE_OPTIONS,
};
use axum::http::{HeaderMap, HeaderName, StatusCode, Uri};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use node_shell::NodeFailure;
use tokio::net::TcpListener;

use super::browsers;
use super::connection::Limited;
use super::shared::Shared;
use crate::Refusal;

/// Browsers that may look at once.
const MOST_BROWSERS: usize = 16;
/// A browser sends short commands.
const LONGEST_COMMAND_BYTES: usize = 16 * 1024;
/// What a connection may hold back beside the message that is sent.
const WRITE_BUFFER_BYTES: usize = 64 * 1024;
/// The largest message, a block of points over its bound, is below this.
const LONGEST_MESSAGE_BYTES: usize = 16 * 1024 * 1024;

static PAGE: LazyLock<String> = LazyLock::new(report::live_page_html);
static POLICY: LazyLock<String> = LazyLock::new(report::live_page_policy);

pub(super) async fn serve(listener: TcpListener, shared: Arc<Shared>) -> Result<(), NodeFailure> {
    let routes = Router::new().route("/live", get(live)).fallback(page).with_state(shared);
    Ok(axum::serve(Limited::new(listener), routes).await?)
}

async fn page(State(shared): State<Arc<Shared>>, uri: Uri, headers: HeaderMap) -> Response {
    if let Err(refusal) = shared.access.check_page(text(&headers, HOST), token(&uri)) {
        return refused(refusal);
    }
    if uri.path() != "/" {
        return with_headers((StatusCode::NOT_FOUND, "there is nothing here\n"));
    }
    let kind = [(CONTENT_TYPE, "text/html; charset=utf-8")];
    with_headers((kind, PAGE.as_str()))
}

async fn live(
    State(shared): State<Arc<Shared>>,
    uri: Uri,
    headers: HeaderMap,
    upgrade: Result<WebSocketUpgrade, axum::extract::ws::rejection::WebSocketUpgradeRejection>,
) -> Response {
    let (host, origin) = (text(&headers, HOST), text(&headers, ORIGIN));
    if let Err(refusal) = shared.access.check_data(host, origin, token(&uri)) {
        return refused(refusal);
    }
    let upgrade = match upgrade {
        Ok(upgrade) => upgrade,
        Err(rejection) => return rejection.into_response(),
    };
    let Some(looking) = shared.look(MOST_BROWSERS) else {
        let text = format!("{MOST_BROWSERS} browsers look already\n");
        return with_headers((StatusCode::SERVICE_UNAVAILABLE, text));
    };
    upgrade
        .max_message_size(LONGEST_COMMAND_BYTES)
        .max_frame_size(LONGEST_COMMAND_BYTES)
        .write_buffer_size(0)
        .max_write_buffer_size(WRITE_BUFFER_BYTES + LONGEST_MESSAGE_BYTES)
        .on_upgrade(async move |socket| {
            browsers::attend(socket, &shared).await;
            drop(looking);
        })
}

fn refused(refusal: Refusal) -> Response {
    with_headers((StatusCode::FORBIDDEN, format!("{refusal}\n")))
}

/// The page is shown as what it is, in no frame, is kept nowhere, and tells its address, which may have the token, to nobody.
fn with_headers(response: impl IntoResponse) -> Response {
    let headers: [(HeaderName, &str); 4] = [
        (CACHE_CONTROL, "no-store"),
        (REFERRER_POLICY, "no-referrer"),
        (X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (CONTENT_SECURITY_POLICY, POLICY.as_str()),
    ];
    (headers, response).into_response()
}

pub(super) fn text(headers: &HeaderMap, name: HeaderName) -> Option<&str> {
    headers.get(name)?.to_str().ok()
}

/// The token in the address.
pub(super) fn token(uri: &Uri) -> Option<&str> {
    uri.query()?.split('&').find_map(|pair| pair.strip_prefix("token="))
}
