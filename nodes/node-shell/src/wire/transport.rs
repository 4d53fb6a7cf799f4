//! The one place for settings of the transport: domain, reach, peers, networks, and the receive buffer
//! with what follows from it.

mod announcement;
mod announcer;
mod backlog;
mod buffer;
mod datagram_filter;
mod environment;
mod health;
mod in_use;
mod interfaces;
mod join;
mod library_threads;
mod listening;
mod multicast_bar;
mod networks;
mod ports;
mod receiving;
mod reception;
mod sockets;

use std::fmt;
use std::net::Ipv4Addr;

pub use announcer::Announcer;
pub use backlog::BacklogWatch;
pub use buffer::{GrantedBuffer, MessageTooLarge, RAISE_RECEIVE_BUFFER};
pub use datagram_filter::DatagramFilter;
pub use environment::TransportError;
pub use health::ReceiveHealth;
pub use in_use::InterfaceInUse;
pub(crate) use interfaces::smallest_mtu_bytes;
pub use join::Joined;
pub(crate) use library_threads::{AtRest, LibraryThreads};
pub(crate) use networks::{NetworkChange, NetworkWatch};

use crate::wire::rmw_zenoh::settings::ZenohSettings;

/// The group that DDS uses for multicast.
const MULTICAST_GROUP: Ipv4Addr = Ipv4Addr::new(239, 255, 0, 1);

/// The receive buffer that is requested of a socket. A sample is sent as one unpaced burst, so this is the size of the
/// largest message: a cloud of 307,200 points has 4.9 to 9.8 MB.
pub(crate) const WANTED_RECEIVE_BUFFER: usize = 32 << 20;

/// The least and the most that a socket can be asked to buffer: one datagram of 64 kB, and what the
/// kernel's `int` holds when doubled.
const RECEIVE_BUFFER_BYTES: std::ops::RangeInclusive<usize> = 64 << 10..=(1 << 30) - 1024;

/// How far a node looks for others by itself, as `ROS_AUTOMATIC_DISCOVERY_RANGE` sets it. Static peers
/// come on top.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum DiscoveryRange {
    /// As far as multicast goes.
    #[default]
    Subnet,
    /// This machine.
    Localhost,
    /// Nowhere, and static peers are not looked for either.
    Off,
}

/// One more place to look for others, as `ROS_STATIC_PEERS` lists them.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum StaticPeer {
    /// The machine with this address.
    Address(Ipv4Addr),
    /// The machine of this name.
    Host(String),
}

/// How a node reaches others.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Transport {
    domain_id: u16,
    range: DiscoveryRange,
    static_peers: Vec<StaticPeer>,
    interfaces: Vec<String>,
    receive_buffer: usize,
    /// Set where it is Zenoh and no DDS.
    zenoh: Option<ZenohSettings>,
}

impl Transport {
    /// The settings of the environment: `ROS_DOMAIN_ID`, `ROS_LOCALHOST_ONLY`,
    /// `ROS_AUTOMATIC_DISCOVERY_RANGE` and `ROS_STATIC_PEERS` as in ROS 2;
    /// `STILLMAP_INTERFACES` (names or addresses of the network interfaces to use, separated by
    /// commas) and `STILLMAP_RECEIVE_BUFFER_KIB` (the receive buffer requested of a socket). With `RMW_IMPLEMENTATION=rmw_zenoh_cpp` it
    /// is Zenoh, by `ZENOH_SESSION_CONFIG_URI`, `ZENOH_CONFIG_OVERRIDE` and `ZENOH_ROUTER_CHECK_ATTEMPTS` as in ROS 2.
    ///
    /// # Errors
    /// When one of them has a value that is not understood.
    pub fn from_environment() -> Result<Self, TransportError> {
        environment::read(|name| std::env::var(name).ok())
    }

    /// All networks, on a domain; `None` above 232.
    #[must_use]
    pub fn on_domain(domain_id: u16) -> Option<Self> {
        (domain_id <= ports::HIGHEST_DOMAIN).then(|| Self::in_domain(domain_id))
    }

