//! How long the corners of a frame take, and matching them: `cargo bench -p pose --bench points`.
// A benchmark may stop where it stands, and exports nothing.
#![allow(clippy::unwrap_used, missing_docs)]

fn main() {}
