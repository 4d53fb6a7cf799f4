//! The program, run by a plain interpreter and by the kernel, says of every datagram what a plain reading of the rules says.

mod interpreter;
mod messages;
mod rules;

use std::net::UdpSocket;
use std::time::Duration;

use proptest::prelude::*;

use super::*;
use messages::{Order, Submessage, rtps};
use rules::{Verdict, judge};

fn of_program(submessages: usize, datagram: &[u8]) -> Verdict {
    interpreter::run(&program::program(submessages).unwrap(), datagram)
}

#[test]
fn each_program_fits_the_kernels_machine() {
    for submessages in SUBMESSAGES {
        let length = program::program(submessages).unwrap().len();
        assert!(length <= 4096, "{submessages} submessages take {length} instructions");
    }
}

/// The datagrams that were found to end a node.
#[test]
fn what_ends_a_node_is_refused_in_both_byte_orders() {
    for order in [Order::Little, Order::Big] {
        let before = [Submessage::info_dst(order), Submessage::info_ts(order)];
        for absurd in [
            Submessage::heartbeat(order, 1, 1 << 56),
            Submessage::heartbeat(order, 1, (1 << 20) + (1 << 16)),
            Submessage::heartbeat(order, i64::MAX - 1, i64::MAX),
            Submessage::heartbeat(order, i64::MIN, i64::MIN + 1),
            Submessage::gap(order, 100_000, 1 << 56),
            Submessage::fragment(order, [0x03, 0x03], u32::MAX),
            Submessage::fragment(order, [0x03, 0x03], 64 << 20),
            Submessage::fragment(order, [0xc7, 0x03], 1 << 16),
            Submessage::fragment(order, [0x00, 0xc2], 1 << 16),
            Submessage::nack_fragment(order, 0),
            Submessage::nack_fragment(order, u32::MAX - 3),
        ] {
            let datagram = rtps(before.iter().chain([&absurd]));
            assert_eq!(judge(40, &datagram), Verdict::Refused, "{order:?} {absurd:?}");
            assert_eq!(of_program(40, &datagram), Verdict::Refused, "{order:?} {absurd:?}");
        }
    }
}

#[test]
fn what_peers_send_is_taken_whole() {
    for order in [Order::Little, Order::Big] {
        let datagram = rtps(&[
            Submessage::info_dst(order),
            Submessage::empty(order, program::kind::INFO_TS),
            Submessage::info_ts(order),
            Submessage::heartbeat(order, 1, 0),
            Submessage::heartbeat(order, 5, (1 << 20) - 1),
            Submessage::heartbeat(order, 1 << 32, (1 << 32) + 7),
            Submessage::gap(order, 1, 2),
            Submessage::fragment(order, [0x04, 0x03], 9_830_400),
            Submessage::fragment(order, [0xc7, 0xc2], 60_000),
            Submessage::nack_fragment(order, 7_000),
            Submessage::empty(order, program::kind::PAD),
            Submessage::data_to_the_end(order),
        ]);
        assert_eq!(judge(40, &datagram), Verdict::Taken(datagram.len()), "{order:?}");
        assert_eq!(of_program(40, &datagram), Verdict::Taken(datagram.len()), "{order:?}");
    }
}

#[test]
fn what_is_behind_the_last_submessage_looked_at_is_cut_off() {
    let many = vec![Submessage::info_ts(Order::Little); 20];
    let datagram = rtps(&many);
    let taken = rtps(&many[..16]).len();
    assert_eq!(judge(16, &datagram), Verdict::Taken(taken));
    assert_eq!(of_program(16, &datagram), Verdict::Taken(taken));
    assert_eq!(of_program(16, &rtps(&many[..16])), Verdict::Taken(taken));
}

#[test]
fn what_is_no_rtps_is_refused() {
    for nothing in [&b""[..], b"RTP", b"RTPX\x02\x03\x01\x01............", b"RTPS\x02\x03"] {
        assert_eq!(judge(16, nothing), Verdict::Refused);
        assert_eq!(of_program(16, nothing), Verdict::Refused);
    }
}

