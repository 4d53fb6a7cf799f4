//! Several machines: programs in network namespaces of their own, joined by veth pairs.
//!
//! A test makes its machines and they go with it; the network of the host it runs on is not touched.
//! Where no namespaces may be made or set up, each test says so in one line and shows nothing.

pub(crate) mod end;
mod site;

mod coming_and_going;
mod discovery;
mod hostile;
mod loss;
mod other_addresses;
mod reach;
