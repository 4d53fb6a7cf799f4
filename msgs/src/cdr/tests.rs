use std::fmt::Debug;

use byteorder::{BigEndian, LittleEndian};
use proptest::prelude::*;

use super::*;
use crate::builtin_interfaces::Time;
use crate::diagnostic_msgs::{DiagnosticArray, DiagnosticStatus, KeyValue};
use crate::geometry_msgs::{Quaternion, Transform, TransformStamped, Vector3};
use crate::introspection::fill::filled;
use crate::registry::for_each_message;
use crate::sensor_msgs::{CameraInfo, Image, LaserScan, PointCloud2, PointField};
use crate::std_msgs::{self, Header};
use crate::tf2_msgs::TFMessage;

fn bytes_of(hexadecimal: &str) -> Vec<u8> {
    let pair = |pair: &[u8]| u8::from_str_radix(std::str::from_utf8(pair).unwrap(), 16).unwrap();
    hexadecimal.as_bytes().chunks(2).map(pair).collect()
}

fn big_endian<M: RosMessage>(message: &M) -> Vec<u8> {
    let mut bytes = vec![0, 0, 0, 0];
    cdr_encoding::to_writer::<M, BigEndian, _>(&mut bytes, message).unwrap();
    bytes
}

fn assert_encoding<M: RosMessage + PartialEq + Debug>(message: &M, hexadecimal: &str) {
    assert_eq!(encode(message).unwrap(), bytes_of(hexadecimal));
    assert_eq!(decode::<M>(&bytes_of(hexadecimal)).as_ref(), Ok(message));
}

fn header(sec: i32, nanosec: u32, frame_id: &str) -> Header {
    Header { stamp: Time { sec, nanosec }, frame_id: frame_id.to_owned() }
}

/// The bytes below were written by the Python package rosbags 0.11 with its Jazzy types.
#[test]
fn a_laser_scan_is_what_others_write() {
    let scan = LaserScan {
        header: header(1_700_000_000, 123_456_789, "laser"),
        angle_min: -0.5,
        angle_max: 0.5,
        angle_increment: 0.5,
        time_increment: 0.001,
        scan_time: 0.14,
        range_min: 0.15,
        range_max: 8.0,
        ranges: vec![1.25, f32::INFINITY, 2.5],
        intensities: Vec::new(),
    };
    assert_encoding(
        &scan,
        "0001000000f1536515cd5b07060000006c61736572000000000000bf0000003f0000003f6f12833a\
         295c0f3e9a99193e00000041030000000000a03f0000807f0000204000000000",
    );
}

#[test]
fn a_tree_of_frames_is_what_others_write() {
    let edge = |header, child: &str, x, y, z, rotation| TransformStamped {
        header,
        child_frame_id: child.to_owned(),
        transform: Transform { translation: Vector3 { x, y, z }, rotation },
    };
    let half_turn = Quaternion { x: 0.0, y: 0.0, z: 1.0, w: 0.0 };
    let tree = TFMessage {
        transforms: vec![
            edge(header(1, 2, "map"), "odom", 1.0, 2.0, 3.0, Quaternion::default()),
            edge(header(-1, 3, "odom"), "base_link", -1.0, 0.0, 0.5, half_turn),
        ],
    };
    assert_encoding(
        &tree,
        "00010000020000000100000002000000040000006d617000050000006f646f6d0000000000000000\
         0000f03f000000000000004000000000000008400000000000000000000000000000000000000000\
         00000000000000000000f03fffffffff03000000050000006f646f6d000000000a00000062617365\
         5f6c696e6b00000000000000000000000000f0bf0000000000000000000000000000e03f00000000\
         000000000000000000000000000000000000f03f0000000000000000",
    );
}

#[test]
fn a_cloud_is_what_others_write() {
    let field = |name: &str, offset| PointField {
        name: name.to_owned(),
        offset,
        datatype: PointField::FLOAT32,
        count: 1,
    };
    let cloud = PointCloud2 {
        header: header(7, 8, "cam"),
        height: 1,
        width: 2,
        fields: vec![field("x", 0), field("y", 4), field("z", 8)],
        is_bigendian: false,
        point_step: 12,
        row_step: 24,
        data: [1.0_f32, 2.0, 3.0, 4.0, 5.0, 6.0].iter().flat_map(|v| v.to_le_bytes()).collect(),
        is_dense: true,
    };
    assert_encoding(
        &cloud,
        "0001000007000000080000000400000063616d000100000002000000030000000200000078000000\
         0000000007000000010000000200000079000000040000000700000001000000020000007a000000\
         080000000700000001000000000000000c00000018000000180000000000803f0000004000004040\
         000080400000a0400000c04001",
    );
}

