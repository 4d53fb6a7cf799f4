//! The services that read the state of a managed node, and change it.

use serde::{Deserialize, Serialize};

use super::{State, Transition, TransitionDescription};

/// A node is to go to another state.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct ChangeState;

/// Says by which transition.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct ChangeStateRequest {
    /// The transition to make. Where it has a label, that counts, or else its number.
    pub transition: Transition,
}

/// Whether it has.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct ChangeStateResponse {
    /// Whether the transition was made.
    pub success: bool,
}
ros_service!(ChangeState, ChangeStateRequest, ChangeStateResponse, "lifecycle_msgs");

/// The state of a node.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct GetState;

/// Asks for it.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct GetStateRequest {
    /// ROS 2 puts one byte on the wire for a message without fields.
    pub structure_needs_at_least_one_member: u8,
}

/// Has it.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct GetStateResponse {
    /// The state of the node.
    pub current_state: State,
}
ros_service!(GetState, GetStateRequest, GetStateResponse, "lifecycle_msgs");

/// The states that a node knows.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct GetAvailableStates;

/// Asks for them.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct GetAvailableStatesRequest {
    /// ROS 2 puts one byte on the wire for a message without fields.
    pub structure_needs_at_least_one_member: u8,
}

/// Has them.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct GetAvailableStatesResponse {
    /// Every state that the node knows.
    pub available_states: Vec<State>,
}
ros_service!(
    GetAvailableStates,
    GetAvailableStatesRequest,
    GetAvailableStatesResponse,
    "lifecycle_msgs"
);

/// The transitions of a node: those that it can make now, or all of them, by the service's name.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct GetAvailableTransitions;

/// Asks for them.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct GetAvailableTransitionsRequest {
    /// ROS 2 puts one byte on the wire for a message without fields.
    pub structure_needs_at_least_one_member: u8,
}

/// Has them.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct GetAvailableTransitionsResponse {
    /// The transitions.
    pub available_transitions: Vec<TransitionDescription>,
}
ros_service!(
    GetAvailableTransitions,
    GetAvailableTransitionsRequest,
    GetAvailableTransitionsResponse,
    "lifecycle_msgs"
);
