//! A peer as a process. It tells what it does in lines on its standard output, and ends when its
//! standard input does, so that it cannot outlive the test.

use std::collections::BTreeSet;
use std::io::{BufRead, BufReader, Write};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::time::{Duration, Instant};

use msgs::RosService;
use serde_json::{Value, json};
use tokio::sync::mpsc;
use tokio::time::timeout;

use super::build::{Make, Program, program};
use super::definitions;
use super::place::{PATIENCE, Place};

/// How Cyclone DDS is set up. Its receive buffer: by default it asks for 1 MiB. Multicast for discovery
/// alone: else the data between two processes of this machine goes out to its network.
const CYCLONE: &str = "<CycloneDDS><Domain>\
    <General><AllowMulticast>spdp</AllowMulticast></General>\
    <Internal><SocketReceiveBufferSize max=\"32MB\"/></Internal>\
    </Domain></CycloneDDS>";

/// How long a peer may take to end before it is killed.
const LONGEST_END: Duration = Duration::from_secs(5);

/// A running peer.
pub(crate) struct Peer {
    child: Child,
    input: Option<ChildStdin>,
    lines: mpsc::UnboundedReceiver<String>,
    matched: BTreeSet<String>,
    heard: Vec<String>,
}

impl Peer {
    /// Starts a peer and waits until it has made its endpoints; `None` where it cannot be had.
    pub(super) async fn start(
        make: Make,
        mode: &str,
        place: &Place,
        arguments: &[&str],
    ) -> Option<Self> {
        Self::start_on(make, mode, place.domain_id(), arguments).await
    }

    /// The same on a domain.
    pub(crate) async fn start_on(
        make: Make,
        mode: &str,
        domain_id: u16,
        arguments: &[&str],
    ) -> Option<Self> {
        let Program { path, arguments: first } = program(make)?;
        let mut child = Command::new(path)
            .args(first)
            .args([mode, &domain_id.to_string()])
            .args(arguments)
            .env("CYCLONEDDS_URI", CYCLONE)
            .env("STILLMAP_MSG_FOLDER", definitions::folder())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let (sender, lines) = mpsc::unbounded_channel();
        let output = BufReader::new(child.stdout.take().unwrap());
        std::thread::spawn(move || {
            for line in output.lines().map_while(Result::ok) {
                if sender.send(line).is_err() {
                    break;
                }
            }
        });
        let input = child.stdin.take();
        let mut peer = Self { child, input, lines, matched: BTreeSet::new(), heard: Vec::new() };
        peer.wait_for("ready").await;
        Some(peer)
    }

    /// Waits for a line that starts with `word`; returns the rest of it.
    pub(crate) async fn wait_for(&mut self, word: &str) -> String {
        loop {
            let line = timeout(PATIENCE, self.lines.recv()).await;
            let line = line.unwrap_or_else(|_| panic!("the peer did not say {word}"));
            let line = line.unwrap_or_else(|| panic!("the peer ended before it said {word}"));
            let (first, rest) = line.split_once(' ').unwrap_or((&line, ""));
            if first == word {
                return rest.to_owned();
            }
            self.keep(first, rest);
        }
    }

    /// Whether the peer has, in time, matched both ends of the exchange of a type.
    pub(super) async fn has_matched(&mut self, type_name: &str, longest: Duration) -> bool {
        let until = tokio::time::Instant::now() + longest;
        while !self.matched.contains(type_name) {
            let Ok(line) = tokio::time::timeout_at(until, self.lines.recv()).await else {
                return false;
            };
            let line = line.expect("the peer has not ended");
            let (first, rest) = line.split_once(' ').unwrap_or((&line, ""));
            self.keep(first, rest);
        }
        true
    }

    /// What the peer heard next, in JSON, if that comes in time.
    pub(super) async fn heard(&mut self, longest: Duration) -> Option<String> {
        if !self.heard.is_empty() {
            return Some(self.heard.remove(0));
        }
        timeout(longest, self.wait_for("heard")).await.ok()
    }

    /// Lets a peer in the mode `call` call a service; returns the response.
    pub(super) async fn call<S: RosService>(&mut self, service: &str, request: Value) -> Value {
        self.tell(&json!([service, S::TYPE_NAME, request]).to_string());
        self.wait_for("answer").await.parse().expect("the peer tells in JSON")
    }

    /// Writes a line to the peer.
    pub(crate) fn tell(&mut self, line: &str) {
        let input = self.input.as_mut().unwrap();
        writeln!(input, "{line}").unwrap();
        input.flush().unwrap();
    }

    fn keep(&mut self, first: &str, rest: &str) {
        match first {
            "matched" => {
                self.matched.insert(rest.to_owned());
            }
            "heard" => self.heard.push(rest.to_owned()),
            _ => {}
        }
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        // The end of its input asks the peer to end, with a good-bye to the others.
        self.input = None;
        let asked = Instant::now();
        while asked.elapsed() < LONGEST_END {
            match self.child.try_wait() {
                Ok(None) => std::thread::sleep(Duration::from_millis(10)),
                _ => return,
            }
        }
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
