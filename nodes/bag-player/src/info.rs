//! The contents of a bag.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::path::PathBuf;

use geometry::Stamp;
use mcap::records::op;
use serde::Serialize;

use crate::bag::Bag;
use crate::catalogue::{Catalogue, Channel};
use crate::error::{BagError, Loss, LossKind, add_loss};
use crate::index::FileIndex;
use crate::message::{CDR, bare, stamp};
use crate::qos::OfferedQos;
use crate::segment::{Form, for_each_record, message_of};
use crate::source::Source;
use crate::sqlite::{self, Database, Paths};

mod display;
mod span;

use span::Span;

/// The contents of a bag: the output of `stillmap info`, as text ([`fmt::Display`]) or JSON.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct BagInfo {
    /// The path that was opened.
    pub path: PathBuf,
    /// Its files, in their order.
    pub files: Vec<FileInfo>,
    /// Size of all files together.
    pub size_bytes: u64,
    /// Log time of the first message; `None` for a bag without messages.
    pub start: Option<Stamp>,
    /// Log time of the last message.
    pub end: Option<Stamp>,
    /// Seconds from the first message to the last.
    pub duration_s: f64,
    /// All messages of all topics.
    pub message_count: u64,
    /// The topics, by name.
    pub topics: Vec<TopicInfo>,
    /// The parts of the bag that cannot be read.
    pub losses: Vec<Loss>,
    /// Other remarks.
    pub remarks: Vec<String>,
}

/// One file of a bag.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct FileInfo {
    /// Its path.
    pub path: PathBuf,
    /// Its size.
    pub size_bytes: u64,
    /// The format of its content.
    pub storage: Storage,
    /// Its MCAP profile; `ros2` for a ROS 2 bag.
    pub profile: String,
    /// The program that wrote it.
    pub library: String,
    /// Whether it has an index of its chunks.
    pub indexed: bool,
    /// How many chunks it has.
    pub chunks: usize,
    /// The compressions of its messages, with `none` where some are not compressed.
    pub compression: Vec<String>,
}

/// The format of a file.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Storage {
    /// MCAP.
    Mcap,
    /// rosbag2's database.
    Sqlite3,
    /// A bag of ROS 1, which is converted to be read.
    Ros1,
}

/// One topic of a bag.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct TopicInfo {
    /// Its name.
    pub topic: String,
    /// The name of its type; empty if the bag has none.
    pub type_name: String,
    /// The definition of its type and of the types in it, in the form of `.msg` files, where the bag has it.
    #[serde(skip)]
    pub definition: Option<String>,
    /// The hash of its type's description (REP-2011), where the bag has it.
    pub type_hash: Option<String>,
    /// The encoding of its messages.
    pub encoding: String,
    /// How many there are.
    pub message_count: u64,
    /// Mean rate from the first to the last message; `None` for fewer than two messages.
    pub rate_hz: Option<f64>,
    /// The QoS that its publishers offered, if it was recorded.
    pub qos: Option<OfferedQos>,
}

/// The counts of a topic.
#[derive(Default)]
struct Tallied {
    messages: u64,
    span: Option<Span>,
    qos: Option<OfferedQos>,
    definition: Option<String>,
    type_hash: Option<String>,
}

impl BagInfo {
    /// The topic of this name, which may be given with or without its leading slash; `None` if the bag has none.
    #[must_use]
    pub fn topic(&self, named: &str) -> Option<&TopicInfo> {
        self.topics.iter().find(|topic| bare(&topic.topic) == bare(named))
    }

    /// The encodings of its messages that are not decoded, such as `json` and `protobuf`.
    #[must_use]
    pub fn other_encodings(&self) -> BTreeSet<&str> {
        let topics =
            self.topics.iter().filter(|topic| !topic.is_playable() && topic.message_count > 0);
        topics.map(|topic| topic.encoding.as_str()).collect()
    }

