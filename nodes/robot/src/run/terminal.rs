//! What the terminal of stdout can show.

use std::ffi::OsStr;
use std::io::IsTerminal;

use report::TerminalColours;

/// Whether stdout is a terminal that may have colours.
pub(crate) fn is_coloured() -> bool {
    is_watched() && colours() != TerminalColours::None
}

/// Whether stdout is a terminal.
pub(super) fn is_watched() -> bool {
    std::io::stdout().is_terminal()
}

/// The colours of the terminal, by its environment.
pub(super) fn colours() -> TerminalColours {
    colours_of(|name| std::env::var_os(name))
}

/// `NO_COLOR` by <https://no-color.org>: set to anything but nothing it says that none are wanted. `COLORTERM` is what terminals with 24
/// bits set.
fn colours_of<Value: AsRef<OsStr>>(variable: impl Fn(&str) -> Option<Value>) -> TerminalColours {
    let text = |name| variable(name).map(|value| value.as_ref().to_string_lossy().into_owned());
    let is_set = |name| text(name).is_some_and(|text| !text.is_empty());
    match text("COLORTERM").as_deref() {
        _ if is_set("NO_COLOR") || text("TERM").as_deref() == Some("dumb") => TerminalColours::None,
        Some("truecolor" | "24bit") => TerminalColours::True,
        _ => TerminalColours::Indexed,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(variables: &[(&str, &'static str)]) -> TerminalColours {
        colours_of(|name| variables.iter().find(|(known, _)| *known == name).map(|(_, text)| *text))
    }

    #[test]
    fn the_environment_says_which_colours_are_shown() {
        assert_eq!(of(&[]), TerminalColours::Indexed);
        assert_eq!(of(&[("COLORTERM", "truecolor"), ("TERM", "xterm")]), TerminalColours::True);
        assert_eq!(of(&[("COLORTERM", "truecolor"), ("NO_COLOR", "1")]), TerminalColours::None);
        assert_eq!(of(&[("NO_COLOR", ""), ("TERM", "xterm-256color")]), TerminalColours::Indexed);
        assert_eq!(of(&[("TERM", "dumb")]), TerminalColours::None);
    }
}