fn submessage() -> impl Strategy<Value = Submessage> {
    let order = prop_oneof![Just(Order::Little), Just(Order::Big)];
    // Near the limits, and anywhere.
    let number = prop_oneof![
        (0_i64..70, -2_i64..3).prop_map(|(upper, add)| (upper << 16) + add),
        (0_i64..5, -2_i64..3).prop_map(|(upper, add)| (upper << 32) + add),
        any::<i64>(),
    ];
    let size = prop_oneof![
        (0_u32..0x500, 0_u32..3).prop_map(|(upper, add)| (upper << 16) + add),
        any::<u32>()
    ];
    let entity =
        prop_oneof![Just(0x00_u8), Just(0x03), Just(0x04), Just(0xc2), Just(0xc7), any::<u8>()];
    (order, 0..8_u8, [number.clone(), number], size, [entity.clone(), entity]).prop_map(
        |(order, which, [first, last], size, entities)| match which {
            0 => Submessage::heartbeat(order, first, last),
            1 => Submessage::gap(order, first, last),
            2 => Submessage::fragment(order, entities, size),
            3 => Submessage::nack_fragment(order, size),
            4 => Submessage::empty(order, (size & 0xff) as u8 as u32),
            5 => Submessage::info_dst(order),
            6 => Submessage::data_to_the_end(order),
            _ => Submessage::info_ts(order),
        },
    )
}

proptest! {
    #[test]
    fn the_program_says_what_the_rules_say(
        submessages in proptest::collection::vec(submessage(), 0..24),
        changes in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..6),
        cut in proptest::option::of(any::<prop::sample::Index>()),
        looked_at in prop_oneof![Just(3_usize), Just(16)],
    ) {
        let mut datagram = rtps(&submessages);
        for (place, byte) in changes {
            let place = place.index(datagram.len());
            datagram[place] = byte;
        }
        if let Some(cut) = cut {
            datagram.truncate(cut.index(datagram.len()));
        }
        prop_assert_eq!(of_program(looked_at, &datagram), judge(looked_at, &datagram));
    }

    #[test]
    fn no_bytes_are_a_fault(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
        let datagram = [b"RTPS".as_slice(), &bytes].concat();
        prop_assert_eq!(of_program(16, &datagram), judge(16, &datagram));
    }
}

/// How many submessages a filter of this process looks at, and what of these datagrams its socket gets; `None` where there is no filter available.
fn received(datagrams: &[Vec<u8>]) -> Option<(usize, Vec<Vec<u8>>)> {
    use std::os::fd::AsRawFd;

    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    let handle = SocketHandle::of(socket.as_raw_fd())
        .inspect_err(|error| println!("skipped: no handle of a socket is available ({error})"))
        .ok()?;
    let filter = DatagramFilter::on([&handle].into_iter());
    let DatagramFilter::On { submessages } = filter else { panic!("{filter}") };
    let sender = UdpSocket::bind("127.0.0.1:0").unwrap();
    let last = rtps(&[Submessage::info_dst(Order::Little)]);
    for datagram in datagrams.iter().chain([&last]) {
        sender.send_to(datagram, socket.local_addr().unwrap()).unwrap();
    }
    socket.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
    let mut received = Vec::new();
    let mut buffer = vec![0; 1 << 16];
    loop {
        let length = socket.recv(&mut buffer).unwrap();
        if buffer[..length] == last {
            return Some((submessages, received));
        }
        received.push(buffer[..length].to_vec());
    }
}

#[test]
fn the_kernel_says_what_the_rules_say() {
    use proptest::strategy::ValueTree;
    use proptest::test_runner::TestRunner;

    let mut runner = TestRunner::deterministic();
    let many = proptest::collection::vec(submessage(), 1..60);
    let mut next = || rtps(&many.new_tree(&mut runner).unwrap().current());
    let mut datagrams: Vec<_> = (0..100).map(|_| next()).collect();
    datagrams.push(rtps(&vec![Submessage::info_ts(Order::Big); 50]));
    let Some((submessages, got)) = received(&datagrams) else { return };
    let expected: Vec<_> = datagrams
        .iter()
        .filter_map(|datagram| match judge(submessages, datagram) {
            Verdict::Taken(length) => Some(datagram[..length].to_vec()),
            Verdict::Refused => None,
        })
        .collect();
    assert_eq!(got.len(), expected.len());
    assert_eq!(got, expected);
}

#[test]
fn a_process_without_sockets_says_why_there_is_no_filter() {
    let filter = DatagramFilter::on(std::iter::empty());
    assert!(filter.missing().unwrap().contains("pidfd_getfd"), "{filter}");
}