    fn in_domain(domain_id: u16) -> Self {
        Self {
            domain_id,
            range: DiscoveryRange::default(),
            static_peers: Vec::new(),
            interfaces: Vec::new(),
            receive_buffer: WANTED_RECEIVE_BUFFER,
            zenoh: None,
        }
    }

    /// The same, for processes of this machine alone. Such a node is invisible to a Cyclone DDS at
    /// its defaults, and does not hear itself.
    #[must_use]
    pub fn loopback_only(self) -> Self {
        self.with_range(DiscoveryRange::Localhost)
    }

    /// The same, looking for others in this range.
    #[must_use]
    pub fn with_range(self, range: DiscoveryRange) -> Self {
        Self { range, ..self }
    }

    /// The same, looking for others on these machines too: IPv4 addresses or host names. Such a node is
    /// sent to directly, never by multicast, which networks with static peers often do not carry. With
    /// [`DiscoveryRange::Localhost`] it does not announce itself by multicast either.
    ///
    /// # Errors
    /// When one of them is neither.
    pub fn with_static_peers<'a>(
        self,
        peers: impl IntoIterator<Item = &'a str>,
    ) -> Result<Self, TransportError> {
        let static_peers = environment::static_peers(peers)?;
        Ok(Self { static_peers, ..self })
    }

    /// The same, on these network interfaces and the loopback; given by their names or addresses. None
    /// means all. Whether they are there is looked at when the transport is used.
    #[must_use]
    pub fn with_interfaces<'a>(self, interfaces: impl IntoIterator<Item = &'a str>) -> Self {
        Self { interfaces: interfaces.into_iter().map(str::to_owned).collect(), ..self }
    }

    /// The same, with sockets that are asked to buffer this many bytes; from 64 KiB to 1 GiB.
    #[must_use]
    pub fn with_receive_buffer(self, bytes: usize) -> Self {
        let receive_buffer =
            bytes.clamp(*RECEIVE_BUFFER_BYTES.start(), *RECEIVE_BUFFER_BYTES.end());
        Self { receive_buffer, ..self }
    }

    /// The settings of Zenoh, where it takes the place of DDS.
    #[cfg(feature = "zenoh")]
    pub(crate) fn zenoh(&self) -> Option<&ZenohSettings> {
        self.zenoh.as_ref()
    }

    /// The same domain on Zenoh.
    #[cfg(all(test, feature = "zenoh"))]
    pub(crate) fn over_zenoh(self, settings: ZenohSettings) -> Self {
        Self { zenoh: Some(settings), ..self }
    }

    /// Whether Zenoh takes the place of DDS. The domain is kept there too; the rest has no meaning.
    #[must_use]
    pub fn is_zenoh(&self) -> bool {
        self.zenoh.is_some()
    }

    /// The domain.
    #[must_use]
    pub fn domain_id(&self) -> u16 {
        self.domain_id
    }

    /// How far others are looked for.
    #[must_use]
    pub fn range(&self) -> DiscoveryRange {
        self.range
    }
}

impl fmt::Display for Transport {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.is_zenoh() {
            return write!(formatter, "domain {}, Zenoh", self.domain_id);
        }
        let reach = match self.range {
            DiscoveryRange::Subnet => "all networks",
            DiscoveryRange::Localhost => "this machine only",
            DiscoveryRange::Off => "no other process",
        };
        write!(formatter, "domain {}, {reach}", self.domain_id)?;
        if self.range != DiscoveryRange::Off && !self.static_peers.is_empty() {
            let peers: Vec<_> = self.static_peers.iter().map(ToString::to_string).collect();
            write!(formatter, " and static peers {}", peers.join(", "))?;
        }
        if !self.interfaces.is_empty() {
            write!(formatter, ", interfaces {}", self.interfaces.join(", "))?;
        }
        Ok(())
    }
}

impl fmt::Display for StaticPeer {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Address(address) => address.fmt(formatter),
            Self::Host(name) => formatter.write_str(name),
        }
    }
}

#[cfg(test)]
mod tests;
