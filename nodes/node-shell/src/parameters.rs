//! Parameters as a typed struct: `P::default()` holds every default there is, a parameter file and the
//! command line lay values over it, and what does not fit is an error that names the key, where it
//! stood and what is accepted.
//!
//! Nested structs are groups: field `edge_m` of field `voxel` is the parameter `voxel.edge_m`, in a
//! file either written so or nested. A field must not hide itself while serialised
//! (`skip_serializing_if`), or it would be unknown.

mod file;
mod overlay;
#[cfg(test)]
mod tests;

use std::fmt;
use std::path::{Path, PathBuf};

use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;

use crate::arguments::ParameterSource;
use crate::names::NodeIdentity;
use overlay::Overlay;

/// The parameter by which ROS 2 switches a node to simulated time.
const USE_SIM_TIME: &str = "use_sim_time";

/// Where a value stood.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum ValueOrigin {
    /// In a parameter file.
    File(PathBuf),
    /// Behind `-p`.
    CommandLine,
}

impl fmt::Display for ValueOrigin {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File(path) => write!(formatter, "in {}", path.display()),
            Self::CommandLine => formatter.write_str("on the command line"),
        }
    }
}

/// A parameter, or a file of them, cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ParameterError {
    /// The file cannot be read.
    #[error("the parameter file {} cannot be read: {source}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The file is no YAML.
    #[error("the parameter file {} is no valid YAML: {reason}", path.display())]
    NotYaml {
        /// The file.
        path: PathBuf,
        /// What the parser says.
        reason: String,
    },
    /// The file is YAML, but no parameter file.
    #[error(
        "the parameter file {}: `{at}` {problem}; accepted is NODE: {{ros__parameters: {{NAME: VALUE}}}}, \
         with /** for every node", path.display()
    )]
    NotParameters {
        /// The file.
        path: PathBuf,
        /// The key where the form breaks.
        at: String,
        /// What is wrong with it.
        problem: &'static str,
    },
    /// The node has no parameter of this name.
    #[error("unknown parameter `{key}` {origin}; {hint}")]
    Unknown {
        /// The parameter.
        key: String,
        /// Where it stood.
        origin: ValueOrigin,
        /// What it may have been meant to be.
        hint: String,
    },
    /// The value does not fit.
    #[error("parameter `{key}` {origin}: {reason}; accepted is {accepted}, not {found}")]
    BadValue {
        /// The parameter.
        key: String,
        /// Where it stood.
        origin: ValueOrigin,
        /// What stood there.
        found: String,
        /// What is accepted.
        accepted: String,
        /// Why it does not fit.
        reason: String,
    },
    /// Simulated time is asked for, which no node of this suite follows.
    #[error(
        "parameter `use_sim_time` {origin}: simulated time is not supported; leave it out, since the \
         nodes take their time from the stamps of the data"
    )]
    SimulatedTime {
        /// Where it stood.
        origin: ValueOrigin,
    },
    /// The struct of defaults cannot be written as parameters; this is a mistake in the program.
    #[error("the defaults of the parameters cannot be written as parameters: {reason}")]
    Defaults {
        /// Why.
        reason: String,
    },
}

/// One `-p name:=value`, for [`load`].
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Assignment {
    /// The parameter, with dots between its parts.
    pub name: String,
    /// The value, in YAML.
    pub value: String,
}

/// The parameters of the node with the full name `node_name` (as `/detection`) out of `files` and then
/// `assignments`, without starting any node.
///
/// # Errors
/// When a file or a value cannot be used; see [`ParameterError`].
pub fn load<P>(
    node_name: &str,
    files: &[impl AsRef<Path>],
    assignments: &[Assignment],
) -> Result<P, ParameterError>
where
    P: Serialize + DeserializeOwned + Default,
{
    let files = files.iter().map(|path| ParameterSource::File(path.as_ref().to_owned()));
    let assignments = assignments.iter().map(|one| ParameterSource::Assignment {
        node: None,
        name: one.name.clone(),
        value: one.value.clone(),
    });
    let sources: Vec<_> = files.chain(assignments).collect();
    let short = node_name.rsplit('/').next().unwrap_or(node_name);
    from_sources(node_name, short, &sources)
}

/// The parameters of `node` out of the sources on its command line.
pub(crate) fn of_node<P>(
    node: &NodeIdentity,
    sources: &[ParameterSource],
) -> Result<P, ParameterError>
where
    P: Serialize + DeserializeOwned + Default,
{
    from_sources(&node.full_name(), node.name(), sources)
}

/// Whether a parameter file has a section for the node with the full name `node_name` (as `/detection`).
///
/// # Errors
/// When the file cannot be read as a parameter file.
pub fn is_for(node_name: &str, file: &Path) -> Result<bool, ParameterError> {
    Ok(!file::parameters_of(file, node_name)?.is_empty())
}

/// Every parameter with its default, in YAML, for a help text.
///
/// # Errors
/// When the struct cannot be written as parameters.
pub fn describe<P>() -> Result<Vec<(String, String)>, ParameterError>
where
    P: Serialize + DeserializeOwned + Default,
{
    Ok(Overlay::<P>::new()?
        .leaves()
        .into_iter()
        .map(|(key, value)| (key, value.to_string()))
        .collect())
}

fn from_sources<P>(
    full_name: &str,
    short_name: &str,
    sources: &[ParameterSource],
) -> Result<P, ParameterError>
where
    P: Serialize + DeserializeOwned + Default,
{
    let mut overlay = Overlay::<P>::new()?;
    let mut set = |key: &str, value: Value, origin: ValueOrigin| {
        if key == USE_SIM_TIME && !overlay.has(USE_SIM_TIME) {
            return refuse_simulated_time(value, origin);
        }
        overlay.set(key, value, origin)
    };
    for source in sources {
        match source {
            ParameterSource::File(path) => {
                let origin = ValueOrigin::File(path.clone());
                for (key, value) in file::parameters_of(path, full_name)? {
                    set(&key, value, origin.clone())?;
                }
            }
            ParameterSource::Text { name, yaml } => {
                let origin = ValueOrigin::File(name.into());
                for (key, value) in file::parameters_in(yaml, name.as_ref(), full_name)? {
                    set(&key, value, origin.clone())?;
                }
            }
            ParameterSource::Assignment { node, name, value } => {
                if node.as_deref().is_some_and(|node| node != short_name) {
                    continue;
                }
                let parsed =
                    serde_saphyr::from_str(value).map_err(|error| bad_yaml(name, value, &error))?;
                set(name, parsed, ValueOrigin::CommandLine)?;
            }
        }
    }
    Ok(overlay.finish())
}

fn refuse_simulated_time(value: Value, origin: ValueOrigin) -> Result<(), ParameterError> {
    match value {
        Value::Bool(false) => Ok(()),
        Value::Bool(true) => Err(ParameterError::SimulatedTime { origin }),
        other => Err(ParameterError::BadValue {
            key: USE_SIM_TIME.to_owned(),
            origin,
            found: other.to_string(),
            accepted: "true or false".to_owned(),
            reason: "it has another type".to_owned(),
        }),
    }
}

fn bad_yaml(name: &str, value: &str, error: &serde_saphyr::Error) -> ParameterError {
    ParameterError::BadValue {
        key: name.to_owned(),
        origin: ValueOrigin::CommandLine,
        found: format!("`{value}`"),
        accepted: "a value in YAML, as 3, 0.5, true, text or [1, 2]".to_owned(),
        reason: error.without_snippet().to_string(),
    }
}
