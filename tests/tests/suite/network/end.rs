//! The two ends of a topic: `stillmap bench publish` and `stillmap bench subscribe`, on a machine of
//! the test.

use std::io::{BufRead, BufReader, Read};
use std::process::{Child, ChildStdout, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process};
use serde::Deserialize;
use serde::de::DeserializeOwned;

use super::site::Machine;

/// Longer than anything here takes on a busy machine; reached only by a fault.
pub(crate) const PATIENCE: Duration = Duration::from_secs(60);

/// DDS gives a silent peer up after 50 s. What happens before that was not brought about by the end of the lease. How
/// long it takes is printed, and measured by `stillmap bench transport`.
pub(crate) const BEFORE_THE_LEASE: Duration = Duration::from_secs(45);

/// The two ends of a topic whose messages must all arrive. The publisher sends until the test ends it, since a subscriber may find it
/// some time after it has found the subscriber, and the subscriber ends with its count: `lost` are those missing in between.
/// The queues hold all that is sent at 50 Hz in those 300 s, which are over only by a fault: no pause of a process overwrites a message.
pub(crate) const RELIABLE: &str = "--reliable --depth 15000 --seconds 300";

/// What the environment may tell a node of the transport. The test's own must not reach the ends.
pub(super) const VARIABLES: [&str; 7] = [
    "ROS_DOMAIN_ID",
    "ROS_LOCALHOST_ONLY",
    "ROS_AUTOMATIC_DISCOVERY_RANGE",
    "ROS_STATIC_PEERS",
    "STILLMAP_INTERFACES",
    "STILLMAP_RECEIVE_BUFFER_KIB",
    "RUST_LOG",
];

/// What a publisher reports at its end.
#[derive(Clone, PartialEq, Debug, Deserialize)]
pub(crate) struct Published {
    pub(crate) published: u64,
    pub(crate) refused: u64,
    pub(crate) subscribers_peak: u64,
    pub(crate) rss_peak_bytes: u64,
}

/// What a subscriber reports at its end.
#[derive(Clone, PartialEq, Debug, Deserialize)]
pub(crate) struct Subscribed {
    pub(crate) received: u64,
    /// Missing between the first and the last one that came.
    pub(crate) lost: Option<u64>,
    pub(crate) out_of_order: u64,
    /// From its start to the first message.
    pub(crate) first_s: Option<f64>,
    pub(crate) latency_ms: Option<LatencyMs>,
    pub(crate) publishers_peak: u64,
    pub(crate) rss_peak_bytes: u64,
    /// The size up to which messages arrive whole with the receive buffer that the kernel grants.
    pub(crate) largest_safe_bytes: u64,
}

/// From the stamp to the moment when a message was taken.
#[derive(Clone, PartialEq, Debug, Deserialize)]
pub(crate) struct LatencyMs {
    pub(crate) median: f64,
    pub(crate) p99: f64,
}

/// One end, a process.
pub(crate) struct End {
    name: String,
    child: Child,
    stdout: ChildStdout,
    stderr: Receiver<String>,
    heard: Vec<String>,
}

impl End {
    pub(crate) fn publish(
        machine: &Machine,
        environment: &[(&str, &str)],
        arguments: &str,
    ) -> Self {
        Self::start(machine, environment, "publish", arguments)
    }

    pub(crate) fn subscribe(
        machine: &Machine,
        environment: &[(&str, &str)],
        arguments: &str,
    ) -> Self {
        Self::start(machine, environment, "subscribe", arguments)
    }

    fn start(machine: &Machine, environment: &[(&str, &str)], role: &str, arguments: &str) -> Self {
        let mut command = machine.command(env!("CARGO_BIN_EXE_stillmap-under-test"));
        for variable in VARIABLES {
            command.env_remove(variable);
        }
        let mut child = command
            .args(["bench", role])
            .args(arguments.split_whitespace())
            .envs(environment.iter().copied())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let (lines, stderr) = channel();
        let source = BufReader::new(child.stderr.take().unwrap());
        std::thread::spawn(move || {
            for line in source.lines().map_while(Result::ok) {
                if lines.send(line).is_err() {
                    return;
                }
            }
        });
        let stdout = child.stdout.take().unwrap();
        let name = format!("bench {role} {arguments}");
        Self { name, child, stdout, stderr, heard: Vec::new() }
    }

    /// Waits until it has found a peer, and returns how long that took.
    pub(crate) fn wait_for_match(&mut self) -> Duration {
        let start = Instant::now();
        let found = self.wait_for_line(PATIENCE, |line| line == "matched");
        assert!(found, "{} found no peer; it said {:#?}", self.name, self.heard);
        start.elapsed()
    }

    /// Whether it has found a peer at the end of `longest`. It is the only wait that a test spends in
    /// full, when there is nothing to find.
    pub(crate) fn finds_a_peer_within(&mut self, longest: Duration) -> bool {
        self.wait_for_line(longest, |line| line == "matched")
    }

    /// Waits for a line on its standard error.
    pub(crate) fn wait_for_line(
        &mut self,
        longest: Duration,
        wanted: impl Fn(&str) -> bool,
    ) -> bool {
        let end = Instant::now() + longest;
        loop {
            let left = end.saturating_duration_since(Instant::now());
            match self.stderr.recv_timeout(left) {
                Ok(line) => {
                    let is_wanted = wanted(&line);
                    self.heard.push(line);
                    if is_wanted {
                        return true;
                    }
                }
                Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => return false,
            }
        }
    }

    /// Waits for its end and returns what it reports.
    pub(crate) fn finish<R: DeserializeOwned>(mut self) -> R {
        let mut report = String::new();
        self.stdout.read_to_string(&mut report).unwrap();
        let status = self.child.wait().unwrap();
        self.heard.extend(self.stderr.try_iter());
        assert!(status.success(), "{}: {status}; it said {:#?}", self.name, self.heard);
        serde_json::from_str(&report)
            .unwrap_or_else(|error| panic!("{}: {error} in {report:?}", self.name))
    }

    /// Asks it to end as a shell does, and returns what it reports.
    pub(crate) fn interrupt<R: DeserializeOwned>(self) -> R {
        let pid = Pid::from_raw(i32::try_from(self.child.id()).unwrap()).unwrap();
        kill_process(pid, Signal::INT).unwrap();
        self.finish()
    }

    /// Kills it, with no chance to say good-bye.
    pub(crate) fn kill(self) {
        drop(self);
    }
}

impl Drop for End {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
