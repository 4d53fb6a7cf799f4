//! The arguments that every ROS 2 node takes: `--ros-args ... [--]`.

mod error;
#[cfg(test)]
mod tests;

use std::path::PathBuf;

pub use error::ArgumentError;

use crate::process::failure::NodeFailure;
use crate::process::log::{self, LogDirective, LogLevel, LogOutputs};
use crate::settings::names::{NameError, NodeIdentity, RemapKind, RemapRule};
use crate::settings::parameters::{self, NodeParameters};

/// Where values of parameters come from, in the order of the command line; later ones win.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum ParameterSource {
    /// `--params-file FILE`.
    File(PathBuf),
    /// A parameter file that the program has in itself.
    Text {
        /// Its name in messages.
        name: String,
        /// Its text.
        yaml: String,
    },
    /// `-p [node:]name:=value`.
    Assignment {
        /// The node that it is for; all of the process where it is absent.
        node: Option<String>,
        /// The parameter, with dots between its parts.
        name: String,
        /// The value, in YAML.
        value: String,
    },
}

/// The text on the command line.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct RosArguments {
    /// Remappings of topics and services, in order.
    pub remappings: Vec<RemapRule>,
    /// Sources of parameter values, in order.
    pub parameters: Vec<ParameterSource>,
    /// The log level.
    pub log: Vec<LogDirective>,
    /// The target.
    pub outputs: LogOutputs,
    /// The arguments outside `--ros-args ... --`, for the program itself.
    pub own: Vec<String>,
    /// Arguments that are accepted and without effect here, as given.
    pub without_effect: Vec<String>,
    node_names: Vec<RemapRule>,
    namespaces: Vec<RemapRule>,
}

const REMAPPING: &str = "FROM:=TO, as scan:=/laser/scan or __node:=left_detection";
const ASSIGNMENT: &str = "NAME:=VALUE, as voxel_edge_m:=0.08";
const FILE: &str = "the path of a YAML file";
const LEVEL: &str = "debug, info, warn, error or fatal, or LOGGER:=LEVEL";
const ENCLAVE: &str = "the absolute name of an enclave, as /robot";
const LOG_FILE: &str = "the name of a file";

/// The schemes that say what a remapping is for.
const SCHEMES: [(&str, RemapKind); 2] =
    [("rostopic://", RemapKind::Topic), ("rosservice://", RemapKind::Service)];

impl RosArguments {
    /// Parses the arguments of a program, without the program's own name at their front.
    ///
    /// # Errors
    /// When an argument within `--ros-args` is unknown or malformed.
    pub fn parse<I>(arguments: I) -> Result<Self, ArgumentError>
    where
        I: IntoIterator,
        I::Item: Into<String>,
    {
        let mut parsed = Self {
            remappings: Vec::new(),
            parameters: Vec::new(),
            log: Vec::new(),
            outputs: LogOutputs::default(),
            own: Vec::new(),
            without_effect: Vec::new(),
            node_names: Vec::new(),
            namespaces: Vec::new(),
        };
        let mut arguments = arguments.into_iter().map(Into::into);
        let mut within_ros_args = false;
        while let Some(argument) = arguments.next() {
            if !within_ros_args {
                if argument == "--ros-args" {
                    within_ros_args = true;
                } else {
                    parsed.own.push(argument);
                }
                continue;
            }
            match argument.as_str() {
                "--" => within_ros_args = false,
                "--ros-args" => {}
                _ => parsed.take_option(argument, &mut arguments)?,
            }
        }
        Ok(parsed)
    }

    /// The identity of the node that the program calls `default_name`. As in ROS 2 a rule `node:__ns:=` is for the name that the
    /// node has by then, after `__node`.
    ///
    /// # Errors
    /// When the default name breaks the rules for names.
    pub fn identity(&self, default_name: &str) -> Result<NodeIdentity, NameError> {
        let pick = |rules: &[RemapRule], name: &str, otherwise: &str| {
            rules
                .iter()
                .find(|rule| rule.is_for(name))
                .map_or_else(|| otherwise.to_owned(), |rule| rule.to.clone())
        };
        let name = pick(&self.node_names, default_name, default_name);
        NodeIdentity::new(&pick(&self.namespaces, &name, "/"), &name)
    }

