//! The bytes of a message on their way out, whatever its type.
//!
//! The client library takes values that implement `Serialize` and encodes them itself, without padding
//! the end. A message that is sent in fragments must be padded to a multiple of four bytes, or Cyclone
//! DDS 0.10.2 refuses its last fragment. So a message is encoded here once, padded, and handed on as
//! a value whose encoding is those very bytes: a tuple has no length in CDR, and words of 16 bytes that
//! start at the body's start need no alignment.

use serde::ser::{Serialize, SerializeTuple, Serializer};

/// Length of the encapsulation header in front of the body.
const HEADER: usize = 4;
/// What the length of a body must be a multiple of.
const ALIGNMENT: usize = 4;
/// Bytes of one word of the tuple.
const WORD: usize = 16;
/// Little-endian plain CDR, the encoding that the client library announces.
const CDR_LE: [u8; 2] = [0, 1];
const CDR_BE: [u8; 2] = [0, 0];

/// The bytes are no message that can be published.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
pub enum PayloadError {
    /// There is not even a header.
    #[error("{bytes} bytes are too few for a message: its header alone has four")]
    TooShort {
        /// How many there are.
        bytes: usize,
    },
    /// The message was recorded on a big-endian machine.
    #[error(
        "the message is big-endian, and only little-endian ones can be published as they are; decode \
         it and publish it typed"
    )]
    BigEndian,
    /// The message has an encoding of another kind, as parameter lists or XCDR2.
    #[error("the message has the encoding {0:#06x}; plain CDR, 0x0001, is accepted")]
    Encoding(u16),
}

/// A message body in little-endian CDR, padded.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Payload {
    body: Vec<u8>,
}

impl Payload {
    /// Takes an encoded message, its header in front.
    pub(crate) fn from_encoded(mut encoded: Vec<u8>) -> Result<Self, PayloadError> {
        Self::check(&encoded)?;
        encoded.drain(..HEADER);
        let padded = encoded.len().next_multiple_of(ALIGNMENT);
        encoded.resize(padded, 0);
        Ok(Self { body: encoded })
    }

    /// Whether an encoded message can be taken.
    pub(crate) fn check(encoded: &[u8]) -> Result<(), PayloadError> {
        let Some([high, low, _, _]) = encoded.first_chunk::<HEADER>().copied() else {
            return Err(PayloadError::TooShort { bytes: encoded.len() });
        };
        match [high, low] {
            CDR_LE => Ok(()),
            CDR_BE => Err(PayloadError::BigEndian),
            other => Err(PayloadError::Encoding(u16::from_be_bytes(other))),
        }
    }

    /// The length on the wire.
    pub(crate) fn len(&self) -> usize {
        HEADER + self.body.len()
    }
}

impl Serialize for Payload {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let (words, tail) = self.body.as_chunks::<WORD>();
        let mut tuple = serializer.serialize_tuple(words.len() + tail.len())?;
        for word in words {
            tuple.serialize_element(&u128::from_le_bytes(*word))?;
        }
        for byte in tail {
            tuple.serialize_element(byte)?;
        }
        tuple.end()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use rustdds::CDRSerializerAdapter;
    use rustdds::no_key::SerializerAdapter;

    use super::*;

    /// What the client library sends.
    fn encode(payload: &Payload) -> Vec<u8> {
        CDRSerializerAdapter::<Payload>::to_bytes(payload).unwrap().to_vec()
    }

    #[test]
    fn what_is_no_little_endian_cdr_is_refused() {
        let refused = |bytes: &[u8]| Payload::from_encoded(bytes.to_vec()).unwrap_err();
        assert_eq!(refused(&[0, 1, 0]), PayloadError::TooShort { bytes: 3 });
        assert_eq!(refused(&[0, 0, 0, 0, 1]), PayloadError::BigEndian);
        assert_eq!(refused(&[0, 3, 0, 0, 1]), PayloadError::Encoding(3));
        assert!(Payload::from_encoded(vec![0, 1, 0, 0]).is_ok());
    }

    proptest! {
        #[test]
        fn the_encoding_is_the_bytes_and_padding(body in proptest::collection::vec(any::<u8>(), 0..200)) {
            let mut encoded = vec![0, 1, 0, 0];
            encoded.extend_from_slice(&body);
            let payload = Payload::from_encoded(encoded).unwrap();
            let sent = encode(&payload);
            prop_assert_eq!(sent.len() % 4, 0);
            prop_assert_eq!(sent.len() + 4, payload.len());
            prop_assert_eq!(&sent[..body.len()], &body[..]);
            prop_assert!(sent[body.len()..].iter().all(|byte| *byte == 0));
            prop_assert!(sent.len() < body.len() + 4);
        }
    }
}
