//! The targets, by what is read.

mod bags;
mod conversions;
mod maps;
mod messages;
mod packets;
mod pictures;
mod recordings;
mod samples;
mod texts;
mod transforms;

use crate::{MemoryBound, Target};

/// All of them.
#[must_use]
pub fn targets() -> Vec<Target> {
    let groups: [&[Target]; 9] = [
        messages::TARGETS,
        conversions::TARGETS,
        transforms::TARGETS,
        pictures::TARGETS,
        bags::TARGETS,
        packets::TARGETS,
        recordings::TARGETS,
        maps::TARGETS,
        texts::TARGETS,
    ];
    groups.concat()
}

/// Readers of values in memory. A megabyte is what serde makes room for on the strength of a claimed count; a string of a byte takes 24.
const VALUES: MemoryBound = MemoryBound { base_bytes: 4 << 20, per_byte: 96 };

/// Cases that the gate runs of a reader of values in memory: some tens of milliseconds.
const FAST: u64 = 4000;

/// The same of a reader of files.
const OF_FILES: u64 = 120;

/// The text that bytes are: what is no UTF-8 is refused by whoever reads the file.
fn text_of(bytes: &[u8]) -> &str {
    match std::str::from_utf8(bytes) {
        Ok(text) => text,
        Err(error) => {
            let (valid, _) = bytes.split_at(error.valid_up_to());
            std::str::from_utf8(valid).unwrap_or_default()
        }
    }
}
