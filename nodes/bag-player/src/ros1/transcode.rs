//! Re-encoding of a message of ROS 1 as CDR.
//!
//! Both write the fields one after the other, little endian. ROS 1 has no padding; CDR aligns a number to
//! its size, ends a string with a zero byte, and encodes an empty message as one byte.

use super::definition::{Kind, Member, Shape};

/// Plain CDR, little endian.
const ENCAPSULATION: [u8; 4] = [0, 1, 0, 0];

/// Messages without a byte that a message may hold: nothing else bounds how many an array of arrays of them claims.
const MOST_EMPTY: usize = 10_000;

/// A message that does not fit its type.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
pub enum TranscodeError {
    /// It ends before its last field.
    #[error("the message ends after {bytes} bytes, in the middle of a field")]
    TooShort {
        /// Its length in bytes.
        bytes: usize,
    },
    /// It holds messages that have no bytes without end.
    #[error("the message holds more than {MOST_EMPTY} messages without a byte")]
    TooManyEmpty,
    /// It has bytes after its last field.
    #[error("the message has {bytes} bytes after its last field")]
    TooLong {
        /// The bytes left.
        bytes: usize,
    },
}

/// The message of these members, with its encapsulation.
pub(super) fn transcode(members: &[Member], ros1: &[u8]) -> Result<Vec<u8>, TranscodeError> {
    let mut writer = Writer { ros1, read: 0, empty: 0, cdr: Vec::with_capacity(ros1.len() + 64) };
    writer.cdr.extend(ENCAPSULATION);
    writer.message(members, true)?;
    let left = ros1.len() - writer.read;
    if left > 0 {
        return Err(TranscodeError::TooLong { bytes: left });
    }
    Ok(writer.cdr)
}

struct Writer<'a> {
    ros1: &'a [u8],
    read: usize,
    /// Messages without a byte so far.
    empty: usize,
    cdr: Vec<u8>,
}

impl<'a> Writer<'a> {
    fn message(&mut self, members: &[Member], kept: bool) -> Result<(), TranscodeError> {
        if members.is_empty() && kept {
            self.cdr.push(0);
        }
        for member in members {
            let kept = kept && !member.dropped;
            match member.shape {
                Shape::One => self.elements(&member.kind, 1, kept)?,
                Shape::Array(count) => self.elements(&member.kind, count, kept)?,
                Shape::Sequence => {
                    let count = self.count()?;
                    if kept {
                        self.put(4, &(count as u32).to_le_bytes());
                    }
                    self.elements(&member.kind, count, kept)?;
                }
            }
        }
        Ok(())
    }

    fn elements(&mut self, kind: &Kind, count: usize, kept: bool) -> Result<(), TranscodeError> {
        match kind {
            Kind::Number(size) => {
                let bytes = self.take(count.saturating_mul(*size))?;
                if kept && count > 0 {
                    self.put(*size, bytes);
                }
            }
            Kind::Text => {
                for _ in 0..count {
                    let length = self.count()?;
                    let text = self.take(length)?;
                    if kept {
                        self.put(4, &(length as u32).saturating_add(1).to_le_bytes());
                        self.cdr.extend_from_slice(text);
                        self.cdr.push(0);
                    }
                }
            }
            Kind::Message(members) => {
                for _ in 0..count {
                    let before = self.read;
                    self.message(members, kept)?;
                    if self.read == before {
                        self.empty += 1;
                        if self.empty > MOST_EMPTY {
                            return Err(TranscodeError::TooManyEmpty);
                        }
                    }
                }
            }
        }
        Ok(())
    }

    fn count(&mut self) -> Result<usize, TranscodeError> {
        let bytes = self.take(4)?;
        let bytes = <[u8; 4]>::try_from(bytes).map_err(|_| self.too_short())?;
        Ok(u32::from_le_bytes(bytes) as usize)
    }

    fn take(&mut self, bytes: usize) -> Result<&'a [u8], TranscodeError> {
        let end = self.read.checked_add(bytes).ok_or_else(|| self.too_short())?;
        let taken = self.ros1.get(self.read..end).ok_or_else(|| self.too_short())?;
        self.read = end;
        Ok(taken)
    }

    fn too_short(&self) -> TranscodeError {
        TranscodeError::TooShort { bytes: self.ros1.len() }
    }

    /// Writes numbers of `size` bytes each.
    fn put(&mut self, size: usize, bytes: &[u8]) {
        let offset = self.cdr.len() - ENCAPSULATION.len();
        let aligned = offset.next_multiple_of(size) + ENCAPSULATION.len();
        self.cdr.resize(aligned, 0);
        self.cdr.extend_from_slice(bytes);
    }
}
