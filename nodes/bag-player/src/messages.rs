//! Reading the messages of a bag in the order of their log times.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

use mcap::records::{MessageHeader, op};
use serde::Serialize;

use crate::catalogue::{Catalogue, Channel};
use crate::compression;
use crate::error::{BagError, Loss, LossKind, add_loss};
use crate::index::FileIndex;
use crate::message::{BagMessage, Filter, stamp};
use crate::segment::{channels_of, for_each_record, message_of, messages_indexed_behind};
use crate::source::Source;
use crate::sqlite::{Database, Paths, Rows};

mod queue;

use queue::{Queue, Queued};

/// The messages of a bag, in the order of their log times; equal times in the order of the file.
///
/// Chunks are decompressed when their first message is due. Only chunks that overlap in time are in
/// memory together, and no more than the bag's merge window allows: in a file whose chunks overlap
/// beyond that, the messages that are returned late are counted in
/// [`Messages::out_of_order`].
pub struct Messages {
    files: Vec<FileReader>,
    pending: VecDeque<PendingSegment>,
    queue: Queue,
    window_bytes: u64,
    filter: Filter,
    last_ns: u64,
    out_of_order: u64,
    losses: Vec<Loss>,
    skipped: BTreeMap<String, Skipped>,
}

/// Messages of a topic that were skipped because of their encoding.
#[derive(Clone, PartialEq, Eq, Debug, Serialize)]
pub struct Skipped {
    /// Their encoding.
    pub encoding: String,
    /// Their number.
    pub messages: u64,
}

struct FileReader {
    index: Arc<FileIndex>,
    source: Option<Source>,
    /// The cursor of a database.
    rows: Option<Rows>,
    catalogue: Catalogue,
    /// The number of segments still to be read; the file is closed after the last.
    open_segments: usize,
    /// The channels of the segments before this one are known.
    channels_read_up_to: usize,
}

struct PendingSegment {
    file: usize,
    segment: usize,
    first_ns: u64,
}

/// A message of a segment that is being read.
struct Found {
    header: MessageHeader,
    place: usize,
    channel: Option<Arc<Channel>>,
    data: Vec<u8>,
}

impl Messages {
    pub(crate) fn new(
        files: &[Arc<FileIndex>],
        filter: Filter,
        losses: Vec<Loss>,
        window_bytes: u64,
    ) -> Self {
        let mut readers = Vec::with_capacity(files.len());
        let mut pending = Vec::new();
        for (file, index) in files.iter().enumerate() {
            let wanted = index.segments.iter().enumerate().filter(|(_, segment)| {
                let channel_wanted = |id: &u16| {
                    let channel = index.catalogue.channel(*id);
                    channel.is_none_or(|channel| filter.wants_topic(&channel.topic))
                };
                filter.overlaps(segment.first_ns, segment.last_ns)
                    && segment
                        .index_offsets
                        .as_ref()
                        .is_none_or(|offsets| offsets.keys().any(channel_wanted))
            });
            let before = pending.len();
            let spans = index.database.iter().filter_map(|database| database.span_ns);
            let rows = spans.filter(|(first_ns, last_ns)| filter.overlaps(*first_ns, *last_ns));
            pending.extend(rows.map(|(first_ns, _)| PendingSegment { file, segment: 0, first_ns }));
            pending.extend(wanted.map(|(number, segment)| PendingSegment {
                file,
                segment: number,
                first_ns: segment.first_ns,
            }));
            readers.push(FileReader {
                index: Arc::clone(index),
                source: None,
                rows: None,
                catalogue: index.catalogue.clone(),
                open_segments: pending.len() - before,
                channels_read_up_to: 0,
            });
        }
        pending.sort_by_key(|pending| (pending.first_ns, pending.file, pending.segment));
        Self {
            files: readers,
            pending: pending.into(),
            queue: Queue::default(),
            window_bytes,
            filter,
            last_ns: 0,
            out_of_order: 0,
            losses,
            skipped: BTreeMap::new(),
        }
    }

    /// The losses so far; complete once the iteration has ended. Losses that are known without
    /// reading (a missing file, a damaged index) are included from the start.
    #[must_use]
    pub fn losses(&self) -> &[Loss] {
        &self.losses
    }

    /// The topics whose messages were skipped because they are not in CDR.
    #[must_use]
    pub fn skipped(&self) -> &BTreeMap<String, Skipped> {
        &self.skipped
    }

