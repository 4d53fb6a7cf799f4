//! A process that is stopped and goes on, as by Ctrl-Z and `fg`.

use std::time::{Duration, Instant};

use free_domain::FreeDomain;
use rustix::process::Signal;

use crate::program::Running;

/// Longer than anything here takes on a busy machine; reached only by a fault.
const PATIENCE: Duration = Duration::from_secs(120);
/// The node is stopped for so long, and then looked at for longer than it takes to see that its library has ended.
const STOPPED: Duration = Duration::from_millis(100);
const LOOKED_AT: Duration = Duration::from_secs(3);

/// Regression: the DDS library ended where it was interrupted, and the node lived on, deaf and mute. If this does not end one day, the
/// library goes on, and `node_shell::services::library_watch` is not needed any more.
#[test]
fn a_node_that_was_stopped_and_goes_on_ends_to_be_started_again() {
    let domain = FreeDomain::new();
    let log = tempfile::NamedTempFile::new().unwrap();
    let mut node = Running::start_on_with_log(domain.number(), log.path(), ["node", "detection"]);
    let said = |text: &str| std::fs::read_to_string(log.path()).unwrap().contains(text);
    let begun = Instant::now();
    // It has all its ends when it says what it misses. One that is stopped before fails to start, after long waits for the library.
    while !said("nothing publishes") {
        assert!(begun.elapsed() < PATIENCE, "the node starts");
        std::thread::sleep(STOPPED);
    }
    let begun = Instant::now();
    // A thread is interrupted where it waits, which those of the library do nearly always.
    while node.is_up() {
        assert!(begun.elapsed() < PATIENCE, "the node lives on");
        node.signal(Signal::STOP);
        std::thread::sleep(STOPPED);
        node.signal(Signal::CONT);
        let looked_at = Instant::now();
        while node.is_up() && looked_at.elapsed() < LOOKED_AT {
            std::thread::sleep(STOPPED);
        }
    }
    assert!(said("the DDS library has ended"), "{}", std::fs::read_to_string(log.path()).unwrap());
    assert!(!node.wait().success());
}
