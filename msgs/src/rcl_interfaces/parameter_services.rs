//! The services by which a node's parameters are read and set.

use serde::{Deserialize, Serialize};

use super::parameters::{
    ListParametersResult, Parameter, ParameterDescriptor, ParameterValue, SetParametersResult,
};

/// What parameters are.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct DescribeParameters;

/// Names them.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct DescribeParametersRequest {
    /// The names.
    pub names: Vec<String>,
}

/// Says it.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct DescribeParametersResponse {
    /// What each of them is, in their order.
    pub descriptors: Vec<ParameterDescriptor>,
}
ros_service!(
    DescribeParameters,
    DescribeParametersRequest,
    DescribeParametersResponse,
    "rcl_interfaces"
);

/// The values of parameters.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct GetParameters;

/// Names them.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct GetParametersRequest {
    /// The names.
    pub names: Vec<String>,
}

/// Has them.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct GetParametersResponse {
    /// The value of each of them, in their order.
    pub values: Vec<ParameterValue>,
}
ros_service!(GetParameters, GetParametersRequest, GetParametersResponse, "rcl_interfaces");

/// The types of parameters.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct GetParameterTypes;

/// Names them.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct GetParameterTypesRequest {
    /// The names.
    pub names: Vec<String>,
}

/// Has them.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct GetParameterTypesResponse {
    /// The type of each of them, in their order.
    #[serde(with = "serde_bytes")]
    pub types: Vec<u8>,
}
ros_service!(
    GetParameterTypes,
    GetParameterTypesRequest,
    GetParameterTypesResponse,
    "rcl_interfaces"
);

/// The names of parameters.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct ListParameters;

/// Says which.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct ListParametersRequest {
    /// The groups, or parameters, to list; all where it is empty.
    pub prefixes: Vec<String>,
    /// How many parts a name may have below a prefix; 0 is [`Self::DEPTH_RECURSIVE`].
    pub depth: u64,
}

/// Has them.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct ListParametersResponse {
    /// What there is.
    pub result: ListParametersResult,
}
ros_service!(
    ListParameters,
    ListParametersRequest {
        /// A depth without end.
        DEPTH_RECURSIVE: u64 = 0,
    },
    ListParametersResponse,
    "rcl_interfaces"
);

/// Parameters are to have other values, each by itself.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct SetParameters;

/// Says which.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct SetParametersRequest {
    /// What to set.
    pub parameters: Vec<Parameter>,
}

/// Whether they have.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct SetParametersResponse {
    /// Whether each of them was set, in their order.
    pub results: Vec<SetParametersResult>,
}
ros_service!(SetParameters, SetParametersRequest, SetParametersResponse, "rcl_interfaces");

/// Parameters are to have other values, all or nothing.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct SetParametersAtomically;

/// Says which.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct SetParametersAtomicallyRequest {
    /// What to set.
    pub parameters: Vec<Parameter>,
}

/// Whether they have.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct SetParametersAtomicallyResponse {
    /// Whether they were set.
    pub result: SetParametersResult,
}
ros_service!(
    SetParametersAtomically,
    SetParametersAtomicallyRequest,
    SetParametersAtomicallyResponse,
    "rcl_interfaces"
);
