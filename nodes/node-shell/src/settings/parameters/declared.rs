//! All that is declared of a node's parameters, those of every node included.

use geometry::parameter::{Declaration, Parameters, all_parameters};
use serde::Serialize;
use serde_json::Value;

use super::{AUTOSTART, NodeParameters, ParameterError, Switches};

/// A parameter as it is declared.
#[derive(Clone, PartialEq, Debug)]
pub struct DeclaredParameter {
    /// Its full name, as ROS 2 has it: `frame.points.levels`.
    pub name: String,
    /// Its declaration.
    pub declaration: Declaration,
    /// Its default.
    pub default: Value,
}

/// Every parameter of a node, in the order of their declarations; those of every node come last.
///
/// # Errors
/// When a default cannot be written as a value.
pub fn declared<P: NodeParameters>() -> Result<Vec<DeclaredParameter>, ParameterError> {
    let mut all = declared_of::<P>()?;
    let mut of_every_node = declared_of::<Switches>()?;
    of_every_node.retain(|one| P::IS_MANAGED || one.name != AUTOSTART);
    all.append(&mut of_every_node);
    Ok(all)
}

fn declared_of<P: Parameters + Serialize + Default>()
-> Result<Vec<DeclaredParameter>, ParameterError> {
    let defaults = default_values::<P>()?;
    let with_default = |name: String, declaration| {
        let default = name.split('.').fold(&defaults, |group, part| &group[part]).clone();
        DeclaredParameter { name, declaration, default }
    };
    let all = all_parameters(P::DECLARATIONS).into_iter();
    Ok(all.map(|one| with_default(one.name, one.declaration)).collect())
}

/// The defaults as a tree of values.
pub(super) fn default_values<P: Serialize + Default>() -> Result<Value, ParameterError> {
    serde_json::to_value(P::default())
        .map_err(|error| ParameterError::Defaults { reason: error.to_string() })
}
