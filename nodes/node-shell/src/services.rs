//! The services and topics of each node beside its own topics: lifecycle, parameters,
//! diagnostics, its log, reports of its cycles; tf, and what an odometry publishes.

pub(crate) mod diagnostics;
pub(crate) mod library_watch;
pub(crate) mod lifecycle;
pub(crate) mod odometry_output;
pub(crate) mod own_tasks;
pub(crate) mod pace;
pub(crate) mod parameter_services;
pub(crate) mod pipeline_watch;
pub(crate) mod rosout;
pub(crate) mod stage_report;
pub(crate) mod steps;
pub(crate) mod transforms;
