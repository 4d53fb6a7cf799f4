//! How a request and its response look on the wire, which depends on the client's middleware.
//!
//! - *Enhanced* mapping of DDS-RPC (Fast DDS, Connext, RustDDS): the body is the message, and the request of a response
//!   is given beside it, by the related sample identity.
//! - Cyclone DDS: 16 bytes precede the message, in requests and responses alike, by which the
//!   client knows its responses again; they say nothing to anyone else and go back as they came.
//!
//! The related sample identity is a parameter before the message. RustDDS 0.15.1 writes them wrongly into a message that
//! it sends in fragments (`data_frag.rs`: a byte too many; built for debugging it ends its thread instead), and the peer
//! ignores the message. So a client of Cyclone DDS gets responses without them, of any size, and all others get none
//! that is sent in fragments.
//!
//! Nothing in a request says which of the two it is, but the first two bytes of its writer's identity are
//! the number of the middleware's vendor.

use std::fmt;

use serde::de::{Deserialize, Deserializer, SeqAccess, Visitor};
use serde::ser::{Serialize, SerializeTuple, Serializer};

/// The number that the OMG has given to Eclipse Cyclone DDS, with which all its identities start.
const CYCLONE: [u8; 2] = [0x01, 0x10];
/// Bytes that Cyclone DDS puts in front of a request: half an identity, and a number that counts.
pub(super) const CYCLONE_HEADER: usize = 16;

/// The length of a body is padded to a multiple of this: Cyclone DDS 0.10.2 refuses a message in fragments otherwise.
pub(super) const PADDED_TO: usize = 4;

/// The overhead of a datagram besides its message, when it is sent whole by a reliable writer: headers of IP, UDP and RTPS, a
/// heartbeat, and what RustDDS holds the message's own header to be (`DATAGRAM_HEADER_OVERHEAD`,
/// `HEARTBEAT_SUBMESSAGE_SERIALIZED_SIZE`, `DATA_SUBMESSAGE_OVERHEAD`).
const OVERHEAD: usize = 48 + 32 + 48;

/// The largest message, with its encapsulation, that RustDDS sends whole to any peer.
pub(super) fn largest_whole(smallest_mtu_bytes: usize) -> usize {
    smallest_mtu_bytes.saturating_sub(OVERHEAD)
}

/// The body of a message as it is on the wire.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub(crate) struct Body(pub(super) Vec<u8>);

impl Body {
    pub(crate) fn bytes(&self) -> &[u8] {
        &self.0
    }
}

impl ros2_client::Message for Body {}

impl Serialize for Body {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        // A tuple has no length in CDR, and bytes need no alignment.
        let mut tuple = serializer.serialize_tuple(self.0.len())?;
        for byte in &self.0 {
            tuple.serialize_element(byte)?;
        }
        tuple.end()
    }
}

impl<'de> Deserialize<'de> for Body {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_tuple(usize::MAX, AllBytes)
    }
}

/// Takes bytes until there are none: of a tuple in CDR only its reader knows the length.
struct AllBytes;

impl<'de> Visitor<'de> for AllBytes {
    type Value = Body;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("the bytes of a message")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut bytes: A) -> Result<Body, A::Error> {
        let mut body = Vec::new();
        // The only fault that a byte can have is not to be there.
        while let Ok(Some(byte)) = bytes.next_element() {
            body.push(byte);
        }
        Ok(Body(body))
    }
}

/// A request cut into what its client wants back and the message.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct Parts {
    /// The bytes that the response must start with.
    pub(super) header: Vec<u8>,
    /// The request's body.
    pub(super) message: Vec<u8>,
}

/// A request that is too short for its client's middleware.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
#[error("a request of {bytes} bytes by Cyclone DDS, whose header alone has {CYCLONE_HEADER}")]
pub(super) struct TooShort {
    bytes: usize,
}

/// Cuts a request, by the identity of its writer.
pub(super) fn cut(writer: [u8; 16], body: Body) -> Result<Parts, TooShort> {
    let Body(mut header) = body;
    let header_length = if writer.starts_with(&CYCLONE) { CYCLONE_HEADER } else { 0 };
    if header.len() < header_length {
        return Err(TooShort { bytes: header.len() });
    }
    let message = header.split_off(header_length);
    Ok(Parts { header, message })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use rustdds::CDRSerializerAdapter;
    use rustdds::RepresentationIdentifier;
    use rustdds::no_key::SerializerAdapter;
    use rustdds::serialization::deserialize_from_cdr_with_rep_id;

    use super::*;

    fn writer(vendor: [u8; 2]) -> [u8; 16] {
        let mut writer = [7; 16];
        writer[..2].copy_from_slice(&vendor);
        writer
    }

    #[test]
    fn only_cyclone_has_a_header() {
        let bytes: Vec<u8> = (0..20).collect();
        let cyclone = cut(writer([1, 0x10]), Body(bytes.clone())).unwrap();
        assert_eq!((cyclone.header.as_slice(), cyclone.message.as_slice()), bytes.split_at(16));
        for other in [[1, 0x0f], [1, 0x12], [1, 1], [0x10, 1]] {
            let parts = cut(writer(other), Body(bytes.clone())).unwrap();
            assert_eq!((parts.header.len(), &parts.message), (0, &bytes));
        }
    }

    #[test]
    fn a_request_without_its_header_is_refused() {
        assert_eq!(cut(writer(CYCLONE), Body(vec![0; 15])), Err(TooShort { bytes: 15 }));
        assert!(cut(writer(CYCLONE), Body(vec![0; 16])).unwrap().message.is_empty());
        assert!(cut(writer([1, 0x0f]), Body(Vec::new())).unwrap().message.is_empty());
    }

    proptest! {
        #[test]
        fn a_body_is_its_bytes_in_both_directions(bytes in proptest::collection::vec(any::<u8>(), 0..100)) {
            let sent = CDRSerializerAdapter::<Body>::to_bytes(&Body(bytes.clone())).unwrap();
            prop_assert_eq!(&sent[..], &bytes[..]);
            for encoding in [RepresentationIdentifier::CDR_LE, RepresentationIdentifier::CDR_BE] {
                let (back, _) = deserialize_from_cdr_with_rep_id::<Body>(&sent, encoding).unwrap();
                prop_assert_eq!(&back.0, &bytes);
            }
        }
    }
}
