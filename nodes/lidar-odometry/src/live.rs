//! The datagrams of a scanner as they arrive. Behind the feature `io`.

use std::io;
use std::net::{IpAddr, Ipv4Addr, SocketAddr, UdpSocket};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::thread::JoinHandle;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use geometry::Stamp;
use serde::{Deserialize, Serialize};
use socket2::{Domain, Protocol, Socket, Type};

use crate::capture::Datagram;
use crate::packets::{DATA_PORT, PACKET_BYTES, POSITION_PORT};

/// Where to listen.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LiveConfig {
    /// The local address; all of them by default.
    pub address: IpAddr,
    /// The port of data packets; 0 takes a free one.
    pub data_port: u16,
    /// The port of position packets; not listened on where there is none.
    pub position_port: Option<u16>,
    /// Only datagrams of this host are accepted; of every host where there is none.
    pub scanner: Option<IpAddr>,
    /// The receive buffer that is requested for each port.
    pub receive_buffer_bytes: usize,
    /// Datagrams that wait for their reader; more are dropped and counted.
    pub queue_datagrams: usize,
}

impl Default for LiveConfig {
    fn default() -> Self {
        Self {
            address: IpAddr::V4(Ipv4Addr::UNSPECIFIED),
            data_port: DATA_PORT,
            position_port: Some(POSITION_PORT),
            scanner: None,
            // A second of an HDL-64E: 3472 packets of 1206 bytes.
            receive_buffer_bytes: 3472 * PACKET_BYTES,
            // Two seconds of it.
            queue_datagrams: 2 * 3472,
        }
    }
}

/// Counts of the datagrams that arrived and that were lost.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize)]
pub struct LiveCounts {
    /// Datagrams of the scanner.
    pub received: u64,
    /// Those of them that were dropped because they were not read in time.
    pub dropped: u64,
    /// Datagrams of other hosts.
    pub of_others: u64,
    /// Readings of a socket that failed.
    pub failed_reads: u64,
}

/// Why listening fails.
#[derive(Debug, thiserror::Error)]
pub enum LiveError {
    /// The port cannot be had.
    #[error(
        "cannot listen on {address}: {source}; another program may have the port, or the address is not of this host"
    )]
    Listen {
        /// Where it was to be.
        address: SocketAddr,
        /// The system's error.
        source: io::Error,
    },
    /// The thread cannot be started.
    #[error("cannot start the thread that listens on port {port}: {source}")]
    Thread {
        /// The port.
        port: u16,
        /// The system's error.
        source: io::Error,
    },
    /// The configuration does not hold.
    #[error("{name} is 0")]
    Zero {
        /// The value that must be larger.
        name: &'static str,
    },
}

/// Listens on the ports of a scanner, each in a thread of its own, until it is dropped.
///
/// Datagrams that the kernel drops because its buffer is full are not counted here: they are missing in the packets' timestamps and
/// azimuths ([`crate::packets::Continuity`]).
#[derive(Debug)]
pub struct LiveSource {
    datagrams: Receiver<Datagram>,
    shared: Arc<Shared>,
    listeners: Vec<JoinHandle<()>>,
    data_address: SocketAddr,
}

#[derive(Debug, Default)]
struct Shared {
    stop: AtomicBool,
    received: AtomicU64,
    dropped: AtomicU64,
    of_others: AtomicU64,
    failed_reads: AtomicU64,
}

/// A listener looks this often whether it is to end.
const LOOK_EVERY: Duration = Duration::from_millis(100);
/// After a reading that failed a listener rests, so that a broken socket takes no processor.
const REST: Duration = Duration::from_millis(10);
/// The longest datagram: what is longer than a packet must be seen to be so.
const LONGEST_BYTES: usize = 65_536;

