//! Peers of other makes: Cyclone DDS, its Python package, Fast DDS. Whatever the suite sends, they read
//! the same message, and the other way round. `tests/peers/README.md` says what they are and how to
//! get them; where one is missing, its tests say so in a line.

pub(crate) mod build;
mod cases;
pub(crate) mod definitions;
mod fill;
mod idl;
mod lengths;
mod message_types;
pub(crate) mod peer;
mod place;

mod by_name;
mod discovery;
mod distances;
mod drivers;
mod filtered_scan;
mod fresh_clients;
mod latched;
mod lifecycle;
mod misfits;
mod parameters;
mod round_trips;
mod saved_map;
mod services;
