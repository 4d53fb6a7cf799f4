//! Which keyframes show the same place, by descriptors alone, and with no vocabulary that would have to be trained.
//!
//! | module | what is in it |
//! |---|---|
//! | `index` | descriptors that are nearly the same, found without comparing all (multi-index hashing) |
//! | `database` | which keyframes have descriptors like those of a frame, and how much that says |
//! | `candidates` | the keyframes that a loop may be closed with, or a lost camera may be at |
//!
//! A bag of words quantises a descriptor to a word, and takes all of a word for the same. Here 96 of the 256 bits make 6
//! words of 16 bits, each with a table of its own (Norouzi, Punjani and Fleet 2012, "Fast search in Hamming space with
//! multi-index hashing"): of two descriptors that differ in an eighth of their bits one word at least is the same, but for
//! one bit, in 95 of 100 cases; those that have such a word are compared in full. So a vote is of a corner that really looks
//! the same, and like no other corner of its keyframe. The descriptors stay in the frames that the map keeps.

mod candidates;
mod database;
mod index;
#[cfg(test)]
mod tests;

pub use candidates::{Candidate, CandidateConfig, Consistency, loop_candidates, lost_candidates};
pub(crate) use database::BYTES_OF_LOOK;
pub use database::{PlaceConfig, PlaceDatabase, Score};
