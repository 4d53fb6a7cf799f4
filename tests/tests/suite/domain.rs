//! A DDS domain for one test, by the file that the tests of `node-shell` have: what is in one domain at the same time hears of each
//! other, whatever the namespaces.

use node_shell::Transport;

#[path = "../../../nodes/node-shell/src/wire/transport/free_domain.rs"]
#[allow(dead_code, reason = "some of it is for node-shell only")]
mod free_domain;
#[path = "../../../nodes/node-shell/src/wire/transport/ports.rs"]
#[allow(dead_code, reason = "some ports are of interest to node-shell only")]
mod ports;

pub(crate) use free_domain::FreeDomain;
