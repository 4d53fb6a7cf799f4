//! What each node offers beside its own topics: time, lifecycle, parameters, diagnostics, its log.

pub(crate) mod clock;
pub(crate) mod diagnostics;
pub(crate) mod lifecycle;
pub(crate) mod parameter_services;
pub(crate) mod rosout;
