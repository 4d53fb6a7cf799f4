//! The bytes of a received message, whatever its type.
//!
//! The client library decodes each message, and does not give out the bytes. So a message is "decoded" here into the
//! very bytes of its body. The library does not give out their order: they are taken for little-endian, which is
//! what ROS 2 sends on all machines that it supports.

use std::fmt;

use msgs::RosMessage;
use serde::de::{Deserialize, Deserializer, SeqAccess, Visitor};
use serde::ser::{Serialize, SerializeTuple, Serializer};

/// The encapsulation header of plain CDR, little-endian.
const HEADER: [u8; 4] = [0, 1, 0, 0];

/// A message in little-endian CDR, its encapsulation header in front.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Encoded(pub(crate) Vec<u8>);

impl RosMessage for Encoded {
    /// For the log alone: the type of the topic is the subscription's.
    const TYPE_NAME: &'static str = "encoded message";
    const DEFINITION: &'static str = "";
}

impl Serialize for Encoded {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let body = self.0.get(HEADER.len()..).unwrap_or_default();
        // A tuple has no length in CDR, and bytes need no alignment.
        let mut tuple = serializer.serialize_tuple(body.len())?;
        for byte in body {
            tuple.serialize_element(byte)?;
        }
        tuple.end()
    }
}

impl<'de> Deserialize<'de> for Encoded {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_tuple(usize::MAX, AllBytes)
    }
}

/// Takes bytes until there are none: of a tuple in CDR only its reader knows the length.
struct AllBytes;

impl<'de> Visitor<'de> for AllBytes {
    type Value = Encoded;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("the bytes of a message")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut body: A) -> Result<Encoded, A::Error> {
        let mut encoded = HEADER.to_vec();
        // Word by word, an eighth of the calls. A word's only fault is that less is left, which is not taken then.
        while let Ok(Some(word)) = body.next_element::<u64>() {
            encoded.extend(word.to_le_bytes());
        }
        while let Ok(Some(byte)) = body.next_element::<u8>() {
            encoded.push(byte);
        }
        Ok(Encoded(encoded))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use rustdds::RepresentationIdentifier;
    use rustdds::serialization::deserialize_from_cdr_with_rep_id;

    use super::*;

    proptest! {
        #[test]
        fn a_message_is_its_bytes(body in proptest::collection::vec(any::<u8>(), 0..100)) {
            let encoded = [&HEADER, &body[..]].concat();
            let little = RepresentationIdentifier::CDR_LE;
            let (taken, _) = deserialize_from_cdr_with_rep_id::<Encoded>(&body, little).unwrap();
            prop_assert_eq!(&taken.0, &encoded);
            prop_assert_eq!(&msgs::cdr::decode::<Encoded>(&encoded).unwrap().0, &encoded);
            prop_assert_eq!(msgs::cdr::encode(&taken).unwrap(), encoded);
        }
    }
}
