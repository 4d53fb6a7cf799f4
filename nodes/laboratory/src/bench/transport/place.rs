//! The DDS domain and namespace of a run, which separate it from other runs and from other
//! programs on the machine.

use std::process::{Command, Stdio};

use super::case::Mode;
use robot::Failure;
use robot::Process;

/// The domains of runs: above 0, which robots use, and those of the tests (`free_domain::FreeDomain`), and below those
/// whose ports overlap with the ephemeral ports of Linux.
const DOMAINS: std::ops::Range<u32> = 71..101;

/// A domain and a namespace.
#[derive(Clone, Debug)]
pub(super) struct Place {
    pub(super) domain: u32,
    pub(super) mode: Mode,
    namespace: String,
    buffer_kib: Option<u32>,
}

impl Place {
    /// Those of the run with this number.
    pub(super) fn new(run: u32, mode: Mode, buffer_kib: Option<u32>) -> Self {
        let process = std::process::id();
        let domain =
            DOMAINS.start + process.wrapping_mul(13).wrapping_add(run) % DOMAINS.len() as u32;
        Self { domain, mode, namespace: format!("/bench_{process}_{run}"), buffer_kib }
    }

    /// Starts an end: `stillmap bench` with `arguments`, its stdout and stderr as pipes.
    pub(super) fn start(&self, name: &str, arguments: &[String]) -> Result<Process, Failure> {
        let mut command = Process::this_program(name)?;
        command.arg("bench").args(arguments);
        let namespace = format!("__ns:={}", self.namespace);
        let diagnostics = format!("/diagnostics:={}/diagnostics", self.namespace);
        command.args(["--ros-args", "-r", &namespace, "-r", &diagnostics, "--log-level", "error"]);
        self.set_environment(&mut command);
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        Process::spawn(name, command)
    }

    fn set_environment(&self, command: &mut Command) {
        let range = match self.mode {
            Mode::AllNetworks => "SUBNET",
            Mode::Localhost | Mode::Composed => "LOCALHOST",
        };
        command
            .env("ROS_DOMAIN_ID", self.domain.to_string())
            .env("ROS_AUTOMATIC_DISCOVERY_RANGE", range)
            // It would take precedence over the discovery range.
            .env_remove("ROS_LOCALHOST_ONLY")
            .env_remove("ROS_STATIC_PEERS");
        if let Some(kib) = self.buffer_kib {
            command.env("STILLMAP_RECEIVE_BUFFER_KIB", kib.to_string());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_do_not_meet() {
        let runs = 0..DOMAINS.len() as u32;
        let places: Vec<_> = runs.map(|run| Place::new(run, Mode::Localhost, None)).collect();
        for (at, place) in places.iter().enumerate() {
            assert!(DOMAINS.contains(&place.domain));
            let meets =
                |other: &Place| other.domain == place.domain || other.namespace == place.namespace;
            assert!(!places[..at].iter().any(meets));
        }
    }
}
