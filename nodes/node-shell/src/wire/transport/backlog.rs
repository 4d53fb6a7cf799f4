//! Bounds what the DDS library reads before it looks at it.
//!
//! RustDDS 0.15 reads a socket until it is empty and handles the datagrams afterwards
//! (`dp_event_loop.rs`, `messages_bounded(usize::MAX)`). Where it reads more slowly than others send, since the machine
//! has no CPU time for it, the socket never is empty: memory grows with all that is sent, and nothing is
//! delivered. So a socket in which much has waited for a while is closed to what is new until it has been
//! read: the kernel drops that, as it does when a receive buffer is full, and it is counted as such.

use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use super::sockets::SocketHandle;

/// So many eighths of its receive buffer are much: one that waits, and two that the kernel may still count of what was read. A
/// library that keeps up has less waiting again and again, even where datagrams come without a pause: 588 MB/s on two cores
/// (measured).
const MUCH_EIGHTHS: u64 = 3;
/// How long that may last: several periods of a camera.
const LONGEST_BACKLOG: Duration = Duration::from_millis(200);
/// How often sockets are looked at.
const LOOK: Duration = Duration::from_millis(50);
/// How often they are while much waits in one of them: often enough to observe the moments at which it does not.
const BUSY_LOOK: Duration = Duration::from_millis(10);
/// The kernel makes the least of it that it allows.
const CLOSED: usize = 0;

/// Watches the sockets of a participant until it is dropped.
#[derive(Debug)]
pub struct BacklogWatch {
    /// Closing it ends the thread.
    stop: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl BacklogWatch {
    /// Watches `sockets`.
    ///
    /// # Errors
    /// When no thread can be started.
    pub(super) fn start(sockets: Vec<SocketHandle>) -> std::io::Result<Self> {
        let (stop, stopped) = channel();
        let mut watched: Vec<_> = sockets.into_iter().filter_map(Watched::new).collect();
        let thread = std::thread::Builder::new()
            .name("receive backlog".to_owned())
            .spawn(move || watch(&mut watched, &stopped))?;
        Ok(Self { stop: Some(stop), thread: Some(thread) })
    }
}

impl Drop for BacklogWatch {
    fn drop(&mut self) {
        self.stop.take();
        if let Some(thread) = self.thread.take() {
            // It holds handles of the sockets, which are to be closed when the participant is gone.
            let _ = thread.join();
        }
    }
}

fn watch(sockets: &mut Vec<Watched>, stopped: &Receiver<()>) {
    loop {
        let now = Instant::now();
        sockets.retain_mut(|socket| {
            let looked = socket.look(now);
            looked
                .inspect_err(|error| tracing::debug!("a socket is no longer watched: {error}"))
                .is_ok()
        });
        let busy = sockets.iter().any(|socket| socket.backlog.since.is_some());
        match stopped.recv_timeout(if busy { BUSY_LOOK } else { LOOK }) {
            Err(RecvTimeoutError::Timeout) => {}
            Ok(()) | Err(RecvTimeoutError::Disconnected) => return,
        }
    }
}

/// A socket with its backlog.
#[derive(Debug)]
struct Watched {
    handle: SocketHandle,
    /// The receive buffer while the socket is open.
    open_bytes: usize,
    backlog: Backlog,
}

impl Watched {
    fn new(handle: SocketHandle) -> Option<Self> {
        let open_bytes = handle
            .receive_buffer()
            .inspect_err(|error| tracing::debug!("a socket is not watched: {error}"))
            .ok()?;
        Some(Self { handle, open_bytes, backlog: Backlog::default() })
    }

    fn look(&mut self, now: Instant) -> std::io::Result<()> {
        // The kernel counts its own memory, and allows twice the receive buffer of it.
        let much_bytes = 2 * self.open_bytes as u64 * MUCH_EIGHTHS / 8;
        let waiting = match self.handle.waiting_bytes()? {
            0 => Waiting::Nothing,
            some if some < much_bytes => Waiting::Some,
            _ => Waiting::Much,
        };
        match self.backlog.look(now, waiting) {
            None => Ok(()),
            Some(Turn::Close) => {
                tracing::debug!(
                    "this node has had no CPU time to read its sockets for {LONGEST_BACKLOG:?}: data \
                     are dropped until it has"
                );
                self.handle.set_receive_buffer(CLOSED)
            }
            Some(Turn::Open) => self.handle.set_receive_buffer(self.open_bytes),
        }
    }
}

/// The bytes that wait in a socket.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Waiting {
    Nothing,
    Some,
    Much,
}

/// The state of the backlog of one socket.
#[derive(Clone, Copy, Default, Debug)]
struct Backlog {
    /// Since when much has waited.
    since: Option<Instant>,
    closed: bool,
}

/// The action on a socket.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Turn {
    Close,
    Open,
}

impl Backlog {
    /// Notes what waits; returns what is to be done.
    fn look(&mut self, now: Instant, waiting: Waiting) -> Option<Turn> {
        if self.closed {
            // Not before it is empty does the library look at what it has read.
            if waiting != Waiting::Nothing {
                return None;
            }
            *self = Self::default();
            return Some(Turn::Open);
        }
        if waiting != Waiting::Much {
            self.since = None;
            return None;
        }
        let since = *self.since.get_or_insert(now);
        if now.duration_since(since) < LONGEST_BACKLOG {
            return None;
        }
        self.closed = true;
        Some(Turn::Close)
    }
}

#[cfg(test)]
mod tests;
