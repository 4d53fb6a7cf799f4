//! The rules of the filter, read plainly.

use super::super::program::{kind, limits};

/// The verdict on a datagram.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Verdict {
    /// This many of its bytes are accepted.
    Taken(usize),
    Refused,
}

struct Reader<'a> {
    bytes: &'a [u8],
    little: bool,
}

impl Reader<'_> {
    fn byte(&self, at: usize) -> Option<u8> {
        self.bytes.get(at).copied()
    }

    fn half(&self, at: usize) -> Option<u16> {
        let bytes = self.bytes.get(at..at + 2)?.try_into().ok()?;
        Some(if self.little { u16::from_le_bytes(bytes) } else { u16::from_be_bytes(bytes) })
    }

    fn word(&self, at: usize) -> Option<u32> {
        let bytes = self.bytes.get(at..at + 4)?.try_into().ok()?;
        Some(if self.little { u32::from_le_bytes(bytes) } else { u32::from_be_bytes(bytes) })
    }
}

pub(super) fn judge(submessages: usize, datagram: &[u8]) -> Verdict {
    taken(submessages, datagram).map_or(Verdict::Refused, Verdict::Taken)
}

/// How many bytes are taken; `None` of a datagram that ends within a field, or breaks a rule.
fn taken(submessages: usize, datagram: &[u8]) -> Option<usize> {
    if !datagram.starts_with(b"RTPS") {
        return None;
    }
    let mut at = 20;
    for _ in 0..submessages {
        if at == datagram.len() {
            return Some(at);
        }
        let flags = *datagram.get(at..at + 4)?.get(1)?;
        let reader = Reader { bytes: datagram, little: flags & 1 == 1 };
        let found = u32::from(reader.byte(at)?);
        if !is_harmless(&reader, found, at)? {
            return None;
        }
        let length = usize::from(reader.half(at + 2)?);
        if length == 0 && found != kind::PAD && found != kind::INFO_TS {
            return Some(datagram.len());
        }
        at += 4 + length;
    }
    (at <= datagram.len()).then_some(at)
}

fn is_harmless(reader: &Reader<'_>, found: u32, at: usize) -> Option<bool> {
    Some(match found {
        kind::HEARTBEAT | kind::GAP => {
            let upper = [reader.word(at + 12)?, reader.word(at + 20)?];
            let lower = || Some([reader.word(at + 16)? >> 16, reader.word(at + 24)? >> 16]);
            upper[0] == upper[1] && upper[0] < 1 << 24 && {
                let [first, last] = lower()?;
                last < first || last - first <= limits::RANGE_UPPER_HALF
            }
        }
        kind::DATA_FRAG => {
            let bytes = reader.word(at + 32)?;
            if bytes < 1 << 16 {
                return Some(true);
            }
            if bytes >> 16 >= limits::MESSAGE_UPPER_HALF {
                return Some(false);
            }
            u32::from(reader.byte(at + 11)?) < limits::BUILTIN_KIND
                && u32::from(reader.byte(at + 15)?) < limits::BUILTIN_KIND
        }
        kind::NACK_FRAG => (1..1 << 16).contains(&reader.word(at + 20)?),
        _ => true,
    })
}
