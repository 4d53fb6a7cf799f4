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
#[cfg(feature = "zenoh")]
pub(crate) mod topics;

/// In the first bytes of the number that a node has here, as DDS has participants: no vendor of DDS has it.
pub(crate) const PARTICIPANT_MARK: [u8; 2] = [0xff, 0x5a];
