//! Refuses datagrams that cost the DDS library memory without bound, before they reach it.
//!
//! RustDDS 0.15 takes some numbers of a datagram at their word: it lists every sequence number that a heartbeat or a gap
//! names (`rtps_writer_proxy.rs`, `missing_seqnums` and `irrelevant_changes_range`), and allocates what a fragment claims
//! that its message has (`fragment_assembler.rs`). One datagram of 52 bytes is enough to use up all memory. The library
//! keeps its sockets to itself, but the kernel can judge what arrives in them: each gets a filter, a program
//! of the kernel's classic packet filter.

mod assembler;
mod program;

use std::fmt;

pub(super) use assembler::Instruction;

use super::sockets::SocketHandle;

/// How many submessages of a datagram are looked at: what the kernel's 4096 instructions have room for, and what its option
/// memory has room for where `net.core.optmem_max` is 20,480 bytes, the default before Linux 6.8.
const SUBMESSAGES: [usize; 2] = [40, 12];

/// Whether what arrives is judged before the DDS library gets it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum DatagramFilter {
    /// Each receiving socket has its filter.
    On {
        /// How many submessages of a datagram are taken; what is behind them is cut off.
        submessages: usize,
    },
    /// There is none, for this reason.
    Off(String),
}

impl DatagramFilter {
    /// Filters what arrives in these sockets; without one of them nothing is known to be filtered.
    pub(super) fn on<'a>(sockets: impl Iterator<Item = &'a SocketHandle> + Clone) -> Self {
        if sockets.clone().next().is_none() {
            return Self::Off(
                "the sockets of this process are not available (pidfd_getfd, Linux 5.6)".to_owned(),
            );
        }
        let mut reason = String::new();
        for submessages in SUBMESSAGES {
            match attach(submessages, sockets.clone()) {
                Ok(()) => return Self::On { submessages },
                Err(error) => reason = error,
            }
        }
        Self::Off(reason)
    }

    /// Why there is no filter.
    #[must_use]
    pub fn missing(&self) -> Option<&str> {
        match self {
            Self::On { .. } => None,
            Self::Off(reason) => Some(reason),
        }
    }
}

impl fmt::Display for DatagramFilter {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::On { submessages } => write!(formatter, "{submessages} submessages a datagram"),
            Self::Off(reason) => write!(formatter, "none: {reason}"),
        }
    }
}

fn attach<'a>(
    submessages: usize,
    sockets: impl Iterator<Item = &'a SocketHandle>,
) -> Result<(), String> {
    let program: Vec<Instruction> =
        program::program(submessages).map_err(|error| error.to_string())?;
    for socket in sockets {
        socket.attach_filter(&program).map_err(|error| format!("SO_ATTACH_FILTER: {error}"))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests;
