//! The errors of the recorder.

use std::io;
use std::path::PathBuf;

use node_shell::ShellError;

use crate::error::BagError;

/// Why a bag could not be recorded.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// The bag already exists.
    #[error("{path} already exists; give another name with -o, or --overwrite", path = path.display())]
    Exists {
        /// The bag.
        path: PathBuf,
    },
    /// A recording of this name goes on, or was cut off.
    #[error(
        "{temporary} is there already: of a recording that goes on, or of one that was cut off, of which `stillmap import bag {temporary} \
         -o NAME.mcap` makes a bag. Give another name with -o, or --overwrite to drop it",
        temporary = temporary.display()
    )]
    CutOff {
        /// The file.
        temporary: PathBuf,
    },
    /// The bag cannot be written; the recorded part is in the temporary file beside it.
    #[error(transparent)]
    Bag(#[from] BagError),
    /// The node cannot be created on the network.
    #[error(transparent)]
    Shell(#[from] ShellError),
    /// The duration is invalid.
    #[error("--duration must be a number of seconds above 0, not {value}")]
    Duration {
        /// The given value.
        value: f64,
    },
    /// The thread that writes the bag could not be started, or failed.
    #[error("the bag cannot be written on a thread of its own: {0}")]
    Thread(io::Error),
}