    /// The topic's name in the bag, given with or without its leading slash; the given name where the bag has no
    /// such topic.
    #[must_use]
    pub fn recorded_name<'a>(&'a self, named: &'a str) -> &'a str {
        self.topic(named).map_or(named, |topic| &topic.topic)
    }
}

impl TopicInfo {
    /// Whether its messages can be decoded and played, which only those in CDR can.
    #[must_use]
    pub fn is_playable(&self) -> bool {
        self.encoding == CDR
    }
}

/// The number of messages by channel, and the times of the first and the last one.
#[derive(Default)]
struct Tally {
    counts: BTreeMap<(String, String, String), Tallied>,
    span: Option<Span>,
    losses: Vec<Loss>,
}

pub(crate) fn of(bag: &Bag, read_all: bool) -> Result<BagInfo, BagError> {
    let mut tally = Tally { losses: bag.losses().to_vec(), ..Tally::default() };
    for file in bag.files() {
        if let Some(database) = &file.database {
            tally.read_rows(file.paths(), database, read_all)?;
            continue;
        }
        match &file.statistics {
            Some(statistics) if file.knows_all_channels() && !read_all => {
                let spans = span::of_channels(file)
                    .map_err(|source| BagError::Open { path: file.path.clone(), source })?;
                for (id, channel) in file.catalogue.channels() {
                    let count = statistics.channel_message_counts.get(&id);
                    tally.add(channel, count.copied().unwrap_or(0), spans.get(&id).copied());
                }
                if statistics.message_count > 0 {
                    tally.extend(Span::at(statistics.message_start_time));
                    tally.extend(Span::at(statistics.message_end_time));
                }
            }
            _ => tally.read(file)?,
        }
    }
    let span = tally.span;
    let topics: Vec<TopicInfo> = tally
        .counts
        .into_iter()
        .map(|((topic, type_name, encoding), tallied)| TopicInfo {
            rate_hz: tallied
                .span
                .map(Span::seconds)
                .filter(|seconds| tallied.messages > 1 && *seconds > 0.0)
                .map(|seconds| (tallied.messages - 1) as f64 / seconds),
            qos: tallied.qos.or_else(|| bag.listed_qos(&topic)),
            topic,
            type_name,
            definition: tallied.definition,
            type_hash: tallied.type_hash,
            encoding,
            message_count: tallied.messages,
        })
        .collect();
    Ok(BagInfo {
        path: bag.path().to_owned(),
        files: bag.files().iter().map(|file| file_info(file)).collect(),
        size_bytes: bag.files().iter().map(|file| file.size_bytes).sum(),
        start: span.map(|span| stamp(span.first_ns)),
        end: span.map(|span| stamp(span.last_ns)),
        duration_s: span.map_or(0.0, Span::seconds),
        message_count: topics.iter().map(|topic| topic.message_count).sum(),
        topics,
        losses: tally.losses,
        remarks: bag.remarks().to_vec(),
    })
}

fn file_info(file: &FileIndex) -> FileInfo {
    let mut compression = BTreeSet::new();
    let mut chunks = 0;
    for segment in &file.segments {
        let name = match &segment.form {
            Form::Chunk { compression } => {
                chunks += 1;
                compression.as_str()
            }
            Form::Run => "",
        };
        compression.insert(if name.is_empty() { "none" } else { name }.to_owned());
    }
    if let Some(database) = &file.database {
        let each = if database.has_packed_messages { "zstd, each message" } else { "none" };
        compression.insert(each.to_owned());
    }
    if file.is_packed {
        compression.remove("none");
        compression.insert("zstd, the whole file".to_owned());
    }
    FileInfo {
        path: file.path.clone(),
        size_bytes: file.size_bytes,
        storage: file.storage,
        profile: file.profile.clone(),
        library: file.library.clone(),
        indexed: file.indexed,
        chunks,
        compression: compression.into_iter().collect(),
    }
}

