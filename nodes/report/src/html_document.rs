//! The head and foot of every page.

use maud::{DOCTYPE, Markup, PreEscaped, html};

/// The style that all pages share.
const STYLE: &str = include_str!("html_document/style.css");

/// A whole document. `own_style` comes after the style that all share. A page with a script has a `policy` that allows it
/// (Content-Security-Policy).
pub(crate) fn document(
    title: &str,
    own_style: &str,
    policy: Option<&str>,
    body: &Markup,
) -> String {
    let markup = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                @if let Some(policy) = policy { meta http-equiv="Content-Security-Policy" content=(policy); }
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                title { "stillmap: " (title) }
                style { (PreEscaped(STYLE)) (PreEscaped(own_style)) }
            }
            body { (body) }
        }
    };
    markup.into_string()
}

/// A table that scrolls where it is wider than the page, with the keyboard, too.
pub(crate) fn scrolling(table: &Markup) -> Markup {
    html! { div.scroll tabindex="0" { (table) } }
}
