//! What each message, request and response on Zenoh carries beside its bytes.

/// Of a number and a time, eight bytes each, and of the sender's identity with its length in front.
const BYTES: usize = 8 + 8 + 1 + IDENTITY;
const IDENTITY: usize = 16;
/// What rmw_zenoh before 0.2.4 (April 2025) begins with: the name of the first part, and its length in front.
const NAMED: &[u8] = b"\x0fsequence_number";

/// Why a message or a request is refused that comes without.
#[cfg(feature = "zenoh")]
pub(crate) const REFUSED: &str = "its attachment is not that of rmw_zenoh 0.2.4 or later";

/// The number of a message, when it was sent, and by which endpoint.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Attachment {
    /// Counts a publisher's messages, or a client's requests, from 1.
    pub(crate) number: i64,
    /// By the sender's wall clock, since 1970.
    pub(crate) sent_ns: i64,
    /// A response has its client's.
    pub(crate) sender: [u8; IDENTITY],
}

impl Attachment {
    pub(crate) fn to_bytes(self) -> [u8; BYTES] {
        let mut bytes = [0; BYTES];
        let (number, rest) = bytes.split_at_mut(8);
        let (time, rest) = rest.split_at_mut(8);
        let (length, sender) = rest.split_at_mut(1);
        number.copy_from_slice(&self.number.to_le_bytes());
        time.copy_from_slice(&self.sent_ns.to_le_bytes());
        length.copy_from_slice(&[IDENTITY as u8]);
        sender.copy_from_slice(&self.sender);
        bytes
    }

    /// `None` for what is no such attachment. More may follow it.
    pub(crate) fn of_bytes(bytes: &[u8]) -> Option<Self> {
        if bytes.starts_with(NAMED) {
            return None;
        }
        let (number, rest) = bytes.split_first_chunk()?;
        let (time, rest) = rest.split_first_chunk()?;
        let (length, rest) = rest.split_first()?;
        let sender = (usize::from(*length) == IDENTITY).then(|| rest.first_chunk())??;
        Some(Self {
            number: i64::from_le_bytes(*number),
            sent_ns: i64::from_le_bytes(*time),
            sender: *sender,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_attachment_is_33_bytes_in_both_directions() {
        let sender = std::array::from_fn(|at| at as u8);
        let one = Attachment { number: -2, sent_ns: 1 << 40, sender };
        let bytes = one.to_bytes();
        assert_eq!((bytes[0], bytes[7], bytes[13], bytes[16], bytes[32]), (0xfe, 0xff, 1, 16, 15));
        assert_eq!(Attachment::of_bytes(&bytes), Some(one));
        assert_eq!(Attachment::of_bytes(&bytes[..32]), None);
        let mut other = bytes;
        other[16] = 24;
        assert_eq!(Attachment::of_bytes(&other), None);
    }

    /// The text was taken for the number and the time of each message whose number ends with a byte of 16: all before it counted as lost.
    #[test]
    fn an_attachment_of_named_parts_is_none() {
        let mut bytes = [NAMED, &16_i64.to_le_bytes(), b"\x10source_timestamp"].concat();
        bytes.extend([&[0; 8], b"\x0asource_gid\x10".as_slice(), &[7; IDENTITY]].concat());
        assert_eq!((bytes.len(), bytes[16]), (77, 16));
        assert_eq!(Attachment::of_bytes(&bytes), None);
    }
}