impl Tally {
    fn add(&mut self, channel: &Channel, count: u64, span: Option<Span>) {
        let key = (
            channel.topic.to_string(),
            channel.type_name.to_string(),
            channel.encoding.to_string(),
        );
        let entry = self.counts.entry(key).or_default();
        entry.messages += count;
        entry.span = joined(entry.span, span);
        entry.qos = entry.qos.or(channel.qos);
        if entry.definition.is_none() && !channel.definition.is_empty() {
            entry.definition = Some(channel.definition.to_string());
        }
        if entry.type_hash.is_none() && !channel.type_hash.is_empty() {
            entry.type_hash = Some(channel.type_hash.to_string());
        }
    }

    fn extend(&mut self, span: Span) {
        self.span = joined(self.span, Some(span));
    }

    /// Counts the messages of a database: without reading their data, unless that is requested or the table cannot be read
    /// to its end.
    fn read_rows(
        &mut self,
        paths: Paths<'_>,
        database: &Database,
        read_all: bool,
    ) -> Result<(), BagError> {
        let walked = if read_all { None } else { sqlite::walk(paths, database).ok() };
        let (counts, losses) = match walked {
            Some(walked) => walked,
            None => sqlite::read_through(paths, database)?,
        };
        for loss in losses {
            add_loss(&mut self.losses, loss);
        }
        for (id, channel) in &database.topics {
            let counted = counts.get(id);
            let span = counted
                .map(|counted| Span { first_ns: counted.first_ns, last_ns: counted.last_ns });
            self.add(channel, counted.map_or(0, |counted| counted.messages), span);
            self.span = joined(self.span, span);
        }
        Ok(())
    }

    /// Counts the messages of a file by reading it, in the order of the file.
    fn read(&mut self, file: &FileIndex) -> Result<(), BagError> {
        let mut source = Source::open(file.paths().opened)
            .map_err(|source| BagError::Open { path: file.path.clone(), source })?;
        let mut catalogue: Catalogue = file.catalogue.clone();
        let mut unknown: BTreeMap<u16, u64> = BTreeMap::new();
        for segment in &file.segments {
            let mut counts: BTreeMap<u16, (u64, Span)> = BTreeMap::new();
            let read = for_each_record(&mut source, segment, &mut |opcode, body| {
                if opcode != op::MESSAGE {
                    // An invalid record is reported when the messages are read.
                    let _ = catalogue.take(opcode, body);
                } else if let Some((header, _)) = message_of(body) {
                    let at = Span::at(header.log_time);
                    let (count, span) = counts.entry(header.channel_id).or_insert((0, at));
                    *count += 1;
                    *span = span.with(at);
                }
            });
            if let Err(fault) = read {
                let recovered: u64 = counts.values().map(|(count, _)| count).sum();
                let kind = match fault.kind {
                    LossKind::CutOff { .. } => LossKind::CutOff { recovered_messages: recovered },
                    kind => kind,
                };
                self.losses.push(Loss {
                    file: file.path.clone(),
                    offset_bytes: segment.offset,
                    size_bytes: segment.end - segment.offset,
                    messages: None,
                    kind,
                });
                if !fault.cut {
                    continue;
                }
            }
            for (id, (count, span)) in counts {
                self.extend(span);
                match catalogue.channel(id) {
                    Some(channel) => self.add(channel, count, Some(span)),
                    None => *unknown.entry(id).or_default() += count,
                }
            }
        }
        for (_, channel) in catalogue.channels() {
            self.add(channel, 0, None);
        }
        self.losses.extend(unknown.into_iter().map(|(channel_id, count)| Loss {
            file: file.path.clone(),
            offset_bytes: 0,
            size_bytes: 0,
            messages: Some(count),
            kind: LossKind::UnknownChannel { channel_id },
        }));
        Ok(())
    }
}

fn joined(one: Option<Span>, other: Option<Span>) -> Option<Span> {
    match (one, other) {
        (Some(one), Some(other)) => Some(one.with(other)),
        (one, other) => one.or(other),
    }
}

impl fmt::Display for BagInfo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        display::write(self, f)
    }
}
