//! The errors of an encoded message.

use std::fmt::Display;

/// A message could not be encoded or decoded.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[error("{type_name} in CDR: {fault}")]
pub struct CdrError {
    /// The type that was requested.
    pub type_name: &'static str,
    /// The fault.
    pub fault: CdrFault,
}

/// The fault of an encoded message. Places count from the start of the message, its
/// encapsulation header included.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
pub enum CdrFault {
    /// There is not even an encapsulation header.
    #[error("{bytes} bytes are no message, the encapsulation header alone takes 4")]
    NoHeader {
        /// Bytes there are.
        bytes: usize,
    },
    /// Another encapsulation than plain CDR, for instance a parameter list or XCDR2.
    #[error(
        "encapsulation {identifier:#06x} is not read; the writer must send plain CDR (0x0000 or 0x0001)"
    )]
    UnknownEncapsulation {
        /// The representation identifier.
        identifier: u16,
    },
    /// The message ends within a field.
    #[error(
        "it ends at byte {at}, where a field needs {needed} bytes and {left} are left; it was cut, \
         or is of another type"
    )]
    Ended {
        /// The position of the field, alignment included.
        at: usize,
        /// Bytes that the field needs, alignment included.
        needed: usize,
        /// Bytes there are.
        left: usize,
    },
    /// A string or sequence claims more elements than the rest of the message could hold.
    #[error(
        "the {what} at byte {at} claims {claimed} elements where {left} bytes are left; it was cut, \
         or is of another type"
    )]
    ClaimsTooMuch {
        /// `string`, `bytes` or `sequence`.
        what: &'static str,
        /// Where its elements would start.
        at: usize,
        /// How many elements it claims.
        claimed: u32,
        /// Bytes there are.
        left: usize,
    },
    /// A string without the zero byte that must end it.
    #[error("the string of {length} bytes at byte {at} does not end in a zero byte")]
    Unterminated {
        /// Where it starts.
        at: usize,
        /// Its length as claimed, the terminator included.
        length: u32,
    },
    /// A string that is not UTF-8.
    #[error("the string at byte {at} is not UTF-8: {reason}")]
    NotUtf8 {
        /// Where it starts.
        at: usize,
        /// Where within the string it stops being UTF-8.
        reason: std::str::Utf8Error,
    },
    /// A truth value that is neither 0 nor 1.
    #[error("the truth value at byte {at} is {value}, not 0 or 1")]
    NotABool {
        /// Its position.
        at: usize,
        /// The value there.
        value: u8,
    },
    /// The message is longer than its type and padding explain.
    #[error("{left} bytes are left after the last field, from byte {at}; it is of another type")]
    BytesLeft {
        /// Where the last field ends.
        at: usize,
        /// Bytes after it.
        left: usize,
    },
    /// The message is too long to be encoded.
    #[error(
        "its {bytes} bytes are more than the 4294967295 that CDR can count; send less at a time"
    )]
    TooLong {
        /// How long it would be.
        bytes: usize,
    },
    /// The struct holds something that no ROS 2 message has.
    #[error("a {0} has no place in a ROS 2 message")]
    Unsupported(&'static str),
    /// The message of serde.
    #[error("{0}")]
    Other(String),
}

impl serde::de::Error for CdrFault {
    fn custom<T: Display>(message: T) -> Self {
        Self::Other(message.to_string())
    }
}
