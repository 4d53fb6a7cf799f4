//! The page of the live view: the 3D view of the report, fed by a connection to the program that serves it.

use maud::{PreEscaped, html};
use serde_json::json;

use crate::RANGE_STEP_M;
use crate::html_document::document;
use crate::payload::{self, HEIGHT_COLOURS, json_in_script};
use crate::scene;

/// The style of what only this page has.
const STYLE: &str = include_str!("../page/live.css");

/// The Content-Security-Policy of the page: its script and no other, connections to its own server, and no page around it. It is to be
/// sent as a header too, since a page cannot forbid by itself that others put it in a frame.
#[must_use]
pub fn live_page_policy() -> String {
    // Browsers pass over frame-ancestors in the page itself.
    format!("{}; frame-ancestors 'none'", policy_in_page())
}

fn policy_in_page() -> String {
    format!("{}; connect-src 'self'", scene::content_security_policy())
}

/// The page of the live view. It is the same for all: what is shown comes by the connection.
#[must_use]
pub fn live_page_html() -> String {
    let header = json!({
        "height_colours": HEIGHT_COLOURS, "range_step_m": RANGE_STEP_M, "cloud_step_m": payload::CLOUD_STEP_M,
    });
    let body = html! {
        header.live-head {
            p.kicker { "stillmap live view" }
            p.connection id="connection" role="status" { "connecting" }
        }
        main {
            div id="live" { "The live view needs a browser that runs scripts and has WebGL 2." }
        }
        script type="application/json" id="live-header" { (PreEscaped(json_in_script(&header))) }
        (scene::script())
    };
    let style = format!("{}{STYLE}", scene::STYLE);
    document("live view", &style, Some(&policy_in_page()), &body)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_may_connect_to_its_own_server_and_is_in_no_frame() {
        let page = live_page_html();
        assert!(page.contains("connect-src 'self'") && page.contains("id=\"live-header\""));
        let policy = live_page_policy();
        assert!(policy.contains("frame-ancestors 'none'") && policy.contains("sha256-"));
    }
}