    /// The parameters of the node that the program calls `default_name`: the defaults of `P`, with the values of parameter files and
    /// of the command line applied to them, checked. No node is needed for it: what is wrong is to be said before one starts.
    ///
    /// # Errors
    /// When the name breaks the rules for names, a file or a value cannot be used, or a parameter does not hold.
    pub fn parameters_of<P: NodeParameters>(&self, default_name: &str) -> Result<P, NodeFailure> {
        let identity = self.identity(default_name)?;
        let _within = log::span_of(&identity.logger_name()).entered();
        let parameters: P = parameters::of_node(&identity, &self.parameters)?;
        parameters.validate_node()?;
        Ok(parameters)
    }

    /// The nodes that assignments and remappings name before a `:`.
    pub fn named_nodes(&self) -> impl Iterator<Item = &str> {
        let of_parameters = self.parameters.iter().filter_map(|source| match source {
            ParameterSource::Assignment { node, .. } => node.as_deref(),
            ParameterSource::File(_) | ParameterSource::Text { .. } => None,
        });
        let rules = [&self.remappings, &self.node_names, &self.namespaces].into_iter().flatten();
        of_parameters.chain(rules.filter_map(|rule| rule.node.as_deref()))
    }

    /// Says in the log what was accepted and changes nothing.
    pub fn warn_of_options_without_effect(&self) {
        for argument in &self.without_effect {
            tracing::info!("the ROS argument `{argument}` has no effect here");
        }
    }

    fn take_option(
        &mut self,
        option: String,
        rest: &mut impl Iterator<Item = String>,
    ) -> Result<(), ArgumentError> {
        let mut value = |accepted| match rest.next() {
            Some(value) if value != "--" => Ok(value),
            _ => Err(ArgumentError::NoValue { option: option.clone(), accepted }),
        };
        match option.as_str() {
            "-r" | "--remap" => {
                let value = value(REMAPPING)?;
                self.take_remapping(option, value)
            }
            "-p" | "--param" => {
                let value = value(ASSIGNMENT)?;
                self.take_assignment(option, value)
            }
            "--params-file" => {
                self.parameters.push(ParameterSource::File(PathBuf::from(value(FILE)?)));
                Ok(())
            }
            "--log-level" => {
                let value = value(LEVEL)?;
                self.take_log_level(option, value)
            }
            "-e" | "--enclave" => {
                let path = value(ENCLAVE)?;
                if !path.starts_with('/') {
                    return Err(ArgumentError::BadValue { option, value: path, accepted: ENCLAVE });
                }
                self.without_effect.push(format!("{option} {path}"));
                Ok(())
            }
            "--log-config-file" => {
                let file = value(LOG_FILE)?;
                self.without_effect.push(format!("{option} {file}"));
                Ok(())
            }
            "--log-file-name" => {
                let name = value(LOG_FILE)?;
                // It names a file, not a place.
                if name.is_empty() || name.contains('/') {
                    return Err(ArgumentError::BadValue {
                        option,
                        value: name,
                        accepted: LOG_FILE,
                    });
                }
                self.outputs.file_name = Some(name);
                Ok(())
            }
            "--enable-stdout-logs" | "--disable-stdout-logs" => {
                self.outputs.stderr = option.starts_with("--enable");
                Ok(())
            }
            "--enable-rosout-logs" | "--disable-rosout-logs" => {
                self.outputs.rosout = option.starts_with("--enable");
                Ok(())
            }
            "--enable-external-lib-logs" | "--disable-external-lib-logs" => {
                self.outputs.file = option.starts_with("--enable");
                Ok(())
            }
            _ => Err(ArgumentError::Unknown { argument: option }),
        }
    }

