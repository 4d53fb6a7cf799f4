//! The time span of the messages of each channel of a file.
//!
//! It is read from the message indices of chunks, without decompressing the chunks, and only of chunks in which a channel
//! can begin or end.

use std::collections::BTreeMap;
use std::io;

use mcap::records::{Record, op};

use crate::index::FileIndex;
use crate::record;
use crate::segment::{Segment, for_each_record, message_of};
use crate::source::{MAX_RECORD_BYTES, Source};

/// The log times of the first and the last message.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Span {
    pub(super) first_ns: u64,
    pub(super) last_ns: u64,
}

impl Span {
    pub(super) fn at(log_time_ns: u64) -> Self {
        Self { first_ns: log_time_ns, last_ns: log_time_ns }
    }

    /// The span that contains both.
    pub(super) fn with(self, other: Self) -> Self {
        Self {
            first_ns: self.first_ns.min(other.first_ns),
            last_ns: self.last_ns.max(other.last_ns),
        }
    }

    pub(super) fn seconds(self) -> f64 {
        self.last_ns.saturating_sub(self.first_ns) as f64 * 1e-9
    }
}

/// The spans of the channels of a file, by their numbers.
pub(super) fn of_channels(file: &FileIndex) -> io::Result<BTreeMap<u16, Span>> {
    let mut source = Source::open(file.paths().opened)?;
    let mut spans: BTreeMap<u16, Span> = BTreeMap::new();
    let mut indexed: Vec<(&Segment, &BTreeMap<u16, u64>)> = Vec::new();
    for segment in &file.segments {
        match &segment.index_offsets {
            Some(offsets) => indexed.push((segment, offsets)),
            None => read_through(&mut source, segment, &mut spans),
        }
    }
    indexed.sort_by_key(|(segment, _)| segment.first_ns);
    for (segment, offsets) in &indexed {
        look(&mut source, offsets, &mut spans, |span| segment.first_ns < span.first_ns);
    }
    indexed.sort_by_key(|(segment, _)| std::cmp::Reverse(segment.last_ns));
    for (segment, offsets) in &indexed {
        look(&mut source, offsets, &mut spans, |span| segment.last_ns > span.last_ns);
    }
    Ok(spans)
}

/// Reads the message index of the channels whose span the chunk can extend.
fn look(
    source: &mut Source,
    offsets: &BTreeMap<u16, u64>,
    spans: &mut BTreeMap<u16, Span>,
    can_widen: impl Fn(&Span) -> bool,
) {
    for (channel, offset) in offsets {
        if spans.get(channel).is_none_or(&can_widen)
            && let Some(span) = indexed_span(source, *channel, *offset)
        {
            widen(spans, *channel, span);
        }
    }
}

/// The message index of a channel at `offset`; `None` if there is none, or it is damaged.
fn indexed_span(source: &mut Source, channel: u16, offset: u64) -> Option<Span> {
    let frame = source.frame_at(offset).ok().flatten()?;
    if frame.opcode != op::MESSAGE_INDEX || frame.end() > source.size {
        return None;
    }
    let body = source.body_start(&frame, MAX_RECORD_BYTES).ok()?;
    match record::parse(frame.opcode, &body) {
        Ok(Record::MessageIndex(index)) if index.channel_id == channel => {
            index.records.iter().map(|entry| Span::at(entry.log_time)).reduce(Span::with)
        }
        _ => None,
    }
}

/// Finds the spans in a part of the file without an index. Errors are reported when the messages are read.
fn read_through(source: &mut Source, segment: &Segment, spans: &mut BTreeMap<u16, Span>) {
    let _ = for_each_record(source, segment, &mut |opcode, body| {
        if let Some((header, _)) = (opcode == op::MESSAGE).then(|| message_of(body)).flatten() {
            widen(spans, header.channel_id, Span::at(header.log_time));
        }
    });
}

fn widen(spans: &mut BTreeMap<u16, Span>, channel: u16, with: Span) {
    spans.entry(channel).and_modify(|span| *span = span.with(with)).or_insert(with);
}