    /// The number of messages that were returned after one with a later log time.
    #[must_use]
    pub fn out_of_order(&self) -> u64 {
        self.out_of_order
    }

    /// Reads the segments that may hold a message before the earliest one in the queue.
    fn fill(&mut self) -> Result<(), BagError> {
        while let Some(pending) = self.pending.front() {
            let due = self.queue.first_ns().is_none_or(|first_ns| {
                pending.first_ns <= first_ns && self.queue.size_bytes() < self.window_bytes
            });
            if !due {
                break;
            }
            if let Some(pending) = self.pending.pop_front() {
                self.load(&pending)?;
            }
        }
        Ok(())
    }

    fn load(&mut self, pending: &PendingSegment) -> Result<(), BagError> {
        // What is pending is of a file and a segment that there are.
        let Some(reader) = self.files.get_mut(pending.file) else { return Ok(()) };
        let index = Arc::clone(&reader.index);
        if let Some(database) = &index.database {
            return self.load_rows(pending.file, database, index.paths());
        }
        let Some(segment) = index.segments.get(pending.segment) else { return Ok(()) };
        let source = match &mut reader.source {
            Some(source) => source,
            None => match Source::open(index.paths().opened) {
                Ok(source) => reader.source.insert(source),
                Err(source) => {
                    self.pending.retain(|other| other.file != pending.file);
                    return Err(BagError::Open { path: index.path.clone(), source });
                }
            },
        };

        let mut found: Vec<Found> = Vec::new();
        let mut skipped: Vec<Arc<Channel>> = Vec::new();
        let mut malformed = 0;
        let (filter, catalogue) = (&self.filter, &mut reader.catalogue);
        let read = for_each_record(source, segment, &mut |opcode, body| {
            if opcode != op::MESSAGE {
                malformed += u64::from(catalogue.take(opcode, body).is_err());
                return;
            }
            let Some((header, data)) = message_of(body) else {
                malformed += 1;
                return;
            };
            if !filter.wants_time(header.log_time) {
                return;
            }
            let channel = catalogue.channel(header.channel_id).cloned();
            if let Some(channel) = &channel {
                if !filter.wants_topic(&channel.topic) {
                    return;
                }
                if !filter.wants_encoding(&channel.encoding) {
                    skipped.push(Arc::clone(channel));
                    return;
                }
            }
            found.push(Found { header, place: found.len(), channel, data: data.to_vec() });
        });
        if found.iter().any(|found| found.channel.is_none()) {
            reader.read_channels_before(pending.segment);
        }

        let mut loss = |size_bytes, messages, kind| {
            self.losses.push(Loss {
                file: index.path.clone(),
                offset_bytes: segment.offset,
                size_bytes,
                messages,
                kind,
            });
        };
        if malformed > 0 {
            let kind = LossKind::BadChunk { reason: "a record is invalid".into() };
            loss(0, Some(malformed), kind);
        }
        if let Err(fault) = read {
            let size_bytes = segment.end - segment.offset;
            if fault.cut {
                let recovered_messages = found.len() as u64;
                loss(size_bytes, None, LossKind::CutOff { recovered_messages });
            } else {
                // It is not known how many of the messages of a damaged chunk were readable.
                found.clear();
                skipped.clear();
                let wanted = |id: u16, log_time_ns: u64| {
                    let channel = reader.catalogue.channel(id);
                    filter.wants_time(log_time_ns)
                        && channel.is_none_or(|channel| filter.wants_topic(&channel.topic))
                };
                let messages = reader
                    .source
                    .as_mut()
                    .and_then(|source| messages_indexed_behind(source, segment, &wanted));
                loss(size_bytes, messages, fault.kind);
            }
        }
        reader.open_segments = reader.open_segments.saturating_sub(1);
        if reader.open_segments == 0 {
            reader.source = None;
        }
        for channel in skipped {
            self.skip(&channel);
        }
        for message in found {
            self.enqueue(pending, message);
        }
        Ok(())
    }

