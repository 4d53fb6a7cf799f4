//! Segments, the units in which a file is read: a chunk, or a run of messages outside of chunks.

use std::collections::BTreeMap;
use std::io;

use mcap::McapError;
use mcap::records::{MessageHeader, Record, op};
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};

use crate::catalogue::Catalogue;
use crate::error::LossKind;
use crate::record;
use crate::source::{FRAME_HEADER_BYTES, Frame, MAX_RECORD_BYTES, Source};

/// Largest content of a chunk that is decompressed: writers use 1 .. 8 MiB, and a chunk has at least one message.
const MAX_CHUNK_BYTES: u64 = 256 << 20;

/// No chunk decompresses to more than this many times its size: a zstd block of 128 KiB takes at
/// least 4 bytes (RFC 8878, 3.1.1.2), an lz4 block has at most 255 to 1. One that claims more is damaged.
const MAX_COMPRESSION_RATIO: u64 = 32 * 1024;

/// Smallest body of a chunk: its header with an empty compression name.
const MIN_CHUNK_HEADER_BYTES: u64 = 40;

/// Longest accepted name of a compression; the real ones have 3 or 4 letters.
const MAX_COMPRESSION_NAME_BYTES: u64 = 64;

/// A message's header within its record: channel, sequence, log time, publish time.
pub(crate) const MESSAGE_HEADER_BYTES: u64 = 22;

/// A part of a file that is read at once.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Segment {
    /// Offset of its first byte in the file.
    pub(crate) offset: u64,
    /// Offset after its last byte; the end of the file where it is cut off.
    pub(crate) end: u64,
    /// Earliest log time of its messages.
    pub(crate) first_ns: u64,
    /// Latest log time of its messages.
    pub(crate) last_ns: u64,
    /// The offsets of the message index of each channel, if there is one.
    pub(crate) index_offsets: Option<BTreeMap<u16, u64>>,
    pub(crate) form: Form,
}

/// The kind of a segment.
#[derive(Clone, PartialEq, Debug)]
pub(crate) enum Form {
    /// A chunk record, with the name of its compression.
    Chunk { compression: String },
    /// Records outside of chunks.
    Run,
}

/// The header of a chunk's record, without its CRC, which the reader checks.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct ChunkHead {
    pub(crate) first_ns: u64,
    pub(crate) last_ns: u64,
    pub(crate) compression: String,
    uncompressed_bytes: u64,
    compressed_bytes: u64,
    /// Length of this header: the records follow it.
    head_bytes: u64,
}

impl ChunkHead {
    /// Reads the header before a chunk's records; `None` if the record or the file ends before.
    pub(crate) fn read(source: &mut Source, frame: &Frame) -> io::Result<Option<Self>> {
        let wanted = MIN_CHUNK_HEADER_BYTES + MAX_COMPRESSION_NAME_BYTES;
        let body = source.body_start(frame, wanted)?;
        Ok(Self::parse(&body))
    }

    fn parse(body: &[u8]) -> Option<Self> {
        let (first_ns, rest) = take_u64(body)?;
        let (last_ns, rest) = take_u64(rest)?;
        let (uncompressed_bytes, rest) = take_u64(rest)?;
        let (_crc, rest) = rest.split_first_chunk::<4>()?;
        let (name_bytes, rest) = rest.split_first_chunk::<4>()?;
        let name_bytes = u32::from_le_bytes(*name_bytes);
        let (name, rest) = rest.split_at_checked(usize::try_from(name_bytes).ok()?)?;
        let (compressed_bytes, _) = take_u64(rest)?;
        Some(Self {
            first_ns,
            last_ns,
            compression: String::from_utf8(name.to_vec()).ok()?,
            uncompressed_bytes,
            compressed_bytes,
            head_bytes: MIN_CHUNK_HEADER_BYTES + u64::from(name_bytes),
        })
    }
}

fn take_u64(bytes: &[u8]) -> Option<(u64, &[u8])> {
    let (head, rest) = bytes.split_first_chunk::<8>()?;
    Some((u64::from_le_bytes(*head), rest))
}

