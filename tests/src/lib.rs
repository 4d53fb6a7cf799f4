//! The tests stand in `tests/suite`; this library is empty.
