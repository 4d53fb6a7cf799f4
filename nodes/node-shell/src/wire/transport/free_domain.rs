//! A DDS domain for one test, that no other test on this machine has at the same time.
//!
//! `tests/tests/suite/domain.rs` has this file too, and `nodes/report/page/tests/domain.mjs` is the same for Node.js.

use std::net::{Ipv4Addr, UdpSocket};
use std::sync::LazyLock;

use super::{Transport, ports};

/// From 101 on some ports are among those that the kernel gives out to any process that asks for one. From 71 on are those that
/// `stillmap bench transport` and what else holds no guard take by their process number.
const DOMAINS: std::ops::Range<u16> = 1..71;

/// A domain that no other of these is on as long as this lives, and that nobody is on when it begins.
pub(crate) struct FreeDomain {
    number: u16,
    /// Holds the domain's last port, which no participant comes to.
    _guard: UdpSocket,
}

impl FreeDomain {
    pub(crate) fn new() -> Self {
        let first = std::process::id() as u16 % DOMAINS.len() as u16;
        let in_turn = DOMAINS.cycle().skip(first.into()).take(DOMAINS.len());
        in_turn.filter_map(Self::take).next().expect("no domain is free")
    }

    fn take(number: u16) -> Option<Self> {
        let port = ports::data_unicast(number, ports::PARTICIPANTS_PER_HOST - 1)?;
        let guard = UdpSocket::bind((Ipv4Addr::LOCALHOST, port)).ok()?;
        // The sockets of a participant are closed by its threads, some time after it was dropped.
        let is_closed = |port: u16| UdpSocket::bind((Ipv4Addr::UNSPECIFIED, port)).is_ok();
        let all_closed = (ports::discovery_multicast(number)..port).all(is_closed);
        all_closed.then_some(Self { number, _guard: guard })
    }

    /// One for all tests that need no more than a domain of this process.
    pub(crate) fn of_this_process() -> &'static Self {
        static DOMAIN: LazyLock<FreeDomain> = LazyLock::new(FreeDomain::new);
        &DOMAIN
    }

    pub(crate) fn number(&self) -> u16 {
        self.number
    }

    pub(crate) fn transport(&self) -> Transport {
        Transport::on_domain(self.number).expect("the domain is below 71")
    }
}

#[test]
fn a_domain_is_not_free_while_a_participant_that_ended_holds_a_port() {
    let ended = FreeDomain::new();
    let number = ended.number();
    let port = ports::discovery_unicast(number, 7).unwrap();
    let socket = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, port)).unwrap();
    drop(ended);
    assert!(FreeDomain::take(number).is_none());
    drop(socket);
}
