//! The summary at the end of an MCAP file.

use std::io;

use mcap::records::{ChunkIndex, Record, Statistics};
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};

use crate::catalogue::Catalogue;
use crate::record;
use crate::source::{FRAME_HEADER_BYTES, Source};

/// The footer's body: two offsets and a checksum.
const FOOTER_BODY_BYTES: u64 = 8 + 8 + 4;

/// The summary at the end of a file.
#[derive(Default, Debug)]
pub(crate) struct Summary {
    pub(crate) catalogue: Catalogue,
    pub(crate) statistics: Option<Statistics>,
    pub(crate) chunks: Vec<ChunkIndex>,
}

/// Why there is no usable summary.
pub(crate) enum Unreadable {
    /// The file does not end with a footer: it was not closed, or is cut off.
    Absent,
    /// There is one, and it is invalid.
    Damaged { offset: u64, reason: String },
}

/// Reads the summary; `None` if the file has none by its footer.
pub(crate) fn read(source: &mut Source) -> Result<Option<Summary>, Unreadable> {
    let magic_bytes = mcap::MAGIC.len() as u64;
    let tail_bytes = FRAME_HEADER_BYTES + FOOTER_BODY_BYTES + magic_bytes;
    let footer_offset = source.size.checked_sub(tail_bytes).filter(|&offset| offset >= magic_bytes);
    let Some(footer_offset) = footer_offset else { return Err(Unreadable::Absent) };
    let mut tail = vec![0; tail_bytes as usize];
    source.seek(footer_offset).map_err(|_| Unreadable::Absent)?;
    source.read_exact(&mut tail).map_err(|_| Unreadable::Absent)?;
    let Some((footer, magic)) = tail.split_at_checked((tail_bytes - magic_bytes) as usize) else {
        return Err(Unreadable::Absent);
    };
    let Some(([opcode, ..], body)) = footer.split_first_chunk::<{ FRAME_HEADER_BYTES as usize }>()
    else {
        return Err(Unreadable::Absent);
    };
    if magic != mcap::MAGIC || *opcode != mcap::records::op::FOOTER {
        return Err(Unreadable::Absent);
    }
    let damaged = |reason: String| Unreadable::Damaged { offset: footer_offset, reason };
    let footer = match record::parse(*opcode, body) {
        Ok(Record::Footer(footer)) => footer,
        Ok(_) => return Err(Unreadable::Absent),
        Err(error) => return Err(damaged(error.to_string())),
    };
    if footer.summary_start == 0 {
        return Ok(None);
    }
    if footer.summary_start < magic_bytes || footer.summary_start > footer_offset {
        return Err(damaged(format!("it should begin at {}", footer.summary_start)));
    }
    let summary = read_records(source, footer.summary_start)
        .map_err(|reason| Unreadable::Damaged { offset: footer.summary_start, reason })?;
    check_chunks(&summary.chunks, footer.summary_start).map_err(damaged)?;
    Ok(Some(summary))
}

fn read_records(source: &mut Source, start: u64) -> Result<Summary, String> {
    let length = source.size - start;
    let mut reader = LinearReader::new_with_options(
        LinearReaderOptions::default()
            .with_skip_start_magic(true)
            // A summary has no chunks; one is not opened.
            .with_emit_chunks(true)
            // Started here and not at the start of the file, the running checksum covers the same bytes as
            // the footer's checksum.
            .with_validate_data_section_crc(true)
            .with_record_length_limit(usize::try_from(length).unwrap_or(usize::MAX)),
    );
    let io_reason = |error: io::Error| error.to_string();
    source.seek(start).map_err(io_reason)?;
    let mut unread_bytes = length;
    let mut summary = Summary::default();
    while let Some(event) = reader.next_event() {
        match event.map_err(|error| error.to_string())? {
            LinearReadEvent::ReadRequest(wanted) => {
                let bytes = wanted.min(usize::try_from(unread_bytes).unwrap_or(usize::MAX));
                source.read_exact(reader.insert(bytes)).map_err(io_reason)?;
                reader.notify_read(bytes);
                unread_bytes -= bytes as u64;
            }
            LinearReadEvent::Record { opcode, data } => {
                summary.catalogue.take(opcode, data).map_err(|error| error.to_string())?;
                match parse_summary_record(opcode, data)? {
                    Some(Record::Statistics(statistics)) => summary.statistics = Some(statistics),
                    Some(Record::ChunkIndex(chunk)) => summary.chunks.push(chunk),
                    _ => {}
                }
            }
        }
    }
    Ok(summary)
}

fn parse_summary_record(opcode: u8, data: &[u8]) -> Result<Option<Record<'_>>, String> {
    use mcap::records::op::{CHUNK_INDEX, STATISTICS};
    if opcode != CHUNK_INDEX && opcode != STATISTICS {
        return Ok(None);
    }
    record::parse(opcode, data).map(Some).map_err(|error| error.to_string())
}

/// Chunks must follow one another in the data section.
fn check_chunks(chunks: &[ChunkIndex], data_end: u64) -> Result<(), String> {
    let mut extents: Vec<(u64, u64)> = chunks
        .iter()
        .map(|chunk| {
            let length = chunk.chunk_length.saturating_add(chunk.message_index_length);
            (chunk.chunk_start_offset, chunk.chunk_start_offset.saturating_add(length))
        })
        .collect();
    extents.sort_unstable();
    let mut free_from = mcap::MAGIC.len() as u64;
    for (start, end) in extents {
        if start < free_from || end > data_end {
            return Err(format!("it has a chunk at {start} .. {end}, which cannot be"));
        }
        free_from = end;
    }
    Ok(())
}
