//! Names of nodes, topics and types: expanded, remapped and checked here, so that the middleware only
//! ever sees absolute ones (it makes `rt//scan` of the relative name `scan` in the namespace `/`).

#[cfg(test)]
mod tests;

/// The longest topic name that a ROS 2 middleware takes (`rmw_validate_full_topic_name`).
const LONGEST_NAME: usize = 247;

/// A name breaks the rules of ROS 2.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[error("`{name}` is no {kind}: {reason}")]
pub struct NameError {
    /// The name.
    pub name: String,
    /// The kind of name.
    pub kind: &'static str,
    /// What is wrong with it, and what is accepted.
    pub reason: &'static str,
}

/// The identity of a node: its name and its namespace.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct NodeIdentity {
    name: String,
    namespace: String,
}

impl NodeIdentity {
    /// A node `name` in `namespace`; a namespace without its leading `/` is taken from the root, and
    /// an empty one is the root.
    ///
    /// # Errors
    /// When either breaks the rules for names.
    pub fn new(namespace: &str, name: &str) -> Result<Self, NameError> {
        check_token(name, name, "node name")?;
        let namespace = format!("/{}", namespace.strip_prefix('/').unwrap_or(namespace));
        if namespace != "/" {
            check_absolute(&namespace, "namespace")?;
        }
        Ok(Self { name: name.to_owned(), namespace })
    }

    /// The name without the namespace.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The namespace: `/`, or a path that starts with `/` and does not end with it.
    #[must_use]
    pub fn namespace(&self) -> &str {
        &self.namespace
    }

    /// The name with its namespace, as `/robot/detection`.
    #[must_use]
    pub fn full_name(&self) -> String {
        join(&self.namespace, &self.name)
    }

    /// The absolute form of a topic name: relative names are in the namespace, those that start
    /// with `~/` under the node's own name; `{node}`, `{ns}` and `{namespace}` are filled in.
    ///
    /// # Errors
    /// When the name breaks the rules for topic names.
    pub fn expand(&self, name: &str) -> Result<String, NameError> {
        let filled = self.substitute(name)?;
        let absolute = if filled == "~" {
            self.full_name()
        } else if let Some(private) = filled.strip_prefix("~/") {
            join(&self.full_name(), private)
        } else if filled.starts_with('/') {
            filled
        } else {
            join(&self.namespace, &filled)
        };
        check_absolute(&absolute, "topic name")
            .map_err(|error| NameError { name: name.to_owned(), ..error })?;
        Ok(absolute)
    }

    /// The absolute form of a topic name after remapping: the first rule that fits wins.
    ///
    /// # Errors
    /// When the name, or what it is remapped to, breaks the rules for topic names.
    pub fn resolve(&self, rules: &[RemapRule], name: &str) -> Result<String, NameError> {
        self.resolve_as(RemapKind::Topic, rules, name)
    }

    /// The same for the name of a service.
    ///
    /// # Errors
    /// As [`NodeIdentity::resolve`].
    pub fn resolve_service(&self, rules: &[RemapRule], name: &str) -> Result<String, NameError> {
        self.resolve_as(RemapKind::Service, rules, name)
    }

    /// The name of the node's logger in ROS 2: its full name with dots, as `robot.detection`.
    #[must_use]
    pub fn logger_name(&self) -> String {
        self.full_name().trim_start_matches('/').replace('/', ".")
    }

    fn resolve_as(
        &self,
        kind: RemapKind,
        rules: &[RemapRule],
        name: &str,
    ) -> Result<String, NameError> {
        let absolute = self.expand(name)?;
        let fitting = |rule: &&RemapRule| {
            rule.is_for(&self.name) && (rule.kind == RemapKind::Any || rule.kind == kind)
        };
        for rule in rules.iter().filter(fitting) {
            if self.expand(&rule.from)? == absolute {
                return self.expand(&rule.to);
            }
        }
        Ok(absolute)
    }