/// Why a segment could not be read whole.
#[derive(PartialEq, Debug)]
pub(crate) struct Fault {
    pub(crate) kind: LossKind,
    /// Whether the records before the fault are valid: the file was cut, not altered.
    pub(crate) cut: bool,
}

impl Fault {
    fn altered(reason: impl Into<String>) -> Self {
        Self { kind: LossKind::BadChunk { reason: reason.into() }, cut: false }
    }

    fn io(error: &io::Error) -> Self {
        Self::altered(format!("the file cannot be read here: {error}"))
    }

    fn cut() -> Self {
        Self { kind: LossKind::CutOff { recovered_messages: 0 }, cut: true }
    }
}

impl From<McapError> for Fault {
    fn from(error: McapError) -> Self {
        match error {
            McapError::BadChunkCrc { saved, calculated } => Self {
                kind: LossKind::ChunkChecksum { stored: saved, computed: calculated },
                cut: false,
            },
            other => Self::altered(other.to_string()),
        }
    }
}

/// Calls `take` with every record of a segment, in the order of the file.
pub(crate) fn for_each_record(
    source: &mut Source,
    segment: &Segment,
    take: &mut dyn FnMut(u8, &[u8]),
) -> Result<(), Fault> {
    match segment.form {
        Form::Chunk { .. } => records_of_chunk(source, segment, take),
        Form::Run => records_of_run(source, segment, take),
    }
}

fn records_of_run(
    source: &mut Source,
    segment: &Segment,
    take: &mut dyn FnMut(u8, &[u8]),
) -> Result<(), Fault> {
    let mut offset = segment.offset;
    while offset < segment.end {
        let frame = source.frame_at(offset).map_err(|error| Fault::io(&error))?;
        let Some(frame) = frame.filter(|frame| frame.end() <= segment.end) else {
            return Err(Fault::cut());
        };
        if matches!(frame.opcode, op::SCHEMA | op::CHANNEL | op::MESSAGE) {
            if frame.body_bytes > MAX_RECORD_BYTES {
                return Err(Fault::altered(format!("a record of {} bytes", frame.body_bytes)));
            }
            let body =
                source.body_start(&frame, frame.body_bytes).map_err(|error| Fault::io(&error))?;
            take(frame.opcode, &body);
        }
        offset = frame.end();
    }
    Ok(())
}

