//! The packets: RTPS messages (RTPS 2.5, section 9.4), little-endian.

const SEDP_PUBLICATIONS_READER: [u8; 4] = [0x00, 0x00, 0x03, 0xc7];
const SEDP_PUBLICATIONS_WRITER: [u8; 4] = [0x00, 0x00, 0x03, 0xc2];
const LITTLE_ENDIAN: u8 = 0x01;
const HEARTBEAT: u8 = 0x07;
const GAP: u8 = 0x08;
const DATA_FRAG: u8 = 0x16;

/// A packet in the name of a participant; the number is to be larger each time.
type Packet = fn([u8; 12], u32) -> Vec<u8>;

/// Those that were found to end a node, each with its name.
pub(super) fn that_end_a_node() -> [(&'static str, Packet); 3] {
    [("a heartbeat", heartbeat), ("a gap", gap), ("a fragment", fragment)]
}

fn number(number: i64) -> [u8; 8] {
    let (upper, lower) = ((number >> 32) as u32, number as u32);
    let mut bytes = [0; 8];
    bytes[..4].copy_from_slice(&upper.to_le_bytes());
    bytes[4..].copy_from_slice(&lower.to_le_bytes());
    bytes
}

fn message(prefix: [u8; 12], kind: u8, body: &[&[u8]]) -> Vec<u8> {
    let body = body.concat();
    let length = u16::try_from(body.len()).unwrap();
    let mut message = b"RTPS\x02\x04\x01\x12".to_vec();
    message.extend(prefix);
    message.extend([kind, LITTLE_ENDIAN]);
    message.extend(length.to_le_bytes());
    message.extend(body);
    message
}

/// Announces 2^56 messages.
fn heartbeat(prefix: [u8; 12], count: u32) -> Vec<u8> {
    let (first, last) = (number(1), number(1 << 56));
    let ends = [SEDP_PUBLICATIONS_READER, SEDP_PUBLICATIONS_WRITER].concat();
    message(prefix, HEARTBEAT, &[&ends, &first, &last, &count.to_le_bytes()])
}

/// Takes 2^56 messages back.
fn gap(prefix: [u8; 12], count: u32) -> Vec<u8> {
    let (first, last) = (number(100_000 + i64::from(count)), number(1 << 56));
    let ends = [SEDP_PUBLICATIONS_READER, SEDP_PUBLICATIONS_WRITER].concat();
    message(prefix, GAP, &[&ends, &first, &last, &0_u32.to_le_bytes()])
}

/// Is one of a message of 4 GB.
fn fragment(prefix: [u8; 12], count: u32) -> Vec<u8> {
    let ends = [SEDP_PUBLICATIONS_READER, SEDP_PUBLICATIONS_WRITER].concat();
    let sizes = [&1_u32.to_le_bytes()[..], &1_u16.to_le_bytes(), &u16::MAX.to_le_bytes()].concat();
    let body = [
        &[0, 0, 28, 0][..],
        &ends,
        &number(i64::from(count)),
        &sizes,
        &u32::MAX.to_le_bytes(),
        &[7; 60],
    ];
    message(prefix, DATA_FRAG, &body)
}
