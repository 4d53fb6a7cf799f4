//! Parameters as a typed struct: `P::default()` holds every default there is, a parameter file and the
//! command line override them, and a value that does not fit is an error that names the key, where it
//! was given and what is accepted.
//!
//! Nested structs are groups: field `edge_m` of field `voxel` is the parameter `voxel.edge_m`, in a
//! file either written so or nested. A field must not hide itself while serialised
//! (`skip_serializing_if`), or it would be unknown.
//!
//! A section that names the node has parameters of the node only. One for several nodes, as `/**`, may have those of
//! others: this one ignores them, and lists them in the log.

mod declared;
mod error;
mod file;
mod node_parameters;
mod overlay;
mod spelling;
#[cfg(test)]
mod tests;
mod text;
mod tree;

use std::path::{Path, PathBuf};

use geometry::parameter::{Declaration, Parameters, all_parameters};
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;

use crate::settings::arguments::ParameterSource;
use crate::settings::names::NodeIdentity;
pub use declared::{DeclaredParameter, declared};
pub use error::{ParameterError, ValueOrigin};
use file::OfFile;
pub use node_parameters::{NoParameters, NodeParameters};
pub(crate) use overlay::Overlay;
pub use spelling::{nearest_name, nearest_name_within};
pub(crate) use text::help;
pub use text::{
    SharedParameters, accepted_numbers, meaning, parameter_file, shared_parameter_file, type_name,
};

/// The parameter by which ROS 2 switches a node to simulated time.
pub(crate) const USE_SIM_TIME: &str = "use_sim_time";
/// The parameter by which a managed node waits to be brought up by others, by the name that Nav2 has for it.
pub(crate) const AUTOSTART: &str = "autostart";

geometry::parameters! {
    /// The parameters that every node has.
    #[derive(Clone, Copy, PartialEq, Eq, Debug)]
    pub(crate) struct Switches {
        /// Whether the node goes by the time of /clock.
        use_sim_time: bool = false;
        /// Whether the node is active from its start; else others bring it up by its lifecycle.
        autostart: bool = true;
    }
}

/// What each node of rclcpp has besides, so that launch files set it for all of their nodes. Nothing goes by it here.
const OF_RCLCPP: &str = "start_type_description_service";
/// The same, of the quality of service of single topics.
const OF_RCLCPP_BELOW: &str = "qos_overrides.";

fn is_of_rclcpp(key: &str) -> bool {
    key == OF_RCLCPP || key.starts_with(OF_RCLCPP_BELOW)
}

impl Switches {
    fn of(&mut self, key: &str) -> Option<&mut bool> {
        match key {
            USE_SIM_TIME => Some(&mut self.use_sim_time),
            AUTOSTART => Some(&mut self.autostart),
            _ => None,
        }
    }
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
    P: Parameters + Serialize + DeserializeOwned + Default,
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
    P: Parameters + Serialize + DeserializeOwned + Default,
{
    from_sources(&node.full_name(), node.name(), sources)
}

/// Whether a parameter file has a section for the node with the full name `node_name` (as `/detection`).
///
/// # Errors
/// When the file cannot be read as a parameter file.
pub fn is_for(node_name: &str, file: &Path) -> Result<bool, ParameterError> {
    Ok(!file::parameters_of(file, node_name)?.parameters.is_empty())
}

/// Whether one of these files gives a parameter of the node with the full name `node_name` a value, be it the default.
///
/// # Errors
/// When a file cannot be read as a parameter file.
pub fn is_given(
    node_name: &str,
    files: &[impl AsRef<Path>],
    parameter: &str,
) -> Result<bool, ParameterError> {
    for path in files {
        let of_file = file::parameters_of(path.as_ref(), node_name)?;
        if of_file.parameters.iter().any(|given| given.key == parameter) {
            return Ok(true);
        }
    }
    Ok(false)
}

/// A parameter that a file has for nodes of any name, as in its section `/**`.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct SharedParameter {
    /// The parameter, with dots between its parts.
    pub name: String,
    /// Where its value is, from 1.
    pub line: u64,
}

