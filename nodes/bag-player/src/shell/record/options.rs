//! The options of the recorder.

use std::path::PathBuf;
use std::time::Duration;

use super::error::RecordError;
use crate::BagWriter;

/// The arguments of `stillmap record`.
#[derive(clap::Args, Clone, PartialEq, Debug)]
pub struct RecordOptions {
    /// The bag, an .mcap file
    #[arg(short, long, value_name = "BAG")]
    pub output: PathBuf,
    /// Record these topics only, otherwise all that appear (comma-separated, or given several times)
    #[arg(long, value_name = "TOPIC", value_delimiter = ',')]
    pub topics: Vec<String>,
    /// Record all but these
    #[arg(long, value_name = "TOPIC", value_delimiter = ',', conflicts_with = "topics")]
    pub exclude: Vec<String>,
    /// End after this time
    #[arg(long = "duration", value_name = "SECONDS", allow_negative_numbers = true)]
    pub duration_s: Option<f64>,
    /// Replace a bag of this name
    #[arg(long)]
    pub overwrite: bool,
    /// Print the summary as JSON
    #[arg(long)]
    pub json: bool,
}

impl RecordOptions {
    /// All topics, until the recorder is stopped.
    #[must_use]
    pub fn new(output: PathBuf) -> Self {
        Self {
            output,
            topics: Vec::new(),
            exclude: Vec::new(),
            duration_s: None,
            overwrite: false,
            json: false,
        }
    }

    /// Checks the options, before a node is created.
    pub(super) fn check(&self) -> Result<(), RecordError> {
        self.longest()?;
        if self.output.exists() && !self.overwrite {
            return Err(RecordError::Exists { path: self.output.clone() });
        }
        let temporary = BagWriter::temporary_of(&self.output);
        if temporary.exists() && !self.overwrite {
            return Err(RecordError::CutOff { temporary });
        }
        Ok(())
    }

    /// The maximum duration of the recording.
    pub(super) fn longest(&self) -> Result<Option<Duration>, RecordError> {
        let Some(duration_s) = self.duration_s else { return Ok(None) };
        match Duration::try_from_secs_f64(duration_s) {
            Ok(longest) if !longest.is_zero() => Ok(Some(longest)),
            _ => Err(RecordError::Duration { value: duration_s }),
        }
    }
}
