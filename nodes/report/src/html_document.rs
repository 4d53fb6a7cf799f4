//! The head and foot of every page.

use maud::{DOCTYPE, Markup, PreEscaped, html};

/// The style that all pages share.
const STYLE: &str = include_str!("html_document/style.css");

/// A whole document. `own_style` comes after the style that all share.
pub(crate) fn document(title: &str, own_style: &str, body: &Markup) -> String {
    let markup = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
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
