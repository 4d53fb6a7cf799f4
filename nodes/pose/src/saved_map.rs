//! The map as bytes: what is needed to find a camera in it again, and to go on with it.
//!
//! # The bytes
//! All numbers outside of the records are little-endian.
//!
//! | bytes | what |
//! |---|---|
//! | 4 | `SMKF` |
//! | 2 | the version, 1 |
//! | 2 | what descriptors mean: those of another number are not comparable with ours |
//! | 8 | the length of all records |
//! | | the records |
//! | 4 | CRC-32 (IEEE) of all before |
//!
//! The records are in the form of [postcard](https://postcard.jamesmunns.com): whole numbers are varints, but for those of
//! descriptors; floating-point numbers are whole. First comes a head (`form::Head`), then as many keyframes, points and lines as it
//! says. A corner takes 68 bytes, a segment 135, a landmark 105, half of it descriptors: some 110 kB for a keyframe of 1000
//! corners and 200 segments that brings 100 landmarks.
//!
//! The appearance of places is not saved: it follows from the descriptors, and takes less time to be made again than to be
//! read.
//!
//! # Who may read it
//! A file of another version is refused: there has been one only.
#![cfg_attr(not(test), deny(clippy::indexing_slicing))]

mod form;
#[cfg(test)]
mod tests;

use nalgebra::Isometry3;
use postcard::{take_from_bytes, to_extend};
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::map::{Map, MapParts, PartsError};
use form::{Head, SavedKeyframe, SavedLine, SavedPoint};

/// How the bytes begin: StillMap's KeyFrames.
const MAGIC: [u8; 4] = *b"SMKF";
/// Goes up when the bytes change.
pub const VERSION: u16 = 1;
/// Goes up when corners or segments are described otherwise: by other pixels, bands or pairs. A test knows the pixels.
const DESCRIPTORS: u16 = 1;
const HEADER_BYTES: usize = 16;
const CHECKSUM_BYTES: usize = 4;

/// A map, and where it is.
#[derive(Clone, Debug)]
pub struct SavedMap {
    /// The map, in the frame of its first camera.
    pub map: Map,
    /// Where that frame is in the one that poses were published in: gravity, and where the robot was set off.
    pub world_from_map: Isometry3<f64>,
}

/// The bytes are not those of a map.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
pub enum SavedMapError {
    /// They begin with other bytes.
    #[error("it is no map of keyframes: it does not begin with SMKF")]
    NotThisFormat,
    /// They are of another version.
    #[error("it has version {found} of the format, and this program reads {VERSION} alone{}", fix(*found))]
    OtherVersion {
        /// Theirs.
        found: u16,
    },
    /// Its features look otherwise to this program.
    #[error(
        "its descriptors have version {found}, and those of this program version {DESCRIPTORS}: nothing of it \
         would be recognised; make the map again"
    )]
    OtherDescriptors {
        /// Theirs.
        found: u16,
    },
    /// They end too early, or go on.
    #[error(
        "it has {found} bytes, and {expected} by what it says: it was cut off, or something was put behind it"
    )]
    Length {
        /// By the header.
        expected: u64,
        /// That are there.
        found: usize,
    },
    /// Some of them have changed.
    #[error(
        "its checksum is {found:08x}, and that of its bytes is {computed:08x}: some have changed"
    )]
    Checksum {
        /// The stated checksum.
        found: u32,
        /// The value in its bytes.
        computed: u32,
    },
    /// The checksum is right, and a record is invalid.
    #[error("{what} {index} of {count} cannot be read: {source}")]
    Record {
        /// The kind of record.
        what: &'static str,
        /// Which.
        index: usize,
        /// Of how many.
        count: u64,
        /// Why.
        source: postcard::Error,
    },
    /// Bytes follow the last record.
    #[error("{bytes} bytes follow its last record")]
    Rest {
        /// How many.
        bytes: usize,
    },
    /// The pose of the map is invalid.
    #[error("the pose of the map in the world is invalid")]
    Pose,
    /// The records are not those of a map.
    #[error(transparent)]
    Parts(#[from] PartsError),
}

fn fix(found: u16) -> &'static str {
    if found > VERSION { ": a newer stillmap wrote it" } else { ": make the map again" }
}

