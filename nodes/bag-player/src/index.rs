//! The index of one file: its segments, channels and statistics; or the tables of a database.
//!
//! The index at the end of the file gives the positions of the chunks. Parts that it does not cover (files
//! without an index, cut files, messages outside of chunks) are scanned record by record; only the
//! headers of the records are read, nothing is decompressed.

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use mcap::records::{ChunkIndex, Record, Statistics, op};

use crate::catalogue::{Catalogue, Channel};
use crate::error::{BagError, Loss, LossKind};
use crate::info::Storage;
use crate::record;
use crate::segment::{ChunkHead, Form, MESSAGE_HEADER_BYTES, Segment, for_each_record, message_of};
use crate::source::{Frame, MAX_RECORD_BYTES, Source};
use crate::sqlite::{Database, Paths};
use crate::summary::{self, Summary};
use crate::temporary::Temporary;

/// Messages outside of chunks are read in runs of about this size, as if they were a chunk.
const RUN_BYTES: u64 = 1 << 20;

mod opening;

/// The index of one file.
#[derive(Clone, Debug)]
pub(crate) struct FileIndex {
    pub(crate) path: PathBuf,
    pub(crate) size_bytes: u64,
    pub(crate) storage: Storage,
    /// The temporary file that is read in place of it.
    temporary: Option<Arc<Temporary>>,
    /// Remarks about the file that are not losses.
    pub(crate) remark: Option<String>,
    /// Whether it is compressed as a whole.
    pub(crate) is_packed: bool,
    /// A database has no segments and no catalogue.
    pub(crate) database: Option<Database>,
    pub(crate) profile: String,
    pub(crate) library: String,
    /// In the order of the file.
    pub(crate) segments: Vec<Segment>,
    pub(crate) catalogue: Catalogue,
    /// Present where the file has them and was read by its index.
    pub(crate) statistics: Option<Statistics>,
    /// The losses known before any message is read.
    pub(crate) losses: Vec<Loss>,
    /// Whether the file has an index of its chunks.
    pub(crate) indexed: bool,
}

impl FileIndex {
    fn empty(path: &Path, size_bytes: u64, storage: Storage) -> Self {
        Self {
            path: path.to_owned(),
            size_bytes,
            storage,
            temporary: None,
            remark: None,
            is_packed: false,
            database: None,
            profile: String::new(),
            library: String::new(),
            segments: Vec::new(),
            catalogue: Catalogue::default(),
            statistics: None,
            losses: Vec::new(),
            indexed: false,
        }
    }

    /// The path for messages, and the one to open.
    pub(crate) fn paths(&self) -> Paths<'_> {
        let opened = self.temporary.as_ref().map_or(self.path.as_path(), |file| file.path());
        Paths { named: &self.path, opened }
    }

    /// The topics that are known without reading the messages.
    pub(crate) fn channels(&self) -> impl Iterator<Item = &Arc<Channel>> {
        let of_database = self.database.iter().flat_map(|database| database.topics.values());
        self.catalogue.channels().map(|(_, channel)| channel).chain(of_database)
    }

    /// Time of the first message by the index.
    pub(crate) fn first_ns(&self) -> Option<u64> {
        let of_database = self.database.as_ref().and_then(|database| database.span_ns);
        let of_segments = self.segments.iter().map(|segment| segment.first_ns);
        of_segments.chain(of_database.map(|(first_ns, _)| first_ns)).min()
    }

    /// Opens an MCAP file and indexes its segments.
    fn of_mcap(path: &Path) -> Result<Self, BagError> {
        let refused = |source| BagError::Open { path: path.to_owned(), source };
        let mut source = Source::open(path).map_err(refused)?;
        let mut losses = Vec::new();
        let summary = match summary::read(&mut source) {
            Ok(summary) => summary,
            Err(summary::Unreadable::Absent) => None,
            Err(summary::Unreadable::Damaged { offset, reason }) => {
                losses.push(Loss {
                    file: path.to_owned(),
                    offset_bytes: offset,
                    size_bytes: source.size.saturating_sub(offset),
                    messages: Some(0),
                    kind: LossKind::Summary { reason },
                });
                None
            }
        };
        let found = summary.is_some();
        let summary = summary.unwrap_or_default();
        let mut walk = Walk::new(path, &source, &summary);
        walk.losses = losses;
        walk.run(&mut source).map_err(refused)?;
        let mut index = walk.finish(&mut source);
        if found {
            index.statistics = summary.statistics;
        }
        Ok(index)
    }

    /// Whether every channel of the file is known without reading its chunks.
    pub(crate) fn knows_all_channels(&self) -> bool {
        self.statistics.as_ref().is_some_and(|statistics| {
            u32::try_from(self.catalogue.len()).is_ok_and(|known| known >= statistics.channel_count)
        })
    }
}