    /// Reads the next rows of a database, and queues it again for the rows after them.
    fn load_rows(
        &mut self,
        file: usize,
        database: &Database,
        paths: Paths<'_>,
    ) -> Result<(), BagError> {
        let mut rows = match self.files.get_mut(file).and_then(|reader| reader.rows.take()) {
            Some(rows) => rows,
            None => Rows::open(paths, database, &self.filter)?,
        };
        for row in rows.batch(&self.filter) {
            if self.filter.wants_encoding(&row.channel.encoding) {
                self.queue.push(Queued {
                    log_time_ns: row.log_time_ns,
                    place: (file, 0, row.place),
                    publish_time_ns: row.log_time_ns,
                    channel: row.channel,
                    data: row.data,
                });
            } else {
                self.skip(&row.channel);
            }
        }
        if let Some(first_ns) = rows.next_ns() {
            let is_before = |other: &PendingSegment| {
                (other.first_ns, other.file, other.segment) < (first_ns, file, 0)
            };
            let place = self.pending.partition_point(is_before);
            self.pending.insert(place, PendingSegment { file, segment: 0, first_ns });
        }
        for loss in rows.take_losses() {
            add_loss(&mut self.losses, loss);
        }
        if let Some(reader) = self.files.get_mut(file) {
            reader.rows = (!rows.is_at_end()).then_some(rows);
        }
        Ok(())
    }

    fn enqueue(&mut self, pending: &PendingSegment, message: Found) {
        let Some(reader) = self.files.get(pending.file) else { return };
        let channel = match message.channel {
            Some(channel) => channel,
            None => match reader.catalogue.channel(message.header.channel_id) {
                // The channel was not known when the message was read, so that the message is not filtered yet.
                Some(channel) if !self.filter.wants_topic(&channel.topic) => return,
                Some(channel) => Arc::clone(channel),
                None => {
                    self.lose_message(pending, message.header.channel_id, message.data.len());
                    return;
                }
            },
        };
        if !self.filter.wants_encoding(&channel.encoding) {
            self.skip(&channel);
            return;
        }
        match compression::message(&channel.encoding, message.data) {
            Ok(data) => self.queue.push(Queued {
                log_time_ns: message.header.log_time,
                place: (pending.file, pending.segment, message.place),
                publish_time_ns: message.header.publish_time,
                channel,
                data,
            }),
            Err(reason) => {
                self.lose_one(pending, 0, LossKind::BadMessages { reason });
            }
        }
    }

    fn skip(&mut self, channel: &Channel) {
        self.skipped
            .entry(channel.topic.to_string())
            .or_insert_with(|| Skipped { encoding: channel.encoding.to_string(), messages: 0 })
            .messages += 1;
    }

    fn lose_message(&mut self, pending: &PendingSegment, channel_id: u16, data_bytes: usize) {
        self.lose_one(pending, data_bytes, LossKind::UnknownChannel { channel_id });
    }

    /// Notes the loss of one message of a segment.
    fn lose_one(&mut self, pending: &PendingSegment, data_bytes: usize, kind: LossKind) {
        let Some(index) = self.files.get(pending.file).map(|reader| &reader.index) else { return };
        let segment = index.segments.get(pending.segment);
        let loss = Loss {
            file: index.path.clone(),
            offset_bytes: segment.map_or(0, |segment| segment.offset),
            size_bytes: data_bytes as u64,
            messages: Some(1),
            kind,
        };
        add_loss(&mut self.losses, loss);
    }
}

impl FileReader {
    /// A channel may be described only in an earlier chunk, which may not have been read.
    fn read_channels_before(&mut self, segment: usize) {
        let Some(source) = &mut self.source else { return };
        while self.channels_read_up_to < segment {
            let Some(earlier) = self.index.segments.get(self.channels_read_up_to) else { return };
            channels_of(source, earlier, &mut self.catalogue);
            self.channels_read_up_to += 1;
        }
    }
}

impl Iterator for Messages {
    type Item = Result<BagMessage, BagError>;

    fn next(&mut self) -> Option<Self::Item> {
        if let Err(error) = self.fill() {
            return Some(Err(error));
        }
        let message = self.queue.pop()?;
        if message.log_time_ns < self.last_ns {
            self.out_of_order += 1;
        }
        self.last_ns = self.last_ns.max(message.log_time_ns);
        Some(Ok(BagMessage {
            topic: Arc::clone(&message.channel.topic),
            type_name: Arc::clone(&message.channel.type_name),
            encoding: Arc::clone(&message.channel.encoding),
            log_time: stamp(message.log_time_ns),
            publish_time: stamp(message.publish_time_ns),
            data: message.data,
        }))
    }
}
