use std::net::{Ipv4Addr, UdpSocket};
use std::time::{Duration, Instant};

use free_domain::FreeDomain;
use proptest::prelude::*;

use super::*;
use crate::wire::transport::{Transport, ports};

/// Longer than the library takes for its first announcement, on a busy machine.
const PATIENCE: Duration = Duration::from_secs(120);

/// Longer than the library's thread takes from sending to letting go of the participant.
const ANNOUNCED: Duration = Duration::from_millis(200);

/// A message as its parts, so that two can be compared: the submessages' kinds and flags, the writer,
/// the inline parameters and the parameters of the payload.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Parts {
    pub(crate) header: Vec<u8>,
    pub(crate) submessages: Vec<(u8, u8)>,
    pub(crate) writer: Vec<u8>,
    /// Whether it is one of the announcer's, by its number.
    pub(crate) of_announcer: bool,
    pub(crate) inline: Vec<(u16, Vec<u8>)>,
    pub(crate) payload: Vec<(u16, Vec<u8>)>,
}

fn take<'a>(bytes: &mut &'a [u8], count: usize) -> Option<&'a [u8]> {
    let (taken, rest) = bytes.split_at_checked(count)?;
    *bytes = rest;
    Some(taken)
}

fn number(bytes: &mut &[u8]) -> Option<u16> {
    Some(u16::from_le_bytes(take(bytes, 2)?.try_into().ok()?))
}

fn parameters(bytes: &mut &[u8]) -> Option<Vec<(u16, Vec<u8>)>> {
    let mut found = Vec::new();
    loop {
        let (name, length) = (number(bytes)?, number(bytes)?);
        if name == parameter::SENTINEL {
            return Some(found);
        }
        found.push((name, take(bytes, length.into())?.to_vec()));
    }
}

/// Reads a message by the specification, independently of how it is written.
pub(crate) fn parts(message: &[u8]) -> Option<Parts> {
    let mut rest = message;
    let header = take(&mut rest, 20)?.to_vec();
    let mut submessages = Vec::new();
    while !rest.is_empty() {
        let kind = take(&mut rest, 2)?;
        let (kind, flags) = (kind[0], kind[1]);
        let length = number(&mut rest)?;
        // The last one may leave its length out.
        let length = if length == 0 { rest.len() } else { length.into() };
        let mut body = take(&mut rest, length)?;
        submessages.push((kind, flags));
        if kind != DATA {
            continue;
        }
        take(&mut body, 4)?;
        take(&mut body, 4)?;
        let writer = take(&mut body, 4)?.to_vec();
        let of_announcer = take(&mut body, 8)?[0] != 0;
        let inline = if flags & WITH_INLINE_QOS == 0 { Vec::new() } else { parameters(&mut body)? };
        if take(&mut body, 4)? != ENCAPSULATION {
            return None;
        }
        let mut payload = parameters(&mut body)?;
        // The library lists the addresses in no fixed order.
        payload.sort();
        return Some(Parts { header, submessages, writer, of_announcer, inline, payload });
    }
    None
}

/// What the library itself announces: it sends to the first twelve participants of this machine, of
/// which this is one.
struct Listener {
    socket: UdpSocket,
    domain: FreeDomain,
}

impl Listener {
    fn new() -> Self {
        let domain = FreeDomain::new();
        let port = ports::discovery_unicast(domain.number(), 7).unwrap();
        let socket = UdpSocket::bind((Ipv4Addr::LOCALHOST, port)).unwrap();
        socket.set_read_timeout(Some(Duration::from_millis(100))).unwrap();
        Self { socket, domain }
    }

    /// The next message that `accept` takes, of participant announcements.
    fn next(&self, accept: impl Fn(&Parts) -> bool) -> Parts {
        let start = Instant::now();
        let mut buffer = [0; 4096];
        loop {
            assert!(start.elapsed() < PATIENCE, "the library announces nothing");
            let Ok(length) = self.socket.recv(&mut buffer) else { continue };
            if let Some(parts) = parts(&buffer[..length])
                && parts.writer == PARTICIPANT_WRITER
                && !parts.of_announcer
                && accept(&parts)
            {
                return parts;
            }
        }
    }
}

fn the_library_announces_the_same(set: impl Fn(Transport) -> Transport) {
    let listener = Listener::new();
    let transport = set(Transport::on_domain(listener.domain.number()).unwrap());
    let (joined, announced) = transport.join_announcing().unwrap();
    let announced = announced.unwrap();
    let prefix = announced.guid[..12].to_vec();
    let of_ours = |parts: &Parts| parts.header[8..] == prefix[..];
    let theirs = listener.next(|parts| of_ours(parts) && parts.inline.is_empty());
    let ours = as_the_librarys(&announced.announcement(0));
    assert_eq!(ours, theirs);
    // While the library announces, its own thread holds the participant; dropped meanwhile, it would end
    // in that thread, which fails without a farewell.
    std::thread::sleep(ANNOUNCED);
    drop(joined.threads.at_rest());
    drop(joined);
    let theirs = listener.next(|parts| of_ours(parts) && !parts.inline.is_empty());
    let ours = as_the_librarys(&announced.farewell(1));
    assert_eq!(ours, theirs);
}

fn as_the_librarys(message: &[u8]) -> Parts {
    let parts = parts(message).unwrap();
    assert!(parts.of_announcer);
    Parts { of_announcer: false, ..parts }
}

#[test]
fn the_library_announces_the_same_on_all_networks() {
    the_library_announces_the_same(|transport| transport);
}

#[test]
fn the_library_announces_the_same_in_localhost_mode() {
    the_library_announces_the_same(Transport::loopback_only);
}

#[test]
fn the_library_announces_the_same_without_multicast() {
    the_library_announces_the_same(|transport| transport.with_static_peers(["127.0.0.1"]).unwrap());
}

fn participant(addresses: usize) -> Participant {
    let at = |port| {
        (1..=addresses).map(move |last| SocketAddrV4::new([10, 0, 0, last as u8].into(), port))
    };
    Participant {
        guid: std::array::from_fn(|byte| byte as u8),
        discovery_unicast: at(7410).collect(),
        discovery_multicast: Vec::new(),
        data_unicast: at(7411).collect(),
        data_multicast: Vec::new(),
    }
}

#[test]
fn numbers_rise_and_stay_apart_from_the_librarys() {
    let number = |count| {
        let message = participant(1).announcement(count);
        // Header, header of the submessage, and its first fields.
        let at = 20 + 4 + 4 + 8;
        let high = i32::from_le_bytes(message[at..at + 4].try_into().unwrap());
        let low = u32::from_le_bytes(message[at + 4..at + 8].try_into().unwrap());
        (i64::from(high) << 32) + i64::from(low)
    };
    assert_eq!(number(0), 1 << 32);
    assert_eq!(number(5), (1 << 32) + 5);
    assert_eq!(number(u32::MAX), (1 << 32) + i64::from(u32::MAX));
}

proptest! {
    #[test]
    fn every_locator_is_in_the_announcement(
        addresses in 0_usize..200, count: u32
    ) {
        let participant = participant(addresses);
        let parts = parts(&participant.announcement(count)).unwrap();
        let count_of = |name| parts.payload.iter().filter(|(one, _)| *one == name).count();
        prop_assert_eq!(count_of(parameter::METATRAFFIC_UNICAST_LOCATOR), addresses);
        prop_assert_eq!(count_of(parameter::DEFAULT_UNICAST_LOCATOR), addresses);
        prop_assert!(parts.payload.iter().all(|(_, value)| value.len() % 4 == 0));
    }
}