/// A scan over the records of a file's data section.
struct Walk<'a> {
    index: FileIndex,
    chunks: BTreeMap<u64, &'a ChunkIndex>,
    losses: Vec<Loss>,
    run: Option<Segment>,
}

impl<'a> Walk<'a> {
    fn new(path: &Path, source: &Source, summary: &'a Summary) -> Self {
        Self {
            index: FileIndex {
                catalogue: summary.catalogue.clone(),
                indexed: !summary.chunks.is_empty(),
                ..FileIndex::empty(path, source.size, Storage::Mcap)
            },
            chunks: summary.chunks.iter().map(|chunk| (chunk.chunk_start_offset, chunk)).collect(),
            losses: Vec::new(),
            run: None,
        }
    }

    fn run(&mut self, source: &mut Source) -> io::Result<()> {
        let mut next = Some(mcap::MAGIC.len() as u64);
        while let Some(offset) = next {
            next = match self.chunks.remove(&offset) {
                Some(chunk) => Some(self.indexed_chunk(chunk)),
                None => self.step(source, offset)?,
            };
        }
        self.end_run();
        Ok(())
    }

    /// Adds the record at `offset` and returns the offset of the next one.
    fn step(&mut self, source: &mut Source, offset: u64) -> io::Result<Option<u64>> {
        let Some(frame) = source.frame_at(offset)? else {
            return Ok(self.cut_off(source, offset));
        };
        let next_chunk = self.next_chunk(offset);
        if next_chunk.is_some_and(|chunk| frame.end() > chunk) {
            return Ok(self.bad_record(source, offset, "it runs into the next chunk"));
        }
        match frame.opcode {
            0 => Ok(self.bad_record(source, offset, "opcode 0")),
            op::CHUNK => self.chunk(source, &frame),
            _ if frame.end() > source.size => Ok(self.cut_off(source, offset)),
            op::DATA_END | op::FOOTER if next_chunk.is_none() => {
                self.check_footer(source, frame.end())?;
                Ok(None)
            }
            op::HEADER => {
                let body = source.body_start(&frame, MAX_RECORD_BYTES)?;
                if let Ok(Record::Header(header)) = record::parse(frame.opcode, &body) {
                    self.index.profile = header.profile;
                    self.index.library = header.library;
                }
                Ok(Some(frame.end()))
            }
            op::SCHEMA | op::CHANNEL => {
                let body = source.body_start(&frame, MAX_RECORD_BYTES)?;
                match self.index.catalogue.take(frame.opcode, &body) {
                    Ok(()) => Ok(Some(frame.end())),
                    Err(error) => Ok(self.bad_record(source, offset, &error.to_string())),
                }
            }
            op::MESSAGE => {
                let body = source.body_start(&frame, MESSAGE_HEADER_BYTES)?;
                let Some((header, _)) = message_of(&body) else {
                    return Ok(self.bad_record(source, offset, "a message without its times"));
                };
                self.extend_run(&frame, header.log_time);
                Ok(Some(frame.end()))
            }
            _ => Ok(Some(frame.end())),
        }
    }

    /// Adds a chunk that no index lists.
    fn chunk(&mut self, source: &mut Source, frame: &Frame) -> io::Result<Option<u64>> {
        self.end_run();
        let cut = frame.end() > source.size;
        let Some(head) = ChunkHead::read(source, frame)? else {
            return Ok(if cut {
                self.cut_off(source, frame.offset)
            } else {
                self.bad_record(source, frame.offset, "a chunk without its head")
            });
        };
        self.index.segments.push(Segment {
            offset: frame.offset,
            end: frame.end().min(source.size),
            first_ns: head.first_ns,
            last_ns: head.last_ns,
            index_offsets: None,
            form: Form::Chunk { compression: head.compression },
        });
        // Where the file ends within a chunk, reading the chunk recovers its first messages and reports the loss of the others.
        Ok((!cut).then_some(frame.end()))
    }

