//! The pose that explains matches.