impl LiveSource {
    /// Begins to listen.
    ///
    /// # Errors
    /// When a port cannot be had, or the configuration leaves no room for datagrams.
    pub fn open(config: &LiveConfig) -> Result<Self, LiveError> {
        for (name, value) in [
            ("receive_buffer_bytes", config.receive_buffer_bytes),
            ("queue_datagrams", config.queue_datagrams),
        ] {
            if value == 0 {
                return Err(LiveError::Zero { name });
            }
        }
        let (sender, datagrams) = sync_channel(config.queue_datagrams);
        let data = listen(SocketAddr::new(config.address, config.data_port), config)?;
        let data_address = data.local_addr().map_err(|source| LiveError::Listen {
            address: SocketAddr::new(config.address, config.data_port),
            source,
        })?;
        let mut sockets = vec![data];
        if let Some(port) = config.position_port {
            sockets.push(listen(SocketAddr::new(config.address, port), config)?);
        }
        // From here on dropping it ends the threads.
        let shared = Arc::new(Shared::default());
        let mut source = Self { datagrams, shared, listeners: Vec::new(), data_address };
        for socket in sockets {
            let port = socket.local_addr().map_or(0, |address| address.port());
            let listener = Listener {
                socket,
                port,
                scanner: config.scanner,
                sender: sender.clone(),
                shared: Arc::clone(&source.shared),
            };
            let thread = std::thread::Builder::new().name(format!("lidar port {port}"));
            let handle = thread.spawn(move || listener.run());
            source.listeners.push(handle.map_err(|source| LiveError::Thread { port, source })?);
        }
        Ok(source)
    }

    /// Where data packets are expected.
    #[must_use]
    pub fn data_address(&self) -> SocketAddr {
        self.data_address
    }

    /// The next datagram, in the order of arrival on its port; `None` where none comes within `patience`.
    #[must_use]
    pub fn next_within(&self, patience: Duration) -> Option<Datagram> {
        self.datagrams.recv_timeout(patience).ok()
    }

    /// The counts so far.
    #[must_use]
    pub fn counts(&self) -> LiveCounts {
        let count = |counter: &AtomicU64| counter.load(Ordering::Relaxed);
        LiveCounts {
            received: count(&self.shared.received),
            dropped: count(&self.shared.dropped),
            of_others: count(&self.shared.of_others),
            failed_reads: count(&self.shared.failed_reads),
        }
    }
}

impl Drop for LiveSource {
    fn drop(&mut self) {
        self.shared.stop.store(true, Ordering::Relaxed);
        for listener in self.listeners.drain(..) {
            // One that panicked has said so.
            let _ = listener.join();
        }
    }
}

fn listen(address: SocketAddr, config: &LiveConfig) -> Result<UdpSocket, LiveError> {
    let open = || -> io::Result<UdpSocket> {
        let socket = Socket::new(Domain::for_address(address), Type::DGRAM, Some(Protocol::UDP))?;
        // The kernel gives as much as it is allowed to.
        socket.set_recv_buffer_size(config.receive_buffer_bytes)?;
        socket.set_read_timeout(Some(LOOK_EVERY))?;
        socket.bind(&address.into())?;
        Ok(socket.into())
    };
    open().map_err(|source| LiveError::Listen { address, source })
}

struct Listener {
    socket: UdpSocket,
    port: u16,
    scanner: Option<IpAddr>,
    sender: SyncSender<Datagram>,
    shared: Arc<Shared>,
}

impl Listener {
    fn run(&self) {
        let mut buffer = vec![0; LONGEST_BYTES];
        while !self.shared.stop.load(Ordering::Relaxed) {
            match self.socket.recv_from(&mut buffer) {
                Ok((length, from)) => {
                    let payload = buffer.get(..length).unwrap_or_default().to_vec();
                    self.take(payload, from.ip());
                }
                Err(error) if is_waiting(&error) => {}
                Err(_) => {
                    self.shared.failed_reads.fetch_add(1, Ordering::Relaxed);
                    std::thread::sleep(REST);
                }
            }
        }
    }

    fn take(&self, payload: Vec<u8>, from: IpAddr) {
        if self.scanner.is_some_and(|scanner| scanner != from) {
            self.shared.of_others.fetch_add(1, Ordering::Relaxed);
            return;
        }
        self.shared.received.fetch_add(1, Ordering::Relaxed);
        let datagram = Datagram { arrival: now(), port: self.port, payload };
        match self.sender.try_send(datagram) {
            Ok(()) => {}
            Err(TrySendError::Full(_) | TrySendError::Disconnected(_)) => {
                self.shared.dropped.fetch_add(1, Ordering::Relaxed);
            }
        }
    }
}

/// Whether nothing has come yet.
fn is_waiting(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut | io::ErrorKind::Interrupted
    )
}

fn now() -> Stamp {
    let since_epoch = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    Stamp::from_nanos(i64::try_from(since_epoch.as_nanos()).unwrap_or(i64::MAX))
}

#[cfg(test)]
mod tests;
