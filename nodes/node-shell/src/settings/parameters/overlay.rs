//! Values that override the defaults, one by one, each checked by itself so that an error names its key.

use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;

use super::{ParameterError, ValueOrigin, nearest_name};

/// A message lists the parameters of a node that has no more than this; what it has to say would be lost among more.
const MAX_LISTED: usize = 20;

/// The parameters so far: as a tree of values, and as the struct of it.
#[derive(Clone)]
pub(crate) struct Overlay<P> {
    defaults: Value,
    tree: Value,
    parameters: P,
}

impl<P> Overlay<P>
where
    P: Serialize + DeserializeOwned + Default,
{
    pub(crate) fn new() -> Result<Self, ParameterError> {
        Self::of(P::default())
    }

    /// Parameters that have values already.
    pub(crate) fn of(parameters: P) -> Result<Self, ParameterError> {
        let tree = |parameters: &P| {
            serde_json::to_value(parameters)
                .map_err(|error| ParameterError::Defaults { reason: error.to_string() })
        };
        let defaults = tree(&P::default())?;
        if !matches!(defaults, Value::Object(_) | Value::Null) {
            return Err(ParameterError::Defaults { reason: "they are no struct".to_owned() });
        }
        Ok(Self { tree: tree(&parameters)?, defaults, parameters })
    }

    /// The parameters as their struct.
    pub(crate) fn parameters(&self) -> &P {
        &self.parameters
    }

    /// The value of a parameter.
    pub(crate) fn value(&self, key: &str) -> Option<&Value> {
        at(&self.tree, key)
    }

    pub(crate) fn finish(self) -> P {
        self.parameters
    }

    /// Whether there is a parameter or a group of this name.
    pub(crate) fn has(&self, key: &str) -> bool {
        self.default_of(key).is_some()
    }

    /// Every parameter with its default.
    pub(crate) fn leaves(&self) -> Vec<(String, &Value)> {
        let mut leaves = Vec::new();
        collect_leaves(&self.defaults, String::new(), &mut leaves);
        leaves
    }

    /// Sets one parameter.
    pub(crate) fn set(
        &mut self,
        key: &str,
        value: Value,
        origin: ValueOrigin,
    ) -> Result<(), ParameterError> {
        let Some(default) = self.default_of(key) else {
            return Err(self.unknown(key, origin));
        };
        let accepted = accepted_form(default);
        let bad = |found: &Value, reason: String| ParameterError::BadValue {
            key: key.to_owned(),
            origin: origin.clone(),
            found: found.to_string(),
            accepted: accepted.clone(),
            reason: reason.into(),
        };
        if default.is_object() {
            let example = self
                .leaves()
                .into_iter()
                .find(|(leaf, _)| leaf.starts_with(&format!("{key}.")))
                .map_or_else(String::new, |(leaf, _)| format!(", as `{leaf}`"));
            return Err(bad(&value, format!("it is a group of parameters{example}")));
        }
        if !same_kind(default, &value) {
            return Err(bad(&value, "it has another type".to_owned()));
        }
        let mut candidate = self.tree.clone();
        let found = value.clone();
        if let Some(place) = at_mut(&mut candidate, key) {
            *place = value;
        }
        let parameters: P = serde_json::from_value(candidate.clone())
            .map_err(|error| bad(&found, error.to_string()))?;
        // A struct that takes a word and has another one for it has renamed it.
        if found.is_string() {
            let renamed =
                serde_json::to_value(&parameters).ok().and_then(|now| at(&now, key).cloned());
            if let Some(now) = renamed.filter(|now| *now != found) {
                tracing::warn!("parameter {key} {origin}: {found} is called {now} now");
                if let Some(place) = at_mut(&mut candidate, key) {
                    *place = now;
                }
            }
        }
        self.parameters = parameters;
        self.tree = candidate;
        Ok(())
    }

    fn default_of(&self, key: &str) -> Option<&Value> {
        at(&self.defaults, key)
    }

    /// The error that the node knows no such parameter.
    pub(crate) fn unknown(&self, key: &str, origin: ValueOrigin) -> ParameterError {
        let known: Vec<String> = self.leaves().into_iter().map(|(leaf, _)| leaf).collect();
        let hint = match nearest_name(key, known.iter().map(String::as_str)) {
            Some(leaf) => format!("did you mean `{leaf}`?"),
            None if known.is_empty() => "this node has no parameters".to_owned(),
            None if known.len() > MAX_LISTED => {
                format!("--help lists the {} that the node has", known.len())
            }
            None => format!("accepted are {}", known.join(", ")),
        };
        ParameterError::Unknown { key: key.to_owned(), origin, hint }
    }
}

fn at<'a>(tree: &'a Value, key: &str) -> Option<&'a Value> {
    key.split('.').try_fold(tree, |group, part| group.as_object()?.get(part))
}

fn at_mut<'a>(tree: &'a mut Value, key: &str) -> Option<&'a mut Value> {
    key.split('.').try_fold(tree, |group, part| group.as_object_mut()?.get_mut(part))
}

fn collect_leaves<'a>(value: &'a Value, key: String, leaves: &mut Vec<(String, &'a Value)>) {
    match value {
        Value::Object(group) => {
            for (name, inner) in group {
                let key = if key.is_empty() { name.clone() } else { format!("{key}.{name}") };
                collect_leaves(inner, key, leaves);
            }
        }
        Value::Null if key.is_empty() => {}
        leaf => leaves.push((key, leaf)),
    }
}

/// Whether a value has the type of the default. A whole number is accepted for a fractional one: no
/// meaning is lost, and ROS 2's insistence on `1.0` only ever costs its users time. A parameter that
/// is absent by default takes what its struct takes.
fn same_kind(default: &Value, value: &Value) -> bool {
    match default {
        Value::Null | Value::Object(_) => true,
        Value::Bool(_) => value.is_boolean(),
        Value::String(_) => value.is_string(),
        Value::Array(_) => value.is_array(),
        Value::Number(number) if number.is_f64() => value.is_number(),
        Value::Number(_) => value.is_i64() || value.is_u64(),
    }
}

fn accepted_form(default: &Value) -> String {
    match default {
        Value::Null => "a value of its type, or null".to_owned(),
        Value::Bool(_) => "true or false".to_owned(),
        Value::Number(number) if number.is_f64() => format!("a number, as {number}"),
        Value::Number(number) => format!("a whole number, as {number}"),
        Value::String(text) => format!("text, as \"{text}\""),
        Value::Array(_) => format!("a list, as {default}"),
        Value::Object(_) => "a value for each of them".to_owned(),
    }
}
