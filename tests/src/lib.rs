//! The tests stand in `tests/suite.rs`; this library is empty.