    /// The offset of the next chunk that the index lists.
    fn next_chunk(&self, offset: u64) -> Option<u64> {
        self.chunks.range(offset..).next().map(|(start, _)| *start)
    }

    /// Adds a chunk from the index and returns the offset of the next record.
    fn indexed_chunk(&mut self, chunk: &ChunkIndex) -> u64 {
        self.end_run();
        let end = chunk.chunk_start_offset.saturating_add(chunk.chunk_length);
        let offsets = &chunk.message_index_offsets;
        self.index.segments.push(Segment {
            offset: chunk.chunk_start_offset,
            end,
            first_ns: chunk.message_start_time,
            last_ns: chunk.message_end_time,
            index_offsets: (!offsets.is_empty()).then(|| offsets.clone()),
            form: Form::Chunk { compression: chunk.compression.clone() },
        });
        end.saturating_add(chunk.message_index_length)
    }

    fn extend_run(&mut self, frame: &Frame, log_time_ns: u64) {
        let run = self.run.get_or_insert(Segment {
            offset: frame.offset,
            end: frame.end(),
            first_ns: log_time_ns,
            last_ns: log_time_ns,
            index_offsets: None,
            form: Form::Run,
        });
        run.end = frame.end();
        run.first_ns = run.first_ns.min(log_time_ns);
        run.last_ns = run.last_ns.max(log_time_ns);
        if run.end - run.offset >= RUN_BYTES {
            self.end_run();
        }
    }

    fn end_run(&mut self) {
        self.index.segments.extend(self.run.take());
    }

    /// A file that was closed properly ends with a footer and the magic bytes.
    fn check_footer(&mut self, source: &mut Source, after_data: u64) -> io::Result<()> {
        let magic_bytes = mcap::MAGIC.len() as u64;
        let mut end = [0; 8];
        if source.size >= after_data + magic_bytes {
            source.seek(source.size - magic_bytes)?;
            source.read_exact(&mut end)?;
        }
        if end != mcap::MAGIC {
            self.cut_off(source, source.size);
            // The data section is closed: all messages are there.
            if let Some(loss) = self.losses.last_mut() {
                loss.messages = Some(0);
            }
        }
        Ok(())
    }

    /// Records a loss from `offset` on and returns where reading can continue: at the next chunk
    /// of the index, if there is one.
    fn lose(&mut self, source: &Source, offset: u64, kind: LossKind) -> Option<u64> {
        let next = self.next_chunk(offset);
        self.losses.push(Loss {
            file: self.index.path.clone(),
            offset_bytes: offset,
            size_bytes: next.unwrap_or(source.size).saturating_sub(offset),
            messages: None,
            kind,
        });
        next
    }

    fn cut_off(&mut self, source: &Source, offset: u64) -> Option<u64> {
        self.lose(source, offset, LossKind::CutOff { recovered_messages: 0 })
    }

    fn bad_record(&mut self, source: &Source, offset: u64, reason: &str) -> Option<u64> {
        self.lose(source, offset, LossKind::BadRecord { reason: reason.to_owned() })
    }

    fn finish(mut self, source: &mut Source) -> FileIndex {
        self.index.losses = self.losses;
        // The times of a chunk without messages are 0: with them the bag would begin in 1970.
        self.index.segments.retain_mut(|segment| {
            (segment.first_ns, segment.last_ns) != (0, 0) || take_times(source, segment)
        });
        self.index
    }
}

/// Finds the times of a segment by reading it; `false` if it is undamaged and has no message.
fn take_times(source: &mut Source, segment: &mut Segment) -> bool {
    let mut times: Option<(u64, u64)> = None;
    let read = for_each_record(source, segment, &mut |opcode, body| {
        if let Some((header, _)) = (opcode == op::MESSAGE).then(|| message_of(body)).flatten() {
            let (first, last) = times.unwrap_or((header.log_time, header.log_time));
            times = Some((first.min(header.log_time), last.max(header.log_time)));
        }
    });
    if let Some((first_ns, last_ns)) = times {
        (segment.first_ns, segment.last_ns) = (first_ns, last_ns);
    }
    times.is_some() || read.is_err()
}
