//! The messages of one type that are exchanged: every length modulo 4 that the type can have, each in
//! one datagram, in a few fragments, and in more than 64 kB.

use msgs::RosMessage;

use super::definitions::Definitions;
use super::fill::{Floats, filled};
use super::lengths::{can_grow, possible_remainders};

/// Seeds that are tried for one length; a remainder that the type can have comes up every fourth time.
const SEEDS: u64 = 400;

/// How large a message is made, and so how it travels.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Size {
    /// In one datagram.
    Whole,
    /// More than the 1.4 kB that a peer puts into one fragment.
    Fragments,
    /// More than 64 kB, which no datagram holds.
    ManyFragments,
}

impl Size {
    /// Lengths of every remainder.
    fn grown_bytes(self, seed: u64) -> Option<usize> {
        let more = (seed % 8) as usize;
        match self {
            Self::Whole => None,
            Self::Fragments => Some(3_000 + more),
            Self::ManyFragments => Some(70_000 + more),
        }
    }

    fn holds(self, bytes: usize) -> bool {
        match self {
            Self::Whole => bytes < 8_000,
            Self::Fragments => (1_500..64_000).contains(&bytes),
            Self::ManyFragments => (65_536..200_000).contains(&bytes),
        }
    }
}

/// One message of the exchange.
pub(super) struct Case<M> {
    pub(super) message: M,
    /// The message in CDR: equal messages have equal bytes, not-a-number and minus zero included.
    pub(super) encoded: Vec<u8>,
}

impl<M: RosMessage> Case<M> {
    /// For a report.
    pub(super) fn name(&self) -> String {
        let bytes = self.encoded.len();
        format!("{} of {bytes} bytes ({} modulo 4)", M::TYPE_NAME, bytes % 4)
    }
}

/// Every case of a type.
pub(super) fn cases<M: RosMessage>(definitions: &Definitions, floats: Floats) -> Vec<Case<M>> {
    let sizes: &[Size] = if can_grow(definitions, M::TYPE_NAME) {
        &[Size::Whole, Size::Fragments, Size::ManyFragments]
    } else {
        &[Size::Whole]
    };
    let mut cases = Vec::new();
    let mut seed = 0;
    for size in sizes {
        for remainder in possible_remainders(definitions, M::TYPE_NAME) {
            let last_seed = seed + SEEDS;
            cases.push(loop {
                seed += 1;
                assert!(seed < last_seed, "no {} of {size:?}, {remainder}", M::TYPE_NAME);
                let message: M = filled(seed, floats, size.grown_bytes(seed));
                let encoded = msgs::cdr::encode(&message).unwrap();
                if encoded.len() % 4 == remainder && size.holds(encoded.len()) {
                    break Case { message, encoded };
                }
            });
        }
    }
    cases
}
