//! The cases: every payload at every rate, with either reliability, in every mode.

use std::fmt;

use clap::ValueEnum;
use serde::Serialize;

/// Payloads in megabytes: a 3D scan, a depth image (640 x 480 x 2 bytes), a colour image, and clouds
/// of 307,200 points with 16 and with 32 bytes each.
pub(super) const PAYLOADS_MB: [f64; 5] = [0.1, 0.6, 1.0, 4.9, 9.8];
/// A scanner's rate, a slow camera's, a Kinect's.
pub(super) const RATES_HZ: [f64; 3] = [7.0, 10.0, 30.0];
/// Bytes of a megabyte (decimal).
const BYTES_PER_MB: f64 = 1e6;

/// How the two ends are connected.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, ValueEnum, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Mode {
    /// Two processes, on all networks of the machine: the default of ROS 2
    AllNetworks,
    /// Two processes, on the loopback alone (ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST)
    Localhost,
    /// Two nodes of one process, as `stillmap up` composes them: nothing is sent
    Composed,
}

impl fmt::Display for Mode {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.pad(match self {
            Self::AllNetworks => "all networks",
            Self::Localhost => "localhost",
            Self::Composed => "composed",
        })
    }
}

/// The reliability.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Reliability {
    BestEffort,
    Reliable,
}

impl fmt::Display for Reliability {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.pad(match self {
            Self::BestEffort => "best effort",
            Self::Reliable => "reliable",
        })
    }
}

/// The measured reliabilities.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub(super) enum ReliabilityChoice {
    /// Best effort: lost messages are not sent again
    BestEffort,
    /// Reliable: lost messages are sent again
    Reliable,
    /// Both, one after the other
    Both,
}

impl ReliabilityChoice {
    fn all(self) -> &'static [Reliability] {
        match self {
            Self::BestEffort => &[Reliability::BestEffort],
            Self::Reliable => &[Reliability::Reliable],
            Self::Both => &[Reliability::BestEffort, Reliability::Reliable],
        }
    }
}

/// One line of the table.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub(super) struct Case {
    pub(super) mode: Mode,
    pub(super) reliability: Reliability,
    pub(super) payload_bytes: u32,
    pub(super) hz: f64,
}

impl Case {
    pub(super) fn payload_mb(&self) -> f64 {
        f64::from(self.payload_bytes) / BYTES_PER_MB
    }
}

impl fmt::Display for Case {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            formatter,
            "{}, {}, {} MB at {} Hz",
            self.mode,
            self.reliability,
            self.payload_mb(),
            self.hz
        )
    }
}

/// All cases, in the order of the table.
pub(super) fn matrix(
    modes: &[Mode],
    reliability: ReliabilityChoice,
    payloads_mb: &[f64],
    rates_hz: &[f64],
) -> Vec<Case> {
    let mut cases = Vec::new();
    for &mode in modes {
        for &reliability in reliability.all() {
            for &payload_mb in payloads_mb {
                for &hz in rates_hz {
                    let payload_bytes = (payload_mb * BYTES_PER_MB).round() as u32;
                    cases.push(Case { mode, reliability, payload_bytes, hz });
                }
            }
        }
    }
    cases
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_matrix_has_every_case_once() {
        let cases = matrix(&[Mode::AllNetworks], ReliabilityChoice::Both, &PAYLOADS_MB, &RATES_HZ);
        assert_eq!(cases.len(), 2 * 5 * 3);
        for (at, case) in cases.iter().enumerate() {
            assert!(!cases[..at].contains(case), "{case}");
        }
        assert_eq!(cases[0].payload_bytes, 100_000);
        assert_eq!(cases[29].payload_bytes, 9_800_000);
        assert_eq!(cases[29].to_string(), "all networks, reliable, 9.8 MB at 30 Hz");
    }
}