#[test]
fn diagnostics_are_what_others_write() {
    let array = DiagnosticArray {
        header: Header::default(),
        status: vec![DiagnosticStatus {
            level: DiagnosticStatus::ERROR,
            name: "scan".to_owned(),
            message: "no scan".to_owned(),
            hardware_id: String::new(),
            values: vec![KeyValue { key: "rate".to_owned(), value: "0".to_owned() }],
        }],
    };
    assert_encoding(
        &array,
        "00010000000000000000000001000000000000000100000002000000050000007363616e00000000\
         080000006e6f207363616e0001000000000000000100000005000000726174650000000002000000\
         3000",
    );
    assert_encoding(&std_msgs::Empty::default(), "0001000000");
}

fn fault_of<M: RosMessage + Debug>(bytes: &[u8]) -> CdrFault {
    let error = decode::<M>(bytes).unwrap_err();
    assert_eq!(error.type_name, M::TYPE_NAME);
    error.fault
}

fn text_message(length: u32, content: &[u8]) -> Vec<u8> {
    [&[0, 1, 0, 0], length.to_le_bytes().as_slice(), content].concat()
}

#[test]
fn a_header_that_is_none_is_named() {
    assert_eq!(fault_of::<std_msgs::Bool>(&[]), CdrFault::NoHeader { bytes: 0 });
    assert_eq!(fault_of::<std_msgs::Bool>(&[0, 1, 0]), CdrFault::NoHeader { bytes: 3 });
    // A parameter list, plain XCDR2, and nothing known.
    for identifier in [0x0003, 0x0007, 0x0100, 0xFFFF_u16] {
        let [high, low] = identifier.to_be_bytes();
        let fault = fault_of::<std_msgs::Bool>(&[high, low, 0, 0, 1]);
        assert_eq!(fault, CdrFault::UnknownEncapsulation { identifier });
    }
    // The options, which may contain the padding, are not read.
    assert_eq!(decode(&[0, 1, 9, 9, 1]), Ok(std_msgs::Bool { data: true }));
}

#[test]
fn strings_that_lie_are_named() {
    type Text = std_msgs::String;
    let text = |data: &str| Ok(Text { data: data.to_owned() });
    assert_eq!(decode(&text_message(3, b"ab\0")), text("ab"));
    assert_eq!(decode(&text_message(1, b"\0")), text(""));
    assert_eq!(decode(&text_message(0, b"")), text(""));
    assert_eq!(
        fault_of::<Text>(&text_message(4, b"ab\0")),
        CdrFault::ClaimsTooMuch { what: "string", at: 8, claimed: 4, left: 3 }
    );
    assert_eq!(
        fault_of::<Text>(&text_message(u32::MAX, b"ab\0")),
        CdrFault::ClaimsTooMuch { what: "string", at: 8, claimed: u32::MAX, left: 3 }
    );
    assert_eq!(
        fault_of::<Text>(&text_message(2, b"ab")),
        CdrFault::Unterminated { at: 8, length: 2 }
    );
    assert!(matches!(
        fault_of::<Text>(&text_message(3, b"\xff\xfe\0")),
        CdrFault::NotUtf8 { at: 8, .. }
    ));
    assert_eq!(
        fault_of::<Text>(&[0, 1, 0, 0, 1, 0]),
        CdrFault::Ended { at: 4, needed: 4, left: 2 }
    );
}

#[test]
fn sequences_of_four_billion_are_refused_at_once() {
    let path = [0, 1, 0, 0, 0xFF, 0xFF, 0xFF, 0xFF, 0, 0, 0, 0];
    let claims = CdrFault::ClaimsTooMuch { what: "sequence", at: 8, claimed: u32::MAX, left: 4 };
    assert_eq!(fault_of::<TFMessage>(&path), claims);

    let mut image = encode(&Image { data: vec![5; 10], ..Image::default() }).unwrap();
    let count_at = image.len() - 14;
    image[count_at..count_at + 4].copy_from_slice(&u32::MAX.to_le_bytes());
    assert_eq!(
        fault_of::<Image>(&image),
        CdrFault::ClaimsTooMuch { what: "bytes", at: count_at + 4, claimed: u32::MAX, left: 10 }
    );
}

#[test]
fn truth_is_0_or_1() {
    assert_eq!(decode(&[0, 1, 0, 0, 0]), Ok(std_msgs::Bool { data: false }));
    let fault = fault_of::<std_msgs::Bool>(&[0, 1, 0, 0, 2]);
    assert_eq!(fault, CdrFault::NotABool { at: 4, value: 2 });
}

#[test]
fn padding_is_read_and_more_is_not() {
    let mut bytes = encode(&std_msgs::Bool { data: true }).unwrap();
    for padding in 1..=7 {
        bytes.push(0);
        assert_eq!(decode(&bytes), Ok(std_msgs::Bool { data: true }), "{padding} bytes");
    }
    bytes.push(0);
    assert_eq!(fault_of::<std_msgs::Bool>(&bytes), CdrFault::BytesLeft { at: 5, left: 8 });
}

