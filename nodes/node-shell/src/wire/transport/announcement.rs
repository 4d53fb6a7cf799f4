//! The message by which a participant makes itself known (RTPS 2.5, section 8.5.3: the simple
//! participant discovery protocol), as the DDS library itself sends it.

use std::net::SocketAddrV4;
use std::time::Duration;

/// The library's announcement; `the_library_announces_the_same` compares byte by byte.
const HEADER_VERSION: [u8; 2] = [2, 4];
const PROTOCOL_VERSION: [u8; 2] = [2, 3];
const VENDOR: [u8; 2] = [0x01, 0x12];

/// The ends of a participant that its announcement lists: announcer and detector of participants,
/// publications, subscriptions and topics, writer and reader of liveliness messages.
const BUILTIN_ENDPOINTS: u32 = 0x1800_0c3f;

/// After how long without an announcement a peer is dropped: five of the library's periods.
pub(super) const LEASE: Duration = Duration::from_secs(50);

/// The library counts its own announcements from 1. These numbers are far above, so that none is taken
/// for a repetition of the library's. A peer that only takes rising numbers then ignores the
/// library's, and so its farewell: hence [`Participant::farewell`].
const FIRST_NUMBER: i64 = 1 << 32;

const DATA: u8 = 0x15;
const LITTLE_ENDIAN: u8 = 0x01;
const WITH_INLINE_QOS: u8 = 0x02;
const WITH_DATA: u8 = 0x04;
const WITH_KEY: u8 = 0x08;
const ANY_READER: [u8; 4] = [0; 4];
const PARTICIPANT_WRITER: [u8; 4] = [0x00, 0x01, 0x00, 0xc2];
/// From the start of the field that holds the offset of the inline QoS to the inline QoS.
const OCTETS_TO_INLINE_QOS: u16 = 16;
/// Parameter list, little-endian, no options.
const ENCAPSULATION: [u8; 4] = [0x00, 0x03, 0x00, 0x00];
const LOCATOR_UDP_V4: i32 = 1;
const DISPOSED_AND_UNREGISTERED: [u8; 4] = [0, 0, 0, 3];

mod parameter {
    pub(super) const SENTINEL: u16 = 0x0001;
    pub(super) const LEASE_DURATION: u16 = 0x0002;
    pub(super) const PROTOCOL_VERSION: u16 = 0x0015;
    pub(super) const VENDOR_ID: u16 = 0x0016;
    pub(super) const DEFAULT_UNICAST_LOCATOR: u16 = 0x0031;
    pub(super) const METATRAFFIC_UNICAST_LOCATOR: u16 = 0x0032;
    pub(super) const METATRAFFIC_MULTICAST_LOCATOR: u16 = 0x0033;
    pub(super) const MANUAL_LIVELINESS_COUNT: u16 = 0x0034;
    pub(super) const EXPECTS_INLINE_QOS: u16 = 0x0043;
    pub(super) const DEFAULT_MULTICAST_LOCATOR: u16 = 0x0048;
    pub(super) const PARTICIPANT_GUID: u16 = 0x0050;
    pub(super) const BUILTIN_ENDPOINT_SET: u16 = 0x0058;
    pub(super) const STATUS_INFO: u16 = 0x0071;
}

/// The announced data of a participant.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct Participant {
    pub(super) guid: [u8; 16],
    pub(super) discovery_unicast: Vec<SocketAddrV4>,
    pub(super) discovery_multicast: Vec<SocketAddrV4>,
    pub(super) data_unicast: Vec<SocketAddrV4>,
    pub(super) data_multicast: Vec<SocketAddrV4>,
}

impl Participant {
    /// The part of its name that everything of the participant shares.
    pub(super) fn prefix(&self) -> [u8; 12] {
        let mut prefix = [0; 12];
        prefix.copy_from_slice(&self.guid[..12]);
        prefix
    }

