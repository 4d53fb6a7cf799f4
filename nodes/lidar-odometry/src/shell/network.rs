//! Packets from the scanner itself: decoded in a thread of their own, so that none waits for a scan that is worked at.

use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use node_shell::{Counters, NodeFailure};
use tokio::sync::mpsc::{Receiver, Sender, channel, error::TrySendError};

use super::parameters::LidarOdometryParameters;
use crate::live::{LiveCounts, LiveSource};
use crate::packets::PositionPacket;
use crate::revolution::{AssemblyCounts, BuiltRevolution, RevolutionAssembly};

/// A revolution of the scanner.
pub(super) type Turn = BuiltRevolution;

/// Revolutions that may wait while one is worked at: as many as of a topic.
const TURNS_KEPT: usize = 5;
/// The thread looks this often whether it is to end.
const PATIENCE: Duration = Duration::from_millis(100);
/// ... and updates the diagnostics this often.
const REPORT_PERIOD: Duration = Duration::from_millis(500);
/// The condition in the diagnostics.
const PACKETS: &str = "packets";

/// A listener on the scanner's port.
#[derive(Debug)]
pub(super) struct Network {
    turns: Receiver<Turn>,
    address: SocketAddr,
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

#[derive(Debug, Default)]
struct Shared {
    stop: AtomicBool,
    turns: AtomicU64,
    /// Of these, those that came while as many waited as may.
    left_out: AtomicU64,
}

impl Network {
    pub(super) fn open(
        counters: Counters,
        parameters: &LidarOdometryParameters,
    ) -> Result<Self, NodeFailure> {
        let assembly = RevolutionAssembly::new(parameters.decoder()?, parameters.revolution())?;
        let live = parameters.live()?;
        let source = LiveSource::open(&live)?;
        let address = source.data_address();
        let (sender, turns) = channel(TURNS_KEPT);
        let shared = Arc::new(Shared::default());
        let listener = Listener {
            data_port: address.port(),
            source,
            assembly,
            sender,
            counters,
            shared: Arc::clone(&shared),
            broken_positions: 0,
        };
        listener.report();
        let thread = std::thread::Builder::new()
            .name("lidar packets".to_owned())
            .spawn(move || listener.run())
            .map_err(|error| format!("cannot start the thread that decodes packets: {error}"))?;
        Ok(Self { turns, address, shared, thread: Some(thread) })
    }

    /// The address where packets are expected.
    pub(super) fn address(&self) -> SocketAddr {
        self.address
    }

    pub(super) fn turns(&self) -> u64 {
        self.shared.turns.load(Ordering::Relaxed)
    }

    pub(super) fn left_out(&self) -> u64 {
        self.shared.left_out.load(Ordering::Relaxed)
    }

    pub(super) async fn next(&mut self) -> Turn {
        match self.turns.recv().await {
            Some(turn) => turn,
            // The thread has ended, and has said why.
            None => std::future::pending().await,
        }
    }

    pub(super) fn try_next(&mut self) -> Option<Turn> {
        self.turns.try_recv().ok()
    }
}

impl Drop for Network {
    fn drop(&mut self) {
        self.shared.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // One that panicked has said so.
            let _ = thread.join();
        }
    }
}

struct Listener {
    source: LiveSource,
    data_port: u16,
    assembly: RevolutionAssembly,
    sender: Sender<Turn>,
    counters: Counters,
    shared: Arc<Shared>,
    broken_positions: u64,
}

impl Listener {
    fn run(mut self) {
        let mut summary = Instant::now();
        while !self.shared.stop.load(Ordering::Relaxed) {
            if let Some(datagram) = self.source.next_within(PATIENCE) {
                if datagram.port == self.data_port {
                    let ended = self.assembly.push(&datagram.payload, datagram.arrival);
                    self.hand_on(ended);
                } else if PositionPacket::parse(&datagram.payload).is_err() {
                    self.broken_positions += 1;
                }
            }
            if summary.elapsed() >= REPORT_PERIOD {
                summary = Instant::now();
                self.report();
            }
        }
    }

    /// Parts of a turn are none: the first one.
    fn hand_on(&mut self, ended: Option<Turn>) {
        let Some(turn) = ended.filter(BuiltRevolution::is_whole) else { return };
        self.shared.turns.fetch_add(1, Ordering::Relaxed);
        match self.sender.try_send(turn) {
            Ok(()) => {}
            Err(TrySendError::Full(_)) => {
                self.shared.left_out.fetch_add(1, Ordering::Relaxed);
                self.counters.count_drop("scan dropped, since the node was busy");
            }
            // The node ends.
            Err(TrySendError::Closed(_)) => {}
        }
    }

    fn report(&self) {
        let (text, is_warning) =
            summary(&self.source.counts(), &self.assembly.counts(), self.broken_positions);
        let scanner = self.assembly.scanner();
        let scanner = scanner.map_or_else(
            || "no packet yet".to_owned(),
            |(model, return_mode)| format!("{model}, {return_mode:?}"),
        );
        self.counters.note_condition(PACKETS, &format!("{scanner}: {text}"), is_warning);
    }
}

/// The text about packets, and whether it is a warning.
pub(super) fn summary(
    live: &LiveCounts,
    assembly: &AssemblyCounts,
    broken_positions: u64,
) -> (String, bool) {
    let losses = assembly.losses;
    let mut text = format!("{} decoded", losses.packets);
    let mut is_warning = false;
    for (count, what) in [
        (losses.lost, "missing by the scanner's clock"),
        (losses.out_of_order, "out of order"),
        (losses.clock_jumps, "jumps of the scanner's clock"),
        (assembly.refused, "could not be decoded"),
        (broken_positions, "broken position packets"),
        (live.dropped, "dropped, since the node was busy"),
        (live.failed_reads, "failed readings of a socket"),
    ] {
        if count > 0 {
            text += &format!(", {count} {what}");
            is_warning = true;
        }
    }
    if live.of_others > 0 {
        text += &format!(", {} of other hosts", live.of_others);
    }
    if let Some(refusal) = assembly.last_refusal {
        text += &format!("; {refusal}");
    }
    (text, is_warning)
}
