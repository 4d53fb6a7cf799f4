//! The transport of bytes: sockets, discovery and the encoded form of a message, and the errors of all that.
#![cfg_attr(not(test), deny(clippy::indexing_slicing))]

pub(crate) mod encoded;
pub(crate) mod error;
pub(crate) mod payload;
pub(crate) mod rmw_zenoh;
pub(crate) mod transport;
