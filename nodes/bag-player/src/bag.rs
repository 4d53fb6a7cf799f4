//! A bag: one file, or a directory of them.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::error::{BagError, Loss, LossKind};
use crate::index::FileIndex;
use crate::info::{self, BagInfo, TopicInfo};
use crate::message::{Filter, Selection, bare};
use crate::messages::Messages;
use crate::rosbag2::{ListedTopic, METADATA_FILE, Metadata};

/// The maximum size of the messages of overlapping chunks in memory, unless [`Bag::with_merge_window`]
/// sets another.
pub const DEFAULT_MERGE_WINDOW_BYTES: u64 = 512 << 20;

/// A recorded bag, open for reading: a file of MCAP, of rosbag2's sqlite3 storage or of ROS 1, recognised by its content; a
/// rosbag2 directory; or a directory with `.mcap` or `.db3` files in it.
///
/// A file that was compressed as a whole (zstd), and a bag of ROS 1, are read from a temporary file, which is
/// removed when the bag and its [`Messages`] are dropped.
///
/// Opening reads the index only. A damaged bag opens as long as there is something to read in it; losses
/// are reported by [`Messages::losses`] and [`BagInfo::losses`].
#[derive(Debug)]
pub struct Bag {
    path: PathBuf,
    files: Vec<Arc<FileIndex>>,
    listed_topics: Vec<ListedTopic>,
    losses: Vec<Loss>,
    remarks: Vec<String>,
    merge_window_bytes: u64,
}

impl Bag {
    /// Opens a bag.
    ///
    /// # Errors
    /// When there is no bag at `path`, or one with another storage, which the message names.
    pub fn open(path: &Path) -> Result<Self, BagError> {
        Self::open_while(path, &|| true)
    }

    /// Opens a bag. Unpacking or converting it, which may take minutes, ends when `goes_on` returns false.
    ///
    /// # Errors
    /// As [`Self::open`], and [`BagError::Interrupted`].
    pub fn open_while(path: &Path, goes_on: &dyn Fn() -> bool) -> Result<Self, BagError> {
        let refused = |source| BagError::Open { path: path.to_owned(), source };
        let kind = std::fs::metadata(path).map_err(refused)?;
        if kind.is_dir() {
            Self::open_directory(path, goes_on)
        } else if path.file_name().is_some_and(|name| name == METADATA_FILE) {
            let directory = path.parent().filter(|parent| !parent.as_os_str().is_empty());
            Self::open_directory(directory.unwrap_or(Path::new(".")), goes_on)
        } else {
            let index = FileIndex::open(path, goes_on)?;
            Ok(Self::new(path, vec![index], Vec::new(), Vec::new()))
        }
    }

    fn new(
        path: &Path,
        files: Vec<FileIndex>,
        listed_topics: Vec<ListedTopic>,
        mut losses: Vec<Loss>,
    ) -> Self {
        losses.extend(files.iter().flat_map(|file| file.losses.iter().cloned()));
        let remarks = files.iter().filter_map(|file| file.remark.clone()).collect();
        Self {
            path: path.to_owned(),
            files: files.into_iter().map(Arc::new).collect(),
            listed_topics,
            losses,
            remarks,
            merge_window_bytes: DEFAULT_MERGE_WINDOW_BYTES,
        }
    }

    fn open_directory(directory: &Path, goes_on: &dyn Fn() -> bool) -> Result<Self, BagError> {
        if directory.join(METADATA_FILE).exists() {
            return Self::open_listed(directory, goes_on);
        }
        let refused = |source| BagError::Open { path: directory.to_owned(), source };
        let mut paths = Vec::new();
        for entry in std::fs::read_dir(directory).map_err(refused)? {
            paths.push(entry.map_err(refused)?.path());
        }
        let found = ["mcap", "db3"].map(|extension| (extension, files_of(&paths, extension)));
        let [(extension, files), other] = match found {
            [mcap, (_, databases)] if databases.is_empty() => [mcap, ("db3", databases)],
            [(_, mcap), databases] if mcap.is_empty() => [databases, ("mcap", mcap)],
            both => both,
        };
        let count = files.len();
        if count == 0 {
            return Err(BagError::NoBagInDirectory { path: directory.to_owned() });
        }
        let files = files.into_iter().map(|path| (path, None)).collect();
        let mut bag = Self::open_files(directory, files, Vec::new(), goes_on)?;
        bag.remarks.push(format!(
            "no {METADATA_FILE}: the {count} .{extension} files in {} are read as one bag",
            directory.display()
        ));
        if !other.1.is_empty() {
            bag.remarks.push(format!("its {} .{} files are not read", other.1.len(), other.0));
        }
        Ok(bag)
    }

    fn open_listed(directory: &Path, goes_on: &dyn Fn() -> bool) -> Result<Self, BagError> {
        let metadata = Metadata::read(directory)?;
        let files =
            metadata.files.into_iter().map(|file| (file.path, file.message_count)).collect();
        Self::open_files(directory, files, metadata.topics, goes_on)
    }

