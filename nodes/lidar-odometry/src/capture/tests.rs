mod reference;

use etherparse::{PacketBuilder, VlanId};
use proptest::prelude::*;

use super::*;

const MICROSECONDS: u32 = 0xa1b2_c3d4;
const NANOSECONDS: u32 = 0xa1b2_3c4d;

/// A pcap file of frames, each a fourth of a second after the one before.
fn pcap(magic: u32, link_type: u32, frames: &[Vec<u8>]) -> Vec<u8> {
    let mut bytes = Vec::new();
    for value in [magic, 0x0004_0002, 0, 0, 65_535, link_type] {
        bytes.extend(value.to_le_bytes());
    }
    let fourth = if magic == NANOSECONDS { 250_000_000 } else { 250_000 };
    for (index, frame) in frames.iter().enumerate() {
        let index = index as u32;
        let length = frame.len() as u32;
        for value in [1000 + index / 4, index % 4 * fourth, length, length] {
            bytes.extend(value.to_le_bytes());
        }
        bytes.extend(frame);
    }
    bytes
}

/// A block of a pcapng file.
fn block(kind: u32, body: &[u8]) -> Vec<u8> {
    let padding = body.len().next_multiple_of(4) - body.len();
    let length = (12 + body.len() + padding) as u32;
    [&kind.to_le_bytes(), &length.to_le_bytes(), body, &vec![0; padding], &length.to_le_bytes()]
        .concat()
}

/// A pcapng file whose one interface counts time in units of the option `if_tsresol`.
fn pcapng(resolution: u8, units: u64, frames: &[Vec<u8>]) -> Vec<u8> {
    let mut section = 0x1a2b_3c4d_u32.to_le_bytes().to_vec();
    section.extend(1_u32.to_le_bytes());
    section.extend(u64::MAX.to_le_bytes());
    let interface = [1, 0, 0, 0, 0, 0, 1, 0, 9, 0, 1, 0, resolution, 0, 0, 0, 0, 0, 0, 0];
    let mut bytes = [block(0x0a0d_0d0a, &section), block(1, &interface)].concat();
    for frame in frames {
        let mut body = Vec::new();
        let length = frame.len() as u32;
        for value in [0, (units >> 32) as u32, units as u32, length, length] {
            body.extend(value.to_le_bytes());
        }
        body.extend(frame);
        bytes.extend(block(6, &body));
    }
    bytes
}

/// A datagram in an Ethernet frame.
fn ethernet(port: u16, payload: &[u8]) -> Vec<u8> {
    let builder = PacketBuilder::ethernet2([1; 6], [2; 6])
        .ipv4([192, 168, 1, 201], [255; 4], 64)
        .udp(443, port);
    let mut frame = Vec::new();
    builder.write(&mut frame, payload).unwrap();
    frame
}

fn read(bytes: &[u8]) -> (Vec<Datagram>, CaptureCounts, Option<CaptureError>) {
    let mut reader = CaptureReader::new(bytes).unwrap();
    let (mut datagrams, mut error) = (Vec::new(), None);
    for next in reader.by_ref() {
        match next {
            Ok(datagram) => datagrams.push(datagram),
            Err(found) => error = Some(found),
        }
    }
    (datagrams, reader.counts(), error)
}

#[test]
fn datagrams_come_with_their_port_and_their_time() {
    let frames = [ethernet(2368, b"data"), ethernet(8308, b"")];
    for magic in [MICROSECONDS, NANOSECONDS] {
        let (datagrams, counts, error) = read(&pcap(magic, 1, &frames));
        assert_eq!(error, None);
        let expected = [
            (Stamp::from_secs_nanos(1000, 0), 2368, b"data".to_vec()),
            (Stamp::from_secs_nanos(1000, 250_000_000), 8308, Vec::new()),
        ];
        let found: Vec<_> =
            datagrams.into_iter().map(|found| (found.arrival, found.port, found.payload)).collect();
        assert_eq!(found, expected);
        let all = CaptureCounts { frames: 2, datagrams: 2, ..CaptureCounts::default() };
        assert_eq!(counts, all);
    }
}

#[test]
fn pcapng_times_are_in_units_of_the_interface() {
    for (resolution, units) in [
        (6, 5_500_000_u64),
        (9, 5_500_000_000),
        (3, 5_500),
        // Powers of two.
        (0x80 | 10, 5 * 1024 + 512),
    ] {
        // A frame whose length is no multiple of four.
        let (datagrams, counts, error) =
            read(&pcapng(resolution, units, &[ethernet(2368, b"odd")]));
        assert_eq!((error, counts.frames), (None, 1), "{resolution}");
        assert_eq!(datagrams[0].arrival, Stamp::from_secs_nanos(5, 500_000_000), "{resolution}");
        assert_eq!(datagrams[0].payload, b"odd");
    }
}

