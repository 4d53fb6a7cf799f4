//! `std_srvs`: services that switch and trigger.

use serde::{Deserialize, Serialize};

/// Something is to be done.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Trigger;

/// Asks for it.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct TriggerRequest {
    /// ROS 2 puts one byte on the wire for a message without fields.
    pub structure_needs_at_least_one_member: u8,
}

/// Whether it was done.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct TriggerResponse {
    /// Whether it was done.
    pub success: bool,
    /// More in words.
    pub message: String,
}
ros_service!(Trigger, TriggerRequest, TriggerResponse, "std_srvs");

/// Something is to be done that cannot fail.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Empty;

/// Asks for it.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct EmptyRequest {
    /// ROS 2 puts one byte on the wire for a message without fields.
    pub structure_needs_at_least_one_member: u8,
}

/// It is done.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct EmptyResponse {
    /// ROS 2 puts one byte on the wire for a message without fields.
    pub structure_needs_at_least_one_member: u8,
}
ros_service!(Empty, EmptyRequest, EmptyResponse, "std_srvs");

/// Something is to be switched on or off.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct SetBool;

/// Says which.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct SetBoolRequest {
    /// On or off.
    pub data: bool,
}

/// Whether it was done.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct SetBoolResponse {
    /// Whether it was done.
    pub success: bool,
    /// More in words.
    pub message: String,
}
ros_service!(SetBool, SetBoolRequest, SetBoolResponse, "std_srvs");
