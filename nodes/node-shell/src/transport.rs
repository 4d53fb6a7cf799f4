//! The one place for settings of the transport: domain, network, and the receive buffer with what
//! follows from it.

use std::fmt;
use std::net::Ipv4Addr;

use rustdds::{DomainParticipant, DomainParticipantBuilder};
use socket2::{Domain, Protocol, Socket, Type};

/// What a socket is asked to buffer. A sample is sent as one unpaced burst, so this is the size of the
/// largest message: a cloud of 307,200 points has 4.9 to 9.8 MB.
const WANTED_RECEIVE_BUFFER: usize = 32 << 20;

/// How much larger than its receive buffer a message may be over the loopback, whose datagrams hold
/// 64 kB and therefore waste less of the buffer than those of 1.4 kB (measured).
const LOOPBACK_GAIN: f64 = 1.9;

/// What lets the kernel grant the receive buffer that is asked for.
pub const RAISE_RECEIVE_BUFFER: &str = "sudo sysctl -w net.core.rmem_max=33554432";

/// The highest domain for which every port number that DDS derives fits in 16 bits.
const HIGHEST_DOMAIN: u16 = 232;

/// How a node reaches others.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Transport {
    domain_id: u16,
    loopback_only: bool,
}

/// The environment asks for something that cannot be had.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[error("{variable}={value}: accepted is {accepted}")]
pub struct TransportError {
    /// The variable of the environment.
    pub variable: &'static str,
    /// Its value.
    pub value: String,
    /// What is accepted.
    pub accepted: &'static str,
}

impl Transport {
    /// What `ROS_DOMAIN_ID`, `ROS_LOCALHOST_ONLY` and `ROS_AUTOMATIC_DISCOVERY_RANGE` say.
    ///
    /// # Errors
    /// When one of them has a value that is not understood.
    pub fn from_environment() -> Result<Self, TransportError> {
        Self::from_variables(|name| std::env::var(name).ok())
    }

    /// All networks, on a domain; `None` above 232.
    #[must_use]
    pub fn on_domain(domain_id: u16) -> Option<Self> {
        (domain_id <= HIGHEST_DOMAIN).then_some(Self { domain_id, loopback_only: false })
    }

    /// The same, for processes of this machine alone. Such a node is invisible to a Cyclone DDS at
    /// its defaults, and does not hear itself.
    #[must_use]
    pub fn loopback_only(self) -> Self {
        Self { loopback_only: true, ..self }
    }

    /// The DDS domain.
    #[must_use]
    pub fn domain_id(&self) -> u16 {
        self.domain_id
    }

    fn from_variables(
        variable: impl Fn(&'static str) -> Option<String>,
    ) -> Result<Self, TransportError> {
        let read = |name| variable(name).filter(|value| !value.is_empty());
        let domain_id = match read("ROS_DOMAIN_ID") {
            None => 0,
            Some(value) => match value.trim().parse() {
                Ok(domain_id) if domain_id <= HIGHEST_DOMAIN => domain_id,
                _ => {
                    let accepted = "a whole number from 0 to 232";
                    return Err(TransportError { variable: "ROS_DOMAIN_ID", value, accepted });
                }
            },
        };
        let loopback_only = match read("ROS_LOCALHOST_ONLY").as_deref() {
            Some("1") => true,
            None | Some("0") => match read("ROS_AUTOMATIC_DISCOVERY_RANGE").as_deref() {
                None | Some("SUBNET" | "SYSTEM_DEFAULT") => false,
                Some("LOCALHOST") => true,
                Some(value) => {
                    return Err(TransportError {
                        variable: "ROS_AUTOMATIC_DISCOVERY_RANGE",
                        value: value.to_owned(),
                        accepted: "SUBNET or LOCALHOST",
                    });
                }
            },
            Some(value) => {
                return Err(TransportError {
                    variable: "ROS_LOCALHOST_ONLY",
                    value: value.to_owned(),
                    accepted: "0 or 1",
                });
            }
        };
        Ok(Self { domain_id, loopback_only })
    }

    pub(crate) fn participant(&self) -> Result<DomainParticipant, rustdds::dds::CreateError> {
        let builder = DomainParticipantBuilder::new(self.domain_id)
            .socket_receive_buffer_size(WANTED_RECEIVE_BUFFER);
        if self.loopback_only {
            builder.with_only_networks([Ipv4Addr::LOCALHOST]).build()
        } else {
            builder.build()
        }
    }

    /// What the kernel grants a socket that asks for what this suite asks for.
    pub(crate) fn granted_buffer(&self) -> GrantedBuffer {
        let granted = read_back(WANTED_RECEIVE_BUFFER).unwrap_or_else(|error| {
            tracing::warn!("the receive buffer of a socket could not be read back: {error}");
            0
        });
        GrantedBuffer { bytes: granted, loopback_only: self.loopback_only }
    }
}

impl fmt::Display for Transport {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let reach = if self.loopback_only { "this machine only" } else { "all networks" };
        write!(formatter, "domain {}, {reach}", self.domain_id)
    }
}

