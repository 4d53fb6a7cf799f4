//! The bytes of a message to send, whatever its type.
//!
//! The client library takes values that implement `Serialize` and encodes them itself, without padding
//! the end. A message that is sent in fragments must be padded to a multiple of four bytes, or Cyclone
//! DDS 0.10.2 refuses its last fragment. So a message is encoded here once, padded, and handed on as
//! a value whose encoding is those very bytes: a tuple has no length in CDR, and words of 16 bytes that
//! start at the body's start need no alignment.

use serde::ser::{Serialize, SerializeTuple, Serializer};

/// Length of the encapsulation header in front of the body.
const HEADER: usize = 4;
/// The length of a body must be a multiple of this.
const ALIGNMENT: usize = 4;
/// Bytes of one word of the tuple.
const WORD: usize = 16;
/// Bytes of a count of bytes, and what its place must be a multiple of.
const COUNT: usize = 4;
/// A shorter body is encoded word by word in no time.
const LONG_BODY: usize = 64 * 1024;
/// Where in a long body the count of nearly all its bytes is looked for: behind the header, the fields and
/// the like.
const FRONT: usize = 1024;
/// How much may follow those bytes.
const BACK: usize = 256;
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

/// A message in little-endian CDR, its body padded.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Payload {
    /// Header and body.
    encoded: Vec<u8>,
}

impl Payload {
    /// Takes an encoded message, its header in front.
    pub(crate) fn from_encoded(mut encoded: Vec<u8>) -> Result<Self, PayloadError> {
        Self::check(&encoded)?;
        let padded = encoded.len().next_multiple_of(ALIGNMENT);
        encoded.resize(padded, 0);
        Ok(Self { encoded })
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
        self.encoded.len()
    }

    /// Header and body.
    #[cfg(feature = "zenoh")]
    pub(crate) fn into_encoded(self) -> Vec<u8> {
        self.encoded
    }

    fn body(&self) -> &[u8] {
        self.encoded.get(HEADER..).unwrap_or_default()
    }
}

impl Serialize for Payload {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let (before, counted, after) = around_counted_bytes(self.body());
        // What follows the counted bytes starts anywhere, and single bytes need no alignment.
        let (words, tail) = before.as_chunks::<WORD>();
        let elements = words.len() + tail.len() + usize::from(counted.is_some()) + after.len();
        let mut tuple = serializer.serialize_tuple(elements)?;
        for word in words {
            tuple.serialize_element(&u128::from_le_bytes(*word))?;
        }
        for byte in tail {
            tuple.serialize_element(byte)?;
        }
        if let Some(counted) = counted {
            tuple.serialize_element(&Counted(counted))?;
        }
        for byte in after {
            tuple.serialize_element(byte)?;
        }
        tuple.end()
    }
}

/// Bytes with their count in front, which the client library copies at once.
struct Counted<'bytes>(&'bytes [u8]);

impl Serialize for Counted<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_bytes(self.0)
    }
}

/// Parts a body at a run of bytes with their count in front that makes up nearly all of it, as the pixels of
/// an image do: word by word, such a body takes longer to encode than to send. Whether the four bytes were
/// meant for a count does not matter: the parts' encodings are the body again.
fn around_counted_bytes(body: &[u8]) -> (&[u8], Option<&[u8]>, &[u8]) {
    if body.len() < LONG_BODY {
        return (body, None, &[]);
    }
    let (places, _) = body.get(..FRONT).unwrap_or(body).as_chunks::<COUNT>();
    for (place, count) in places.iter().enumerate() {
        let start = (place + 1) * COUNT;
        let count = u32::from_le_bytes(*count) as usize;
        let Some((front, behind)) = body.split_at_checked(start) else { break };
        if (behind.len().saturating_sub(BACK)..=behind.len()).contains(&count)
            && let Some((counted, after)) = behind.split_at_checked(count)
        {
            let before = front.get(..front.len() - COUNT).unwrap_or_default();
            return (before, Some(counted), after);
        }
    }
    (body, None, &[])
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use rustdds::CDRSerializerAdapter;
    use rustdds::no_key::SerializerAdapter;

    use super::*;

    /// The bytes that the client library sends.
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

        #[test]
        fn a_long_body_is_parted_without_a_change(
            front in 0..FRONT + 16, back in 0..BACK + 16, seed in any::<u8>(), found in any::<bool>(),
        ) {
            let front = front.next_multiple_of(COUNT);
            let bytes: Vec<u8> = (0..LONG_BODY + 5).map(|at| (at % 239) as u8 ^ seed).collect();
            let mut encoded = vec![0, 1, 0, 0];
            encoded.extend(std::iter::repeat_n(seed | 1, front));
            let count = bytes.len() - if found { back.min(bytes.len()) } else { bytes.len() };
            encoded.extend((count as u32).to_le_bytes());
            encoded.extend(&bytes);
            let payload = Payload::from_encoded(encoded.clone()).unwrap();
            let near = found && front <= FRONT - COUNT && back <= BACK - ALIGNMENT;
            prop_assert!(!near || around_counted_bytes(payload.body()).1.is_some());
            let sent = encode(&payload);
            prop_assert_eq!(&sent[..encoded.len() - HEADER], &encoded[HEADER..]);
            prop_assert!(sent.len() < encoded.len() - HEADER + ALIGNMENT);
        }
    }

    #[test]
    fn the_pixels_of_an_image_are_copied_at_once() {
        let image = msgs::sensor_msgs::Image {
            encoding: "16UC1".to_owned(),
            data: vec![7; 640 * 480 * 2 + 1],
            ..Default::default()
        };
        let payload = Payload::from_encoded(msgs::cdr::encode(&image).unwrap()).unwrap();
        assert_eq!(around_counted_bytes(payload.body()).1, Some(&image.data[..]));
    }
}
