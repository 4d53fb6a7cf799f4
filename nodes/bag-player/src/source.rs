//! One MCAP file on disk and the frames of its records.

use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::path::Path;

/// A record's opcode (1 byte) and length (8 bytes).
pub(crate) const FRAME_HEADER_BYTES: u64 = 9;

/// Longest record outside of chunks that is read into memory: no real schema, channel or message
/// is nearly as long, so that a longer one is damaged.
pub(crate) const MAX_RECORD_BYTES: u64 = 1 << 30;

/// The position of a record in the file.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Frame {
    pub(crate) opcode: u8,
    /// Offset of the opcode.
    pub(crate) offset: u64,
    /// Length of the body by the record.
    pub(crate) body_bytes: u64,
}

impl Frame {
    pub(crate) fn body_offset(&self) -> u64 {
        self.offset + FRAME_HEADER_BYTES
    }

    /// Offset after the record; saturates where the length is invalid.
    pub(crate) fn end(&self) -> u64 {
        self.body_offset().saturating_add(self.body_bytes)
    }
}

/// An open file, its size, and the read position.
pub(crate) struct Source {
    reader: BufReader<File>,
    position: u64,
    pub(crate) size: u64,
}

impl Source {
    pub(crate) fn open(path: &Path) -> io::Result<Self> {
        let file = File::open(path)?;
        let size = file.metadata()?.len();
        Ok(Self { reader: BufReader::new(file), position: 0, size })
    }

    pub(crate) fn seek(&mut self, offset: u64) -> io::Result<()> {
        // A relative seek keeps the buffer where the target is within it.
        match (i64::try_from(offset), i64::try_from(self.position)) {
            (Ok(target), Ok(position)) => self.reader.seek_relative(target - position)?,
            _ => {
                self.reader.seek(SeekFrom::Start(offset))?;
            }
        }
        self.position = offset;
        Ok(())
    }

    pub(crate) fn read_exact(&mut self, buffer: &mut [u8]) -> io::Result<()> {
        let result = self.reader.read_exact(buffer);
        match result {
            Ok(()) => self.position += buffer.len() as u64,
            // After a failed read the position is not known.
            Err(_) => self.position = self.reader.stream_position()?,
        }
        result
    }

    /// The frame at `offset`; `None` if fewer bytes are left than a frame needs.
    pub(crate) fn frame_at(&mut self, offset: u64) -> io::Result<Option<Frame>> {
        if self.size.saturating_sub(offset) < FRAME_HEADER_BYTES {
            return Ok(None);
        }
        self.seek(offset)?;
        let mut header = [0; FRAME_HEADER_BYTES as usize];
        self.read_exact(&mut header)?;
        let [opcode, length @ ..] = header;
        Ok(Some(Frame { opcode, offset, body_bytes: u64::from_le_bytes(length) }))
    }

    /// The first `wanted` bytes of a record's body, or fewer where the record or the file is shorter.
    pub(crate) fn body_start(&mut self, frame: &Frame, wanted: u64) -> io::Result<Vec<u8>> {
        let available = frame.end().min(self.size).saturating_sub(frame.body_offset());
        let length = usize::try_from(wanted.min(available)).unwrap_or(usize::MAX);
        let mut body = vec![0; length];
        self.seek(frame.body_offset())?;
        self.read_exact(&mut body)?;
        Ok(body)
    }
}
