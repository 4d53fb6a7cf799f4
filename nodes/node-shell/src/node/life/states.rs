//! The states of a managed node, and the transitions between them, as the design of ROS 2 has them
//! (<https://design.ros2.org/articles/node_lifecycle.html>) and `lifecycle_msgs` numbers them.

use msgs::lifecycle_msgs::{self as wire, TransitionDescription};

/// A state of a managed node.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum LifecycleState {
    /// It holds nothing and does nothing.
    Unconfigured,
    /// It holds what it held, and does nothing.
    Inactive,
    /// It works.
    Active,
    /// It ends.
    Finalized,
    /// It gets ready.
    Configuring,
    /// It drops what it holds.
    CleaningUp,
    /// It is about to end.
    ShuttingDown,
    /// It begins to work.
    Activating,
    /// It ceases to work.
    Deactivating,
    /// It sees to what has failed.
    ErrorProcessing,
}

use LifecycleState::{
    Activating, Active, CleaningUp, Configuring, Deactivating, ErrorProcessing, Finalized,
    Inactive, ShuttingDown, Unconfigured,
};

/// Every state, in the order in which ROS 2 lists them.
const STATES: [LifecycleState; 10] = [
    Unconfigured,
    Inactive,
    Active,
    Finalized,
    Configuring,
    CleaningUp,
    ShuttingDown,
    Activating,
    Deactivating,
    ErrorProcessing,
];

impl LifecycleState {
    /// Its name in ROS 2.
    #[must_use]
    pub const fn label(self) -> &'static str {
        match self {
            Unconfigured => "unconfigured",
            Inactive => "inactive",
            Active => "active",
            Finalized => "finalized",
            Configuring => "configuring",
            CleaningUp => "cleaningup",
            ShuttingDown => "shuttingdown",
            Activating => "activating",
            Deactivating => "deactivating",
            ErrorProcessing => "errorprocessing",
        }
    }

    const fn id(self) -> u8 {
        match self {
            Unconfigured => wire::State::PRIMARY_STATE_UNCONFIGURED,
            Inactive => wire::State::PRIMARY_STATE_INACTIVE,
            Active => wire::State::PRIMARY_STATE_ACTIVE,
            Finalized => wire::State::PRIMARY_STATE_FINALIZED,
            Configuring => wire::State::TRANSITION_STATE_CONFIGURING,
            CleaningUp => wire::State::TRANSITION_STATE_CLEANINGUP,
            ShuttingDown => wire::State::TRANSITION_STATE_SHUTTINGDOWN,
            Activating => wire::State::TRANSITION_STATE_ACTIVATING,
            Deactivating => wire::State::TRANSITION_STATE_DEACTIVATING,
            ErrorProcessing => wire::State::TRANSITION_STATE_ERRORPROCESSING,
        }
    }

    pub(crate) fn to_message(self) -> wire::State {
        wire::State { id: self.id(), label: self.label().to_owned() }
    }
}

/// Every state, and first the one of which nothing is known.
pub(crate) fn all_states() -> Vec<wire::State> {
    let unknown =
        wire::State { id: wire::State::PRIMARY_STATE_UNKNOWN, label: "unknown".to_owned() };
    std::iter::once(unknown).chain(STATES.map(LifecycleState::to_message)).collect()
}

/// A transition from one state to another.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Step {
    id: u8,
    label: &'static str,
    pub(crate) from: LifecycleState,
    pub(crate) to: LifecycleState,
}

const SUCCESS: &str = "transition_success";
const FAILURE: &str = "transition_failure";
const ERROR: &str = "transition_error";

const fn step(id: u8, label: &'static str, from: LifecycleState, to: LifecycleState) -> Step {
    Step { id, label, from, to }
}

use wire::Transition as T;

/// Every transition, in the order in which ROS 2 lists them.
const STEPS: [Step; 25] = [
    step(T::TRANSITION_CONFIGURE, "configure", Unconfigured, Configuring),
    step(T::TRANSITION_ON_CONFIGURE_SUCCESS, SUCCESS, Configuring, Inactive),
    step(T::TRANSITION_ON_CONFIGURE_FAILURE, FAILURE, Configuring, Unconfigured),
    step(T::TRANSITION_ON_CONFIGURE_ERROR, ERROR, Configuring, ErrorProcessing),
    step(T::TRANSITION_CLEANUP, "cleanup", Inactive, CleaningUp),
    step(T::TRANSITION_ON_CLEANUP_SUCCESS, SUCCESS, CleaningUp, Unconfigured),
    step(T::TRANSITION_ON_CLEANUP_FAILURE, FAILURE, CleaningUp, Inactive),
    step(T::TRANSITION_ON_CLEANUP_ERROR, ERROR, CleaningUp, ErrorProcessing),
    step(T::TRANSITION_ACTIVATE, "activate", Inactive, Activating),
    step(T::TRANSITION_ON_ACTIVATE_SUCCESS, SUCCESS, Activating, Active),
    step(T::TRANSITION_ON_ACTIVATE_FAILURE, FAILURE, Activating, Inactive),
    step(T::TRANSITION_ON_ACTIVATE_ERROR, ERROR, Activating, ErrorProcessing),
    step(T::TRANSITION_DEACTIVATE, "deactivate", Active, Deactivating),
    step(T::TRANSITION_ON_DEACTIVATE_SUCCESS, SUCCESS, Deactivating, Inactive),
    step(T::TRANSITION_ON_DEACTIVATE_FAILURE, FAILURE, Deactivating, Active),
    step(T::TRANSITION_ON_DEACTIVATE_ERROR, ERROR, Deactivating, ErrorProcessing),
    step(T::TRANSITION_UNCONFIGURED_SHUTDOWN, "shutdown", Unconfigured, ShuttingDown),
    step(T::TRANSITION_INACTIVE_SHUTDOWN, "shutdown", Inactive, ShuttingDown),
    step(T::TRANSITION_ACTIVE_SHUTDOWN, "shutdown", Active, ShuttingDown),
    step(T::TRANSITION_ON_SHUTDOWN_SUCCESS, SUCCESS, ShuttingDown, Finalized),
    step(T::TRANSITION_ON_SHUTDOWN_FAILURE, FAILURE, ShuttingDown, Finalized),
    step(T::TRANSITION_ON_SHUTDOWN_ERROR, ERROR, ShuttingDown, ErrorProcessing),
    step(T::TRANSITION_ON_ERROR_SUCCESS, SUCCESS, ErrorProcessing, Unconfigured),
    step(T::TRANSITION_ON_ERROR_FAILURE, FAILURE, ErrorProcessing, Finalized),
    step(T::TRANSITION_ON_ERROR_ERROR, ERROR, ErrorProcessing, Finalized),
];

