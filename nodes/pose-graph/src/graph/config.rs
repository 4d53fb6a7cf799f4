//! The parameters of the optimisation of a graph.

use serde::{Deserialize, Serialize};

/// Parameters of [`optimise`](super::optimise).
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GraphConfig {
    /// A doubtful edge that raises the sum of squared errors by more than this, when it is used too, is wrong.
    pub max_rise_chi2: f64,
    /// Steps with one set of edges, at most.
    pub iterations: usize,
}

impl Default for GraphConfig {
    fn default() -> Self {
        Self {
            // The quantile 0.999 for six numbers, of which one right edge in a thousand exceeds it.
            max_rise_chi2: 22.46,
            // ORB-SLAM2 takes 20 for its essential graph.
            iterations: 20,
        }
    }
}

/// A parameter has a value that means nothing.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
#[error("{name} must be {accepted}, not {value}")]
pub struct ConfigError {
    /// The parameter.
    pub name: &'static str,
    /// What it may be.
    pub accepted: &'static str,
    /// What it is.
    pub value: f64,
}

impl GraphConfig {
    /// Checks every parameter.
    ///
    /// # Errors
    /// The first parameter out of its range, with its name, its value and what is accepted.
    pub fn validate(&self) -> Result<(), ConfigError> {
        let unless = |holds: bool, name, accepted, value| {
            if holds { Ok(()) } else { Err(ConfigError { name, accepted, value }) }
        };
        let chi2 = self.max_rise_chi2;
        unless(chi2.is_finite() && chi2 > 0.0, "max_rise_chi2", "a positive number", chi2)?;
        unless(self.iterations > 0, "iterations", "at least 1", self.iterations as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_are_valid_and_bad_values_are_named() {
        let valid = GraphConfig::default();
        assert_eq!(valid.validate(), Ok(()));
        for (name, config) in [
            ("max_rise_chi2", GraphConfig { max_rise_chi2: f64::NAN, ..valid }),
            ("max_rise_chi2", GraphConfig { max_rise_chi2: f64::INFINITY, ..valid }),
            ("max_rise_chi2", GraphConfig { max_rise_chi2: 0.0, ..valid }),
            ("iterations", GraphConfig { iterations: 0, ..valid }),
        ] {
            assert!(config.validate().unwrap_err().to_string().starts_with(name));
        }
    }
}
