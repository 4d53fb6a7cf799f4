//! Parameters, their values and what they are.

use serde::{Deserialize, Serialize};

use crate::builtin_interfaces::Time;

/// The types that a parameter can have.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct ParameterType {
    /// ROS 2 puts one byte on the wire for a message without fields.
    pub structure_needs_at_least_one_member: u8,
}
ros_message!(ParameterType, "rcl_interfaces", {
    /// It has no value.
    PARAMETER_NOT_SET: u8 = 0,
    /// A truth value.
    PARAMETER_BOOL: u8 = 1,
    /// A whole number.
    PARAMETER_INTEGER: u8 = 2,
    /// A fractional number.
    PARAMETER_DOUBLE: u8 = 3,
    /// A text.
    PARAMETER_STRING: u8 = 4,
    /// Bytes.
    PARAMETER_BYTE_ARRAY: u8 = 5,
    /// Truth values.
    PARAMETER_BOOL_ARRAY: u8 = 6,
    /// Whole numbers.
    PARAMETER_INTEGER_ARRAY: u8 = 7,
    /// Fractional numbers.
    PARAMETER_DOUBLE_ARRAY: u8 = 8,
    /// Texts.
    PARAMETER_STRING_ARRAY: u8 = 9,
});

/// The value of a parameter: of the fields the one counts that the type names.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct ParameterValue {
    /// One of the types, for instance [`ParameterType::PARAMETER_DOUBLE`].
    pub r#type: u8,
    /// Of [`ParameterType::PARAMETER_BOOL`].
    pub bool_value: bool,
    /// Of [`ParameterType::PARAMETER_INTEGER`].
    pub integer_value: i64,
    /// Of [`ParameterType::PARAMETER_DOUBLE`].
    pub double_value: f64,
    /// Of [`ParameterType::PARAMETER_STRING`].
    pub string_value: String,
    /// Of [`ParameterType::PARAMETER_BYTE_ARRAY`].
    #[serde(with = "serde_bytes")]
    pub byte_array_value: Vec<u8>,
    /// Of [`ParameterType::PARAMETER_BOOL_ARRAY`].
    pub bool_array_value: Vec<bool>,
    /// Of [`ParameterType::PARAMETER_INTEGER_ARRAY`].
    pub integer_array_value: Vec<i64>,
    /// Of [`ParameterType::PARAMETER_DOUBLE_ARRAY`].
    pub double_array_value: Vec<f64>,
    /// Of [`ParameterType::PARAMETER_STRING_ARRAY`].
    pub string_array_value: Vec<String>,
}
ros_message!(ParameterValue, "rcl_interfaces");

/// A parameter and its value.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Parameter {
    /// The name, with dots between its parts.
    pub name: String,
    /// The value.
    pub value: ParameterValue,
}
ros_message!(Parameter, "rcl_interfaces");

/// The numbers that a parameter may have.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct FloatingPointRange {
    /// The least.
    pub from_value: f64,
    /// The largest.
    pub to_value: f64,
    /// The distance from one to the next; 0 where all between are accepted.
    pub step: f64,
}
ros_message!(FloatingPointRange, "rcl_interfaces");

/// The whole numbers that a parameter may have.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
pub struct IntegerRange {
    /// The least.
    pub from_value: i64,
    /// The largest.
    pub to_value: i64,
    /// The distance from one to the next; 0 where all between are accepted.
    pub step: u64,
}
ros_message!(IntegerRange, "rcl_interfaces");

/// What a parameter is.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct ParameterDescriptor {
    /// Its name.
    pub name: String,
    /// One of the types, for instance [`ParameterType::PARAMETER_DOUBLE`].
    pub r#type: u8,
    /// What it means.
    pub description: String,
    /// What is accepted, in words, where type and range do not say it.
    pub additional_constraints: String,
    /// Whether it stays as it is once the node runs.
    pub read_only: bool,
    /// Whether its type may change.
    pub dynamic_typing: bool,
    /// Of a fractional number: what is accepted, at most one; none where all are.
    pub floating_point_range: Vec<FloatingPointRange>,
    /// Of a whole number: what is accepted, at most one; none where all are.
    pub integer_range: Vec<IntegerRange>,
}
ros_message!(ParameterDescriptor, "rcl_interfaces");

/// Whether a parameter was set.
#[derive(Clone, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
pub struct SetParametersResult {
    /// Whether it was.
    pub successful: bool,
    /// Why it was not.
    pub reason: String,
}
ros_message!(SetParametersResult, "rcl_interfaces");

/// Names of parameters.
#[derive(Clone, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
pub struct ListParametersResult {
    /// The parameters.
    pub names: Vec<String>,
    /// The groups that they are in.
    pub prefixes: Vec<String>,
}
ros_message!(ListParametersResult, "rcl_interfaces");

/// The changes of a node's parameters.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct ParameterEvent {
    /// When.
    pub stamp: Time,
    /// The node, by its full name.
    pub node: String,
    /// What it has got.
    pub new_parameters: Vec<Parameter>,
    /// What has another value.
    pub changed_parameters: Vec<Parameter>,
    /// What it has no longer.
    pub deleted_parameters: Vec<Parameter>,
}
ros_message!(ParameterEvent, "rcl_interfaces");
