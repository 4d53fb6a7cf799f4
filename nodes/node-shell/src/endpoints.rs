//! The ends of topics and services: publishers and subscriptions, with their DDS side and their counters.
#![cfg_attr(not(test), deny(clippy::indexing_slicing))]

pub(crate) mod assembly;
pub(crate) mod counters;
pub(crate) mod gate;
pub(crate) mod network;
pub(crate) mod publisher;
pub(crate) mod raw_subscription;
pub(crate) mod reader;
pub(crate) mod service;
pub(crate) mod service_client;
pub(crate) mod subscription;
pub(crate) mod writer;