impl Step {
    /// The transition that a client requests, out of a state: by its label where the request has one, or else by its number.
    pub(crate) fn wanted(from: LifecycleState, request: &T) -> Option<Self> {
        let is_it = |step: &&Self| {
            if request.label.is_empty() {
                step.id == request.id
            } else {
                step.label == request.label
            }
        };
        let own_end = [SUCCESS, FAILURE, ERROR];
        STEPS
            .iter()
            .find(|step| step.from == from && is_it(step) && !own_end.contains(&step.label))
            .copied()
    }

    /// The transition by which this one ends successfully.
    pub(crate) fn success(self) -> Option<Self> {
        STEPS.iter().find(|step| step.from == self.to && step.label == SUCCESS).copied()
    }

    pub(crate) fn transition(self) -> T {
        T { id: self.id, label: self.label.to_owned() }
    }

    fn to_message(self) -> TransitionDescription {
        TransitionDescription {
            transition: self.transition(),
            start_state: self.from.to_message(),
            goal_state: self.to.to_message(),
        }
    }
}

/// The transitions out of a state.
pub(crate) fn available(from: LifecycleState) -> Vec<TransitionDescription> {
    STEPS.iter().filter(|step| step.from == from).map(|step| step.to_message()).collect()
}

/// Every transition.
pub(crate) fn graph() -> Vec<TransitionDescription> {
    STEPS.iter().map(|step| step.to_message()).collect()
}

/// The transitions of a node that starts by itself.
pub(crate) fn start_up() -> impl Iterator<Item = Step> {
    ["configure", "activate"].into_iter().flat_map(|label| {
        let asked = STEPS.iter().find(|step| step.label == label).copied();
        asked.into_iter().chain(asked.and_then(Step::success))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn by_label(label: &str) -> T {
        T { id: 0, label: label.to_owned() }
    }

    #[test]
    fn a_node_goes_up_and_down_as_it_is_asked() {
        let mut state = Unconfigured;
        for (label, expected) in [
            ("configure", Inactive),
            ("activate", Active),
            ("deactivate", Inactive),
            ("cleanup", Unconfigured),
            ("shutdown", Finalized),
        ] {
            let step = Step::wanted(state, &by_label(label)).unwrap();
            state = step.success().unwrap().to;
            assert_eq!(state, expected, "{label}");
        }
        assert!(available(Finalized).is_empty());
    }

    #[test]
    fn each_state_has_its_own_number_for_the_end() {
        let shutdown = |from, id| Step::wanted(from, &T { id, label: String::new() }).is_some();
        for (from, id) in [(Unconfigured, 5), (Inactive, 6), (Active, 7)] {
            for other in 5..=7 {
                assert_eq!(shutdown(from, other), other == id, "{from:?} {other}");
            }
        }
    }

    #[test]
    fn what_is_not_possible_is_no_step() {
        assert_eq!(Step::wanted(Unconfigured, &by_label("activate")), None);
        assert_eq!(Step::wanted(Active, &by_label("cleanup")), None);
        assert_eq!(Step::wanted(Active, &by_label("fly")), None);
        // How a step ends is not for others to say.
        assert_eq!(Step::wanted(Configuring, &by_label(SUCCESS)), None);
        // A label counts before a number.
        let both = T { id: T::TRANSITION_ACTIVATE, label: "cleanup".to_owned() };
        assert_eq!(Step::wanted(Inactive, &both).unwrap().to, CleaningUp);
    }

    #[test]
    fn every_state_but_the_end_has_transitions_and_numbers_are_unique() {
        let states = all_states();
        assert_eq!(states.len(), 11);
        for state in STATES {
            assert_eq!(available(state).is_empty(), state == Finalized, "{state:?}");
        }
        let mut ids: Vec<u8> = graph().iter().map(|one| one.transition.id).collect();
        ids.sort_unstable();
        ids.dedup();
        assert_eq!(ids.len(), STEPS.len());
    }

    #[test]
    fn a_start_passes_through_every_state_in_between() {
        let states: Vec<_> = start_up().map(|step| step.to).collect();
        assert_eq!(states, [Configuring, Inactive, Activating, Active]);
    }
}