    /// The `count`th announcement.
    pub(super) fn announcement(&self, count: u32) -> Vec<u8> {
        let mut data = Parameters::new();
        data.put(parameter::PROTOCOL_VERSION, &PROTOCOL_VERSION);
        data.put(parameter::VENDOR_ID, &VENDOR);
        data.put(parameter::EXPECTS_INLINE_QOS, &[0]);
        data.put(parameter::PARTICIPANT_GUID, &self.guid);
        data.locators(parameter::METATRAFFIC_UNICAST_LOCATOR, &self.discovery_unicast);
        data.locators(parameter::METATRAFFIC_MULTICAST_LOCATOR, &self.discovery_multicast);
        data.locators(parameter::DEFAULT_UNICAST_LOCATOR, &self.data_unicast);
        data.locators(parameter::DEFAULT_MULTICAST_LOCATOR, &self.data_multicast);
        data.put(parameter::BUILTIN_ENDPOINT_SET, &BUILTIN_ENDPOINTS.to_le_bytes());
        let lease = u32::try_from(LEASE.as_secs()).unwrap_or(u32::MAX);
        data.put(parameter::LEASE_DURATION, &[lease.to_le_bytes(), [0; 4]].concat());
        data.put(parameter::MANUAL_LIVELINESS_COUNT, &[0; 4]);
        self.message(count, WITH_DATA, &[], &data.end())
    }

    /// The announcement that the participant leaves; `count` one above that of the last announcement.
    pub(super) fn farewell(&self, count: u32) -> Vec<u8> {
        let mut status = Parameters::new();
        status.put(parameter::STATUS_INFO, &DISPOSED_AND_UNREGISTERED);
        let mut key = Parameters::new();
        key.put(parameter::PARTICIPANT_GUID, &self.guid);
        self.message(count, WITH_KEY | WITH_INLINE_QOS, &status.end(), &key.end())
    }

    fn message(&self, count: u32, content: u8, inline_qos: &[u8], payload: &[u8]) -> Vec<u8> {
        let mut message = Vec::new();
        message.extend(b"RTPS");
        message.extend(HEADER_VERSION);
        message.extend(VENDOR);
        message.extend(self.prefix());

        let number = FIRST_NUMBER + i64::from(count);
        let mut body = Vec::new();
        body.extend([0; 2]);
        body.extend(OCTETS_TO_INLINE_QOS.to_le_bytes());
        body.extend(ANY_READER);
        body.extend(PARTICIPANT_WRITER);
        body.extend(((number >> 32) as i32).to_le_bytes());
        body.extend((number as u32).to_le_bytes());
        body.extend(inline_qos);
        body.extend(ENCAPSULATION);
        body.extend(payload);
        submessage(&mut message, DATA, LITTLE_ENDIAN | content, &body);
        message
    }
}

fn submessage(message: &mut Vec<u8>, kind: u8, flags: u8, body: &[u8]) {
    // Announcements are a few hundred bytes: 32 interfaces would be 2 kB.
    let length = u16::try_from(body.len()).unwrap_or(0);
    message.extend([kind, flags]);
    message.extend(length.to_le_bytes());
    message.extend(body);
}

/// A list of parameters, each padded to four bytes.
struct Parameters(Vec<u8>);

impl Parameters {
    fn new() -> Self {
        Self(Vec::new())
    }

    fn put(&mut self, name: u16, value: &[u8]) {
        let padded = value.len().next_multiple_of(4);
        self.0.extend(name.to_le_bytes());
        self.0.extend(u16::try_from(padded).unwrap_or(0).to_le_bytes());
        self.0.extend(value);
        self.0.resize(self.0.len() + padded - value.len(), 0);
    }

    fn locators(&mut self, name: u16, addresses: &[SocketAddrV4]) {
        for address in addresses {
            let mut locator = Vec::with_capacity(24);
            locator.extend(LOCATOR_UDP_V4.to_le_bytes());
            locator.extend(u32::from(address.port()).to_le_bytes());
            locator.extend([0; 12]);
            locator.extend(address.ip().octets());
            self.put(name, &locator);
        }
    }

    fn end(mut self) -> Vec<u8> {
        self.0.extend(parameter::SENTINEL.to_le_bytes());
        self.0.extend([0; 2]);
        self.0
    }
}

#[cfg(test)]
pub(super) mod tests;
