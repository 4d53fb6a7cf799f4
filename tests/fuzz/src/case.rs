//! A target, and one case of it.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};

use crate::allocation::most_held;

/// A reader of outside bytes.
#[derive(Clone, Copy)]
pub struct Target {
    /// Its name on the command line.
    pub name: &'static str,
    /// Reads the bytes; a panic is a failure.
    pub body: fn(&[u8]),
    /// Small valid inputs.
    pub seeds: fn() -> Vec<Vec<u8>>,
    /// Words of the format, which mutation alone would hardly find.
    pub words: &'static [&'static [u8]],
    /// What it may hold.
    pub memory: MemoryBound,
    /// Cases that the gate runs: those of files take longer than those of bytes.
    pub gate_cases: u64,
}

/// The memory that a reader may hold at a time, what it returns included.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct MemoryBound {
    /// Whatever the input.
    pub base_bytes: usize,
    /// For each byte of the input.
    pub per_byte: usize,
}

impl MemoryBound {
    /// For an input of so many bytes.
    #[must_use]
    pub fn of(&self, input_bytes: usize) -> usize {
        self.base_bytes.saturating_add(self.per_byte.saturating_mul(input_bytes))
    }
}

/// Why a case failed.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
pub enum Failed {
    /// The reader panicked.
    #[error("it panicked: {0}")]
    Panicked(String),
    /// It held too much memory.
    #[error("it held {held} bytes for an input of {input_bytes}; {warranted} are warranted")]
    HeldTooMuch {
        /// At a time.
        held: usize,
        /// The length of the input.
        input_bytes: usize,
        /// The bound.
        warranted: usize,
    },
}

/// Gives an input to a target.
///
/// # Errors
/// When it panicked, or held more memory than is warranted.
pub fn run(target: &Target, input: &[u8]) -> Result<(), Failed> {
    let (read, held) = most_held(|| catch_unwind(AssertUnwindSafe(|| (target.body)(input))));
    read.map_err(|panic| Failed::Panicked(text_of(&*panic)))?;
    let warranted = target.memory.of(input.len());
    if held > warranted {
        return Err(Failed::HeldTooMuch { held, input_bytes: input.len(), warranted });
    }
    Ok(())
}

fn text_of(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    text.or(panic.downcast_ref::<&str>().copied()).unwrap_or("no text").to_owned()
}
