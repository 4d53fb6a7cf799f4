//! Bounds what the DDS library reads before it looks at it.
//!
//! RustDDS 0.15 reads a socket until it is empty and handles the datagrams afterwards
//! (`dp_event_loop.rs`, `messages_bounded(usize::MAX)`). Where it reads more slowly than others send, since the machine
//! has no CPU time for it, the socket never is empty: memory grows with all that is sent, and nothing is
//! delivered. So a socket that has not been empty for a while is closed to what is new until it has been
//! read: the kernel drops that, as it does when a receive buffer is full, and it is counted as such.

use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use super::sockets::SocketHandle;

/// How long a socket may be read without becoming empty: several periods of a camera, in which it is
/// read empty between two images even at 290 MB/s on two cores (measured).
const LONGEST_BACKLOG: Duration = Duration::from_millis(200);
/// How often sockets are looked at that were empty.
const IDLE_LOOK: Duration = Duration::from_millis(50);
/// How often they are while one of them is not: often enough to meet the moments at which it is empty.
const BUSY_LOOK: Duration = Duration::from_millis(5);
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
    /// When there is no thread to be had.
    pub(super) fn start(sockets: Vec<SocketHandle>) -> std::io::Result<Self> {
        let (stop, stopped) = channel();
        let mut watched: Vec<_> = sockets.into_iter().map(Watched::new).collect();
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
            socket
                .look(now)
                .inspect_err(|error| tracing::debug!("a socket is no longer watched: {error}"))
                .is_ok()
        });
        let busy = sockets.iter().any(|socket| socket.backlog.since.is_some());
        match stopped.recv_timeout(if busy { BUSY_LOOK } else { IDLE_LOOK }) {
            Err(RecvTimeoutError::Timeout) => {}
            Ok(()) | Err(RecvTimeoutError::Disconnected) => return,
        }
    }
}

/// A socket with its backlog.
#[derive(Debug)]
struct Watched {
    socket: SocketHandle,
    backlog: Backlog,
    /// What the receive buffer was when the socket was closed.
    open_bytes: Option<usize>,
}

impl Watched {
    fn new(socket: SocketHandle) -> Self {
        Self { socket, backlog: Backlog::default(), open_bytes: None }
    }

    fn look(&mut self, now: Instant) -> std::io::Result<()> {
        match self.backlog.look(now, self.socket.has_backlog()?) {
            None => {}
            Some(Turn::Close) => {
                self.open_bytes = Some(self.socket.receive_buffer()?);
                self.socket.set_receive_buffer(CLOSED)?;
                tracing::debug!(
                    "this node has had no CPU time to take what arrived for {LONGEST_BACKLOG:?}: what \
                     arrives is dropped until it has"
                );
            }
            Some(Turn::Open) => {
                if let Some(bytes) = self.open_bytes.take() {
                    self.socket.set_receive_buffer(bytes)?;
                }
            }
        }
        Ok(())
    }
}

/// What is known of the backlog of one socket.
#[derive(Clone, Copy, Default, Debug)]
struct Backlog {
    /// Since when the socket has not been seen empty.
    since: Option<Instant>,
    closed: bool,
}

/// What is to be done with a socket.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Turn {
    Close,
    Open,
}

impl Backlog {
    /// Notes whether datagrams wait; returns what is to be done.
    fn look(&mut self, now: Instant, waiting: bool) -> Option<Turn> {
        if !waiting {
            self.since = None;
            return std::mem::take(&mut self.closed).then_some(Turn::Open);
        }
        let since = *self.since.get_or_insert(now);
        if self.closed || now.duration_since(since) < LONGEST_BACKLOG {
            return None;
        }
        self.closed = true;
        Some(Turn::Close)
    }
}

#[cfg(test)]
mod tests;
