//! The settings of a node at its start: arguments, names, parameters, quality of service.
#![cfg_attr(not(test), deny(clippy::indexing_slicing))]

pub mod arguments;
pub mod names;
pub mod parameters;
pub(crate) mod qos;
pub(crate) mod waiting_cycles;
