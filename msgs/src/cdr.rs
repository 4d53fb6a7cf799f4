//! CDR, the encoding of ROS 2 on the wire and in bags: four bytes that name the encapsulation, then
//! the fields one after the other, each aligned to its own size from the end of those four bytes.
//!
//! Writing is `cdr_encoding`'s. Reading is our own, since that crate drops the last byte of a string
//! whose terminator is missing and cannot say where in a message something is wrong.
#![cfg_attr(not(test), deny(clippy::indexing_slicing))]

mod decoder;
mod error;
#[cfg(test)]
mod tests;

use std::io;

use byteorder::LittleEndian;

pub use error::{CdrError, CdrFault};

use crate::RosMessage;
use decoder::Decoder;

/// Bytes of the encapsulation header.
pub const HEADER_BYTES: usize = 4;

/// Representation identifier of CDR, big endian (OMG DDSI-RTPS 2.3, table 10.3).
const CDR_BIG_ENDIAN: u16 = 0x0000;
/// Representation identifier of CDR, little endian.
const CDR_LITTLE_ENDIAN: u16 = 0x0001;

/// Bytes that may follow the last field: a writer may pad a message to the largest alignment of CDR.
/// More than that is another message than the one that was requested.
const MAX_PADDING_BYTES: usize = 7;

/// The order of the bytes of a number.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum ByteOrder {
    /// The lowest byte first; what this crate writes.
    Little,
    /// The highest byte first.
    Big,
}

/// The message in CDR, little endian, with its encapsulation header.
///
/// # Errors
/// When the message is longer than the 32 bits of its counts can say.
pub fn encode<M: RosMessage>(message: &M) -> Result<Vec<u8>, CdrError> {
    let failed = |fault| CdrError { type_name: M::TYPE_NAME, fault };
    let mut bytes = Vec::with_capacity(HEADER_BYTES + size_of::<M>());
    bytes.extend_from_slice(&CDR_LITTLE_ENDIAN.to_be_bytes());
    bytes.extend_from_slice(&[0, 0]);
    cdr_encoding::to_writer::<M, LittleEndian, _>(&mut bytes, message)
        .map_err(|error| failed(CdrFault::Other(error.to_string())))?;
    // A count that had lost its upper bits would be in a message of at least that many bytes.
    if bytes.len() > u32::MAX as usize {
        return Err(failed(CdrFault::TooLong { bytes: bytes.len() }));
    }
    Ok(bytes)
}

/// How many bytes [`encode`] makes of the message: counted, without the bytes.
///
/// # Errors
/// As [`encode`].
pub fn encoded_len<M: RosMessage>(message: &M) -> Result<usize, CdrError> {
    let failed = |fault| CdrError { type_name: M::TYPE_NAME, fault };
    let mut counted = Counted { bytes: HEADER_BYTES };
    cdr_encoding::to_writer::<M, LittleEndian, _>(&mut counted, message)
        .map_err(|error| failed(CdrFault::Other(error.to_string())))?;
    if counted.bytes > u32::MAX as usize {
        return Err(failed(CdrFault::TooLong { bytes: counted.bytes }));
    }
    Ok(counted.bytes)
}

/// Counts what is written to it.
struct Counted {
    bytes: usize,
}

impl io::Write for Counted {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.bytes = self.bytes.saturating_add(bytes.len());
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// The message that `bytes` hold: its encapsulation header, then CDR of either byte order. Up to 7
/// bytes of padding may follow the last field.
///
/// # Errors
/// When the bytes are not a message of this type, with the place where that showed.
pub fn decode<M: RosMessage>(bytes: &[u8]) -> Result<M, CdrError> {
    let failed = |fault| CdrError { type_name: M::TYPE_NAME, fault };
    let Some(([high, low, _, _], body)) = bytes.split_first_chunk::<HEADER_BYTES>() else {
        return Err(failed(CdrFault::NoHeader { bytes: bytes.len() }));
    };
    match u16::from_be_bytes([*high, *low]) {
        CDR_LITTLE_ENDIAN => decode_body(body, ByteOrder::Little),
        CDR_BIG_ENDIAN => decode_body(body, ByteOrder::Big),
        identifier => Err(failed(CdrFault::UnknownEncapsulation { identifier })),
    }
}

/// As [`decode`], for a message whose encapsulation header was read already.
///
/// # Errors
/// As [`decode`].
pub fn decode_body<M: RosMessage>(body: &[u8], order: ByteOrder) -> Result<M, CdrError> {
    match order {
        ByteOrder::Little => decode_ordered::<M, false>(body),
        ByteOrder::Big => decode_ordered::<M, true>(body),
    }
    .map_err(|fault| CdrError { type_name: M::TYPE_NAME, fault })
}

fn decode_ordered<M: RosMessage, const BIG_ENDIAN: bool>(body: &[u8]) -> Result<M, CdrFault> {
    let mut decoder = Decoder::<BIG_ENDIAN>::new(body);
    let message = M::deserialize(&mut decoder)?;
    match decoder.left() {
        0..=MAX_PADDING_BYTES => Ok(message),
        left => Err(CdrFault::BytesLeft { left, at: decoder.at() }),
    }
}
