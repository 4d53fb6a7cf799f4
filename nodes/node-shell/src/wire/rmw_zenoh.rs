//! ROS 2 over Zenoh, as `rmw_zenoh` of ROS 2 Jazzy and later has it: a session for each process, keys that name topics and services,
//! liveliness tokens that announce endpoints, and attachments with a message's number, time and sender.
//!
//! What follows of names and settings needs no Zenoh, and is tested in every build.

#[cfg(any(feature = "zenoh", test))]
pub(crate) mod attachment;
#[cfg(any(feature = "zenoh", test))]
pub(crate) mod keys;
#[cfg(feature = "zenoh")]
pub(crate) mod services;
#[cfg(feature = "zenoh")]
pub(crate) mod session;
pub(crate) mod settings;
#[cfg(any(feature = "zenoh", test))]
pub(crate) mod token_changes;
#[cfg(feature = "zenoh")]
pub(crate) mod topics;

/// What a node on Zenoh is connected to.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct ZenohLinks {
    /// They connect it to nodes of other machines, and tell it of those of its own.
    pub routers: usize,
    /// Other nodes, directly.
    pub peers: usize,
}

/// In the first bytes of the number that a node has here, as DDS has participants: no vendor of DDS has it.
pub(crate) const PARTICIPANT_MARK: [u8; 2] = [0xff, 0x5a];
