//! Holds up what the DDS library receives, without losing any of it.
//!
//! The library's event loop waits for its sockets with epoll, and hands out neither. But the kernel lists what an epoll
//! instance of this process waits for (proc_pid_fdinfo(5)), and changes it by number (epoll_ctl(2)). A socket that is not
//! waited for keeps what arrives in its receive buffer; once it is waited for again, the event loop is told that there is
//! something to read.

use std::path::PathBuf;

/// The sockets of a participant, as the library's event loop waits for them: none where the kernel does not list that.
#[derive(Debug)]
pub(super) struct Reception {
    awaited: Vec<Awaited>,
}

/// A socket in an epoll instance.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct Awaited {
    instance: i32,
    socket: i32,
    events: u32,
    data: u64,
}

/// While it is there, the participant receives nothing.
#[must_use = "the participant receives again when it is dropped"]
#[derive(Debug)]
pub(super) struct Paused<'a>(&'a Reception);

impl Reception {
    /// The reception of these sockets of this process, by their numbers.
    pub(super) fn of(sockets: &[i32]) -> Self {
        let awaited = instances().into_iter().flat_map(|(instance, list)| parse(instance, &list));
        Self { awaited: awaited.filter(|one| sockets.contains(&one.socket)).collect() }
    }

    /// Whether there is something to pause.
    pub(super) fn can_be_paused(&self) -> bool {
        !self.awaited.is_empty()
    }

    /// From now on nothing is received, until what is returned is dropped. One at a time.
    pub(super) fn pause(&self) -> Paused<'_> {
        self.awaited.iter().for_each(|one| set(*one, NOTHING));
        Paused(self)
    }
}

impl Drop for Paused<'_> {
    fn drop(&mut self) {
        self.0.awaited.iter().for_each(|one| set(*one, one.events));
    }
}

/// No event is waited for.
const NOTHING: u32 = 0;

/// The epoll instances of this process, by number, each with the kernel's list of what it waits for.
fn instances() -> Vec<(i32, String)> {
    let Ok(entries) = std::fs::read_dir("/proc/self/fd") else { return Vec::new() };
    let instance = |entry: std::fs::DirEntry| {
        let is_epoll = std::fs::read_link(entry.path()).ok()? == *"anon_inode:[eventpoll]";
        let number = is_epoll.then(|| entry.file_name().to_str()?.parse().ok()).flatten()?;
        let list = PathBuf::from("/proc/self/fdinfo").join(entry.file_name());
        Some((number, std::fs::read_to_string(list).ok()?))
    };
    entries.flatten().filter_map(instance).collect()
}

/// Lines as `tfd:        5 events:       1d data: ffffffffffffffff  pos:0 ino:61af sdev:7`.
fn parse(instance: i32, list: &str) -> Vec<Awaited> {
    let awaited = |line: &str| {
        let mut words = line.strip_prefix("tfd:")?.split_ascii_whitespace();
        let socket = words.next()?.parse().ok()?;
        let events = words.nth(1)?;
        let data = words.nth(1)?;
        Some(Awaited {
            instance,
            socket,
            events: u32::from_str_radix(events, 16).ok()?,
            data: u64::from_str_radix(data, 16).ok()?,
        })
    };
    list.lines().filter_map(awaited).collect()
}

#[cfg(target_os = "linux")]
fn set(awaited: Awaited, events: u32) {
    use nix::sys::epoll::{EpollEvent, EpollFlags, EpollOp};

    let events = EpollFlags::from_bits_retain(events.cast_signed());
    let mut event = EpollEvent::new(events, awaited.data);
    // What replaces it takes an owned handle, and another handle of the socket is another entry to epoll.
    #[expect(deprecated, reason = "the library owns the instance and the socket")]
    let done = nix::sys::epoll::epoll_ctl(
        awaited.instance,
        EpollOp::EpollCtlMod,
        awaited.socket,
        &mut event,
    );
    if let Err(error) = done {
        tracing::debug!("a socket is waited for as before: {error}");
    }
}

/// Elsewhere the kernel lists nothing.
#[cfg(not(target_os = "linux"))]
fn set(_awaited: Awaited, _events: u32) {}

#[cfg(test)]
mod tests;
