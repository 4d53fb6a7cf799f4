//! `rcl_interfaces`: the log of a node, and its parameters.

mod parameter_services;
mod parameters;

use serde::{Deserialize, Serialize};

use crate::builtin_interfaces::Time;

pub use parameter_services::{
    DescribeParameters, DescribeParametersRequest, DescribeParametersResponse, GetParameterTypes,
    GetParameterTypesRequest, GetParameterTypesResponse, GetParameters, GetParametersRequest,
    GetParametersResponse, ListParameters, ListParametersRequest, ListParametersResponse,
    SetParameters, SetParametersAtomically, SetParametersAtomicallyRequest,
    SetParametersAtomicallyResponse, SetParametersRequest, SetParametersResponse,
};
pub use parameters::{
    FloatingPointRange, IntegerRange, ListParametersResult, Parameter, ParameterDescriptor,
    ParameterEvent, ParameterType, ParameterValue, SetParametersResult,
};

/// One line of a node's log.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Log {
    /// When it was written.
    pub stamp: Time,
    /// One of the levels, for instance [`Log::WARN`].
    pub level: u8,
    /// The logger.
    pub name: String,
    /// The line.
    pub msg: String,
    /// The source file that wrote it.
    pub file: String,
    /// The function that wrote it.
    pub function: String,
    /// The line in the source file.
    pub line: u32,
}
ros_message!(Log, "rcl_interfaces", {
    /// For debugging.
    DEBUG: u8 = 10,
    /// For the operator.
    INFO: u8 = 20,
    /// Something needs attention.
    WARN: u8 = 30,
    /// Something did not work.
    ERROR: u8 = 40,
    /// The node cannot go on.
    FATAL: u8 = 50,
});
