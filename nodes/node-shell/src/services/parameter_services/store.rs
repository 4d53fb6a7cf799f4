//! The parameters of a running node: what they are, and how they change.

use std::collections::{BTreeMap, BTreeSet};

use msgs::rcl_interfaces::{
    ListParametersRequest, ListParametersResult, Parameter, ParameterDescriptor, ParameterType,
    ParameterValue,
};
use serde_json::Value;

use super::descriptor::descriptors;
use super::value;
use crate::settings::parameters::{
    AUTOSTART, NodeParameters, Overlay, ParameterError, Switches, USE_SIM_TIME, ValueOrigin,
};

/// The separator of the parts of a name.
const SEPARATOR: char = '.';

pub(super) struct Store<P> {
    overlay: Overlay<P>,
    /// The parameters of every node.
    switches: BTreeMap<&'static str, Value>,
    descriptors: BTreeMap<String, ParameterDescriptor>,
}

impl<P: NodeParameters> Store<P> {
    /// # Errors
    /// When the struct cannot be written as parameters.
    pub(super) fn new(parameters: &P, switches: Switches) -> Result<Self, ParameterError> {
        Ok(Self {
            overlay: Overlay::of(parameters.clone())?,
            switches: BTreeMap::from([
                (USE_SIM_TIME, Value::Bool(switches.use_sim_time)),
                (AUTOSTART, Value::Bool(switches.autostart)),
            ]),
            descriptors: descriptors::<P>()?,
        })
    }

    /// The parameters as the node's struct.
    pub(super) fn parameters(&self) -> &P {
        self.overlay.parameters()
    }

    /// Whether the node has parameters besides those of every node.
    pub(super) fn has_own(&self) -> bool {
        self.descriptors.keys().any(|name| !self.switches.contains_key(name.as_str()))
    }

    /// Every parameter.
    pub(super) fn all(&self) -> Vec<Parameter> {
        self.descriptors.keys().map(|name| self.parameter(name)).collect()
    }

    /// Every parameter with its value, in a line.
    pub(super) fn line(&self) -> String {
        let one = |name: &String| format!("{name}: {}", self.value(name).unwrap_or(&Value::Null));
        self.descriptors.keys().map(one).collect::<Vec<_>>().join(", ")
    }

    /// The descriptor of each parameter; one that the node does not have is not set.
    pub(super) fn describe(&self, names: &[String]) -> Vec<ParameterDescriptor> {
        let unknown =
            |name: &String| ParameterDescriptor { name: name.clone(), ..Default::default() };
        names
            .iter()
            .map(|name| self.descriptors.get(name).cloned().unwrap_or_else(|| unknown(name)))
            .collect()
    }

    /// The value of each parameter; one that the node does not have is not set.
    pub(super) fn values(&self, names: &[String]) -> Vec<ParameterValue> {
        names.iter().map(|name| self.parameter(name).value).collect()
    }

    /// The type of each parameter; one that the node does not have is not set.
    pub(super) fn types(&self, names: &[String]) -> Vec<u8> {
        names.iter().map(|name| self.kind(name)).collect()
    }

    /// The names below the prefixes that are no deeper than requested, and the groups that they are in.
    pub(super) fn list(&self, request: &ListParametersRequest) -> ListParametersResult {
        let is_near = |rest: &str| {
            let depth = rest.matches(SEPARATOR).count() as u64;
            request.depth == ListParametersRequest::DEPTH_RECURSIVE || depth < request.depth
        };
        let is_asked_for = |name: &str| {
            let below = |prefix: &String| {
                let rest = name.strip_prefix(prefix.as_str())?;
                if rest.is_empty() { Some(rest) } else { rest.strip_prefix(SEPARATOR) }
            };
            if request.prefixes.is_empty() {
                return is_near(name);
            }
            request.prefixes.iter().filter_map(below).any(is_near)
        };
        let names: Vec<String> =
            self.descriptors.keys().filter(|name| is_asked_for(name)).cloned().collect();
        let groups: BTreeSet<&str> =
            names.iter().filter_map(|name| Some(name.rsplit_once(SEPARATOR)?.0)).collect();
        let prefixes = groups.into_iter().map(str::to_owned).collect();
        ListParametersResult { names, prefixes }
    }

    /// Sets parameters, all or none; returns them with the values that they now have.
    ///
    /// # Errors
    /// With the reason, for people.
    pub(super) fn set(&mut self, wanted: &[Parameter]) -> Result<Vec<Parameter>, String> {
        let mut candidate = self.overlay.clone();
        for Parameter { name, value } in wanted {
            let Some(descriptor) = self.descriptors.get(name) else {
                return Err(candidate.unknown(name, ValueOrigin::Service).to_string());
            };
            if descriptor.read_only {
                return Err(format!(
                    "parameter `{name}` cannot change while the node runs; give it at the start, with -p or in a \
                     parameter file"
                ));
            }
            let value = value::of_message(value)
                .map_err(|reason| format!("parameter `{name}`: {reason}"))?;
            candidate.set(name, value, ValueOrigin::Service).map_err(|error| error.to_string())?;
        }
        candidate.parameters().validate_node().map_err(|error| error.to_string())?;
        self.overlay = candidate;
        Ok(wanted.iter().map(|one| self.parameter(&one.name)).collect())
    }

    fn parameter(&self, name: &str) -> Parameter {
        let value = self.value(name).unwrap_or(&Value::Null);
        Parameter { name: name.to_owned(), value: value::to_message(value, self.kind(name)) }
    }

    fn kind(&self, name: &str) -> u8 {
        match (self.descriptors.get(name), self.value(name)) {
            (Some(descriptor), Some(value)) if descriptor.dynamic_typing => value::type_of(value),
            (Some(descriptor), _) => descriptor.r#type,
            (None, _) => ParameterType::PARAMETER_NOT_SET,
        }
    }

    fn value(&self, name: &str) -> Option<&Value> {
        self.switches.get(name).or_else(|| self.overlay.value(name))
    }
}
