//! Every reader of outside bytes, given mutated bytes: messages, bags, captures, maps, texts.
//!
//! A [`Target`] is one reader with a body over bytes, and small valid inputs that the suite's own writers make. The body knows
//! nothing of who makes the bytes, so that another engine can: [`Mutator`] makes them from a seed without looking at what they do, so
//! that a case is repeated by its number.
//!
//! A body fails by a panic, which overflow checks and assertions raise as well, or by holding more memory than the target's
//! [`MemoryBound`] warrants for its input ([`allocation`]). What takes the process down (a stack that ends, an allocation that is
//! refused) or never ends is found by the program `stillmap-fuzz`, which runs the cases in a process of their own.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a panic is a finding")]

pub mod allocation;
mod case;
mod checksums;
mod mutation;
mod targets;

pub use case::{Failed, MemoryBound, Target, run};
pub use mutation::{MOST_BYTES, Mutator};
pub use targets::targets;

#[cfg(test)]
mod tests;
