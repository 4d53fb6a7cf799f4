//! Holds the structs to their `.msg` files: serialises a message into a [`shape::Shape`] and compares
//! that with the parsed text. Also fills messages of any type, for tests that need one of each.

pub(crate) mod compare;
pub(crate) mod fill;
mod shape;
#[cfg(test)]
mod tests;