/// Asks a socket for a buffer and reads back what it got: the kernel clamps in silence.
fn read_back(wanted: usize) -> std::io::Result<usize> {
    let socket = Socket::new(Domain::IPV4, Type::DGRAM, Some(Protocol::UDP))?;
    // macOS refuses what it does not grant, where Linux clamps: then the default stands.
    let _ = socket.set_recv_buffer_size(wanted);
    let reported = socket.recv_buffer_size()?;
    // Linux reports the double, for its bookkeeping.
    Ok(if cfg!(target_os = "linux") { reported / 2 } else { reported })
}

/// The receive buffer that the kernel grants, and so what size of message arrives whole.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct GrantedBuffer {
    bytes: usize,
    loopback_only: bool,
}

impl GrantedBuffer {
    /// The buffer.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.bytes
    }

    /// The size up to which messages arrive whole. Above it some arrive, the fewer the larger.
    #[must_use]
    pub fn largest_safe_message(&self) -> usize {
        if self.loopback_only { (self.bytes as f64 * LOOPBACK_GAIN) as usize } else { self.bytes }
    }

    /// Whether a message of `bytes` arrives whole.
    ///
    /// # Errors
    /// When it does not; the error says how to mend that.
    pub fn check(&self, topic: &str, bytes: usize) -> Result<(), MessageTooLarge> {
        if bytes <= self.largest_safe_message() {
            return Ok(());
        }
        Err(MessageTooLarge {
            topic: topic.to_owned(),
            bytes,
            largest_safe: self.largest_safe_message(),
        })
    }
}

impl fmt::Display for GrantedBuffer {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let kib = |bytes: usize| bytes / 1024;
        write!(formatter, "{} KiB", kib(self.bytes))?;
        if self.bytes < WANTED_RECEIVE_BUFFER {
            write!(formatter, " of {} KiB asked for", kib(WANTED_RECEIVE_BUFFER))?;
        }
        Ok(())
    }
}

/// A message is larger than what arrives whole.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[error(
    "messages of {} kB on {topic} are larger than the {} kB that the kernel lets a socket receive at \
     once, so most will be lost; raise the limit on this machine: {}",
    bytes / 1000, largest_safe / 1000, RAISE_RECEIVE_BUFFER
)]
pub struct MessageTooLarge {
    /// The topic.
    pub topic: String,
    /// The size of the message.
    pub bytes: usize,
    /// The size up to which messages arrive whole.
    pub largest_safe: usize,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(variables: &[(&str, &str)]) -> Result<Transport, TransportError> {
        Transport::from_variables(|name| {
            variables.iter().find(|(key, _)| *key == name).map(|(_, value)| (*value).to_owned())
        })
    }

    #[test]
    fn the_environment_says_where_to_talk() {
        let expect = |variables: &[(&str, &str)], domain_id, loopback_only| {
            assert_eq!(read(variables).unwrap(), Transport { domain_id, loopback_only });
        };
        expect(&[], 0, false);
        expect(&[("ROS_DOMAIN_ID", "42")], 42, false);
        expect(&[("ROS_DOMAIN_ID", "")], 0, false);
        expect(&[("ROS_LOCALHOST_ONLY", "1")], 0, true);
        expect(&[("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")], 0, true);
        expect(&[("ROS_AUTOMATIC_DISCOVERY_RANGE", "SUBNET")], 0, false);
        expect(
            &[("ROS_LOCALHOST_ONLY", "1"), ("ROS_AUTOMATIC_DISCOVERY_RANGE", "SUBNET")],
            0,
            true,
        );
    }

    #[test]
    fn what_is_not_understood_is_named() {
        for (name, value) in [
            ("ROS_DOMAIN_ID", "233"),
            ("ROS_DOMAIN_ID", "-1"),
            ("ROS_DOMAIN_ID", "a"),
            ("ROS_LOCALHOST_ONLY", "yes"),
            ("ROS_AUTOMATIC_DISCOVERY_RANGE", "OFF"),
        ] {
            let error = read(&[(name, value)]).unwrap_err().to_string();
            assert!(error.starts_with(&format!("{name}={value}: accepted is")), "{error}");
        }
    }

    #[test]
    fn a_message_that_does_not_fit_comes_with_its_mend() {
        let small = GrantedBuffer { bytes: 208 * 1024, loopback_only: false };
        assert!(small.check("/scan", 5_000).is_ok());
        let error = small.check("/depth/image", 614_400).unwrap_err().to_string();
        for part in ["614 kB", "/depth/image", "212 kB", "net.core.rmem_max=33554432"] {
            assert!(error.contains(part), "{error}");
        }
        let loopback = GrantedBuffer { bytes: 4 << 20, loopback_only: true };
        assert!(loopback.check("/points", 4_915_200).is_ok());
        assert!(loopback.check("/points", 9_830_400).is_err());
    }

    #[test]
    fn the_kernel_grants_no_more_than_was_asked() {
        let granted = read_back(64 << 10).unwrap();
        assert!(granted > 0 && granted <= 64 << 10, "{granted}");
    }
}