#[test]
fn an_error_names_type_place_and_numbers() {
    let error = decode::<std_msgs::String>(&text_message(9, b"ab\0")).unwrap_err();
    assert_eq!(
        error.to_string(),
        "std_msgs/msg/String in CDR: the string at byte 8 claims 9 elements where 3 bytes are \
         left; it was cut, or is of another type"
    );
}

#[test]
fn a_body_without_header_is_read_in_the_given_order() {
    let time = Time { sec: 1, nanosec: 2 };
    assert_eq!(decode_body(&[1, 0, 0, 0, 2, 0, 0, 0], ByteOrder::Little), Ok(time));
    assert_eq!(decode_body(&[0, 0, 0, 1, 0, 0, 0, 2], ByteOrder::Big), Ok(time));
}

/// A message goes out and comes back in both byte orders, and another implementation reads the same.
fn assert_round_trip<M: RosMessage + PartialEq + Debug>(seed: u64) {
    let message: M = filled(seed);
    let bytes = encode(&message).unwrap();
    assert_eq!(encoded_len(&message), Ok(bytes.len()));
    assert_eq!(decode::<M>(&bytes).as_ref(), Ok(&message));
    assert_eq!(decode::<M>(&big_endian(&message)).as_ref(), Ok(&message));
    let (theirs, read) = cdr_encoding::from_bytes::<M, LittleEndian>(&bytes[4..]).unwrap();
    assert_eq!((theirs, read), (message, bytes.len() - 4));
}

/// No prefix of a message is a message.
fn assert_cuts_are_seen<M: RosMessage + Debug>() {
    let bytes = encode(&filled::<M>(1)).unwrap();
    for length in 0..bytes.len() {
        assert!(decode::<M>(&bytes[..length]).is_err(), "{} cut at {length}", M::TYPE_NAME);
    }
}

/// Whatever the bytes, decoding ends, and what it takes for a message the other implementation
/// takes for the same one.
fn decode_anything<M: RosMessage + PartialEq>(bytes: &[u8]) {
    if let Ok(message) = decode::<M>(bytes) {
        let body = &bytes[4..];
        let theirs = if bytes[1] == 1 {
            cdr_encoding::from_bytes::<M, LittleEndian>(body)
        } else {
            cdr_encoding::from_bytes::<M, BigEndian>(body)
        };
        let (theirs, _) = theirs.unwrap();
        // Compared as bytes, since a NaN is not equal to itself.
        assert_eq!(encode(&theirs).unwrap(), encode(&message).unwrap());
    }
}

fn decode_damaged<M: RosMessage + PartialEq>(seed: u64, damage: &[(usize, u8)]) {
    let mut bytes = encode(&filled::<M>(seed)).unwrap();
    for (at, value) in damage {
        let at = at % bytes.len();
        bytes[at] = *value;
    }
    decode_anything::<M>(&bytes);
}

#[test]
fn no_prefix_of_a_message_is_a_message() {
    macro_rules! check {
        ($($message:ty,)*) => { $(assert_cuts_are_seen::<$message>();)* };
    }
    for_each_message!(check);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn every_message_goes_out_and_comes_back(seed in any::<u64>()) {
        macro_rules! check {
            ($($message:ty,)*) => { $(assert_round_trip::<$message>(seed);)* };
        }
        for_each_message!(check);
    }

    #[test]
    fn random_bytes_are_survived(
        order in 0_u8..2,
        body in proptest::collection::vec(prop_oneof![3 => 0_u8..4, 1 => any::<u8>()], 0..300),
    ) {
        let bytes = [&[0, order, 0, 0], body.as_slice()].concat();
        macro_rules! check {
            ($($message:ty,)*) => { $(decode_anything::<$message>(&bytes);)* };
        }
        for_each_message!(check);
    }

    #[test]
    fn damaged_messages_are_survived(
        seed in any::<u64>(),
        damage in proptest::collection::vec((any::<usize>(), any::<u8>()), 1..6),
    ) {
        macro_rules! check {
            ($($message:ty,)*) => { $(decode_damaged::<$message>(seed, &damage);)* };
        }
        for_each_message!(check);
    }

    #[test]
    fn extremes_come_back_bit_by_bit(ranges in proptest::collection::vec(any::<u32>(), 0..9)) {
        let ranges: Vec<f32> = ranges.into_iter().map(f32::from_bits).collect();
        let scan = LaserScan { ranges: ranges.clone(), ..LaserScan::default() };
        let back: LaserScan = decode(&encode(&scan).unwrap()).unwrap();
        let bits = |values: &[f32]| values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
        prop_assert_eq!(bits(&back.ranges), bits(&ranges));
    }
}

#[test]
fn an_empty_sequence_of_doubles_needs_no_alignment_of_its_own() {
    // `d` of CameraInfo ends at an odd multiple of 4; the nine doubles after it are aligned to 8.
    let info = CameraInfo { distortion_model: "abc".to_owned(), ..CameraInfo::default() };
    assert_eq!(decode(&encode(&info).unwrap()), Ok(info));
}
