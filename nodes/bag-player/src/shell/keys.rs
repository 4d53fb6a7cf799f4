//! The keys of the player, on a terminal.

use std::io::{IsTerminal, stdin};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::process::getpgrp;
use rustix::termios::{LocalModes, OptionalActions, Termios, tcgetattr, tcgetpgrp, tcsetattr};
use tokio::sync::mpsc;

/// The longest time until the thread that reads the keys notices that it should end.
const POLL: Timespec = Timespec { tv_sec: 0, tv_nsec: 100_000_000 };

/// The action of a key.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Key {
    /// Pause, or continue.
    Pause,
    /// Publish one message while paused.
    Step,
    /// End.
    Quit,
}

/// The terminal's keys, one by one; the terminal is restored when this is dropped.
///
/// Only line editing and echo are switched off: Ctrl-C is still a signal, and printed text
/// keeps its line breaks.
pub(super) struct Keys {
    pressed: mpsc::UnboundedReceiver<Key>,
    /// `None` if there is no terminal to read from.
    terminal: Option<Terminal>,
}

struct Terminal {
    before: Termios,
    ended: Arc<AtomicBool>,
}

impl Keys {
    /// Reads the keys of the terminal on stdin, if there is one and this process may read it.
    pub(super) fn listen() -> Self {
        let (sender, pressed) = mpsc::unbounded_channel();
        Self { pressed, terminal: Terminal::take(sender) }
    }

    /// Whether there are keys to press.
    pub(super) fn are_there(&self) -> bool {
        self.terminal.is_some()
    }

    /// The next key; never where there are none.
    pub(super) async fn next(&mut self) -> Key {
        match self.pressed.recv().await {
            Some(key) => key,
            None => std::future::pending().await,
        }
    }

    /// A key that has been pressed.
    pub(super) fn try_next(&mut self) -> Option<Key> {
        self.pressed.try_recv().ok()
    }
}

impl Terminal {
    fn take(sender: mpsc::UnboundedSender<Key>) -> Option<Self> {
        let input = stdin();
        // A process in the background would be stopped for changing the terminal.
        if !input.is_terminal() || tcgetpgrp(&input).ok()? != getpgrp() {
            return None;
        }
        let before = tcgetattr(&input).ok()?;
        let mut silent = before.clone();
        silent.local_modes -= LocalModes::ICANON | LocalModes::ECHO;
        tcsetattr(&input, OptionalActions::Now, &silent).ok()?;
        let ended = Arc::new(AtomicBool::new(false));
        let terminal = Self { before, ended: Arc::clone(&ended) };
        // Without the thread `terminal` is dropped here, which restores the terminal.
        std::thread::Builder::new()
            .name("keys".to_owned())
            .spawn(move || read_keys(&sender, &ended))
            .ok()?;
        Some(terminal)
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        self.ended.store(true, Ordering::Relaxed);
        // Where the terminal is closed there is nothing to restore.
        let _ = tcsetattr(stdin(), OptionalActions::Now, &self.before);
    }
}

fn read_keys(sender: &mpsc::UnboundedSender<Key>, ended: &AtomicBool) {
    let input = stdin();
    let mut bytes = [0; 64];
    while !ended.load(Ordering::Relaxed) {
        let mut ready = [PollFd::new(&input, PollFlags::IN)];
        match poll(&mut ready, Some(&POLL)) {
            Ok(0) | Err(rustix::io::Errno::INTR) => continue,
            Ok(_) => {}
            Err(_) => return,
        }
        // Not through the buffer of std's stdin, which would hide bytes from `poll`.
        let Ok(read) = rustix::io::read(&input, &mut bytes) else { return };
        if read == 0 {
            return;
        }
        for key in keys_in(bytes.get(..read).unwrap_or(&bytes)) {
            if sender.send(key).is_err() {
                return;
            }
        }
    }
}

/// The keys in the bytes of a terminal. An arrow is a sequence of three bytes.
fn keys_in(mut bytes: &[u8]) -> Vec<Key> {
    let mut keys = Vec::new();
    loop {
        let (key, rest) = match bytes {
            [] => return keys,
            [0x1b, b'[' | b'O', b'C', rest @ ..] => (Some(Key::Step), rest),
            [0x1b, b'[' | b'O', _, rest @ ..] => (None, rest),
            [b' ', rest @ ..] => (Some(Key::Pause), rest),
            [b's' | b'S', rest @ ..] => (Some(Key::Step), rest),
            [b'q' | b'Q', rest @ ..] => (Some(Key::Quit), rest),
            [_, rest @ ..] => (None, rest),
        };
        keys.extend(key);
        bytes = rest;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bytes_of_a_terminal_are_keys() {
        assert_eq!(keys_in(b" s\x1b[Cq"), [Key::Pause, Key::Step, Key::Step, Key::Quit]);
        assert_eq!(keys_in(b"\x1bOC"), [Key::Step]);
    }

    #[test]
    fn other_keys_are_nothing() {
        // The up arrow, a letter, an escape alone, a letter of several bytes.
        assert_eq!(keys_in("\x1b[Ax\u{1b}ñ".as_bytes()), []);
    }
}
