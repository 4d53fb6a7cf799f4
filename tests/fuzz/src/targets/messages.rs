//! CDR of every message.

use msgs::{RosMessage, cdr};

use super::{FAST, VALUES, samples};
use crate::Target;

pub(super) const TARGETS: &[Target] = &[Target {
    name: "cdr",
    body: of_any_type,
    seeds,
    words: &[&[0, 1, 0, 0], &[0, 0, 0, 0], &[1, 0, 0, 0], &[2, 0, 0, 0, b'a', 0]],
    memory: VALUES,
    gate_cases: 3 * FAST,
}];

type Read = fn(&[u8]);

macro_rules! readers {
    ($($message:ty,)*) => {
        &[$((<$message as RosMessage>::TYPE_NAME, read::<$message> as Read)),*]
    };
}

/// Every message.
const READERS: &[(&str, Read)] = msgs::for_each_message!(readers);

/// The first byte says which message the others are one of.
fn of_any_type(bytes: &[u8]) {
    let Some((which, message)) = bytes.split_first() else { return };
    if let Some((_, read)) = READERS.get(usize::from(*which) % READERS.len()) {
        read(message);
    }
}

/// What is read is written again, and then always the same bytes.
fn read<M: RosMessage>(bytes: &[u8]) {
    let Ok(message) = cdr::decode::<M>(bytes) else { return };
    let written = cdr::encode(&message).expect("what was read fits into a message");
    let again: M = cdr::decode(&written).expect("what is written can be read");
    assert!(cdr::encode(&again).as_ref() == Ok(&written), "it is not what was written");
}

fn seeds() -> Vec<Vec<u8>> {
    // A message of zeros has empty lists and texts, where it is as long as its numbers take.
    let zeros = |which: usize| {
        let mut input = vec![which as u8, 0, 1, 0, 0];
        input.resize(input.len() + 64, 0);
        input
    };
    let of_type = |(type_name, message): (&str, Vec<u8>)| {
        let which = READERS.iter().position(|(name, _)| *name == type_name)?;
        Some([vec![which as u8], message].concat())
    };
    let mut seeds: Vec<Vec<u8>> =
        samples::every_message().into_iter().filter_map(of_type).collect();
    seeds.extend((0..READERS.len()).map(zeros));
    seeds
}