    fn take_remapping(&mut self, option: String, value: String) -> Result<(), ArgumentError> {
        let bad = |value: &str| ArgumentError::BadValue {
            option: option.clone(),
            value: value.to_owned(),
            accepted: REMAPPING,
        };
        let (left, to) = value.split_once(":=").ok_or_else(|| bad(&value))?;
        // rcl has the node before the scheme: `node:rostopic://from:=to`.
        let (node, from) = split_node(left);
        let (kind, from) = split_scheme(from);
        let to = match split_scheme(to) {
            (RemapKind::Any, to) => to,
            (of_target, to) if of_target == kind => to,
            _ => return Err(bad(&value)),
        };
        if to.is_empty() {
            return Err(bad(&value));
        }
        let rule = RemapRule { kind, node, from: from.to_owned(), to: to.to_owned() };
        // Any node will do to check a name's form.
        let probe = |namespace: &str, name: &str| NodeIdentity::new(namespace, name);
        let checked = match from {
            "__node" | "__name" | "__ns" if kind != RemapKind::Any => return Err(bad(&value)),
            "__node" | "__name" => probe("/", to).map(|_| &mut self.node_names),
            "__ns" if to.starts_with('/') => probe(to, "node").map(|_| &mut self.namespaces),
            "__ns" => return Err(bad(&value)),
            _ => probe("/", "node")
                .and_then(|node| node.expand(from).and_then(|_| node.expand(to)))
                .map(|_| &mut self.remappings),
        };
        match checked {
            Ok(rules) => {
                rules.push(rule);
                Ok(())
            }
            Err(source) => Err(ArgumentError::BadName { option, value, source }),
        }
    }

    fn take_assignment(&mut self, option: String, value: String) -> Result<(), ArgumentError> {
        let assignment = value.split_once(":=").and_then(|(left, yaml)| {
            let (node, name) = split_node(left);
            let well_formed = !name.is_empty() && name.split('.').all(|part| !part.is_empty());
            well_formed.then(|| ParameterSource::Assignment {
                node,
                name: name.to_owned(),
                value: yaml.to_owned(),
            })
        });
        match assignment {
            Some(assignment) => {
                self.parameters.push(assignment);
                Ok(())
            }
            None => Err(ArgumentError::BadValue { option, value, accepted: ASSIGNMENT }),
        }
    }

    fn take_log_level(&mut self, option: String, value: String) -> Result<(), ArgumentError> {
        let (logger, level) = match value.split_once(":=") {
            Some((logger, level)) => (Some(logger.to_owned()), level),
            None => (None, value.as_str()),
        };
        let well_formed = logger.as_deref().is_none_or(is_logger);
        match LogLevel::parse(level) {
            Some(level) if well_formed => {
                self.log.push(LogDirective { logger, level });
                Ok(())
            }
            _ => Err(ArgumentError::BadValue { option, value, accepted: LEVEL }),
        }
    }
}

/// Takes the `node:` off the front of `node:name`; a `:` cannot be in a name, but in its scheme.
fn split_node(left: &str) -> (Option<String>, &str) {
    match left.split_once(':') {
        Some((_, rest)) if rest.starts_with("//") => (None, left),
        Some((node, name)) => (Some(node.to_owned()), name),
        None => (None, left),
    }
}

/// Takes the scheme off the front of a name.
fn split_scheme(name: &str) -> (RemapKind, &str) {
    SCHEMES
        .iter()
        .find_map(|(scheme, kind)| Some((*kind, name.strip_prefix(scheme)?)))
        .unwrap_or((RemapKind::Any, name))
}

/// Whether it can be the name of a logger: parts with dots or, as libraries of this suite have it, `::` between them.
fn is_logger(name: &str) -> bool {
    name.replace("::", ".").split('.').all(|part| {
        !part.is_empty() && part.chars().all(|one| one.is_ascii_alphanumeric() || one == '_')
    })
}
