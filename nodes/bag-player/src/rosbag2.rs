//! `metadata.yaml`, in which rosbag2 lists the files of a bag.

use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};

use serde::Deserialize;

use crate::error::BagError;
use crate::qos::{OfferedQos, Profile};

/// Name of the metadata file in a bag's directory.
pub(crate) const METADATA_FILE: &str = "metadata.yaml";

/// Largest metadata file that is read; real ones have some kB per topic.
const MAX_METADATA_BYTES: u64 = 64 << 20;

/// The used contents of `metadata.yaml`.
#[derive(Debug)]
pub(crate) struct Metadata {
    /// The files, in their order.
    pub(crate) files: Vec<ListedFile>,
    pub(crate) topics: Vec<ListedTopic>,
}

/// A file of the bag.
#[derive(PartialEq, Debug)]
pub(crate) struct ListedFile {
    pub(crate) path: PathBuf,
    pub(crate) message_count: Option<u64>,
}

/// A topic of the bag.
#[derive(PartialEq, Debug)]
pub(crate) struct ListedTopic {
    pub(crate) name: String,
    pub(crate) qos: Option<OfferedQos>,
}

#[derive(Deserialize)]
struct MetadataFile {
    rosbag2_bagfile_information: Information,
}

#[derive(Deserialize)]
struct Information {
    #[serde(default)]
    storage_identifier: String,
    #[serde(default)]
    compression_format: String,
    #[serde(default)]
    compression_mode: String,
    #[serde(default)]
    relative_file_paths: Vec<String>,
    #[serde(default)]
    files: Vec<FileInformation>,
    #[serde(default)]
    topics_with_message_count: Vec<TopicWithCount>,
}

#[derive(Deserialize)]
struct FileInformation {
    path: String,
    message_count: u64,
}

#[derive(Deserialize)]
struct TopicWithCount {
    topic_metadata: TopicMetadata,
}

#[derive(Deserialize)]
struct TopicMetadata {
    name: String,
    #[serde(default)]
    offered_qos_profiles: OfferedProfiles,
}

/// A string of YAML within the YAML up to version 8 of the metadata, plain YAML from 9 on.
#[derive(Deserialize)]
#[serde(untagged)]
enum OfferedProfiles {
    Text(String),
    List(Vec<Profile>),
}

impl Default for OfferedProfiles {
    fn default() -> Self {
        Self::List(Vec::new())
    }
}

impl Metadata {
    /// Reads the metadata of the bag in `directory`.
    pub(crate) fn read(directory: &Path) -> Result<Self, BagError> {
        let path = directory.join(METADATA_FILE);
        let refused = |source| BagError::Open { path: path.clone(), source };
        let bad = |reason: String| BagError::BadMetadata { path: path.clone(), reason };
        let size = std::fs::metadata(&path).map_err(refused)?.len();
        if size > MAX_METADATA_BYTES {
            return Err(bad(format!("{size} bytes are too many for it")));
        }
        let bytes = std::fs::read(&path).map_err(refused)?;
        let text = String::from_utf8(bytes).map_err(|error| bad(error.to_string()))?;
        let parsed: MetadataFile =
            serde_saphyr::from_str(&text).map_err(|error| bad(error.to_string()))?;
        let information = parsed.rosbag2_bagfile_information;
        check_storage(directory, &information)?;
        if information.relative_file_paths.is_empty() {
            return Err(bad("it lists no file".into()));
        }
        // Of a file that is there twice the first counts.
        let counts: BTreeMap<&str, u64> = information
            .files
            .iter()
            .rev()
            .map(|file| (file.path.as_str(), file.message_count))
            .collect();
        let files = information
            .relative_file_paths
            .iter()
            .map(|listed| ListedFile {
                path: within(directory, listed),
                message_count: counts.get(listed.as_str()).copied(),
            })
            .collect();
        let topics = information
            .topics_with_message_count
            .into_iter()
            .map(|topic| ListedTopic {
                name: topic.topic_metadata.name,
                qos: match topic.topic_metadata.offered_qos_profiles {
                    OfferedProfiles::Text(text) => OfferedQos::from_yaml(&text),
                    OfferedProfiles::List(profiles) => OfferedQos::from_profiles(&profiles),
                },
            })
            .collect();
        Ok(Self { files, topics })
    }
}

fn check_storage(directory: &Path, information: &Information) -> Result<(), BagError> {
    let path = directory.to_owned();
    match information.storage_identifier.as_str() {
        "mcap" | "sqlite3" => {}
        other => return Err(BagError::UnknownStorage { path, storage: other.to_owned() }),
    }
    match information.compression_mode.to_ascii_uppercase().as_str() {
        "" | "NONE" => Ok(()),
        // Compressed files and messages are recognised by their content.
        _ if information.compression_format == "zstd" => Ok(()),
        mode => Err(BagError::OuterCompression {
            path,
            mode: mode.to_owned(),
            format: information.compression_format.clone(),
        }),
    }
}

/// The listed file within the bag's directory. Early versions listed it with the directory's name
/// in front, and the directory may have been renamed since: then only the file's name is used. Nothing
/// outside of the directory is ever opened.
fn within(directory: &Path, listed: &str) -> PathBuf {
    let listed = Path::new(listed);
    let inside = listed.components().all(|component| matches!(component, Component::Normal(_)));
    let direct = directory.join(listed);
    let found = match listed.file_name() {
        Some(name) if !inside || !direct.exists() => directory.join(name),
        _ => direct,
    };
    // A file of the bag may have been compressed or unpacked since.
    let mut packed = found.clone().into_os_string();
    packed.push(".zstd");
    let packed = PathBuf::from(packed);
    if !found.exists() && packed.exists() {
        return packed;
    }
    let unpacked = found.with_extension("");
    let is_packed = found.extension().is_some_and(|extension| extension == "zstd");
    if is_packed && !found.exists() && unpacked.exists() { unpacked } else { found }
}