/// The parameters of a file that are for the node with the full name `node_name` (as `/detection`) and for others as well.
///
/// # Errors
/// When the file cannot be read as a parameter file.
pub fn shared(node_name: &str, file: &Path) -> Result<Vec<SharedParameter>, ParameterError> {
    let of_file = file::parameters_of(file, node_name)?;
    let shared = of_file.parameters.into_iter().filter(|given| !given.names_the_node);
    Ok(shared.map(|given| SharedParameter { name: given.key, line: given.line }).collect())
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
    P: Parameters + Serialize + DeserializeOwned + Default,
{
    let mut overlay = Overlay::<P>::new()?;
    let mut ignored = Vec::new();
    let unused = for_each_value(full_name, short_name, sources, |mut given| {
        if let Some(name) = name_now(P::DECLARATIONS, &given.key) {
            tracing::warn!("parameter {} {}: it is called {name} now", given.key, given.origin);
            given.key = name;
        }
        if overlay.has(&given.key) {
            return overlay.set(&given.key, given.value, given.origin);
        }
        if Switches::default().of(&given.key).is_some() {
            return truth(&given).map(|_| ());
        }
        if is_of_rclcpp(&given.key) {
            tracing::info!("parameter {} {}: it has no effect here", given.key, given.origin);
            return Ok(());
        }
        if given.is_for_it_alone {
            return Err(overlay.unknown(&given.key, given.origin));
        }
        ignored.push(given.key);
        Ok(())
    })?;
    for UnusedFile { path, is_for } in unused {
        tracing::warn!(
            "the parameter file {} has nothing for {full_name}; it is for {is_for}",
            path.display()
        );
    }
    if !ignored.is_empty() {
        tracing::info!(
            "{full_name} has no parameters {}; ignored, since they are in sections for several nodes",
            ignored.join(", ")
        );
    }
    Ok(overlay.finish())
}

/// The name of the parameter that was called so before.
fn name_now(declarations: &[Declaration], former_name: &str) -> Option<String> {
    let mut all = all_parameters(declarations).into_iter();
    all.find(|one| one.declaration.former_name == Some(former_name)).map(|one| one.name)
}

/// The parameters that every node has.
///
/// # Errors
/// When a file or a value cannot be used.
pub(crate) fn switches(
    node: &NodeIdentity,
    sources: &[ParameterSource],
) -> Result<Switches, ParameterError> {
    let mut switches = Switches::default();
    for_each_value(&node.full_name(), node.name(), sources, |given| {
        if let Some(switch) = switches.of(&given.key) {
            *switch = truth(&given)?;
        }
        Ok(())
    })?;
    Ok(switches)
}

/// A value that a source has for the node.
struct Given {
    key: String,
    value: Value,
    origin: ValueOrigin,
    /// Whether it can be for no other node, so that the node must know it.
    is_for_it_alone: bool,
}

/// A file that has nothing for the node.
struct UnusedFile {
    path: PathBuf,
    is_for: String,
}

/// Hands over the values of all sources for the node, in their order. Returns the files that have none.
fn for_each_value(
    full_name: &str,
    short_name: &str,
    sources: &[ParameterSource],
    mut take: impl FnMut(Given) -> Result<(), ParameterError>,
) -> Result<Vec<UnusedFile>, ParameterError> {
    let mut unused = Vec::new();
    for source in sources {
        let (path, OfFile { parameters, is_for_others }) = match source {
            ParameterSource::File(path) => (path.as_path(), file::parameters_of(path, full_name)?),
            ParameterSource::Text { name, yaml } => {
                (Path::new(name), file::parameters_in(yaml, Path::new(name), full_name)?)
            }
            ParameterSource::Assignment { node, name, value } => {
                if node.as_deref().is_none_or(|node| node == short_name) {
                    let parsed = serde_saphyr::from_str(value)
                        .map_err(|error| bad_yaml(name, value, &error))?;
                    take(Given {
                        key: name.clone(),
                        value: parsed,
                        origin: ValueOrigin::CommandLine,
                        is_for_it_alone: true,
                    })?;
                }
                continue;
            }
        };
        // A preset that the program has in itself is not the user's.
        if let (ParameterSource::File(path), Some(is_for)) = (source, is_for_others) {
            unused.push(UnusedFile { path: path.clone(), is_for });
        }
        for parameter in parameters {
            take(Given {
                key: parameter.key,
                value: parameter.value,
                origin: ValueOrigin::File { path: path.into(), line: parameter.line },
                is_for_it_alone: parameter.names_the_node,
            })?;
        }
    }
    Ok(unused)
}

fn truth(given: &Given) -> Result<bool, ParameterError> {
    given.value.as_bool().ok_or_else(|| ParameterError::BadValue {
        key: given.key.clone(),
        origin: given.origin.clone(),
        found: given.value.to_string(),
        accepted: "true or false".to_owned(),
        reason: "it has another type".into(),
    })
}

fn bad_yaml(name: &str, value: &str, error: &serde_saphyr::Error) -> ParameterError {
    ParameterError::BadValue {
        key: name.to_owned(),
        origin: ValueOrigin::CommandLine,
        found: format!("`{value}`"),
        accepted: "a value in YAML, as 3, 0.5, true, text or [1, 2]".to_owned(),
        reason: error.without_snippet().to_string().into(),
    }
}