    /// Opens the files of a bag; those that cannot be read are losses as long as one can.
    fn open_files(
        directory: &Path,
        listed: Vec<(PathBuf, Option<u64>)>,
        topics: Vec<ListedTopic>,
        goes_on: &dyn Fn() -> bool,
    ) -> Result<Self, BagError> {
        let count = listed.len();
        let mut files = Vec::new();
        let mut losses = Vec::new();
        for (path, messages) in listed {
            let kind = if path.exists() {
                match FileIndex::open(&path, goes_on) {
                    Ok(index) => {
                        files.push(index);
                        continue;
                    }
                    Err(error @ BagError::Interrupted { .. }) => return Err(error),
                    Err(error) => LossKind::UnreadableFile { reason: error.to_string() },
                }
            } else {
                LossKind::MissingFile
            };
            let size_bytes = std::fs::metadata(&path).map_or(0, |metadata| metadata.len());
            losses.push(Loss { file: path, offset_bytes: 0, size_bytes, messages, kind });
        }
        if files.is_empty() {
            let first = losses.first().map_or_else(String::new, ToString::to_string);
            return Err(BagError::NoFileLeft { path: directory.to_owned(), listed: count, first });
        }
        Ok(Self::new(directory, files, topics, losses))
    }

    /// The same bag with another bound on the messages of overlapping chunks in memory. A single
    /// chunk is always read whole, whatever its size.
    #[must_use]
    pub fn with_merge_window(mut self, bytes: u64) -> Self {
        self.merge_window_bytes = bytes;
        self
    }

    /// The path that was opened.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The contents of the bag. Reads the index if there is one, and otherwise the whole bag.
    ///
    /// # Errors
    /// When a file can no longer be opened.
    pub fn info(&self) -> Result<BagInfo, BagError> {
        info::of(self, false)
    }

    /// The contents of the bag, counted by reading all of it: finds damaged chunks that [`Bag::info`] does
    /// not read.
    ///
    /// # Errors
    /// When a file can no longer be opened.
    pub fn check(&self) -> Result<BagInfo, BagError> {
        info::of(self, true)
    }

    /// The topics of the bag. Reads the index if there is one, and otherwise the whole bag.
    ///
    /// # Errors
    /// When a file can no longer be opened.
    pub fn topics(&self) -> Result<Vec<TopicInfo>, BagError> {
        Ok(self.info()?.topics)
    }

    /// The selected messages, in the order of their log times.
    ///
    /// # Errors
    /// When the selection asks for a topic that the bag does not have, or its times are invalid.
    pub fn messages(&self, selection: &Selection) -> Result<Messages, BagError> {
        let filter = Filter::new(selection, self.start_ns().unwrap_or(0))?;
        self.check_topics(selection)?;
        Ok(Messages::new(&self.files, filter, self.losses.clone(), self.merge_window_bytes))
    }

    /// Every requested topic must exist. The whole bag is read for this only when its index does
    /// not have the topic.
    fn check_topics(&self, selection: &Selection) -> Result<(), BagError> {
        let Some(topics) = &selection.topics else { return Ok(()) };
        let known = |topic: &str| {
            let mut channels = self.files.iter().flat_map(|file| file.channels());
            channels.any(|channel| bare(&channel.topic) == bare(topic))
        };
        let unknown: Vec<&String> = topics.iter().filter(|topic| !known(topic)).collect();
        if unknown.is_empty() {
            return Ok(());
        }
        let available = self.topics()?;
        for topic in unknown {
            if !available.iter().any(|other| bare(&other.topic) == bare(topic)) {
                let names: Vec<&str> = available.iter().map(|topic| topic.topic.as_str()).collect();
                return Err(BagError::NoSuchTopic {
                    path: self.path.clone(),
                    topic: topic.clone(),
                    available: if names.is_empty() { "none".into() } else { names.join(", ") },
                });
            }
        }
        Ok(())
    }

    pub(crate) fn files(&self) -> &[Arc<FileIndex>] {
        &self.files
    }

    pub(crate) fn losses(&self) -> &[Loss] {
        &self.losses
    }

    pub(crate) fn remarks(&self) -> &[String] {
        &self.remarks
    }

    /// The QoS that the bag's metadata lists for a topic.
    pub(crate) fn listed_qos(&self, topic: &str) -> Option<crate::qos::OfferedQos> {
        self.listed_topics.iter().find(|listed| listed.name == topic)?.qos
    }

    /// Log time of the first message by the index.
    pub(crate) fn start_ns(&self) -> Option<u64> {
        self.files.iter().filter_map(|file| file.first_ns()).min()
    }
}

/// The files of this extension, also those that were compressed as a whole, unless the unpacked file is beside them.
fn files_of(paths: &[PathBuf], extension: &str) -> Vec<PathBuf> {
    let is_of = |path: &Path| path.extension().is_some_and(|found| found == extension);
    let is_packed = |path: &PathBuf| {
        let is_zstd = path.extension().is_some_and(|found| found == "zstd" || found == "zst");
        is_zstd && is_of(&path.with_extension("")) && !paths.contains(&path.with_extension(""))
    };
    let mut files: Vec<PathBuf> =
        paths.iter().filter(|path| is_of(path) || is_packed(path)).cloned().collect();
    files.sort();
    files
}
