//! The environment's settings of the transport. The only place of the suite that reads it.

use std::borrow::Cow;
use std::net::Ipv4Addr;

use super::{DiscoveryRange, RECEIVE_BUFFER_BYTES, StaticPeer, Transport, ports};
use crate::wire::rmw_zenoh::settings;

const DOMAIN: &str = "ROS_DOMAIN_ID";
const LOCALHOST_ONLY: &str = "ROS_LOCALHOST_ONLY";
const RANGE: &str = "ROS_AUTOMATIC_DISCOVERY_RANGE";
const STATIC_PEERS: &str = "ROS_STATIC_PEERS";
const RECEIVE_BUFFER: &str = "STILLMAP_RECEIVE_BUFFER_KIB";

/// As many as ROS 2 takes.
const MOST_STATIC_PEERS: usize = 32;

/// The environment, or its substitute, requests something impossible.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[error("{variable}={value}: accepted is {accepted}")]
pub struct TransportError {
    /// The variable of the environment.
    pub variable: &'static str,
    /// Its value.
    pub value: String,
    /// The accepted values.
    pub accepted: Cow<'static, str>,
}

impl TransportError {
    /// Whether another start would fail in the same way. An interface may be there by then.
    pub(crate) fn is_for_good(&self) -> bool {
        self.variable != super::interfaces::VARIABLE
    }

    pub(crate) fn new(variable: &'static str, value: &str, accepted: &'static str) -> Self {
        Self { variable, value: value.to_owned(), accepted: Cow::Borrowed(accepted) }
    }
}

/// Reads the variables.
pub(super) fn read(
    variable: impl Fn(&'static str) -> Option<String>,
) -> Result<Transport, TransportError> {
    let read = |name| variable(name).map(|one| one.trim().to_owned()).filter(|one| !one.is_empty());
    let mut transport = Transport::in_domain(0);
    transport.zenoh = settings::read(read)?;
    if let Some(value) = read(DOMAIN) {
        transport.domain_id =
            value.parse().ok().filter(|domain| *domain <= ports::HIGHEST_DOMAIN).ok_or_else(
                || TransportError::new(DOMAIN, &value, "a whole number from 0 to 232"),
            )?;
    }
    if let Some(value) = read(RANGE) {
        transport.range = match value.to_ascii_uppercase().as_str() {
            // The default of the system is where nothing else is configured.
            "SUBNET" | "SYSTEM_DEFAULT" => DiscoveryRange::Subnet,
            "LOCALHOST" => DiscoveryRange::Localhost,
            "OFF" => DiscoveryRange::Off,
            _ => {
                let accepted = "SUBNET, LOCALHOST, OFF or SYSTEM_DEFAULT";
                return Err(TransportError::new(RANGE, &value, accepted));
            }
        };
    }
    if let Some(value) = read(STATIC_PEERS) {
        transport.static_peers = static_peers(items(&value, ';'))?;
    }
    match read(LOCALHOST_ONLY).as_deref() {
        None | Some("0") => {}
        // It is the older variable, and in ROS 2 it wins over the two newer variables.
        Some("1") => {
            if transport.range != DiscoveryRange::Localhost || !transport.static_peers.is_empty() {
                tracing::debug!("{LOCALHOST_ONLY}=1 wins over {RANGE} and {STATIC_PEERS}");
            }
            transport.range = DiscoveryRange::Localhost;
            transport.static_peers.clear();
        }
        Some(value) => return Err(TransportError::new(LOCALHOST_ONLY, value, "0 or 1")),
    }
    if let Some(value) = read(super::interfaces::VARIABLE) {
        transport.interfaces = items(&value, ',').map(str::to_owned).collect();
    }
    if let Some(value) = read(RECEIVE_BUFFER) {
        let kib: Option<usize> = value.parse().ok().filter(|kib: &usize| {
            kib.checked_mul(1024).is_some_and(|bytes| RECEIVE_BUFFER_BYTES.contains(&bytes))
        });
        let accepted = "a whole number of KiB from 64 to 1048575";
        let kib = kib.ok_or_else(|| TransportError::new(RECEIVE_BUFFER, &value, accepted))?;
        transport.receive_buffer = kib * 1024;
    }
    Ok(transport)
}

/// The peers that the texts name.
pub(super) fn static_peers<'a>(
    texts: impl IntoIterator<Item = &'a str>,
) -> Result<Vec<StaticPeer>, TransportError> {
    let texts: Vec<_> = texts.into_iter().collect();
    let peers: Option<Vec<_>> = texts.iter().map(|text| StaticPeer::parse(text)).collect();
    peers.filter(|peers| peers.len() <= MOST_STATIC_PEERS).ok_or_else(|| {
        let accepted = "at most 32 IPv4 addresses or host names, separated by semicolons";
        TransportError::new(STATIC_PEERS, &texts.join(";"), accepted)
    })
}

fn items(value: &str, separator: char) -> impl Iterator<Item = &str> {
    value.split(separator).map(str::trim).filter(|item| !item.is_empty())
}

impl StaticPeer {
    /// An IPv4 address or a host name; `None` when the text is neither.
    #[must_use]
    pub fn parse(text: &str) -> Option<Self> {
        if let Ok(address) = text.parse::<Ipv4Addr>() {
            let reachable = !address.is_unspecified() && !address.is_multicast();
            return reachable.then_some(Self::Address(address));
        }
        // What looks like an address is no name: 10.0.0.256 is a mistake, not a host.
        let has_letter = text.chars().any(|one| one.is_ascii_alphabetic());
        let label = |label: &str| {
            (1..=63).contains(&label.len())
                && label.chars().all(|one| one.is_ascii_alphanumeric() || one == '-' || one == '_')
        };
        let is_name = has_letter && text.len() <= 253 && text.split('.').all(label);
        is_name.then(|| Self::Host(text.to_owned()))
    }
}

#[cfg(test)]
mod tests;