#[test]
fn every_kind_of_network_leads_to_the_datagram() {
    let payload = [7; 20];
    let plain = ethernet(2368, &payload);
    let ip = plain[14..].to_vec();
    let vlan = |builder: etherparse::PacketBuilderStep<etherparse::VlanHeader>| {
        let mut frame = Vec::new();
        builder.ipv4([1; 4], [2; 4], 64).udp(443, 2368).write(&mut frame, &payload).unwrap();
        frame
    };
    let id = |id| VlanId::try_new(id).unwrap();
    let mut v6 = Vec::new();
    let builder = PacketBuilder::ethernet2([1; 6], [2; 6]).ipv6([1; 16], [2; 16], 64);
    builder.udp(443, 2368).write(&mut v6, &payload).unwrap();
    let mut cooked = vec![0; 14];
    cooked.extend([0x08, 0x00]);
    cooked.extend(&ip);
    let mut cooked_2 = vec![0x08, 0x00];
    cooked_2.extend([0; 18]);
    cooked_2.extend(&ip);
    for (link_type, frame) in [
        (1, plain.clone()),
        (1, vlan(PacketBuilder::ethernet2([1; 6], [2; 6]).single_vlan(id(5)))),
        (1, vlan(PacketBuilder::ethernet2([1; 6], [2; 6]).double_vlan(id(5), id(6)))),
        (1, v6),
        (101, ip.clone()),
        (0, [&[2, 0, 0, 0], &ip[..]].concat()),
        (113, cooked),
        (276, cooked_2),
    ] {
        let (datagrams, counts, error) = read(&pcap(MICROSECONDS, link_type, &[frame]));
        assert_eq!(error, None);
        assert_eq!(datagrams.len(), 1, "link type {link_type}: {counts:?}");
        assert_eq!((datagrams[0].port, datagrams[0].payload.as_slice()), (2368, &payload[..]));
    }
}

#[test]
fn what_is_no_whole_datagram_is_counted_by_its_kind() {
    let whole = ethernet(2368, &[7; 20]);
    let mut fragment = whole.clone();
    // More fragments follow.
    fragment[20] |= 0x20;
    let mut later_fragment = whole.clone();
    later_fragment[21] = 3;
    let mut tcp = whole.clone();
    tcp[23] = 6;
    let frames =
        [whole.clone(), fragment, later_fragment, tcp, vec![1, 2, 3], whole[..40].to_vec(), vec![]];
    let (datagrams, counts, error) = read(&pcap(MICROSECONDS, 1, &frames));
    assert_eq!((datagrams.len(), error), (1, None));
    assert_eq!((counts.frames, counts.fragments, counts.datagrams), (7, 2, 1));
    assert_eq!(counts.cut_frames + counts.other_frames, 4, "{counts:?}");

    // A snap length cuts the frame, and the capture says so.
    let mut snapped = pcap(MICROSECONDS, 1, &[whole[..50].to_vec()]);
    let stated = 24 + 12;
    snapped[stated..stated + 4].copy_from_slice(&62_u32.to_le_bytes());
    let (datagrams, counts, _) = read(&snapped);
    assert_eq!((datagrams.len(), counts.cut_frames), (0, 1));
}

#[test]
fn a_capture_that_ends_within_a_frame_gives_what_is_whole() {
    let frames = vec![ethernet(2368, &[7; 1206]); 3];
    for bytes in [pcap(MICROSECONDS, 1, &frames), pcapng(6, 7, &frames)] {
        let (datagrams, counts, error) = read(&bytes[..bytes.len() - 100]);
        assert_eq!((datagrams.len(), counts.cut_off, error), (2, true, None));
        let (datagrams, counts, _) = read(&bytes);
        assert_eq!((datagrams.len(), counts.cut_off), (3, false));
    }
}

#[test]
fn what_is_wrong_is_said() {
    let error = |bytes: &[u8]| CaptureReader::new(bytes).err().unwrap().to_string();
    assert_eq!(error(b""), "the capture is empty (0 bytes)");
    assert_eq!(
        error(b"# no capture, but long enough to be one"),
        "this is neither pcap nor pcapng"
    );
    let (_, _, error) = read(&pcap(MICROSECONDS, 105, &[vec![0; 60]]));
    assert!(error.unwrap().to_string().starts_with("frames of link type 105"));
    let mut damaged = pcap(MICROSECONDS, 1, &[ethernet(2368, b"data"), ethernet(2368, b"data")]);
    let second = 24 + 16 + 46 + 8;
    damaged[second..second + 4].copy_from_slice(&u32::MAX.to_le_bytes());
    let (datagrams, _, error) = read(&damaged);
    assert_eq!(datagrams.len(), 1);
    assert!(error.unwrap().to_string().contains("damaged after 1 frames"));
    let mut other_interface = pcapng(6, 7, &[ethernet(2368, b"data")]);
    let at = 28 + 32 + 8;
    other_interface[at] = 4;
    let (_, _, error) = read(&other_interface);
    assert_eq!(error, Some(CaptureError::Interface { frame: 0, interface: 4 }));
}

proptest! {
    #[test]
    fn no_bytes_make_it_panic_or_run_for_ever(
        mut noise in proptest::collection::vec(any::<u8>(), 0..400),
        places in proptest::collection::vec((0..600_usize, any::<u8>()), 0..6),
        cut in 0..600_usize,
        ng in any::<bool>(),
    ) {
        let frames = vec![ethernet(2368, &[7; 60]); 3];
        let mut bytes = if ng { pcapng(6, 7, &frames) } else { pcap(MICROSECONDS, 1, &frames) };
        for (place, byte) in places {
            if let Some(old) = bytes.get_mut(place) {
                *old = byte;
            }
        }
        bytes.truncate(cut);
        bytes.append(&mut noise);
        if let Ok(mut reader) = CaptureReader::new(&bytes[..]) {
            // A frame has at least 8 bytes.
            prop_assert!(reader.by_ref().count() <= bytes.len() / 8 + 1);
        }
    }

    #[test]
    fn no_frame_makes_it_panic(
        frame in proptest::collection::vec(any::<u8>(), 0..100),
        place in 0..62_usize,
        byte in any::<u8>(),
    ) {
        let mut damaged = ethernet(2368, &[7; 20]);
        damaged[place] = byte;
        for link_type in [0, 1, 101, 113, 276] {
            let link = LinkLayer::of(link_type).unwrap();
            let _ = (link.contents(&frame), link.contents(&damaged));
        }
    }
}
