//! The threads by which the DDS library serves a participant, and when they rest.
//!
//! RustDDS 0.15.1 deadlocks where an endpoint is made at the wrong moment. Its discovery thread locks
//! its database for reading while it sends the event loop, through a queue of 32, the matches of a new endpoint; the
//! event loop, which empties the queue, reads the database for each participant that it is sent; and the thread that
//! creates the next endpoint waits to write to the database, which holds up every reader after it. Some twenty
//! participants that start together on a busy machine are enough: one of them neither receives nor sends any more. The
//! library's interface does not show when the discovery thread is done with an endpoint, but the kernel does: when
//! that thread and the event loop sleep at one moment, the queue is empty and nothing is locked.

use std::collections::BTreeSet;
use std::time::{Duration, Instant};

/// How the library's threads are called: "RustDDS Participant 0 event loop", "RustDDS discovery thread".
const NAME: &str = "RustDDS";

/// The pause between two looks. The threads need some 0.1 ms for an endpoint.
const PAUSE: Duration = Duration::from_micros(100);

/// After this long the next endpoint is made in any case: an event loop that data keep busy never rests, and of 24 nodes that
/// start at once on two cores two endpoints in three wait this long. By then the discovery thread is done with the one before:
/// ten such starts of ten went well.
const LONGEST: Duration = Duration::from_millis(250);

/// The library's threads for one participant, by their numbers in the kernel: none where the kernel does not list
/// them, which is always at rest.
#[derive(Debug)]
pub(crate) struct LibraryThreads {
    numbers: BTreeSet<u32>,
}

/// A thread as the kernel shows it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct Look {
    sleeps: bool,
    /// How often it has left the processor: a thread that woke in between has.
    switches: u64,
}

impl LibraryThreads {
    /// The threads of the library that this process has.
    pub(super) fn present() -> BTreeSet<u32> {
        let Ok(threads) = std::fs::read_dir("/proc/self/task") else { return BTreeSet::new() };
        threads
            .flatten()
            .filter_map(|thread| thread.file_name().to_str()?.parse().ok())
            .filter(|number| look(*number).is_some())
            .collect()
    }

    /// Those that have begun since `before`. Of two participants that begin at once, each may have both's.
    pub(super) fn since(before: &BTreeSet<u32>) -> Self {
        Self { numbers: Self::present().difference(before).copied().collect() }
    }

    /// Waits until all of them sleep at one moment, a quarter of a second at most; `false` when they did not.
    pub(crate) fn wait_for_rest(&self) -> bool {
        let begun = Instant::now();
        while !self.rest() {
            if begun.elapsed() > LONGEST {
                return false;
            }
            std::thread::sleep(PAUSE);
        }
        true
    }

    /// Whether each sleeps, and has slept from the first look at it to the second: all of them between the looks.
    fn rest(&self) -> bool {
        let first = self.looks();
        first.iter().all(|look| look.sleeps) && self.looks() == first
    }

    fn looks(&self) -> Vec<Look> {
        self.numbers.iter().filter_map(|number| look(*number)).collect()
    }
}

/// `None` where there is no such thread of the library: it has ended.
fn look(number: u32) -> Option<Look> {
    parse(&std::fs::read_to_string(format!("/proc/self/task/{number}/status")).ok()?)
}

fn parse(status: &str) -> Option<Look> {
    let field = |name: &str| {
        status.lines().find_map(|line| Some(line.strip_prefix(name)?.strip_prefix(':')?.trim()))
    };
    let count = |name: &str| field(name)?.parse::<u64>().ok();
    if !field("Name")?.starts_with(NAME) {
        return None;
    }
    Some(Look {
        sleeps: field("State")?.starts_with('S'),
        switches: count("voluntary_ctxt_switches")? + count("nonvoluntary_ctxt_switches")?,
    })
}

#[cfg(test)]
mod tests;
