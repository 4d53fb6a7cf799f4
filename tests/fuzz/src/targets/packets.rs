//! Packets of a scanner: as datagrams, in captures, in messages.

use geometry::Stamp;
use lidar_odometry::capture::CaptureReader;
use lidar_odometry::packets::{DATA_PORT, DecoderConfig, Gprmc, PACKET_BYTES, PositionPacket};
use lidar_odometry::revolution::{PacketClock, RevolutionAssembly, RevolutionConfig, deskewed};

use super::{FAST, samples, text_of};
use crate::{MemoryBound, Target};

/// A capture is read through a buffer of a megabyte, which grows to a frame's length at most.
const CAPTURE: MemoryBound = MemoryBound { base_bytes: 12 << 20, per_byte: 256 };

pub(super) const TARGETS: &[Target] = &[
    Target {
        name: "velodyne",
        body: packets,
        seeds: || vec![samples::velodyne_packet(), samples::velodyne_packet().repeat(3)],
        words: &[&[0xff, 0xee], &[0xff, 0xdd], &[0x37, 0x22], &[0x38, 0x21], &[0x39, 0x28]],
        memory: CAPTURE,
        gate_cases: FAST / 2,
    },
    Target {
        name: "pcap",
        body: capture,
        seeds: || vec![pcap(), pcapng()],
        words: &[
            &[0x0a, 0x0d, 0x0d, 0x0a],
            &[0xd4, 0xc3, 0xb2, 0xa1],
            &[8, 0, 0x45],
            &[0x86, 0xdd],
            &[0x81, 0],
        ],
        memory: CAPTURE,
        gate_cases: FAST / 2,
    },
    Target {
        name: "gprmc",
        body: position,
        seeds: positions,
        words: &[b"$GPRMC,", b"*", b",A,", b",V,"],
        memory: CAPTURE,
        gate_cases: FAST,
    },
];

fn assembly(clock: PacketClock) -> RevolutionAssembly {
    let made = RevolutionAssembly::new(DecoderConfig::default(), RevolutionConfig::default());
    made.expect("the defaults are a configuration").with_clock(clock)
}

/// One packet after the other; the last one may be shorter.
fn packets(bytes: &[u8]) {
    for clock in [PacketClock::Arrival, PacketClock::Scanner] {
        let mut assembly = assembly(clock);
        let arrivals = (0..).map(|packet| Stamp::from_nanos(1_700_000_000_000_000_000 + packet));
        for (packet, arrival) in bytes.chunks(PACKET_BYTES).zip(arrivals) {
            let _ = assembly.push(packet, arrival);
        }
        if let Some(built) = assembly.finish() {
            let _ = deskewed(&built.revolution, &Default::default(), 0.0);
        }
        let _ = assembly.counts();
    }
}

fn capture(bytes: &[u8]) {
    let Ok(reader) = CaptureReader::new(bytes) else { return };
    let mut assembly = assembly(PacketClock::Arrival);
    for datagram in reader.map_while(Result::ok) {
        let _ = assembly.push(&datagram.payload, datagram.arrival);
        let _ = PositionPacket::parse(&datagram.payload);
    }
    let _ = assembly.finish();
}

/// A frame of Ethernet with a datagram of IPv4.
fn frame(payload: &[u8]) -> Vec<u8> {
    let datagram_bytes = (8 + payload.len()) as u16;
    let mut frame = vec![0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0x60, 0x76, 0x88, 0, 0, 0, 8, 0];
    frame.extend([0x45, 0]);
    frame.extend((20 + datagram_bytes).to_be_bytes());
    frame.extend([0, 0, 0x40, 0, 0xff, 17, 0, 0, 192, 168, 1, 201, 255, 255, 255, 255]);
    frame.extend(DATA_PORT.to_be_bytes());
    frame.extend(DATA_PORT.to_be_bytes());
    frame.extend(datagram_bytes.to_be_bytes());
    frame.extend([0, 0]);
    frame.extend(payload);
    frame
}

fn pcap() -> Vec<u8> {
    let mut file = Vec::new();
    for word in [0xa1b2_c3d4_u32, 0x0004_0002, 0, 0, 65_535, 1] {
        file.extend(word.to_le_bytes());
    }
    for _ in 0..2 {
        let frame = frame(&samples::velodyne_packet());
        for word in [1_700_000_000, 5, frame.len() as u32, frame.len() as u32] {
            file.extend(word.to_le_bytes());
        }
        file.extend(frame);
    }
    file
}

fn pcapng() -> Vec<u8> {
    let block = |kind: u32, body: &[u8]| {
        let length = (12 + body.len()) as u32;
        [&kind.to_le_bytes(), &length.to_le_bytes(), body, &length.to_le_bytes()].concat()
    };
    let section = [&0x1a2b_3c4d_u32.to_le_bytes()[..], &[1, 0, 0, 0], &[0xff; 8]].concat();
    // Ethernet, and times in units of 10^-9 s.
    let interface = [1, 0, 0, 0, 0xff, 0xff, 0, 0, 9, 0, 1, 0, 9, 0, 0, 0, 0, 0, 0, 0];
    let mut frame = frame(&samples::velodyne_packet());
    let length = frame.len() as u32;
    frame.resize(frame.len().next_multiple_of(4), 0);
    let mut packet = Vec::new();
    for word in [0, 0x0017_979c, 0xfe00_0000, length, length] {
        packet.extend(u32::to_le_bytes(word));
    }
    packet.extend(frame);
    [block(0x0a0d_0d0a, &section), block(1, &interface), block(6, &packet)].concat()
}

fn position(bytes: &[u8]) {
    let _ = Gprmc::parse(bytes);
    let _ = Gprmc::parse(text_of(bytes).as_bytes());
    let _ = PositionPacket::parse(bytes);
}

fn positions() -> Vec<Vec<u8>> {
    let sentence =
        b"$GPRMC,220516,A,5133.82,N,00042.24,W,173.8,231.8,130694,004.2,W*70\r\n".to_vec();
    let mut packet = vec![0; 512];
    if let Some(place) = packet.get_mut(206..206 + sentence.len()) {
        place.copy_from_slice(&sentence);
    }
    vec![sentence, packet]
}