    fn substitute(&self, name: &str) -> Result<String, NameError> {
        let mut filled = String::with_capacity(name.len());
        let mut rest = name;
        while let Some((before, after)) = rest.split_once('{') {
            let Some((key, tail)) = after.split_once('}') else {
                return Err(NameError {
                    name: name.to_owned(),
                    kind: "topic name",
                    reason: "its curly brace is never closed",
                });
            };
            filled.push_str(before);
            match key {
                "node" => filled.push_str(&self.name),
                "ns" | "namespace" => filled.push_str(self.namespace.trim_start_matches('/')),
                _ => {
                    return Err(NameError {
                        name: name.to_owned(),
                        kind: "topic name",
                        reason: "only {node}, {ns} and {namespace} can be filled in",
                    });
                }
            }
            rest = tail;
        }
        filled.push_str(rest);
        Ok(filled)
    }
}

/// The kind of name that a rule changes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum RemapKind {
    /// Topics and services: `from:=to`.
    Any,
    /// Topics alone: `rostopic://from:=to`.
    Topic,
    /// Services alone: `rosservice://from:=to`.
    Service,
}

/// One `from:=to` of the command line.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct RemapRule {
    /// The kind of name that it changes.
    pub kind: RemapKind,
    /// The node that the rule is for; all of the process where it is absent.
    pub node: Option<String>,
    /// The name of the topic or service in the program.
    pub from: String,
    /// The name to use instead.
    pub to: String,
}

impl RemapRule {
    /// Whether the rule is for the node `name`.
    #[must_use]
    pub fn is_for(&self, name: &str) -> bool {
        self.node.as_deref().is_none_or(|node| node == name)
    }
}

/// The name that a topic has on the wire: `rt/scan` for `/scan`.
#[must_use]
pub(crate) fn dds_topic_name(absolute: &str) -> String {
    format!("rt{absolute}")
}

/// The name that the topic of a service's requests has on the wire: `rq/switchRequest` for `/switch`.
#[must_use]
pub(crate) fn dds_request_topic_name(absolute: &str) -> String {
    format!("rq{absolute}Request")
}

/// The name that the topic of a service's responses has on the wire: `rr/switchReply` for `/switch`.
#[must_use]
pub(crate) fn dds_response_topic_name(absolute: &str) -> String {
    format!("rr{absolute}Reply")
}

/// The name that a type has on the wire: `sensor_msgs::msg::dds_::LaserScan_` for
/// `sensor_msgs/msg/LaserScan`.
///
/// # Errors
/// When the name does not have the form `package/msg/Type`.
pub(crate) fn dds_type_name(type_name: &str) -> Result<String, NameError> {
    let mut parts = type_name.split('/');
    match (parts.next(), parts.next(), parts.next(), parts.next()) {
        (Some(package), Some(kind), Some(name), None)
            if [package, kind, name].iter().all(|part| is_token(part)) =>
        {
            Ok(format!("{package}::{kind}::dds_::{name}_"))
        }
        _ => Err(NameError {
            name: type_name.to_owned(),
            kind: "message type",
            reason: "a type is written package/msg/Type",
        }),
    }
}

/// The ROS name of a type on the wire, for messages to people; other forms are left as they are.
#[must_use]
pub(crate) fn ros_type_name(dds_type_name: &str) -> String {
    dds_type_name.replacen("::dds_::", "::", 1).trim_end_matches('_').replace("::", "/")
}

fn join(namespace: &str, name: &str) -> String {
    if namespace == "/" { format!("/{name}") } else { format!("{namespace}/{name}") }
}

fn is_token(token: &str) -> bool {
    token.starts_with(|first: char| first.is_ascii_alphabetic() || first == '_')
        && token.chars().all(|one| one.is_ascii_alphanumeric() || one == '_')
}

fn check_token(token: &str, whole: &str, kind: &'static str) -> Result<(), NameError> {
    let reason = if token.is_empty() {
        "a part of it is empty"
    } else if token.starts_with(|first: char| first.is_ascii_digit()) {
        "no part may start with a digit"
    } else if is_token(token) {
        return Ok(());
    } else {
        "only letters, digits and underscores are accepted"
    };
    Err(NameError { name: whole.to_owned(), kind, reason })
}

/// Checks a name that starts with `/`.
fn check_absolute(name: &str, kind: &'static str) -> Result<(), NameError> {
    let fail = |reason| Err(NameError { name: name.to_owned(), kind, reason });
    let Some(tokens) = name.strip_prefix('/') else {
        return fail("it must start with a slash");
    };
    if name.len() > LONGEST_NAME {
        return fail("it is longer than 247 characters");
    }
    tokens.split('/').try_for_each(|token| check_token(token, name, kind))
}