/// A record cannot be written.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
#[error("the map cannot be encoded: {0}")]
pub struct EncodeError(#[from] postcard::Error);

impl SavedMap {
    /// The map as bytes. The same map gives the same bytes.
    ///
    /// # Errors
    /// Never, as far as is known: the encoder's own.
    pub fn encode(&self) -> Result<Vec<u8>, EncodeError> {
        encoded(&self.map.parts(), &self.world_from_map)
    }

    /// The map that bytes are. They may come from anywhere: nothing is taken that [`Map::check`] refuses, and no more memory
    /// than they are long, some times over.
    ///
    /// # Errors
    /// When they are not those of a map: the first thing that is wrong.
    pub fn decode(bytes: &[u8]) -> Result<Self, SavedMapError> {
        let mut rest = records(bytes)?;
        let head: Head = take(&mut rest, ("the head", 0, 1))?;
        let world_from_map = head.world_from_map().ok_or(SavedMapError::Pose)?;
        let mut parts = MapParts {
            config: head.config(),
            keyframes_so_far: head.keyframes_so_far,
            ..MapParts::default()
        };
        parts.keyframes =
            all::<SavedKeyframe, _>(&mut rest, ("keyframe", head.keyframes), Into::into)?;
        parts.points = all::<SavedPoint, _>(&mut rest, ("point", head.points), Into::into)?;
        parts.lines = all::<SavedLine, _>(&mut rest, ("line", head.lines), Into::into)?;
        if !rest.is_empty() {
            return Err(SavedMapError::Rest { bytes: rest.len() });
        }
        Ok(Self { map: Map::from_parts(parts)?, world_from_map })
    }
}

fn encoded(parts: &MapParts, world_from_map: &Isometry3<f64>) -> Result<Vec<u8>, EncodeError> {
    let mut bytes = Vec::new();
    bytes.extend(MAGIC);
    bytes.extend(VERSION.to_le_bytes());
    bytes.extend(DESCRIPTORS.to_le_bytes());
    bytes.extend([0; 8]);
    put(&mut bytes, &Head::of(parts, world_from_map))?;
    for keyframe in &parts.keyframes {
        put(&mut bytes, &SavedKeyframe::from(keyframe))?;
    }
    for point in &parts.points {
        put(&mut bytes, &SavedPoint::from(point))?;
    }
    for line in &parts.lines {
        put(&mut bytes, &SavedLine::from(line))?;
    }
    let length = (bytes.len() - HEADER_BYTES) as u64;
    if let Some(place) = bytes.get_mut(HEADER_BYTES - 8..HEADER_BYTES) {
        place.copy_from_slice(&length.to_le_bytes());
    }
    let checksum = crc32fast::hash(&bytes);
    bytes.extend(checksum.to_le_bytes());
    Ok(bytes)
}

/// The bytes of the records, where the rest is as it must be.
fn records(bytes: &[u8]) -> Result<&[u8], SavedMapError> {
    let mut ahead = bytes;
    if word(&mut ahead) != Some(MAGIC) {
        return Err(SavedMapError::NotThisFormat);
    }
    // Of a header that is cut off nothing can be said but that.
    let too_short = SavedMapError::Length {
        expected: (HEADER_BYTES + CHECKSUM_BYTES) as u64,
        found: bytes.len(),
    };
    let version = word(&mut ahead).map(u16::from_le_bytes).ok_or(too_short.clone())?;
    if version != VERSION {
        return Err(SavedMapError::OtherVersion { found: version });
    }
    let descriptors = word(&mut ahead).map(u16::from_le_bytes).ok_or(too_short.clone())?;
    let length = word(&mut ahead).map(u64::from_le_bytes).ok_or(too_short)?;
    let expected = length.saturating_add((HEADER_BYTES + CHECKSUM_BYTES) as u64);
    let found = bytes.len();
    if expected != found as u64 {
        return Err(SavedMapError::Length { expected, found });
    }
    let (before, checksum) =
        bytes.split_last_chunk().ok_or(SavedMapError::Length { expected, found })?;
    let (found, computed) = (u32::from_le_bytes(*checksum), crc32fast::hash(before));
    if found != computed {
        return Err(SavedMapError::Checksum { found, computed });
    }
    if descriptors != DESCRIPTORS {
        return Err(SavedMapError::OtherDescriptors { found: descriptors });
    }
    Ok(before.get(HEADER_BYTES..).unwrap_or_default())
}

/// The next bytes, if there are this many.
fn word<const BYTES: usize>(ahead: &mut &[u8]) -> Option<[u8; BYTES]> {
    let (word, rest) = ahead.split_first_chunk()?;
    *ahead = rest;
    Some(*word)
}

fn put(bytes: &mut Vec<u8>, record: &impl Serialize) -> Result<(), EncodeError> {
    // Appends, and gives back what it was given.
    *bytes = to_extend(record, std::mem::take(bytes))?;
    Ok(())
}

fn take<T: DeserializeOwned>(
    rest: &mut &[u8],
    (what, index, count): (&'static str, usize, u64),
) -> Result<T, SavedMapError> {
    let (record, after) = take_from_bytes(rest).map_err(|source| SavedMapError::Record {
        what,
        index,
        count,
        source,
    })?;
    *rest = after;
    Ok(record)
}

/// This many records. Missing ones are found at the first that is missing: no number decides how much memory is taken.
fn all<T: DeserializeOwned, P>(
    rest: &mut &[u8],
    (what, count): (&'static str, u64),
    part: impl Fn(T) -> P,
) -> Result<Vec<P>, SavedMapError> {
    let mut parts = Vec::new();
    while (parts.len() as u64) < count {
        parts.push(part(take(rest, (what, parts.len(), count))?));
    }
    Ok(parts)
}
