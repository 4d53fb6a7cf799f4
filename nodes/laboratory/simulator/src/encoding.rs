//! How drivers write what was measured, and what was not.

use serde::{Deserialize, Serialize};

/// The value of a beam, or of a pixel in metres, where nothing was measured.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum NoReturn {
    /// `+Inf`: nothing within reach (REP-117); of simulators, too.
    Inf,
    /// NaN: no measurement.
    Nan,
    /// 0: of drivers older than REP-117.
    Zero,
}

impl NoReturn {
    /// The value in a message.
    #[must_use]
    pub fn value(self) -> f32 {
        match self {
            Self::Inf => f32::INFINITY,
            Self::Nan => f32::NAN,
            Self::Zero => 0.0,
        }
    }
}

/// The encoding of a depth image.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub enum DepthEncoding {
    /// Millimetres in 16 bits, 0 where nothing was measured.
    #[serde(rename = "16UC1")]
    Millimetres,
    /// Metres in 32 bits.
    #[serde(rename = "32FC1")]
    Metres,
}
