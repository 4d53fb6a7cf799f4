//! `lifecycle_msgs`: the states of managed nodes, and the transitions between them.

mod services;

use serde::{Deserialize, Serialize};

pub use services::{
    ChangeState, ChangeStateRequest, ChangeStateResponse, GetAvailableStates,
    GetAvailableStatesRequest, GetAvailableStatesResponse, GetAvailableTransitions,
    GetAvailableTransitionsRequest, GetAvailableTransitionsResponse, GetState, GetStateRequest,
    GetStateResponse,
};

/// A state of a managed node.
#[derive(Clone, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
pub struct State {
    /// One of the states, for instance [`State::PRIMARY_STATE_ACTIVE`].
    pub id: u8,
    /// The same in words.
    pub label: String,
}
ros_message!(State, "lifecycle_msgs", {
    /// Nothing is known of the node.
    PRIMARY_STATE_UNKNOWN: u8 = 0,
    /// It holds nothing.
    PRIMARY_STATE_UNCONFIGURED: u8 = 1,
    /// It is ready, and does nothing.
    PRIMARY_STATE_INACTIVE: u8 = 2,
    /// It works.
    PRIMARY_STATE_ACTIVE: u8 = 3,
    /// It ends.
    PRIMARY_STATE_FINALIZED: u8 = 4,
    /// It gets ready.
    TRANSITION_STATE_CONFIGURING: u8 = 10,
    /// It drops what it holds.
    TRANSITION_STATE_CLEANINGUP: u8 = 11,
    /// It is about to end.
    TRANSITION_STATE_SHUTTINGDOWN: u8 = 12,
    /// It begins to work.
    TRANSITION_STATE_ACTIVATING: u8 = 13,
    /// It ceases to work.
    TRANSITION_STATE_DEACTIVATING: u8 = 14,
    /// It sees to what has failed.
    TRANSITION_STATE_ERRORPROCESSING: u8 = 15,
});

/// The transition of a managed node from one state to another.
#[derive(Clone, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
pub struct Transition {
    /// One of the transitions, for instance [`Transition::TRANSITION_ACTIVATE`].
    pub id: u8,
    /// The same in words.
    pub label: String,
}
ros_message!(Transition, "lifecycle_msgs", {
    /// The node comes to be.
    TRANSITION_CREATE: u8 = 0,
    /// It is to get ready.
    TRANSITION_CONFIGURE: u8 = 1,
    /// It is to drop what it holds.
    TRANSITION_CLEANUP: u8 = 2,
    /// It is to work.
    TRANSITION_ACTIVATE: u8 = 3,
    /// It is to cease.
    TRANSITION_DEACTIVATE: u8 = 4,
    /// It is to end, holding nothing.
    TRANSITION_UNCONFIGURED_SHUTDOWN: u8 = 5,
    /// It is to end, being ready.
    TRANSITION_INACTIVE_SHUTDOWN: u8 = 6,
    /// It is to end in the midst of its work.
    TRANSITION_ACTIVE_SHUTDOWN: u8 = 7,
    /// The node is no more.
    TRANSITION_DESTROY: u8 = 8,
    /// It is ready.
    TRANSITION_ON_CONFIGURE_SUCCESS: u8 = 10,
    /// It could not get ready.
    TRANSITION_ON_CONFIGURE_FAILURE: u8 = 11,
    /// Something failed while it got ready.
    TRANSITION_ON_CONFIGURE_ERROR: u8 = 12,
    /// It has dropped what it held.
    TRANSITION_ON_CLEANUP_SUCCESS: u8 = 20,
    /// It could not drop it.
    TRANSITION_ON_CLEANUP_FAILURE: u8 = 21,
    /// Something failed while it did.
    TRANSITION_ON_CLEANUP_ERROR: u8 = 22,
    /// It works.
    TRANSITION_ON_ACTIVATE_SUCCESS: u8 = 30,
    /// It could not begin to.
    TRANSITION_ON_ACTIVATE_FAILURE: u8 = 31,
    /// Something failed while it began.
    TRANSITION_ON_ACTIVATE_ERROR: u8 = 32,
    /// It has ceased.
    TRANSITION_ON_DEACTIVATE_SUCCESS: u8 = 40,
    /// It could not cease.
    TRANSITION_ON_DEACTIVATE_FAILURE: u8 = 41,
    /// Something failed while it ceased.
    TRANSITION_ON_DEACTIVATE_ERROR: u8 = 42,
    /// It ends.
    TRANSITION_ON_SHUTDOWN_SUCCESS: u8 = 50,
    /// It ends, and something is left undone.
    TRANSITION_ON_SHUTDOWN_FAILURE: u8 = 51,
    /// Something failed at its end.
    TRANSITION_ON_SHUTDOWN_ERROR: u8 = 52,
    /// The error was recovered.
    TRANSITION_ON_ERROR_SUCCESS: u8 = 60,
    /// The error could not be recovered.
    TRANSITION_ON_ERROR_FAILURE: u8 = 61,
    /// Something failed while it was.
    TRANSITION_ON_ERROR_ERROR: u8 = 62,
    /// The node's part was done.
    TRANSITION_CALLBACK_SUCCESS: u8 = 97,
    /// It was not done.
    TRANSITION_CALLBACK_FAILURE: u8 = 98,
    /// It failed.
    TRANSITION_CALLBACK_ERROR: u8 = 99,
});

/// Where a transition begins and where it leads.
#[derive(Clone, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
pub struct TransitionDescription {
    /// The transition.
    pub transition: Transition,
    /// The state in which it begins.
    pub start_state: State,
    /// The state that it leads to.
    pub goal_state: State,
}
ros_message!(TransitionDescription, "lifecycle_msgs");

/// A managed node has gone from one state to another.
#[derive(Clone, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
pub struct TransitionEvent {
    /// When, in nanoseconds.
    pub timestamp: u64,
    /// By which transition.
    pub transition: Transition,
    /// The state in which it was.
    pub start_state: State,
    /// The state in which it is.
    pub goal_state: State,
}
ros_message!(TransitionEvent, "lifecycle_msgs");
