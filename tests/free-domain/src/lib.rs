//! A DDS domain for one test, that no other test on this machine has at the same time.
//!
//! What is in one domain at the same time hears of each other, whatever the namespaces. `nodes/report/page/tests/domain.mjs` is
//! the same for Node.js.

use std::net::{Ipv4Addr, UdpSocket};
use std::ops::{Range, RangeInclusive};
use std::sync::LazyLock;

/// From 101 on some ports are among those that the kernel gives out to any process that asks for one, and from 71 on are those
/// that `stillmap bench transport` takes by its process number.
const DOMAINS: Range<u16> = 1..71;

/// A domain that no other of these is on as long as this lives, and that nobody is on when it begins.
#[derive(Debug)]
pub struct FreeDomain {
    number: u16,
    /// Holds the domain's last port, which no participant comes to.
    _guard: UdpSocket,
}

impl FreeDomain {
    /// # Panics
    ///
    /// If somebody is on each domain.
    #[expect(clippy::new_without_default, reason = "two of them are never equal")]
    #[expect(clippy::panic, reason = "for tests alone: one that has no domain has failed")]
    pub fn new() -> Self {
        let first = std::process::id() as u16 % DOMAINS.len() as u16;
        let in_turn = DOMAINS.cycle().skip(first.into()).take(DOMAINS.len());
        let free = in_turn.filter_map(Self::take).next();
        free.unwrap_or_else(|| panic!("somebody is on each domain of {DOMAINS:?}"))
    }

    fn take(number: u16) -> Option<Self> {
        let ports = ports(number);
        let guard = UdpSocket::bind((Ipv4Addr::LOCALHOST, *ports.end())).ok()?;
        // The sockets of a participant are closed by its threads, some time after it was dropped.
        let is_closed = |port: u16| UdpSocket::bind((Ipv4Addr::UNSPECIFIED, port)).is_ok();
        let all_closed = (*ports.start()..*ports.end()).all(is_closed);
        all_closed.then_some(Self { number, _guard: guard })
    }

    /// One for all tests that need no more than a domain of this process.
    pub fn of_this_process() -> &'static Self {
        static DOMAIN: LazyLock<FreeDomain> = LazyLock::new(FreeDomain::new);
        &DOMAIN
    }

    /// The value for `ROS_DOMAIN_ID`.
    pub fn number(&self) -> u16 {
        self.number
    }
}

/// All ports of a domain (RTPS 2.5, section 9.6.2.3): 250, from 7400 on.
fn ports(domain: u16) -> RangeInclusive<u16> {
    let first = 7400 + 250 * domain;
    first..=first + 249
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_that_live_at_the_same_time_are_apart() {
        let three = [FreeDomain::new(), FreeDomain::new(), FreeDomain::new()];
        let [first, second, third] = three.each_ref().map(FreeDomain::number);
        assert!(first != second && second != third && first != third);
    }

    #[test]
    fn a_domain_is_not_free_while_a_participant_that_ended_holds_a_port() {
        let ended = FreeDomain::new();
        let number = ended.number();
        let socket = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, ports(number).start() + 24)).unwrap();
        drop(ended);
        assert!(FreeDomain::take(number).is_none());
        drop(socket);
    }
}
