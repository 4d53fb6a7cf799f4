//! The threads by which the DDS library serves a participant, and how they are stopped while an endpoint is made.
//!
//! RustDDS 0.15.1 deadlocks where an endpoint is made at the wrong moment. Its discovery thread locks
//! its database for reading while it sends the event loop, through a queue of 32, the matches of a new endpoint; the
//! event loop, which empties the queue, reads the database for each participant that it is sent; and the thread that
//! creates the next endpoint waits to write to the database, which holds up every reader after it. Some twenty
//! participants that start together on a busy machine are enough: one of them neither receives nor sends any more. So
//! the participant receives nothing while an endpoint is made, and it is made once both threads are done with what came
//! before. The library's interface does not show when they are, but the kernel does: when both wait for events at one moment,
//! and neither for a lock, the queue is empty and nothing is locked.

use std::collections::BTreeSet;
use std::path::Path;
use std::time::{Duration, Instant};

use super::reception::{Paused, Reception};

/// How the library's threads are called: "RustDDS Participant 0 event loop", "RustDDS discovery thread".
const NAME: &str = "RustDDS";

/// It has so many for each participant.
const OF_A_PARTICIPANT: usize = 2;

/// In the name of each function of the kernel in which a thread waits for a lock, or for room in a queue.
const LOCK: &str = "futex";

/// The first pause between two looks: the threads need some 0.1 ms for an endpoint. Each further one is twice as long, so that
/// where many participants share a processor the looks do not take it from the threads that are looked at.
const FIRST_PAUSE: Duration = Duration::from_micros(100);
const LONGEST_PAUSE: Duration = Duration::from_millis(20);

/// After this long an endpoint is made in any case: while nothing is received the threads come to rest as soon as they have had
/// the CPU time for what they have received, which takes seconds where many participants start on a busy machine.
const LONGEST: Duration = Duration::from_secs(60);
/// The same where reception cannot be paused, so that data can keep the event loop busy for ever.
const LONGEST_WHILE_RECEIVING: Duration = Duration::from_secs(2);

/// The library's threads for one participant, by their numbers in the kernel, and what keeps them busy: none where the kernel
/// does not list them, which is always at rest.
#[derive(Debug)]
pub(crate) struct LibraryThreads {
    numbers: BTreeSet<u32>,
    reception: Reception,
}

/// While it is there, the threads of a participant are at rest.
#[must_use = "an endpoint is made while it is there"]
#[derive(Debug)]
pub(crate) struct AtRest<'a>(#[expect(dead_code, reason = "it ends with this")] Paused<'a>);

/// A thread as the kernel shows it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct Look {
    /// Waits for something to do, and for no lock.
    idles: bool,
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

    /// Those that have begun since `before`, of a participant that receives in these sockets.
    pub(super) fn since(before: &BTreeSet<u32>, sockets: &[i32]) -> Self {
        let numbers = Self::present().difference(before).copied().collect();
        Self { numbers, reception: Reception::of(sockets) }
    }

    /// Pauses the reception, and waits until all threads idle at one moment. One at a time.
    pub(crate) fn at_rest(&self) -> AtRest<'_> {
        let paused = self.reception.pause();
        let is_paused = self.reception.can_be_paused();
        let longest = if is_paused { LONGEST } else { LONGEST_WHILE_RECEIVING };
        let begun = Instant::now();
        let mut pause = FIRST_PAUSE;
        while !self.rest() && begun.elapsed() < longest {
            std::thread::sleep(pause);
            pause = (2 * pause).min(LONGEST_PAUSE);
        }
        AtRest(paused)
    }

    /// Whether each idles, and has idled from the first look at it to the second: all of them between the looks.
    fn rest(&self) -> bool {
        let first = self.looks();
        first.iter().all(|look| look.idles) && self.looks() == first
    }

    /// Whether one of them has ended. `false` where they are not known for certain: others of the library began at the same moment, or
    /// the kernel does not list them.
    pub(crate) fn have_ended(&self) -> bool {
        // Without opening a file: a process that has no descriptor left cannot read of its threads.
        let is_gone = |number: &u32| {
            let entry = format!("/proc/self/task/{number}");
            matches!(Path::new(&entry).try_exists(), Ok(false))
        };
        self.numbers.len() == OF_A_PARTICIPANT && self.numbers.iter().any(is_gone)
    }

    fn looks(&self) -> Vec<Look> {
        self.numbers.iter().filter_map(|number| look(*number)).collect()
    }
}

/// `None` where there is no such thread of the library: it has ended.
fn look(number: u32) -> Option<Look> {
    let read = |name: &str| std::fs::read_to_string(format!("/proc/self/task/{number}/{name}"));
    // Some kernels do not tell.
    parse(&read("status").ok()?, &read("wchan").unwrap_or_default())
}

/// A thread's status, and the kernel's function in which it waits (proc_pid_wchan(5)).
fn parse(status: &str, waits_in: &str) -> Option<Look> {
    let field = |name: &str| {
        status.lines().find_map(|line| Some(line.strip_prefix(name)?.strip_prefix(':')?.trim()))
    };
    let count = |name: &str| field(name)?.parse::<u64>().ok();
    if !field("Name")?.starts_with(NAME) {
        return None;
    }
    Some(Look {
        idles: field("State")?.starts_with('S') && !waits_in.contains(LOCK),
        switches: count("voluntary_ctxt_switches")? + count("nonvoluntary_ctxt_switches")?,
    })
}

#[cfg(test)]
mod tests;
