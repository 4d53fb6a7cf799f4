//! Why nothing is recorded.

use std::io;
use std::path::PathBuf;

use node_shell::ShellError;

use crate::error::BagError;

/// Why a bag could not be recorded.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// There is a bag of this name.
    #[error("{path} is there already; give another name with -o, or --overwrite", path = path.display())]
    Exists {
        /// The bag.
        path: PathBuf,
    },
    /// The bag cannot be written; what was recorded stays in the temporary file beside it.
    #[error(transparent)]
    Bag(#[from] BagError),
    /// The network does not allow it.
    #[error(transparent)]
    Shell(#[from] ShellError),
    /// The duration makes no sense.
    #[error("--duration must be a number of seconds above 0, not {value}")]
    Duration {
        /// The given value.
        value: f64,
    },
    /// The thread that writes the bag could not be started, or broke off.
    #[error("the bag cannot be written on a thread of its own: {0}")]
    Thread(io::Error),
}