/// Decompresses a chunk record by record. The reader of the mcap crate gets the header and the
/// records but never the bytes after them, so that a record with a wrong length reaches
/// the end of the input instead of the neighbouring bytes.
fn records_of_chunk(
    source: &mut Source,
    segment: &Segment,
    take: &mut dyn FnMut(u8, &[u8]),
) -> Result<(), Fault> {
    let frame = source.frame_at(segment.offset).map_err(|error| Fault::io(&error))?;
    let Some(frame) = frame else { return Err(Fault::cut()) };
    if frame.opcode != op::CHUNK {
        return Err(Fault::altered(format!("a record 0x{:02x} where a chunk is", frame.opcode)));
    }
    let cut_off = frame.end() > source.size;
    let head = ChunkHead::read(source, &frame).map_err(|error| Fault::io(&error))?;
    let Some(head) = head else {
        return Err(if cut_off { Fault::cut() } else { Fault::altered("its head is too short") });
    };
    let content_bytes = head.head_bytes.saturating_add(head.compressed_bytes);
    if content_bytes > frame.body_bytes {
        return Err(Fault::altered(format!(
            "{} bytes of content in a record of {}",
            head.compressed_bytes, frame.body_bytes
        )));
    }
    let justified = head.compressed_bytes.saturating_mul(MAX_COMPRESSION_RATIO);
    if head.uncompressed_bytes > justified.min(MAX_CHUNK_BYTES) {
        return Err(Fault::altered(format!(
            "{} bytes claim to decompress to {}",
            head.compressed_bytes, head.uncompressed_bytes
        )));
    }
    let records_bytes =
        if head.compression.is_empty() { head.compressed_bytes } else { head.uncompressed_bytes };
    let limit = content_bytes.max(records_bytes).min(MAX_CHUNK_BYTES);
    let mut reader = LinearReader::new_with_options(
        LinearReaderOptions::default()
            .with_skip_start_magic(true)
            .with_skip_end_magic(true)
            .with_validate_chunk_crcs(true)
            .with_record_length_limit(usize::try_from(limit).unwrap_or(usize::MAX)),
    );

    let frame_header = [&[op::CHUNK][..], &content_bytes.to_le_bytes()].concat();
    reader.insert(frame_header.len()).copy_from_slice(&frame_header);
    reader.notify_read(frame_header.len());
    source.seek(frame.body_offset()).map_err(|error| Fault::io(&error))?;
    let mut unread_bytes = content_bytes.min(source.size - frame.body_offset());
    let mut taken_bytes = 0;
    loop {
        match reader.next_event() {
            Some(Ok(LinearReadEvent::Record { opcode, data })) => {
                taken_bytes += FRAME_HEADER_BYTES + data.len() as u64;
                take(opcode, data);
            }
            Some(Ok(LinearReadEvent::ReadRequest(_))) if unread_bytes == 0 => {
                return if cut_off {
                    Err(Fault::cut())
                } else if taken_bytes == records_bytes {
                    Ok(())
                } else {
                    Err(Fault::altered("it ends in the middle of a record"))
                };
            }
            Some(Ok(LinearReadEvent::ReadRequest(wanted_bytes))) => {
                let bytes = wanted_bytes.min(usize::try_from(unread_bytes).unwrap_or(usize::MAX));
                source.read_exact(reader.insert(bytes)).map_err(|error| Fault::io(&error))?;
                reader.notify_read(bytes);
                unread_bytes -= bytes as u64;
            }
            Some(Err(error)) => return Err(error.into()),
            None => return Ok(()),
        }
    }
}

/// Adds the schemas and channels of a segment, without its messages.
pub(crate) fn channels_of(source: &mut Source, segment: &Segment, catalogue: &mut Catalogue) {
    // Errors of the segment are reported when its messages are read.
    let _ = for_each_record(source, segment, &mut |opcode, body| {
        let _ = catalogue.take(opcode, body);
    });
}

/// A message record's header and data; `None` if it is too short.
pub(crate) fn message_of(body: &[u8]) -> Option<(MessageHeader, &[u8])> {
    let (channel_id, rest) = body.split_first_chunk::<2>()?;
    let (sequence, rest) = rest.split_first_chunk::<4>()?;
    let (log_time, rest) = take_u64(rest)?;
    let (publish_time, data) = take_u64(rest)?;
    let header = MessageHeader {
        channel_id: u16::from_le_bytes(*channel_id),
        sequence: u32::from_le_bytes(*sequence),
        log_time,
        publish_time,
    };
    Some((header, data))
}

/// The number of messages in the message index after a chunk: the count of a lost chunk.
/// `None` if there is no such index.
pub(crate) fn messages_indexed_behind(
    source: &mut Source,
    segment: &Segment,
    wanted: &dyn Fn(u16, u64) -> bool,
) -> Option<u64> {
    let mut offset = segment.end;
    let mut count = None;
    loop {
        let frame = source.frame_at(offset).ok()??;
        if frame.opcode != op::MESSAGE_INDEX || frame.end() > source.size {
            return count;
        }
        let body = source.body_start(&frame, frame.body_bytes.min(MAX_RECORD_BYTES)).ok()?;
        let Ok(Record::MessageIndex(index)) = record::parse(frame.opcode, &body) else {
            return count;
        };
        let listed =
            index.records.iter().filter(|entry| wanted(index.channel_id, entry.log_time)).count();
        count = Some(count.unwrap_or(0) + listed as u64);
        offset = frame.end();
    }
}
